"""Time responses: speeds of top drive and bit, with the times the bit is stuck shaded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.design import parameter
from drillctl.plots.plane import NAMES
from drillctl.plots.style import BLUE, SMALL, VERMILLION, dress, grid_or_new

if TYPE_CHECKING:
    from drillctl.simulation import Simulation


def time_response(
    results: Simulation | Sequence[Simulation],
    ax: Axes | Sequence[Axes] | None = None,
    paths: Sequence[str] = (),
) -> Figure:
    """Speeds of top drive and bit against time.

    Parameters
    ----------
    results : Simulation or sequence of Simulation
        One panel each, in the order given.
    ax : Axes or sequence of Axes, optional
        As many as results.
    paths : sequence of str, optional
        Parameters to be named in the titles; by default the drive's numbers.

    Returns
    -------
    Figure
        Speeds in rpm; grey where the bit is at rest.

    Raises
    ------
    InputError
        Not as many axes as results.
    """
    runs = list(results) if isinstance(results, Sequence) else [results]
    columns = 1 if len(runs) == 1 else 2
    rows = -(-len(runs) // columns)
    given = [ax] if isinstance(ax, Axes) else ax
    figure, panels = grid_or_new(
        given, rows, columns, 4.2 * columns + 1.8, 2.6 * rows + 1.0, share_x=True, share_y=True
    )
    for panel, run in zip(panels, runs, strict=False):
        _panel(panel, run, paths)
    for number in range(len(runs), len(panels)):
        panels[number].set_visible(False)
        above = panels[number - columns]
        above.set_xlabel("time (s)")
        above.tick_params(labelbottom=True)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=4, fontsize=SMALL, frameon=False
    )
    return figure


def _panel(ax: Axes, run: Simulation, paths: Sequence[str]) -> None:
    bit = run.signals["bit_speed"] / units.RPM
    top = run.signals["top_speed"] / units.RPM
    stuck = run.signals["stuck"] > 0.5
    ax.fill_between(
        run.time, 0.0, 1.0, where=stuck, transform=ax.get_xaxis_transform(), color="#BBBBBB",
        alpha=0.6, linewidth=0.0, label="bit stuck",
    )  # fmt: skip
    ax.plot(run.time, bit, color=BLUE, linewidth=1.1, label="bit")
    ax.plot(run.time, top, color=VERMILLION, linewidth=1.1, linestyle="--", label="top drive")
    ax.axhline(
        run.design.speed / units.RPM, color="black", linewidth=0.7, linestyle=":", label="set speed"
    )
    ax.set_xlim(0.0, float(run.time[-1]))
    dress(ax, "time (s)", "speed (rpm)", _title(run, paths))
    ax.label_outer()


def _title(run: Simulation, paths: Sequence[str]) -> str:
    if paths:
        numbers = ", ".join(_named(run, path) for path in paths)
    elif run.design.simple_drive:
        law = run.design.top_drive
        numbers = ", ".join(f"{k} {v:g}" for k, v in law._asdict().items())  # type: ignore[attr-defined]
    else:
        numbers = run.design.tables.controller.law
    j1 = run.measures.j1
    # A run that broke down has no measures.
    return f"{run.status}: {numbers}" if j1 is None else f"J1 {j1:.1f} s: {numbers}"


def _named(run: Simulation, path: str) -> str:
    """A parameter of the run's design by its usual name, in the units people read."""
    found = parameter(run.design, path)
    value, unit = units.displayed(found.value, found.si_unit)
    return f"{NAMES.get(path, path.rpartition('.')[2])} {value:g} {unit}".rstrip()
