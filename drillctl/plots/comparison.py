"""Compared cases: J1 over the draws, paired differences, weight, regions and responses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import parameter
from drillctl.ensemble.cases import mean_interval
from drillctl.errors import InputError, shown
from drillctl.plots import style
from drillctl.simulation.measures import MEASURES

if TYPE_CHECKING:
    import shapely

    from drillctl.ensemble.grid import Axis
    from drillctl.studies.compare.compute import ComparedCase, Comparison


UNBEATEN = "unbeaten in both"  # legend of the cases that no other beats
NO_DRAWS = "Each case at its own values, without draws."
OUTLINES = (3.2, 1.7)
"""Outline of the first and the last case (points): under a later one an equal one is seen."""
TRACES = (2.0, 1.1)  # line of the first and the last case, likewise
FILL = 0.10  # how much of its colour fills a region: enough to tell inside from outside


@style.picture()
def j1_distributions(result: Comparison, ax: Axes | None = None) -> Figure:
    """Share of the draws at or under each J1, a curve a case, with the levels marked.

    A curve ends below 1 where draws failed: they are under no level.
    """
    figure, ax = style.axes_or_new(ax, 7.5, 5.0)
    for number, case in enumerate(result.cases):
        values = np.sort(case.measures["j1"][~np.isnan(case.measures["j1"])])
        share = np.arange(1, len(values) + 1) / result.realizations
        failed = result.realizations - len(values)
        label = f"{case.name} ({failed} failed)" if failed else case.name
        ax.step(
            np.concatenate([values[:1], values]), np.concatenate([share[:1] * 0.0, share]),
            where="post", label=label, **style.look(number),
        )  # fmt: skip
    for level in result.levels:
        ax.axvline(level, color=style.GREY, linewidth=0.8, linestyle=":")
        ax.text(
            level, 1.015, f"{level:g}", color=style.GREY, fontsize=style.SMALL, ha="center",
            transform=ax.get_xaxis_transform(),
        )  # fmt: skip
    ax.set_ylim(0.0, 1.0)
    ax.set_xlim(left=0.0)
    style.dress(ax, "J1 (s)", "share of draws at or under")
    title = style.heading(result, "Distribution of J1 over the draws")
    style.title(ax, title, pad=18.0)
    _legend_below(ax, len(result.cases))
    text = _caption(result, _draws(result), "Grey: levels of J1 (s).")
    style.note(figure, text)
    return figure


@style.picture(result="Two cases or more.", raises="There is one case only.")
def paired_differences(result: Comparison, ax: Axes | None = None) -> Figure:
    """Difference of each case from the baseline in every measure, with 95 % intervals.

    In percent of the baseline's mean over the same draws; a measure that is zero or undefined
    there is named below.
    """
    if len(result.cases) < 2:
        raise InputError("differences are between two cases or more, the result has 1")
    figure, ax = style.axes_or_new(ax, 8.0, 6.0)
    drawn, left_out = _relative(result)
    others = result.cases[1:]
    for number, case in enumerate(others):
        place = np.arange(len(drawn)) + (number - 0.5 * (len(others) - 1)) * 0.8 / len(others)
        rows = [drawn[name][case.name] for name in drawn]
        known = [k for k, row in enumerate(rows) if row is not None]
        points = np.array([rows[k] for k in known]).reshape(-1, 3)
        ax.errorbar(
            points[:, 0], place[known],
            xerr=np.abs(points[:, 1:].T - points[:, 0]), fmt="o", markersize=4.5, capsize=3.0,
            linewidth=style.LINE, color=style.colour(number + 1), label=case.name,
        )  # fmt: skip
    ax.axvline(0.0, color=style.BLACK, linewidth=0.8)
    ax.set_yticks(range(len(drawn)), [MEASURES[name].label for name in drawn])
    ax.set_ylim(max(len(drawn), 1) - 0.5, -0.5)
    what = f"Mean difference from {result.baseline.name!r} at the same draws"
    style.dress(ax, "difference (% of its mean)", "", style.heading(result, what))
    _legend_below(ax, len(others))
    lost = f"Zero or undefined in a case: {', '.join(left_out)}." if left_out else ""
    text = "Mean of the differences draw by draw; bars: 95 % bootstrap intervals of that mean."
    style.note(figure, _caption(result, _draws(result), text, lost))
    return figure


@style.picture()
def j1_against_weight(
    result: Comparison, ax: Axes | None = None, system: units.System = "si"
) -> Figure:
    """J1 against the mean weight on bit after the start: what smoothness costs in weight.

    A Pareto picture: a dot a draw, a large mark a case at its means over the draws that all cases
    define; ringed those that no other beats in both, with the border of what they beat. No rings
    where the weights were made equal.
    """
    figure, ax = style.axes_or_new(ax, 7.5, 5.5)
    shared = _shared(result)
    means = []
    for number, case in enumerate(result.cases):
        j1 = case.measures["j1"]
        weight, _ = units.displayed(case.measures["mean_weight_after_start"], "N", system)
        if np.isnan(j1).all():
            continue
        colour = style.colour(number)
        ax.plot(weight, j1, ".", color=colour, markersize=3.0, alpha=0.35)
        if not shared.any():
            continue
        means.append((float(weight[shared].mean()), float(j1[shared].mean())))
        ax.errorbar(
            *means[-1], xerr=_bar(weight[shared], result.seed), yerr=_bar(j1[shared], result.seed),
            fmt="osD^v"[number % 5], color=colour, markeredgecolor=style.BLACK, markersize=9.0,
            capsize=3.0, label=case.name, zorder=4,
        )  # fmt: skip
    # Of weights made equal only the rest of a search is left: nothing to be better in.
    rings = len(means) > 1 and not result.equal_mean_weight
    if rings:
        # More weight than one of them is to be had only at the J1 of the next: hence the steps.
        ax.plot(
            *zip(*_unbeaten(means), strict=True), "o--", drawstyle="steps-pre", color=style.BLACK,
            linewidth=0.9, markersize=17.0, markerfacecolor="none", markeredgewidth=1.2,
            label=UNBEATEN, zorder=3,
        )  # fmt: skip
    _, unit = units.displayed(1.0, "N", system)
    ax.set_ylim(bottom=0.0)
    title = style.heading(result, "J1 against mean weight on bit")
    style.dress(ax, f"mean WOB after {result.weight_from:g} s ({unit})", "J1 (s)", title)
    _legend_below(ax, len(result.cases) + 1)
    count = int(shared.sum())
    which = "the draws" if count == result.realizations else f"the {count} draws defined in all"
    text = f"Large: means over {which} with their 95 % intervals; small: the draws."
    best = "Ringed: no other case has less J1 and more weight on the mean." if rings else ""
    style.note(figure, _caption(result, _draws(result), text, best))
    return figure


@style.picture(
    result="With at least one case that has a map.",
    level="Level of J1 (s), any; by default the lowest of the comparison.",
    raises="No case has a map, or the level is not a positive number.",
)
def compared_regions(
    result: Comparison,
    level: float | None = None,
    ax: Axes | None = None,
    system: units.System = "si",
) -> Figure:
    """Outlines of {J1 <= level} of every case, over the same two parameters.

    With the share of the cells in the legend; a cross where a case is in the map.
    """
    level = result.levels[0] if level is None else level
    if not (math.isfinite(level) and level > 0.0):
        raise InputError(f"a level of J1 is a positive number of seconds, got {shown(level)}")
    axes = _axes(result)
    figure, ax = style.axes_or_new(ax, 8.0, 6.5)
    x, x_label = style.axis_label(axes[0], system)
    y, y_label = style.axis_label(axes[1], system)
    scales = np.array([units.displayed(1.0, axis.unit, system)[0] for axis in axes])
    widths = np.linspace(*OUTLINES, len(result.cases))
    for number, (case, width) in enumerate(zip(result.cases, widths, strict=True)):
        _outline(ax, case, level, number, float(width), scales)
    ax.plot(
        *zip(*_places(result, axes, scales), strict=True), "X", color=style.BLACK, markersize=9.0,
        markeredgewidth=2.0, linestyle="", label="where the cases are", zorder=5,
    )  # fmt: skip
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(y[0], y[-1])
    title = style.heading(result, f"Region of J1 at or under {level:g} s, by case")
    style.dress(ax, x_label, y_label, title)
    _legend_below(ax, 2)
    style.note(figure, _caption(result, NO_DRAWS))
    return figure


@style.picture(ax="Three panels, from the top.", raises="Another number of axes than three.")
def compared_responses(
    result: Comparison, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Bit speed, weight on bit and top torque of every case against time.

    A panel a signal, a line a case.
    """
    figure, panels = style.grid_or_new(ax, 3, 1, 9.0, 8.0, share_x=True)
    signals = (
        ("bit_speed", "rad/s", "bit speed"), ("weight_on_bit", "N", "WOB"),
        ("top_torque", "N*m", "top torque"),
    )  # fmt: skip
    widths = np.linspace(*TRACES, len(result.cases))
    for panel, (name, si_unit, words) in zip(panels, signals, strict=True):
        factor, unit = units.displayed(1.0, si_unit, system)
        for number, case in enumerate(result.cases):
            run = case.nominal.response
            j1 = "J1 undefined" if run.measures.j1 is None else f"J1 {run.measures.j1:.1f} s"
            panel.plot(
                run.time, factor * run.signals[name], label=f"{case.name} ({j1})",
                **style.look(number, widths[number]),
            )  # fmt: skip
        panel.set_xlim(0.0, float(result.baseline.nominal.response.time[-1]))
        style.dress(panel, "time (s)" if panel is panels[-1] else "", f"{words} ({unit})")
    title = style.heading(result, "Speed, weight on bit and top torque, by case")
    style.title(panels[0], title)
    style.legend_under(panels[-1], 2, drop=0.22)
    style.note(figure, _caption(result, NO_DRAWS))
    return figure


def _relative(
    result: Comparison,
) -> tuple[dict[str, dict[str, tuple[float, float, float] | None]], list[str]]:
    """Differences and interval ends (%) by measure and case; and the measures without any."""
    drawn: dict[str, dict[str, tuple[float, float, float] | None]] = {}
    left_out = []
    for name in result.baseline.measures:
        row = {case.name: _percent(result, case, name) for case in result.cases[1:]}
        if any(row.values()):
            drawn[name] = row
        if not all(row.values()):
            left_out.append(MEASURES[name].label)
    return drawn, left_out


def _percent(
    result: Comparison, case: ComparedCase, name: str
) -> tuple[float, float, float] | None:
    base = result.baseline.measures[name]
    # Over the pairs alone: the draws that the difference is of.
    paired = base[~np.isnan(base) & ~np.isnan(case.measures[name])]
    difference = result.paired[case.name][name]
    mean = abs(float(paired.mean())) if paired.size else 0.0
    if difference.value is None or mean == 0.0:
        return None
    low, high = difference.interval or (difference.value, difference.value)
    return 100 * difference.value / mean, 100 * low / mean, 100 * high / mean


def _shared(result: Comparison) -> np.ndarray:
    """Draws at which J1 and weight are defined in every case, but for cases without any."""
    known = [
        ~np.isnan(case.measures["j1"] + case.measures["mean_weight_after_start"])
        for case in result.cases
    ]
    some = [one for one in known if one.any()]
    return np.logical_and.reduce(some) if some else np.zeros(result.realizations, dtype=bool)


def _bar(values: np.ndarray, seed: int) -> list[list[float]] | None:
    interval, mean = mean_interval(values, seed), float(values.mean())
    # Rounding alone may put the mean of equal values outside.
    return interval and [[max(mean - interval[0], 0.0)], [max(interval[1] - mean, 0.0)]]


def _unbeaten(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Points that no other beats with more weight and less J1, by weight."""
    return sorted(
        one for one in points
        if not any(o != one and o[0] >= one[0] and o[1] <= one[1] for o in points)
    )  # fmt: skip


def _axes(result: Comparison) -> tuple[Axis, ...]:
    for case in result.cases:
        if case.nominal.map is not None:
            return case.nominal.map.axes
    reasons = "; ".join(f"{case.name}: {case.nominal.no_map}" for case in result.cases)
    raise InputError(f"no case has a map: {reasons}")


def _outline(
    ax: Axes, case: ComparedCase, level: float, number: int, width: float, scales: Array
) -> None:
    result = case.region(level)
    share = "no map" if result is None else f"{result.area_fraction:.1%} of the cells"
    parts = [] if result is None or result.polygons is None else result.polygons.geoms
    rings = [ring * scales for polygon in parts for ring in _rings(polygon)]
    # An empty region has its entry in the legend too.
    path = Path.make_compound_path(*map(Path, rings)) if rings else Path(np.empty((0, 2)))
    ax.add_patch(
        PathPatch(
            path, facecolor=to_rgba(style.colour(number), FILL), edgecolor=style.colour(number),
            linewidth=width, linestyle=style.look(number)["linestyle"],
            label=f"{case.name} ({share})",
        )
    )  # fmt: skip


def _rings(polygon: shapely.Polygon) -> list[Array]:
    """Corners of the border and of the holes, each of shape (corners, 2).

    Border and holes run in opposite senses: what fills a path leaves out a hole by that.
    """
    from shapely.geometry.polygon import orient

    turned = orient(polygon)
    return [np.asarray(ring.coords) for ring in (turned.exterior, *turned.interiors)]


def _places(result: Comparison, axes: tuple[Axis, ...], scales: Array) -> list[tuple[float, float]]:
    """Where the cases stand in the map, each place once; those outside are not seen."""
    places = []
    for case in result.cases:
        if case.nominal.map is not None:
            own = [parameter(case.nominal.map.design, axis.path).value for axis in axes]
            x, y = (math.nan if value is None else value for value in own)
            places.append((x * scales[0], y * scales[1]))
    return list(dict.fromkeys(places))


def _legend_below(ax: Axes, entries: int) -> None:
    """Legend under the axes, four entries a row, that of the unbeaten after the cases."""
    handles, labels = ax.get_legend_handles_labels()
    last = [h for h, label in zip(handles, labels, strict=True) if label == UNBEATEN]
    style.legend_under(ax, min(entries, 4), [h for h in handles if h not in last] + last, drop=0.13)


def _draws(result: Comparison) -> str:
    return (
        f"{result.realizations} draws of {', '.join(result.baseline.drawn)}, the same for all "
        f"cases (seed {result.seed})."
    )


def _caption(result: Comparison, *lines: str) -> str:
    equal = "Nominal weights shifted for equal means." if result.equal_mean_weight else ""
    return style.caption(result, lines[0], equal, *lines[1:])
