"""Steps without derivatives, at all realizations: what is left where J1 jumps.

A pattern search (Hooke & Jeeves 1961): a step each way along every axis and along the direction
that the last round gained by; half the step where nothing is gained. It finds the floor of a
narrow valley whose sides are made of jumps, where a linear model promises what it cannot keep.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.robust.judge import Judge, Point

Array = NDArray[np.float64]

FIRST_STEP = 0.01
"""Over the bounds' width."""
LAST_STEP = 1e-3
ROUNDS = 14
"""Most rounds."""


def polished(judge: Judge, start: Point) -> Point:
    """The end of a pattern search from a point, judged at all realizations."""
    best, step = judge.at_all(start), FIRST_STEP
    gained = np.zeros(len(best.values))
    for _ in range(ROUNDS):
        trials = judge.points(_around(judge, best, step, gained), len(judge))
        found = min(trials, key=lambda point: point.merit)
        if found.merit < best.merit:
            gained = judge.shares(found.values) - judge.shares(best.values)
            best = found
            continue
        gained = np.zeros(len(best.values))
        step *= 0.5
        if step < LAST_STEP:
            break
    return best


def _around(judge: Judge, best: Point, step: float, gained: Array) -> Array:
    """Points a step away along every axis, and twice what was gained last."""
    n, at = len(best.values), judge.shares(best.values)
    moves = [sign * step * np.eye(n)[k] for k in range(n) for sign in (1.0, -1.0)]
    if gained.any():
        moves.append(2.0 * gained)
    elif n == 2:  # a valley lies across the axes more often than not
        moves += [step * np.array([a, b]) for a in (0.7, -0.7) for b in (0.7, -0.7)]
    points = np.stack([judge.values(at + move) for move in moves])
    return points[np.any(points != best.values, axis=1)]
