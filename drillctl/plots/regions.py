"""Three regions in one picture: a fill, a hatching and an outline, so that none hides another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from drillctl import units
from drillctl.plots.style import (
    BLACK,
    BLUE,
    OVER_TWO,
    SMALL,
    VERMILLION,
    legend_under,
    picture,
    plane,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from drillctl.studies.three_regions.compute import ThreeRegions

FILL = "#F7DFA6"
"""Of the cells at or under the level: light enough for hatching and marks, grey in print."""
HATCH = "////"
OUTLINE = 2.4
"""Width of the outline of local stability (points): more than anything else in the picture."""

_MARKS = {
    "bistable": ("o", VERMILLION, "bistable: locally stable, yet a start still sticks"),
    "undecided": (".", BLACK, "undecided: locally stable, settling takes longer"),
    "lingering": ("^", VERMILLION, "lingering: unstable, growing too slowly to show"),
    "failed": ("x", BLACK, "failed"),
}
"""Symbol, colour and legend of the cells at which the regions differ."""


@picture(**OVER_TWO)
def three_regions(
    result: ThreeRegions, ax: Axes | None = None, system: units.System = "si"
) -> Figure:
    """Local stability, J1 and attraction over two parameters, cell by cell.

    Every cell is a rectangle, so that what is counted in the caption is what is seen.
    """
    figure, ax, x, y = plane(result, ax, 7.2, system, "regions are shown over")
    handles = [
        *_regions(result, ax, x, y),
        *(h for name in _MARKS for h in _marked(result, name, ax, x, y)),
    ]
    ax.set_xlim(*_edges(x)[[0, -1]])
    ax.set_ylim(*_edges(y)[[0, -1]])
    legend_under(ax, 2, handles, drop=0.1)
    figure.supxlabel(_caption(result), fontsize=SMALL)
    return figure


def _regions(result: ThreeRegions, ax: Axes, x: np.ndarray, y: np.ndarray) -> list[Artist]:
    """Draw the regions that are not empty; their legend, with the cells of each."""
    counts = result.counts
    inside, attracted = result.inside_level, result.attracted
    if inside.any():
        ax.contourf(*_cells(x, y, inside), levels=[0.5, 1.5], colors=[FILL])
    if attracted.any():
        hatched = ax.contourf(
            *_cells(x, y, attracted), levels=[0.5, 1.5], colors="none", hatches=[HATCH]
        )
        hatched.set_edgecolor(BLUE)
        hatched.set_linewidth(0.0)
    if result.locally_stable.any():
        outline = ax.contour(
            *_cells(x, y, result.locally_stable), levels=[0.5], colors=BLACK, linewidths=OUTLINE
        )
        outline.set_clip_on(False)
    return [
        Line2D(
            [], [], color=BLACK, linewidth=OUTLINE,
            label=f"locally stable, linear ({counts['locally_stable']})",
        ),
        Patch(facecolor=FILL, label=f"J1 at or under {result.level:g} s ({inside.sum()})"),
        Patch(
            facecolor="none", edgecolor=BLUE, hatch=HATCH, linewidth=0.0,
            label=f"attracted from both starts ({counts['attracted']})",
        ),
    ]  # fmt: skip


def _marked(
    result: ThreeRegions, name: str, ax: Axes, x: np.ndarray, y: np.ndarray
) -> list[Artist]:
    """Mark cells of one kind; nothing, also in the legend, if there are none."""
    first, second = np.nonzero(getattr(result, name))
    if not len(first):
        return []
    symbol, colour, meaning = _MARKS[name]
    return list(
        ax.plot(
            x[first], y[second], symbol, color=colour, markersize=4.5, linestyle="none",
            label=f"{meaning} ({len(first)})",
        )
    )  # fmt: skip


def _edges(centres: np.ndarray) -> np.ndarray:
    """Borders of cells around increasing centres, halfway; the outer cells are symmetric."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    between = 0.5 * (centres[1:] + centres[:-1])
    ends = 2.0 * centres[[0, -1]] - between[[0, -1]]
    return np.concatenate([ends[:1], between, ends[1:]])


def _cells(
    x: np.ndarray, y: np.ndarray, mask: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A mask as a field that jumps at the borders of its cells, and is zero around the grid."""
    field = np.pad(np.kron(mask, np.ones((2, 2))), 1)
    return np.repeat(_edges(x), 2), np.repeat(_edges(y), 2), field.T


def _caption(result: ThreeRegions) -> str:
    table, counts = result.design.tables, result.counts
    origin = f"String {table.status}. " if table.status == "reconstructed" else ""
    spread = f"{100.0 * result.band:g} %"
    lines = [
        f"{origin}{result.j1.size} cells. J1 over {table.simulation.duration:g} s, start "
        f"{table.start.kind.replace('_', ' ')}. Attracted: bit within {spread} of the operating "
        f"speed",
        f"for the last {result.window:g} s of {result.horizon:g} s, from rest "
        f"({counts['from_rest']}) and wound up ({counts['from_wound_up']}).",
        _differences(result),
    ]
    if not _at_set_speed(result):
        lines.append(
            "Without integral action the operating speed is the cell's own equilibrium "
            f"({counts['no_operating_point']} cells have none); J1 is of the set speed."
        )
    return "\n".join(lines)


def _differences(result: ThreeRegions) -> str:
    """Where the regions differ, in one sentence."""
    stable, inside = result.locally_stable, result.inside_level
    return (
        f"Of the locally stable cells {(stable & ~inside).sum()} are over the level and "
        f"{(stable & ~result.attracted).sum()} not attracted; "
        f"{(inside & ~stable).sum()} under the level are not stable, "
        f"{(inside & ~result.attracted).sum()} not attracted."
    )


def _at_set_speed(result: ThreeRegions) -> bool:
    """Whether every cell drills steadily at its set speed, as with integral action."""
    set_speed: float | np.ndarray = result.design.speed
    for dimension, axis in enumerate(result.axes):
        if axis.path == "operating_point.speed":
            set_speed = np.expand_dims(axis.values, 1 - dimension)
    return bool(np.all(result.reference_speed == set_speed))
