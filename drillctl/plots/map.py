"""Maps of J1: values, contours at the levels, the minimum, the audited cells.

Estimated errors of the batch engine over a sample of lanes, and audited differences.

What smoothing the friction does to a map.

Three regions in one picture: a fill, a hatching and an outline, so that none hides another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from drillctl import units
from drillctl.errors import InputError
from drillctl.plots import style
from drillctl.simulation.measures import STATUSES
from drillctl.simulation.scheme import PROMISES, ROUNDING, SMALLEST

if TYPE_CHECKING:
    from matplotlib.artist import Artist

    from drillctl.studies import Doctor, Sweep
    from drillctl.studies.regularisation.compute import Regularisation
    from drillctl.studies.three_regions.compute import ThreeRegions

MOST_COLOURED = 2000
"""Cells along an axis that are coloured: more than a picture has points along it."""


@style.picture(**style.OVER_TWO)
def stability_map(result: Sweep, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """J1 over two parameters with its regions.

    Colours stop at twice the highest level; failed cells are white with a cross.
    """
    figure, ax, x, y = style.plane(result, ax, 6.0, system, "J1 with its levels")
    top = 2.0 * result.levels[-1]
    i, j = (slice(None, None, -(-len(a) // MOST_COLOURED)) for a in result.axes)
    # Without the darkest end, on which black contours would be lost.
    part = style.colours(0.18, 1.0).reversed()
    mesh = style.cells(ax, x[i], y[j], result.j1[i, j], cmap=part, vmin=0.0, vmax=top)
    bar = style.colour_bar(figure, mesh, ax, "J1 (s)", "max")
    finite = result.j1[np.isfinite(result.j1)]
    shown = [v for v in result.levels if finite.size and finite.min() <= v <= finite.max()]
    if shown:
        lines = ax.contour(
            x, y, result.j1.T, levels=shown, colors=style.BLACK, linewidths=style.LINE
        )
        ax.clabel(lines, fmt=lambda level: f"{level:g}", fontsize=style.SMALL, inline_spacing=2)
        bar.add_lines(lines)
    _mark_cells(result, ax, x, y)
    style.legend_under(ax, 3)
    style.note(figure, _caption(result))
    return figure


def _mark_cells(result: Sweep, ax: Axes, x: np.ndarray, y: np.ndarray) -> None:
    shape = result.j1.shape
    if result.minimum is not None:
        best = np.unravel_index(int(np.nanargmin(result.j1)), shape)
        label = f"minimum {result.minimum[0]:.2f} s"
        ax.plot(x[best[0]], y[best[1]], "*", **style.STAR, label=label)
    if len(result.audit.cells):
        i, j = np.unravel_index(result.audit.cells, shape)
        ax.plot(
            x[i], y[j], **style.RING, markersize=6, markeredgewidth=1.3,
            label="audited with the reference solver",
        )  # fmt: skip
    failed = np.nonzero(result.status == STATUSES.index("failed"))
    if len(failed[0]):
        ax.plot(x[failed[0]], y[failed[1]], "x", color=style.BLACK, markersize=4, label="failed")


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
    return style.caption(result, f"{table.duration:g} s, {scheme}; {checked}")


@style.picture(result="Over one parameter.", raises="The result has more than one parameter.")
def sweep_line(result: Sweep, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """J1 over one parameter, with the levels."""
    if len(result.axes) != 1:
        raise InputError(f"a line shows 1 parameter, the result has {len(result.axes)}")
    figure, ax = style.axes_or_new(ax)
    x, label = style.axis_label(result.axes[0], system)
    ax.plot(x, result.j1, "-", color=style.BLACK, linewidth=style.LINE, label="batch engine")
    if len(result.audit.cells):
        again = x[result.audit.cells], result.audit.reference["j1"]
        ax.plot(*again, **style.RING, label="reference solver")
    for level in result.levels:
        ax.axhline(level, color=style.GREY, linewidth=0.8, linestyle="--")
        ax.annotate(
            f"{level:g}", (1.0, level), xycoords=("axes fraction", "data"), fontsize=style.SMALL,
            xytext=(3, -3), textcoords="offset points",
        )  # fmt: skip
    style.dress(ax, label, "J1 (s)", style.heading(result, "J1 with its levels"))
    style.legend(ax)
    style.note(figure, _caption(result))
    return figure


@style.picture(
    result="Of a design that the batch engine takes.",
    raises="The engine refused the design: there is nothing to draw.",
)
def error_estimate(result: Doctor, ax: Axes | None = None) -> Figure:
    """Estimated error of each lane over its J1, beside what the accuracy promises.

    Circles are audited differences, on the lanes that were simulated again.
    """
    if not len(result.cells):
        raise InputError("there is no estimate to draw: the batch engine refused this design")
    figure, ax = style.axes_or_new(ax, 7.0, 4.5)
    j1 = np.maximum(result.estimate.j1[0], SMALLEST)
    ax.loglog(
        j1, np.maximum(result.estimate.of_lanes, ROUNDING), ".", color=style.BLUE,
        label=f"{len(j1)} lanes, estimated",
    )  # fmt: skip
    if len(result.audit.cells):
        ax.loglog(
            np.maximum(result.audit.batch["j1"], SMALLEST),
            np.maximum(result.audit.differences, ROUNDING),
            **style.RING, markersize=8, label="beside the reference solver",
        )  # fmt: skip
    promise = PROMISES[result.accuracy]
    for value, dash, name in ((promise.median, "--", "median"), (promise.p99, "-", "99 %")):
        if value is not None:
            label = f"'{result.accuracy}' over the paper's map: {name}"
            ax.axhline(
                value, color=style.BLACK, linestyle=dash, linewidth=0.6 * style.LINE, label=label
            )
    title = style.heading(result, "Estimated error of the batch engine")
    style.dress(ax, "J1 (s)", "relative error of J1", title)
    style.written_out(ax.xaxis, (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0))
    style.legend_under(ax, 2, drop=0.14)  # the lines of what is promised cross the whole picture
    return figure


@style.picture(result="From `drillctl.regularisation`.", ax="Two panels.")
def regularisation(
    result: Regularisation, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Draw the shift of J1 and the size of the regions against the width of the smoothing.

    Left: median, 95th percentile and worst relative change of J1 over the cells. Right: cells at
    or under each level over those of the set-valued map.
    """
    figure, (left, right) = style.grid_or_new(ax, 1, 2, 10.5, 4.6)
    size = np.abs(result.shifts)
    widths, unit = units.displayed(np.asarray(result.widths), "rad/s", system)
    for number, (share, name) in enumerate(((0.5, "median cell"), (0.95, "95th percentile"),
                                            (1.0, "worst cell"))):  # fmt: skip
        change = [100.0 * np.nanquantile(x, share) for x in size]
        left.loglog(widths, change, "o", markersize=4, label=name, **style.look(number))
    for number, level in enumerate(result.levels):
        exact, cells = result.cells(level)
        if exact == 0:
            continue
        right.semilogx(
            widths, np.array(cells) / exact, "o", markersize=4,
            label=f"J1 at or under {level:g} s ({exact} cells)", **style.look(number),
        )  # fmt: skip
    right.axhline(1.0, color=style.BLACK, linewidth=0.8)
    over = f"width of the regularisation ({unit})"
    style.dress(left, over, "change of J1 (%)", "Friction smoothed by tanh")
    style.dress(right, over, "cells over those of set-valued friction", "Size of the regions")
    for panel in (left, right):
        style.legend(panel)
    about = f"{result.j1.size} cells, {result.design.tables.simulation.duration:g} s"
    text = style.caption(result, f"{style.title_of(result)}; {about}")
    style.note(figure, text)
    return figure


FILL = "#F7DFA6"
"""Of the cells at or under the level: light enough for hatching and marks, grey in print."""
HATCH = "////"
OUTLINE = 2.4
"""Width of the outline of local stability (points): more than anything else in the picture."""

_MARKS = {
    "bistable": ("o", style.VERMILLION, "bistable: locally stable, yet a start still sticks"),
    "undecided": (".", style.BLACK, "undecided: locally stable, settling takes longer"),
    "lingering": ("^", style.VERMILLION, "lingering: unstable, growing too slowly to show"),
    "failed": ("x", style.BLACK, "failed"),
}
"""Symbol, colour and legend of the cells at which the regions differ."""


@style.picture(**style.OVER_TWO)
def three_regions(
    result: ThreeRegions, ax: Axes | None = None, system: units.System = "si"
) -> Figure:
    """Local stability, J1 and attraction over two parameters, cell by cell.

    Every cell is a rectangle, so that what is counted in the caption is what is seen.
    """
    figure, ax, x, y = style.plane(result, ax, 7.2, system, "Local stability, J1 and attraction")
    handles = [
        *_fills(result, ax, x, y),
        *(h for name in _MARKS for h in _marked(result, name, ax, x, y)),
    ]
    style.within_cells(ax, x, y)
    style.legend_under(ax, 2, handles, drop=0.1)
    style.note(figure, _caption_of_regions(result))
    return figure


def _fills(result: ThreeRegions, ax: Axes, x: np.ndarray, y: np.ndarray) -> list[Artist]:
    """Draw the regions that are not empty; their legend, with the cells of each."""
    counts = result.counts
    inside, attracted = result.inside_level, result.attracted
    if inside.any():
        ax.contourf(*_cells(x, y, inside), levels=[0.5, 1.5], colors=[FILL])
    if attracted.any():
        hatched = ax.contourf(
            *_cells(x, y, attracted), levels=[0.5, 1.5], colors="none", hatches=[HATCH]
        )
        hatched.set_edgecolor(style.BLUE)
        hatched.set_linewidth(0.0)
    if result.locally_stable.any():
        outline = ax.contour(
            *_cells(x, y, result.locally_stable),
            levels=[0.5],
            colors=style.BLACK,
            linewidths=OUTLINE,
        )
        outline.set_clip_on(False)
    return [
        Line2D(
            [], [], color=style.BLACK, linewidth=OUTLINE,
            label=f"locally stable, linear ({counts['locally_stable']})",
        ),
        Patch(facecolor=FILL, label=f"J1 at or under {result.level:g} s ({inside.sum()})"),
        Patch(
            facecolor="none", edgecolor=style.BLUE, hatch=HATCH, linewidth=0.0,
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


def _cells(
    x: np.ndarray, y: np.ndarray, mask: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A mask as a field that jumps at the borders of its cells, and is zero around the grid."""
    field = np.pad(np.kron(mask, np.ones((2, 2))), 1)
    return np.repeat(style.edges(x), 2), np.repeat(style.edges(y), 2), field.T


def _caption_of_regions(result: ThreeRegions) -> str:
    table, counts = result.design.tables, result.counts
    lines = [
        f"{result.j1.size} cells. J1 over {table.simulation.duration:g} s, start "
        f"{table.start.kind.replace('_', ' ')}.",
        f"Attracted: bit within {100.0 * result.band:g} % of the operating speed for the last "
        f"{result.window:g} s of {result.horizon:g} s, from rest ({counts['from_rest']}) and "
        f"wound up ({counts['from_wound_up']}).",
        _differences(result),
    ]
    if not _at_set_speed(result):
        lines.append(
            "Without integral action the operating speed is the cell's own equilibrium "
            f"({counts['no_operating_point']} cells have none); J1 is of the set speed."
        )
    return style.caption(result, *lines, width=125)


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
