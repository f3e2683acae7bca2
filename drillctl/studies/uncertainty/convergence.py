"""How areas settle as realizations are added."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.uncertainty.areas import Area, region_areas
from drillctl.studies.uncertainty.probability import INNER, probability_map
from drillctl.studies.uncertainty.scatter import Scatter

Array = NDArray[np.float64]

FEWEST = 16
"""Realizations that the first point of a curve has, or two a replicate."""


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
