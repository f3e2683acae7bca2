"""Robust gains of a policy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.advantage.policies import Policy
from drillctl.studies.tune.search import optimum as least
from drillctl.studies.tune.search import search_problem

Array = NDArray[np.float64]

AT_BOUND = 1e-3
"""Over the bounds' width: nearer is at the bound."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """Gains with the least objective."""

    values: Array  # shape (parameters,): SI
    value: float  # objective at the realizations of the search (s)
    share: float  # share of them with J1 at or under the level
    # paths of gains that lie on a bound: the objective may be less beyond it
    at_bounds: tuple[str, ...]
    trajectories: int  # runs that it took


def optimum(policy: Policy, realizations: int, starts: Sequence[Array] = ()) -> Optimum:
    """Search the gains of a policy with the least objective, from known ones as well."""
    design = policy.design.replace({"tune.realizations": realizations})
    problem = search_problem(design, policy.tuned)
    best = least(problem, starts)
    shares = problem.shares(best.values)
    bounds = tuple(
        t.path
        for t, share in zip(policy.tuned, shares, strict=True)
        if not AT_BOUND < share < 1.0 - AT_BOUND
    )
    return Optimum(best.values, best.value, best.share, bounds, problem.trajectories)
