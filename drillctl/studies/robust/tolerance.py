"""How far gains may drift: each alone, and two together as a map about the optimum.

A gain may drift until too few realizations stay under the level, all at the draws of the
certificate. A line from the optimum to a bound is looked at close by first, then ever further
apart, so that the nearest place where the probability falls below what is required is found and
not one behind it; bisection then tells it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.grid import Axis
from drillctl.progress import Progress
from drillctl.studies.robust.fresh import Fresh
from drillctl.studies.robust.tuned import Tuned

Array = NDArray[np.float64]

LOOKED_AT = 24
"""Points on the line from the optimum to a bound, at distances that grow with their square."""
AT_A_TIME = 6
"""Of them, run at a time: none behind the first below."""
HALVINGS = 8
"""Of the step in which it falls."""
POINTS = 21
"""Along each axis of the neighbourhood."""
LINE_POINTS = 81
"""Of the neighbourhood of a single parameter."""
FEW = 500
"""Draws of the neighbourhood, the first ones: its probabilities are for the eye."""
AROUND = 0.6
"""How far the neighbourhood goes on behind the tolerance, over the tolerance's width."""
LEAST_HALF = 0.02
"""Its least half width, over that of the bounds."""


@dataclass(frozen=True, eq=False)
class Tolerance:
    """How far one parameter may drift alone."""

    # of the parameter
    path: str
    unit: str
    value: float  # at the optimum (SI)
    # between these the probability is never below the required one (SI); both the value itself
    # where it is so at the optimum already
    low: float
    high: float
    # whether that end is the bound of the search: how far it goes on is not known
    low_at_bound: bool
    high_at_bound: bool
    # shape (points,): Points that were looked at (SI, increasing), and the probability there
    values: Array
    probability: Array


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """Probability about the optimum over the first one or two parameters."""

    axes: tuple[Axis, ...]  # one or two
    probability: Array  # shape of the axes: Share of the draws with J1 at or under the level
    realizations: int  # how many draws


def tolerances(
    fresh: Fresh, values: Array, probability: float, progress: Progress
) -> tuple[Tolerance, ...]:
    """Tolerance of each parameter."""
    progress.begin("tolerance of the gains", len(values))
    found = []
    for k in range(len(values)):
        found.append(_tolerance(fresh, values, k, probability))
        progress.advance(1)
    return tuple(found)


def _tolerance(fresh: Fresh, values: Array, k: int, probability: float) -> Tolerance:
    tuned = fresh.judge.tuned[k]
    seen = {float(values[k]): probability}
    ends = []
    for bound in (tuned.low, tuned.high):
        if probability < fresh.judge.table.probability:
            ends.append((float(values[k]), False))
        else:
            ends.append(_end(fresh, values, k, bound, seen))
    at = np.array(sorted(seen))
    return Tolerance(
        tuned.path, tuned.unit, float(values[k]),
        ends[0][0], ends[1][0], ends[0][1], ends[1][1],
        at, np.array([seen[x] for x in at]),
    )  # fmt: skip


def _end(
    fresh: Fresh, values: Array, k: int, bound: float, seen: dict[float, float]
) -> tuple[float, bool]:
    """Where the probability falls below what is required, and whether that is the bound."""
    required = fresh.judge.table.probability
    start = float(values[k])
    line = start + (bound - start) * (np.arange(1, LOOKED_AT + 1) / LOOKED_AT) ** 2
    if start == bound:
        return bound, True
    inside = start
    for first in range(0, LOOKED_AT, AT_A_TIME):
        some = line[first : first + AT_A_TIME]
        shares = fresh.shares(_moved(values, k, some))
        seen.update(zip(some.tolist(), shares.tolist(), strict=True))
        below = np.flatnonzero(shares < required)
        if len(below):
            inside = inside if below[0] == 0 else float(some[below[0] - 1])
            return _halved(fresh, values, k, inside, float(some[below[0]]), seen), False
        inside = float(some[-1])
    return bound, True


def _halved(
    fresh: Fresh, values: Array, k: int, inside: float, outside: float, seen: dict[float, float]
) -> float:
    """The last value that keeps the probability, by bisection."""
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        (share,) = fresh.shares(_moved(values, k, np.array([middle])))
        seen[middle] = float(share)
        if share < fresh.judge.table.probability:
            outside = middle
        else:
            inside = middle
    return inside


def _moved(values: Array, k: int, others: Array) -> Array:
    """Points that differ from the optimum in one parameter."""
    points = np.tile(values, (len(others), 1))
    points[:, k] = others
    return points


def neighbourhood(fresh: Fresh, values: Array, found: tuple[Tolerance, ...]) -> Neighbourhood:
    """Probability over the first two parameters, or the only one, about the optimum."""
    some = min(2, len(values))
    points = POINTS if some == 2 else LINE_POINTS
    axes = tuple(
        _about(tuned, one, points)
        for tuned, one in zip(fresh.judge.tuned[:some], found[:some], strict=True)
    )
    grid = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
    cells = np.tile(values, (grid[0].size, 1))
    for k, column in enumerate(grid):
        cells[:, k] = column.ravel()
    count = min(FEW, fresh.count)
    shares = fresh.shares(cells, count)
    return Neighbourhood(axes, shares.reshape(grid[0].shape), count)


def _about(tuned: Tuned, one: Tolerance, points: int) -> Axis:
    wide = AROUND * (one.high - one.low) + LEAST_HALF * (tuned.high - tuned.low)
    low, high = max(tuned.low, one.low - wide), min(tuned.high, one.high + wide)
    return Axis(tuned.path, tuned.unit, np.linspace(low, high, points))
