"""How areas settle as realizations are added, and when they are enough.

A run stops by a fixed schedule of looks, with intervals that are corrected for their number.

Looking at the data again and again until an interval happens to be narrow makes it hold less
often than it says. The looks are therefore fixed before the first lane is run, and the interval
of each has its share of the error that all may make together (Bonferroni).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.design.uncertain_tables import UntilTable
from drillctl.ensemble.cases import CONFIDENCE, Interval
from drillctl.ensemble.probability import INNER, Area, Scatter, probability_map, region_areas
from drillctl.errors import InputError

Array = NDArray[np.float64]

FEWEST = 16  # realizations that the first point of a curve has, or two a replicate


class Convergence(NamedTuple):
    """Areas of the inner regions against the number of realizations."""

    counts: tuple[int, ...]  # realizations, from the first on
    # by level, one a count, with 95 % intervals of that count by itself
    areas: dict[float, tuple[Area, ...]]


def convergence(j1: Array, levels: tuple[float, ...], scatter: Scatter, seed: int) -> Convergence:
    """Areas of the inner regions at doubling numbers of realizations."""
    counts, count = [], max(FEWEST, 2 * scatter.replicates)
    while count < len(j1):
        counts.append(count)
        count *= 2
    counts.append(len(j1))
    rows = []
    for count in counts:
        asked = [(probability_map(j1[:count], level, scatter), INNER) for level in levels]
        rows.append(region_areas(j1[:count], asked, scatter, seed))
    return Convergence(
        tuple(counts),
        {level: tuple(row[k] for row in rows) for k, level in enumerate(levels)},
    )


class Look(NamedTuple):
    """The area as it was known at a number of realizations."""

    realizations: int  # how many had been run
    area: float  # share of the map
    interval: Interval  # corrected for the number of looks
    confidence: float  # of this interval by itself

    def enough(self, half_width: float) -> bool:
        """Whether the area is known to within a half-width on either side."""
        low, high = self.interval
        return max(self.area - low, high - self.area) <= half_width


def schedule(first: int, most: int) -> tuple[int, ...]:
    """Numbers of realizations at which the area is looked at: doubling, up to the most."""
    looks = []
    while first < most:
        looks.append(first)
        first *= 2
    return (*looks, most)


def level_of(table: UntilTable, levels: tuple[float, ...]) -> float:
    """The level whose region is to be known: that of the table, or the highest of the map."""
    if table.level is None:
        return levels[-1]
    if table.level not in levels:
        allowed = ", ".join(f"{level:g}" for level in levels)
        raise InputError(
            f"{table.level:g} is no level of the map; allowed: {allowed}", "uncertainty.until.level"
        )
    return table.level


def look(
    j1: Array, table: UntilTable, level: float, looks: int, scatter: Scatter, seed: int
) -> Look:
    """The area at one of the looks."""
    confidence = 1.0 - (1.0 - CONFIDENCE) / looks
    result = probability_map(j1, level, scatter)
    (area,) = region_areas(j1, [(result, table.probability)], scatter, seed, confidence)
    return Look(len(j1), area.value, area.interval, confidence)
