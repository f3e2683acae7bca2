"""Rows under each other, one a setting: J1 by its quantiles, and a probability beside it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from drillctl.plots import style

HEIGHT = 0.42  # of a row (inches)


def row(
    spread: Axes, chance: Axes, place: int, quantiles: Sequence[float], probability: float,
    interval: tuple[float, float], colour: str,
) -> None:  # fmt: skip
    """Quantiles of 5, 25, 50, 75 and 95 %, those that are finite; a probability with its ends."""
    low, first, middle, third, high = quantiles
    for ends, width, opaque in (((low, high), 1.6, 1.0), ((first, third), 7.0, 0.55)):
        if np.isfinite(ends).all():
            spread.plot(
                ends, [place, place], "-", color=colour, linewidth=width, alpha=opaque,
                solid_capstyle="butt",
            )  # fmt: skip
    if np.isfinite(middle):
        spread.plot(middle, place, "o", color=colour, markeredgecolor="white", markersize=6.5)
    chance.plot(interval, [place, place], "-", color=colour, linewidth=2.2)
    chance.plot(probability, place, "o", color=colour, markersize=5.5)


def finish(spread: Axes, chance: Axes, names: Sequence[str], level: float, required: float) -> None:
    """Names of the rows, from the top, and what is required."""
    spread.set_yticks(range(len(names)), names)
    spread.set_ylim(len(names) - 0.5, -0.5)
    spread.set_xlim(left=0.0)
    chance.set_xlim(-0.03, 1.03)
    for panel, value in ((spread, level), (chance, required)):
        limit(panel, value)


def limit(panel: Axes, value: float) -> None:
    """A line at what is required."""
    panel.axvline(value, color=style.BLACK, linewidth=1.0, linestyle="--")
