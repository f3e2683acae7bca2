"""Maps of J1: values, contours at the levels, the minimum, the audited cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from drillctl import units
from drillctl.errors import InputError
from drillctl.plots.plane import axis_label, legend_under, origin_of, plane, title_of
from drillctl.plots.style import BLACK, LINE, SMALL, VERMILLION, axes_or_new, dress
from drillctl.simulation.measures import STATUSES

if TYPE_CHECKING:
    from drillctl.studies import Sweep

MOST_COLOURED = 2000
"""Cells along an axis that are coloured: more than a picture has points along it."""


def stability_map(result: Sweep, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """J1 over two parameters with its regions.

    Parameters
    ----------
    result : Sweep
        Over two parameters.
    ax : Axes, optional
        Axes to draw on.
    system : {'si', 'field'}
        Units of the axes.

    Returns
    -------
    Figure
        Colours stop at twice the highest level; failed cells are white with a cross.

    Raises
    ------
    InputError
        The result has another number of parameters than two.
    """
    figure, ax, x, y = plane(result, ax, 6.0, system)
    top = 2.0 * result.levels[-1]
    i, j = (slice(None, None, -(-len(a) // MOST_COLOURED)) for a in result.axes)
    mesh = ax.pcolormesh(
        x[i], y[j], result.j1[i, j].T, cmap=_colours(), vmin=0.0, vmax=top, shading="nearest",
        rasterized=True,
    )  # fmt: skip
    bar = figure.colorbar(mesh, ax=ax, extend="max", pad=0.02)
    bar.set_label("J1 (s)")
    bar.ax.tick_params(labelsize=SMALL)
    finite = result.j1[np.isfinite(result.j1)]
    shown = [v for v in result.levels if finite.size and finite.min() <= v <= finite.max()]
    if shown:
        lines = ax.contour(x, y, result.j1.T, levels=shown, colors=BLACK, linewidths=LINE)
        ax.clabel(lines, fmt=lambda level: f"{level:g}", fontsize=SMALL, inline_spacing=2)
        bar.add_lines(lines)
    _mark_cells(result, ax, x, y)
    legend_under(ax, 3)
    figure.supxlabel(_caption(result), fontsize=SMALL)
    return figure


def _colours() -> ListedColormap:
    """Viridis without its darkest end, on which black contours would be lost."""
    from matplotlib import colormaps

    return ListedColormap(colormaps["viridis_r"](np.linspace(0.0, 0.82, 256)))


def _mark_cells(result: Sweep, ax: Axes, x: np.ndarray, y: np.ndarray) -> None:
    shape = result.j1.shape
    if result.minimum is not None:
        best = np.unravel_index(int(np.nanargmin(result.j1)), shape)
        ax.plot(
            x[best[0]], y[best[1]], "*", color=VERMILLION, markeredgecolor="white", markersize=15,
            label=f"minimum {result.minimum[0]:.2f} s",
        )  # fmt: skip
    if len(result.audit.cells):
        i, j = np.unravel_index(result.audit.cells, shape)
        ax.plot(
            x[i], y[j], "o", markerfacecolor="none", markeredgecolor=VERMILLION, markersize=6,
            markeredgewidth=1.3, label="audited with the reference solver",
        )  # fmt: skip
    failed = np.nonzero(result.status == STATUSES.index("failed"))
    if len(failed[0]):
        ax.plot(x[failed[0]], y[failed[1]], "x", color=BLACK, markersize=4, label="failed")


def _caption(result: Sweep) -> str:
    audit = result.audit
    if audit.verdict == "none":
        checked = "audit: none"
    else:
        worst = "none finished" if audit.worst is None else f"worst {audit.worst:.1e}"
        checked = f"audit: {audit.verdict} ({len(audit.cells)} cells, {worst} relative in J1)"
    table = result.design.tables.simulation
    scheme = "step and modes by the string"
    if result.step is not None:
        scheme = f"step {result.step * 1e3:g} ms, {result.modes} modes"
    return f"{origin_of(result)}{table.duration:g} s, {scheme}; {checked}"


def sweep_line(result: Sweep, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """J1 over one parameter, with the levels.

    Parameters
    ----------
    result : Sweep
        Over one parameter.
    ax : Axes, optional
        Axes to draw on.
    system : {'si', 'field'}
        Units of the axis.

    Raises
    ------
    InputError
        The result has more than one parameter.
    """
    if len(result.axes) != 1:
        raise InputError(f"a line shows 1 parameter, the result has {len(result.axes)}")
    figure, ax = axes_or_new(ax)
    x, label = axis_label(result.axes[0], system)
    ax.plot(x, result.j1, "-", color=BLACK, linewidth=LINE, label="batch engine")
    if len(result.audit.cells):
        ax.plot(
            x[result.audit.cells], result.audit.reference, "o", markerfacecolor="none",
            markeredgecolor=VERMILLION, label="reference solver",
        )  # fmt: skip
    for level in result.levels:
        ax.axhline(level, color="#888888", linewidth=0.8, linestyle="--")
        ax.annotate(
            f"{level:g}", (1.0, level), xycoords=("axes fraction", "data"), fontsize=SMALL,
            xytext=(3, -3), textcoords="offset points",
        )  # fmt: skip
    dress(ax, label, "J1 (s)", title_of(result))
    ax.legend(fontsize=SMALL, frameon=False)
    figure.supxlabel(_caption(result), fontsize=SMALL)
    return figure
