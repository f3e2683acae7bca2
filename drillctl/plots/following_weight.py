"""A weight on bit that follows the bit speed: against the delay of its path, and what it gains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.arrays import Array
from drillctl.plots import style

if TYPE_CHECKING:
    from drillctl.ensemble.cases import Crossing
    from drillctl.studies.advantage import Advantage
    from drillctl.studies.advantage.compute import DelayLine
    from drillctl.studies.delay.compute import DelayedBenefit, WeightDelay


BAND = 0.18  # how much of its colour fills an interval
MARKS = "osD^vP"  # of gains and policies, with the colours
APART = 0.006
"""Shares of gains are set apart by this much of the axis, lest their bars hide each other."""
HARM = 0.6  # harm that is shown, over the objective of the constant weight


@style.picture(result="From `drillctl.studies.delay`.", ax="Two panels.")
def weight_delay(
    result: WeightDelay, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Draw J1 and the share of draws in which stick-slip has ended against the total delay.

    Left: mean of J1, a line a gain with its bootstrap band; a cross, with the interval as a bar,
    where it turns harmful. Right: shares with Clopper-Pearson bars. The axis of the delay is a
    square root, since delays are denser at its short end.
    """
    figure, (left, right) = style.grid_or_new(ax, 1, 2, 12.5, 5.6)
    longest = float(result.delays[-1])
    constant, level = result.baseline, result.baseline.j1.value
    moving = [i for i, gain in enumerate(result.gains) if gain > 0.0]
    for number, i in enumerate(moving):
        label = _label(result, i, system)
        _j1_line(left, result.delays, result.benefits[i], number, label)
        _share_line(right, result.delays, result.benefits[i], number, number - len(moving) / 2)
        harmful = result.limits[i].harmful_from
        _cross(left, harmful, level, longest, style.colour(number))
    if level is not None:
        low, high = constant.j1.interval or (level, level)
        left.axhspan(low, high, color=style.BLACK, alpha=0.12, linewidth=0.0)
        left.axhline(level, color=style.BLACK, linewidth=style.LINE, label="constant weight")
    right.axhline(constant.ended.value, color=style.BLACK, linewidth=style.LINE)
    right.axhline(result.enough, color=style.BLACK, linewidth=0.8, linestyle=":")
    right.annotate(
        f"{result.enough:.0%}", (1.0, result.enough), xycoords=("axes fraction", "data"),
        xytext=(3.0, 0.0), textcoords="offset points", va="center", fontsize=style.SMALL,
    )  # fmt: skip
    left.set_ylim(bottom=0.0)
    right.set_ylim(-0.03, 1.03)
    for panel in (left, right):
        _delay_axis(panel, longest)
    over = "total delay of the bit speed (s)"
    style.dress(left, over, "J1 (s), mean over the draws", "Speed error of the bit")
    style.dress(right, over, "share of the draws", "Stick-slip ended")
    style.legend_under(left, 2, drop=0.13)
    if ax is None:
        title = style.heading(result, "Weight on bit that follows the bit speed, against its delay")
        style.headline(figure, title)
        text = (
            f"{result.realizations} draws of {', '.join(result.drawn)}, the same everywhere (seed "
            f"{result.seed}). Bands and bars: 95 % intervals of the mean (bootstrap) and of the "
            "probability (Clopper-Pearson). Crosses: from here on the mean of J1 is not less than "
            "with a constant weight. Black: constant weight."
        )
        style.note(figure, style.caption(result, text))
    return figure


def _j1_line(
    ax: Axes, delays: Array, benefits: Sequence[DelayedBenefit], number: int, label: str
) -> None:
    mean = np.array([one.j1.value for one in benefits], dtype=float)
    ends = np.array([one.j1.ends for one in benefits], dtype=float)
    ax.fill_between(
        delays, ends[:, 0], ends[:, 1], color=style.colour(number), alpha=BAND, linewidth=0.0
    )
    mark = MARKS[number % len(MARKS)]
    ax.plot(delays, mean, mark, markersize=4.0, label=label, **style.look(number))


def _share_line(
    ax: Axes, delays: Array, benefits: Sequence[DelayedBenefit], number: int, place: float
) -> None:
    shares = np.array([one.ended.value for one in benefits])
    ends = np.array([one.ended.interval for one in benefits])
    bars = np.abs(ends.T - shares)
    # Set apart as the eye sees it: on the axis of square roots.
    where = np.square(_root(delays) + (place + 0.5) * APART * np.sqrt(delays[-1]))
    ax.errorbar(
        where, shares, yerr=bars, fmt=MARKS[number % len(MARKS)], capsize=2.5, markersize=4.0,
        elinewidth=1.0, **style.look(number),
    )  # fmt: skip


def _cross(ax: Axes, crossing: Crossing, level: float | None, longest: float, colour: str) -> None:
    """A cross where a line meets a level, and the interval of that place."""
    if crossing.at is None or level is None:
        return
    ends = [longest if end is None else end for end in crossing.interval]
    ax.errorbar(
        [crossing.at], [level], xerr=np.abs(np.array(ends)[:, None] - crossing.at), fmt="X",
        markersize=8.0, markeredgecolor=style.BLACK, markeredgewidth=0.8, capsize=4.0, zorder=6,
        color=colour, elinewidth=2.0,
    )  # fmt: skip


def _delay_axis(ax: Axes, longest: float) -> None:
    if longest == 0.0:
        return
    ax.set_xscale("function", functions=(_root, np.square))
    ticks = [t for t in (0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0) if t <= longest]
    ax.set_xticks(ticks if len(ticks) > 2 else np.linspace(0.0, longest, 5))
    ax.set_xticks([], minor=True)
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_xlim(0.0, 1.02 * longest)


def _root(values: Array) -> Array:
    """Square root; of what lies beyond the axis, nothing."""
    return np.sqrt(np.maximum(values, 0.0))


def _label(result: WeightDelay, number: int, system: units.System) -> str:
    gain, unit = units.displayed(float(result.gains[number]), "N*s/rad", system)
    crossing = result.limits[number].harmful_from
    limit = f"not harmful up to {result.delays[-1]:g} s"
    if crossing.at is not None:
        limit = f"harmful from {crossing.at:.2f} s"
    return f"{gain:.4g} {unit}, {limit}"


@style.picture(result="From `drillctl.advantage`.")
def advantage_front(
    result: Advantage, ax: Axes | None = None, system: units.System = "si"
) -> Figure:
    """Draw the robust objective against the mean weight on bit, a line a policy.

    Each point is a nominal weight with gains tuned for it; bars are 95 % intervals.
    """
    figure, axes = style.axes_or_new(ax, 7.5, 5.2)
    factor, unit = units.displayed(1.0, "N", system)
    front = result.front.figures
    for k, name in enumerate(result.front.policies):
        weight = front["mean_weight"][k, :, 0] * factor
        value = front["objective"][k, :, 0]
        ends = np.stack([front[f"objective_{end}"][k, :, 0] for end in ("low", "high")])
        axes.errorbar(
            weight, value, yerr=np.abs(ends - value), fmt=MARKS[k % 3], markersize=5.0,
            capsize=3.0, label=name, **style.look(k),
        )  # fmt: skip
    axes.set_ylim(bottom=0.0)
    speed, rpm = units.displayed(float(result.front.speeds[0]), "rad/s", system)
    title = style.heading(result, f"Robust J1 against mean weight on bit, at {speed:g} {rpm}")
    across = f"mean weight on bit after the start ({unit})"
    style.dress(axes, across, f"{result.objective} (s)", title)
    style.legend(axes)
    if ax is None:
        style.note(figure, _draws(result))
    return figure


@style.picture(result="From `drillctl.advantage`.", ax="Two panels.")
def advantage_map(
    result: Advantage, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Draw the advantage over weight and speed, a panel for each path of the weight.

    Objective of the constant weight less that of the one that follows, each tuned in each cell; a
    cross where the 95 % interval holds zero.
    """
    figure, panels = style.grid_or_new(ax, 1, 2, 12.0, 5.2)
    factor, unit = units.displayed(1.0, "N", system)
    turning, rpm = units.displayed(1.0, "rad/s", system)
    values = result.chart.figures["advantage"][1:]
    most = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 1.0
    mesh = None
    for k, axes in enumerate(panels, start=1):
        mesh = axes.pcolormesh(
            result.chart.speeds * turning, result.chart.weights * factor, values[k - 1],
            cmap="PuOr", vmin=-most, vmax=most, shading="nearest",
        )  # fmt: skip
        doubtful = ~result.chart.significant(k)
        for i, j in np.ndindex(values[k - 1].shape):
            place = (result.chart.speeds[j] * turning, result.chart.weights[i] * factor)
            value = values[k - 1][i, j]
            mark = "" if not np.isfinite(value) else f"{value:.1f}" + "×" * int(doubtful[i, j])
            dark = abs(value) > 0.6 * most
            axes.annotate(mark, place, ha="center", va="center", fontsize=style.SMALL,
                          color="white" if dark else style.BLACK)  # fmt: skip
        style.dress(axes, f"set speed ({rpm})", f"nominal weight on bit ({unit})",
              result.chart.policies[k])  # fmt: skip
        axes.grid(visible=False)
        axes.set_xticks(result.chart.speeds * turning)
        axes.set_yticks(result.chart.weights * factor)
        for formatted in (axes.xaxis, axes.yaxis):
            formatted.set_major_formatter("{x:.4g}")
    if mesh is not None:
        style.colour_bar(figure, mesh, panels, f"advantage in the {result.objective} (s)")
    if ax is None:
        title = style.heading(result, "J1 saved by a weight that follows the bit speed")
        style.headline(figure, title)
        more = "Positive: the weight that follows is better. ×: the 95 % interval holds zero."
        style.note(figure, _draws(result, more))
    return figure


@style.picture(result="From `drillctl.advantage`.")
def advantage_delay(result: Advantage, ax: Axes | None = None) -> Figure:
    """Draw the advantage against the delay of the path, with kept gains and gains tuned anew.

    Bands are 95 % intervals; a cross with a bar where the advantage of kept gains vanishes and
    where that of gains tuned anew is no longer material.
    """
    figure, axes = style.axes_or_new(ax, 8.0, 5.2)
    study, share = result.delay, result.design.tables.advantage.material
    lines: tuple[tuple[str, DelayLine, Crossing, float, str], ...] = (
        ("gains of the ideal path", study.kept, study.kept.zero, 0.0, style.VERMILLION),
        ("gains tuned at each delay", study.anew, study.anew.material,
         share * study.constant, style.BLUE),
    )  # fmt: skip
    for number, (name, line, crossing, level, colour) in enumerate(lines):
        axes.fill_between(line.delays, line.low, line.high, color=colour, alpha=BAND, linewidth=0)
        axes.plot(line.delays, line.advantage, MARKS[number], color=colour, linewidth=style.LINE,
                  linestyle=style.DASHES[number], markersize=4.0,
                  label=f"{name}: {_vanishes(crossing, level)}")  # fmt: skip
        _cross(axes, crossing, level, float(study.delays[-1]), colour)
    axes.axhline(0.0, color=style.BLACK, linewidth=0.9)
    axes.set_xlim(0.0, max(float(study.delays[-1]), 1e-3) * 1.02)
    if np.isfinite(study.constant):  # harm goes far below: what matters is where it begins
        axes.set_ylim(bottom=max(axes.get_ylim()[0], -HARM * study.constant))
    style.dress(axes, "delay of the bit speed (s)", f"advantage in the {result.objective} (s)",
          style.heading(result, "J1 saved against the delay of the bit speed"))  # fmt: skip
    style.legend_under(axes, 1, drop=0.13)
    if ax is None:
        more = (
            f"Constant weight: {study.constant:.1f} s. Hoist lag and limits are the same at every "
            "delay. Harm goes on below the picture."
        )
        style.note(figure, _draws(result, more))
    return figure


@style.picture(result="From `drillctl.advantage`.")
def advantage_cases(result: Advantage, ax: Axes | None = None) -> Figure:
    """Draw the distribution of J1 of every case over the fresh draws.

    Quantiles 5 to 95 % as a bar, the median as a line, the objective as a diamond with its 95 %
    interval.
    """
    figure, axes = style.axes_or_new(ax, 9.0, 4.8)
    names = []
    for row, case in enumerate(result.cases):
        values = case.measures["j1"]
        values = values[~np.isnan(values)]
        if values.size:
            low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
            colour = style.COLOURS[result.chart.policies.index(case.policy)]
            axes.barh(row, high - low, left=low, height=0.55, color=colour, alpha=0.35)
            axes.plot([middle, middle], [row - 0.28, row + 0.28], color=colour, linewidth=2.0)
        if case.objective.value is not None and case.objective.interval is not None:
            ends = np.abs(np.array(case.objective.interval)[:, None] - case.objective.value)
            axes.errorbar([case.objective.value], [row], xerr=ends, fmt="D", color=style.BLACK,
                          markersize=4.5, capsize=3.5)  # fmt: skip
        names.append(case.name)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlim(left=0.0)
    style.dress(
        axes, "J1 (s)", "", style.heading(result, "J1 of each policy at its robust optimum")
    )
    if ax is None:
        more = f"Bars: 5 to 95 % of the draws; line: median; diamond: {result.objective}."
        style.note(figure, _draws(result, more))
    return figure


def _vanishes(result: Crossing, level: float) -> str:
    what = "none" if level == 0.0 else f"under {level:.2g} s"
    if result.at is None:
        return f"never {what} up to the longest delay"
    low, high = ("beyond" if end is None else f"{end:.2f}" for end in result.interval)
    return f"{what} from {result.at:.2f} s ({low} to {high})"


def _draws(result: Advantage, more: str = "") -> str:
    table = result.design.tables.advantage
    text = (
        f"{table.realizations} fresh draws, the same everywhere (seed {table.seed}); intervals by "
        f"resampled pairs. {more}"
    )
    return style.caption(result, text)
