"""Maps of J1: values, contours at the levels, the minimum, the audited cells.

Estimated errors of the batch engine over a sample of lanes, and what the audit found.

What smoothing the friction does to a map.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from drillctl import units
from drillctl.errors import InputError
from drillctl.plots import style
from drillctl.plots.style import (
    BLACK,
    BLUE,
    LINE,
    OVER_TWO,
    SMALL,
    VERMILLION,
    axes_or_new,
    axis_label,
    dress,
    legend_under,
    origin_of,
    picture,
    plane,
    title_of,
)
from drillctl.simulation.measures import STATUSES
from drillctl.simulation.scheme import PROMISES, ROUNDING, SMALLEST

if TYPE_CHECKING:
    from drillctl.studies import Doctor, Sweep
    from drillctl.studies.regularisation.compute import Regularisation

MOST_COLOURED = 2000
"""Cells along an axis that are coloured: more than a picture has points along it."""


@picture(**OVER_TWO)
def stability_map(result: Sweep, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """J1 over two parameters with its regions.

    Colours stop at twice the highest level; failed cells are white with a cross.
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


@picture(result="Over one parameter.", raises="The result has more than one parameter.")
def sweep_line(result: Sweep, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """J1 over one parameter, with the levels."""
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


@picture(
    result="Of a design that the batch engine takes.",
    raises="The engine refused the design: there is nothing to draw.",
)
def error_estimate(result: Doctor, ax: Axes | None = None) -> Figure:
    """Estimated error of each lane over its J1, beside what the accuracy promises.

    Circles are audited differences, on the lanes that were simulated again.
    """
    if not len(result.cells):
        raise InputError("there is no estimate to draw: the batch engine refused this design")
    figure, ax = axes_or_new(ax, 7.0, 4.5)
    j1 = np.maximum(result.estimate.j1[0], SMALLEST)
    ax.loglog(
        j1, np.maximum(result.estimate.of_lanes, ROUNDING), ".", color=BLUE,
        label=f"{len(j1)} lanes, estimated",
    )  # fmt: skip
    if len(result.audit.cells):
        ax.loglog(
            np.maximum(result.audit.batch, SMALLEST),
            np.maximum(result.audit.differences, ROUNDING),
            "o", markerfacecolor="none", markeredgecolor=VERMILLION, markersize=8,
            label="beside the reference solver",
        )  # fmt: skip
    promise = PROMISES[result.accuracy]
    for value, dash, name in ((promise.median, "--", "median"), (promise.p99, "-", "99 %")):
        if value is not None:
            label = f"'{result.accuracy}' over the paper's map: {name}"
            ax.axhline(value, color=BLACK, linestyle=dash, linewidth=0.6 * LINE, label=label)
    title = title_of(result)
    dress(ax, "J1 (s)", "relative error of J1", title)
    ax.legend(fontsize=SMALL, frameon=False)
    return figure


@picture(result="From `drillctl.regularisation`.", ax="Two panels.")
def regularisation(result: Regularisation, ax: Sequence[Axes] | None = None) -> Figure:
    """Draw the shift of J1 and the size of the regions against the width of the smoothing.

    Left: median, 95th percentile and worst relative change of J1 over the cells. Right: cells at
    or under each level over those of the set-valued map.
    """
    figure, (left, right) = style.grid_or_new(ax, 1, 2, 10.5, 4.6)
    size = np.abs(result.shifts)
    for number, (share, name) in enumerate(((0.5, "median cell"), (0.95, "95th percentile"),
                                            (1.0, "worst cell"))):  # fmt: skip
        change = [100.0 * np.nanquantile(x, share) for x in size]
        left.loglog(
            result.widths, change, "o", color=style.COLOURS[number],
            linestyle=style.DASHES[number], linewidth=style.LINE, markersize=4, label=name,
        )  # fmt: skip
    for number, level in enumerate(result.levels):
        exact, cells = result.cells(level)
        if exact == 0:
            continue
        right.semilogx(
            result.widths, np.array(cells) / exact, "o", color=style.COLOURS[number],
            linestyle=style.DASHES[number % 4], linewidth=style.LINE, markersize=4,
            label=f"J1 at or under {level:g} s ({exact} cells)",
        )  # fmt: skip
    right.axhline(1.0, color=style.BLACK, linewidth=0.8)
    over = "width of the regularisation (rad/s)"
    style.dress(left, over, "change of J1 (%)", "Friction smoothed by tanh")
    style.dress(right, over, "cells over those of set-valued friction", "Size of the regions")
    for panel in (left, right):
        panel.legend(fontsize=style.SMALL, frameon=False)
    table = result.design.tables
    origin = "string reconstructed; " if table.status == "reconstructed" else ""
    extent = f"{result.j1.size} cells, {table.simulation.duration:g} s"
    figure.supxlabel(f"{table.title or result.design.name}; {origin}{extent}", fontsize=style.SMALL)
    return figure
