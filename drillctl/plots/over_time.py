"""Time responses: speeds of top drive and bit, with the times the bit is stuck shaded.

One cycle of the bit speed: exact, simulated, and with one harmonic.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.design import parameter
from drillctl.design.paths import USUAL_NAMES
from drillctl.plots import style
from drillctl.store.tables import quantity

if TYPE_CHECKING:
    from drillctl.simulation import Simulation
    from drillctl.simulation.limit_cycle import LimitCycle


@style.picture(
    paths="Parameters named in the title of each panel; by default the numbers of the drive.",
    raises="Nothing to draw.",
)
def time_response(
    results: Simulation | Sequence[Simulation],
    ax: Axes | Sequence[Axes] | None = None,
    paths: Sequence[str] = (),
    system: units.System = "si",
) -> Figure:
    """Speeds of top drive and bit against time."""
    runs = style.listed(results)
    columns = 1 if len(runs) == 1 else 2
    rows = -(-len(runs) // columns)
    given = [ax] if isinstance(ax, Axes) else ax
    figure, panels = style.grid_or_new(
        given, rows, columns, 4.2 * columns + 1.8, 2.6 * rows + 1.0, share_x=True, share_y=True
    )
    for panel, run in zip(panels, runs, strict=False):
        _panel(panel, run, _title(run, paths, system))
    for number in range(len(runs), len(panels)):
        panels[number].set_visible(False)
        above = panels[number - columns]
        above.set_xlabel("time (s)")
        above.tick_params(labelbottom=True)
    style.legend_of_all(figure, panels[0], 4)
    return figure


def _panel(ax: Axes, run: Simulation, title: str) -> None:
    bit = run.signals["bit_speed"] / units.RPM
    top = run.signals["top_speed"] / units.RPM
    stuck = run.signals["stuck"] > 0.5
    ax.fill_between(
        run.time, 0.0, 1.0, where=stuck, transform=ax.get_xaxis_transform(), color="#BBBBBB",
        alpha=0.6, linewidth=0.0, label="bit stuck",
    )  # fmt: skip
    ax.plot(run.time, bit, color=style.BLUE, linewidth=1.1, label="bit")
    ax.plot(run.time, top, color=style.VERMILLION, linewidth=1.1, linestyle="--", label="top drive")
    ax.axhline(
        run.design.speed / units.RPM, color="black", linewidth=0.7, linestyle=":", label="set speed"
    )
    ax.set_xlim(0.0, float(run.time[-1]))
    style.dress(ax, "time (s)", "speed (rpm)", title)
    ax.label_outer()


LAW_UNITS = {"kp": "N*m*s/rad", "ki": "N*m/rad", "sensed_inertia": "kg*m^2"}  # else torques


def _title(run: Simulation, paths: Sequence[str], system: units.System) -> str:
    if paths:
        # A parameter that the design leaves open has no number.
        given = [path for path in paths if parameter(run.design, path).value is not None]
        numbers = ", ".join(_named(run, path, system) for path in given)
        numbers = numbers or run.design.tables.controller.law
    elif run.design.simple_drive:
        law = run.design.linear_drive._asdict()  # type: ignore[attr-defined]
        numbers = ", ".join(
            f"{USUAL_NAMES.get(f'controller.{k}', k)} "
            f"{quantity(v, LAW_UNITS.get(k, 'N*m'), system)}"
            for k, v in law.items()
        )
    else:
        numbers = run.design.tables.controller.law
    j1 = run.measures.j1
    # A run that broke down has no measures.
    return f"{run.status}: {numbers}" if j1 is None else f"J1 {j1:.1f} s: {numbers}"


def _named(run: Simulation, path: str, system: units.System) -> str:
    """A parameter of the run's design by its usual name, in the units people read."""
    result = parameter(run.design, path)
    shown = quantity(result.value, result.si_unit, system)
    return f"{USUAL_NAMES.get(path, path.rpartition('.')[2])} {shown}"


@style.picture(
    result="Orbit, harmonic prediction and simulation; what there is none of is left out."
)
def limit_cycle(result: LimitCycle, ax: Axes | None = None) -> Figure:
    """Bit speed over one cycle, from the moment it rises through its mean.

    Speeds in rpm. The orbit grey below the last simulated cycle, which hides it where they agree;
    an orbit's harmonic prediction is drawn over the same time.
    """
    figure, axes = style.axes_or_new(ax, 7.0, 4.2)
    run, orbit, cycle = result.simulated, result.orbit, result.predicted
    time = run.time if orbit is None else orbit.time
    if orbit is not None:
        axes.plot(
            time, orbit.bit_speed / units.RPM, color="#BBBBBB", linewidth=5.0,
            label=f"exact orbit, {orbit.period:.2f} s",
        )  # fmt: skip
    axes.plot(
        run.time, run.bit_speed / units.RPM, color=style.BLUE, linewidth=1.3,
        label=f"last simulated, {run.time[-1]:.2f} s",
    )  # fmt: skip
    if cycle is not None:
        axes.plot(
            time, cycle.bit_speed(time) / units.RPM, color=style.VERMILLION, linewidth=1.3,
            linestyle="--", label=f"one harmonic, {cycle.period:.2f} s",
        )  # fmt: skip
    axes.axhline(run.mean_speed / units.RPM, color=style.BLACK, linewidth=0.7, linestyle=":")
    axes.set_xlim(0.0, max(float(time[-1]), float(run.time[-1])))
    style.dress(
        axes, "time from the rise through the mean (s)", "bit speed (rpm)", _cycle_title(result)
    )
    style.legend(axes)
    return figure


def _cycle_title(result: LimitCycle) -> str:
    name, run = result.design.name, result.simulated
    if result.orbit is not None:
        return f"Limit cycle of {name}: largest multiplier {abs(result.orbit.multipliers[0]):.3f}"
    if result.status != "not periodic" or len(run.peaks) == 0:
        return f"Long motion of {name}: {result.status}"
    low, high = (peak / units.RPM for peak in (run.last_peaks.min(), run.last_peaks.max()))
    return f"Long motion of {name}: not periodic, last peaks {low:.1f} to {high:.1f} rpm"
