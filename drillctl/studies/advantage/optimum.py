"""Robust gains of a policy, quickly: a first look, a race, a population, a polish.

The same realizations, objective and polish as `studies.robust.search`, without derivatives, which
a weight that comes late does not have. Known good gains, those of a neighbour or of the other
policy, are polished beside what the population finds, and the better of both is taken. A valley as
narrow as that of a constant weight is a thousandth of the bounds of three gains: whoever starts
elsewhere does not find it, and a policy that contains another must never end above it. Within the
population they would draw all of it into their valley, though others may be deeper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.advantage.policies import Policy
from drillctl.studies.robust.judge import Judge, Point
from drillctl.studies.robust.polish import polished
from drillctl.studies.robust.spread import spread

Array = NDArray[np.float64]

LOOK = {2: 300, 3: 500}
"""Gains of the first look by the number of parameters."""
RACE = ((16, 80), (64, 16))
"""Realizations of each round, and how many gains are kept after it."""
GENERATIONS, AMONG = 20, 100
"""Of the population, and realizations that it lives among."""
CROSSING = 0.9
"""Share of the parameters of a trial that are changed."""
AT_BOUND = 1e-3
"""Over the bounds' width: nearer is at the bound."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """Gains with the least objective found."""

    values: Array  # shape (parameters,): SI
    value: float  # objective at the realizations of the search (s)
    share: float  # share of them with J1 at or under the level
    # paths of gains that lie on a bound: the objective may be less beyond it
    at_bounds: tuple[str, ...]
    trajectories: int  # runs that it took


def optimum(policy: Policy, realizations: int, starts: Sequence[Array] = ()) -> Optimum:
    """Search the gains of a policy with the least objective."""
    judge = _judge(policy, realizations)
    known = [judge.values(judge.shares(np.asarray(start, dtype=float))) for start in starts]
    points = spread(policy.tuned, LOOK[len(policy.tuned)])
    for count, kept in RACE:
        found = judge.points(points, min(count, len(judge)))
        points = np.stack([point.values for point in sorted(found, key=_merit)[:kept]])
    # Two searches, each polished: known gains would draw the whole population into their valley.
    ends = [judge.at_all(_evolved(judge, points)[0])]
    if known:
        ends.append(min(judge.points(np.stack(known), len(judge)), key=_merit))
    best = min((polished(judge, end) for end in ends), key=_merit)
    shares = judge.shares(best.values)
    bounds = tuple(
        t.path
        for t, share in zip(policy.tuned, shares, strict=True)
        if not AT_BOUND < share < 1.0 - AT_BOUND
    )
    return Optimum(best.values, best.value, best.share, bounds, judge.trajectories)


def _judge(policy: Policy, realizations: int) -> Judge:
    values: dict[str, object] = {"tune.realizations": realizations}
    if policy.design.tables.simulation.step is None:
        values["simulation.accuracy"] = "fast"
    return Judge(policy.design.replace(values), policy.tuned)


def _merit(point: Point) -> float:
    return point.merit


def _evolved(judge: Judge, points: Array) -> list[Point]:
    """A population after some generations, the best first.

    Differential evolution (Storn & Price, J. Global Optim. 11 (1997) 341-359), the variant that
    leans to the best (current-to-best/1): a batch of trials at a time is what the engine likes,
    and differences within a population lie along the valley that it has settled in.
    """
    random, count = np.random.Generator(np.random.Philox(0)), min(AMONG, len(judge))
    population = judge.points(points, count)
    size, n = len(population), len(judge.tuned)
    for _ in range(GENERATIONS):
        shares = np.stack([judge.shares(point.values) for point in population])
        best = shares[int(np.argmin([point.merit for point in population]))]
        pairs = np.stack([random.permutation(size)[:2] for _ in range(size)])
        scale = random.uniform(0.4, 0.9, (size, 1))
        moved = shares + scale * (best - shares + shares[pairs[:, 0]] - shares[pairs[:, 1]])
        taken = random.random((size, n)) < CROSSING
        trials = judge.points(judge.values(np.where(taken, moved, shares)), count)
        population = [min(pair, key=_merit) for pair in zip(population, trials, strict=True)]
    return sorted(population, key=_merit)
