"""A weight on bit that follows the bit speed against the delay of its path."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drillctl import units
from drillctl.plots.style import (
    BLACK,
    COLOURS,
    DASHES,
    LINE,
    SMALL,
    TITLE,
    dress,
    grid_or_new,
    title_of,
)
from drillctl.studies.delay.compute import ENOUGH

if TYPE_CHECKING:
    from drillctl.ensemble.cases import Crossing
    from drillctl.studies.delay.compute import DelayedBenefit, WeightDelay

Array = NDArray[np.float64]

WIDEST = 120
"""Longest line of the caption (characters)."""
BAND = 0.18
"""How much of its colour fills an interval."""
MARKS = "osD^vP"
"""Of the gains, with the colours."""
APART = 0.006
"""Shares of gains are set apart by this much of the axis, lest their bars hide each other."""


def weight_delay(
    result: WeightDelay, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Draw J1 and the share of draws in which stick-slip has ended against the total delay.

    Parameters
    ----------
    result : WeightDelay
        From `drillctl.studies.delay`.
    ax : sequence of Axes, optional
        Two panels.
    system : {'si', 'field'}
        Units of the gain.

    Returns
    -------
    Figure
        Left: mean of J1, a line a gain with its bootstrap band; a cross, with the interval as a
        bar, where it turns harmful. Right: shares with Clopper-Pearson bars. The axis of the
        delay is a square root, since delays are denser at its short end.
    """
    figure, (left, right) = grid_or_new(ax, 1, 2, 12.5, 5.6)
    longest = float(result.delays[-1])
    moving = [i for i, gain in enumerate(result.gains) if gain > 0.0]
    for number, i in enumerate(moving):
        label = _label(result, i, system)
        _j1_line(left, result.delays, result.benefits[i], number, label)
        _share_line(right, result.delays, result.benefits[i], number, number - len(moving) / 2)
        _harm(left, result, result.limits[i].harmful_from, number)
    constant = result.baseline
    level = constant.j1.value
    if level is not None:
        low, high = constant.j1.interval or (level, level)
        left.axhspan(low, high, color=BLACK, alpha=0.12, linewidth=0.0)
        left.axhline(level, color=BLACK, linewidth=LINE, label="constant weight")
    right.axhline(constant.ended.value, color=BLACK, linewidth=LINE)
    right.axhline(ENOUGH, color=BLACK, linewidth=0.8, linestyle=":")
    right.annotate(
        f"{ENOUGH:.0%}", (1.0, ENOUGH), xycoords=("axes fraction", "data"), fontsize=SMALL,
        xytext=(3.0, 0.0), textcoords="offset points", va="center",
    )  # fmt: skip
    left.set_ylim(bottom=0.0)
    right.set_ylim(-0.03, 1.03)
    for panel in (left, right):
        _delay_axis(panel, longest)
    over = "total delay of the bit speed (s)"
    dress(left, over, "J1 (s), mean over the draws", "How far the bit strays from its set speed")
    dress(right, over, "share of the draws", "Stick-slip has ended")
    left.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2, fontsize=SMALL, frameon=False
    )
    title = title_of(result)
    figure.suptitle(title, fontsize=TITLE, x=0.01, ha="left")
    figure.supxlabel(_caption(result), fontsize=SMALL)
    return figure


def _j1_line(
    ax: Axes, delays: Array, benefits: Sequence[DelayedBenefit], number: int, label: str
) -> None:
    colour = COLOURS[number % len(COLOURS)]
    mean = np.array([one.j1.value for one in benefits], dtype=float)
    ends = np.array([one.j1.ends for one in benefits], dtype=float)
    ax.fill_between(delays, ends[:, 0], ends[:, 1], color=colour, alpha=BAND, linewidth=0.0)
    ax.plot(
        delays, mean, MARKS[number % len(MARKS)], color=colour, markersize=4.0, linewidth=LINE,
        linestyle=DASHES[number % len(DASHES)], label=label,
    )  # fmt: skip


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
        color=COLOURS[number % len(COLOURS)], linewidth=LINE, elinewidth=1.0,
        linestyle=DASHES[number % len(DASHES)],
    )  # fmt: skip


def _harm(ax: Axes, result: WeightDelay, found: Crossing, number: int) -> None:
    """A cross on the level of the constant weight, and the interval of its place."""
    level = result.baseline.j1.value
    if found.at is None or level is None:
        return
    longest = float(result.delays[-1])
    low, high = found.interval
    ends = [found.at - (low or 0.0), (longest if high is None else high) - found.at]
    ax.errorbar(
        [found.at], [level], xerr=np.maximum(np.array(ends)[:, None], 0.0), fmt="X",
        markersize=8.0, markeredgecolor=BLACK, markeredgewidth=0.8, capsize=4.0, zorder=6,
        color=COLOURS[number % len(COLOURS)], elinewidth=2.0,
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
    gain, unit = units.displayed(float(result.gains[number]), "N", system)
    found = result.limits[number].harmful_from
    told = f"not harmful up to {result.delays[-1]:g} s"
    if found.at is not None:
        told = f"harmful from {found.at:.2f} s"
    return f"{gain:g} {unit} s/rad, {told}"


def _caption(result: WeightDelay) -> str:
    status = result.design.tables.status
    origin = f"String {status}. " if status == "reconstructed" else ""
    text = (
        f"{origin}{result.realizations} draws of {', '.join(result.drawn)}, the same everywhere "
        f"(seed {result.seed}). Bands and bars: 95 % intervals of the mean (bootstrap) and of the "
        "probability (Clopper-Pearson). Crosses: from here on the mean of J1 is not less than with "
        "a constant weight. Black: constant weight."
    )
    return "\n".join(textwrap.wrap(text, WIDEST))
