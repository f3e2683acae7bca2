"""Adaptive maps: the regions, their contours, and the cells that were simulated to find them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from drillctl import units
from drillctl.plots.plane import legend_under, origin_of, plane
from drillctl.plots.style import BLACK, LINE, SMALL, VERMILLION
from drillctl.simulation.measures import STATUSES

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from drillctl.studies import AdaptiveMap

DOT = "#444444"
"""Colour of the simulated cells, seen on every fill."""
DOTS_AREA = 15_000.0
"""Sum of the squares of all dots' sizes (points): they shrink as they grow many."""
PALE = 0.45
"""Opacity of the fills: dots and contours are seen on them."""


def adaptive_map(
    result: AdaptiveMap, ax: Axes | None = None, system: units.System = "si"
) -> Figure:
    """Regions of J1 with a faint dot for each simulated cell.

    Parameters
    ----------
    result : AdaptiveMap
        From `drillctl.adaptive_map`.
    ax : Axes, optional
        Axes to draw on.
    system : {'si', 'field'}
        Units of the axes.

    Returns
    -------
    Figure
        A fill between two levels is a band, not a value: most of its cells were not simulated.
    """
    figure, ax, x, y = plane(result, ax, 6.0, system)
    handles = [*_regions(result, ax, x, y), *_dots(result, ax, x, y), *_marks(result, ax, x, y)]
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(y[0], y[-1])
    legend_under(ax, 3, handles)
    figure.supxlabel(_caption(result), fontsize=SMALL)
    return figure


def _regions(result: AdaptiveMap, ax: Axes, x: np.ndarray, y: np.ndarray) -> list[Artist]:
    """Fills and contours of the levels that are reached."""
    found = [level for level, region in result.regions.items() if region.cells]
    if not found:
        return []
    shades = colormaps["viridis_r"](np.linspace(0.0, 0.6, len(found)))
    values = np.ma.masked_invalid(result.values.T)
    ax.contourf(x, y, values, levels=[-np.inf, *found], colors=shades, alpha=PALE)
    shown = [level for level in found if (result.values > level).any()]
    if shown:  # a level that the whole map is under has no contour
        ax.contour(x, y, values, levels=shown, colors=BLACK, linewidths=0.6 * LINE)
    return [
        Patch(facecolor=(*shade[:3], PALE), edgecolor=BLACK, label=f"J1 at or under {level:g} s")
        for level, shade in zip(found, shades, strict=True)
    ]


def _dots(result: AdaptiveMap, ax: Axes, x: np.ndarray, y: np.ndarray) -> list[Artist]:
    i, j = np.unravel_index(result.cells, result.bands.shape)
    size = float(np.clip(np.sqrt(DOTS_AREA / len(i)), 1.0, 3.0))
    ax.plot(
        x[i], y[j], ".", color=DOT, markersize=size, markeredgewidth=0.0, alpha=0.7,
        rasterized=True,
    )  # fmt: skip
    name = f"simulated: {len(i)} of {result.bands.size} cells"
    return [Line2D([], [], marker=".", color=DOT, linestyle="none", label=name)]


def _marks(result: AdaptiveMap, ax: Axes, x: np.ndarray, y: np.ndarray) -> list[Artist]:
    """The minimum, mismatches of the self-check, failed cells."""
    shape, handles = result.bands.shape, []
    if result.minimum is not None:
        i, j = np.unravel_index(result.cells[int(np.nanargmin(result.measures["j1"]))], shape)
        handles += ax.plot(
            x[i], y[j], "*", color=VERMILLION, markeredgecolor="white", markersize=13,
            label=f"minimum {result.minimum[0]:.2f} s", linestyle="none",
        )  # fmt: skip
    failed = result.cells[result.status == STATUSES.index("failed")]
    for cells, mark, colour, name in (
        (result.self_check.mismatches, "o", VERMILLION, "in another band than said"),
        (failed, "x", BLACK, "failed"),
    ):
        if len(cells):
            i, j = np.unravel_index(cells, shape)
            handles += ax.plot(
                x[i], y[j], mark, color=colour, markersize=4, linestyle="none", label=name
            )
    return list(handles)


def _caption(result: AdaptiveMap) -> str:
    check, audit = result.self_check, result.audit
    first = (
        f"{origin_of(result)}{result.share:.2%} of the full grid's cells; audit: {audit.verdict}"
    )
    if result.full_audit is not None:
        first += f"; full audit: {result.full_audit.verdict}"
    if check.interval is None:
        return f"{first}\nself-check: none"
    return (
        f"{first}\nself-check: {check.verdict} ({len(check.mismatches)} of {len(check.cells)} "
        f"cells left out are in another band than said; at most {check.interval[1]:.1%} at 95 %)"
    )
