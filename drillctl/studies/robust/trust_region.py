"""A trust region on the linearised trajectories of all realizations.

J1 of one realization is smooth but for jumps where a stick event appears or goes; its derivatives
tell nothing of these. A statistic over the realizations, such as a quantile, has kinks where
realizations change their order. The model takes the order into account: every realization is
linear in the step, and their statistic is taken of the linearised values. Its least value within
the region is looked for among points spread over it; a handful of gains needs no more. Of a
quantile or of what lies beyond it only the realizations in the upper part are linearised, as the
others do not come near it in a step; they stay as they are. The batch engine then runs the step:
where the model was wrong, a jump having come between, the region shrinks about the best gains so
far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.robust.judge import Judge, Point
from drillctl.studies.robust.spread import spread
from drillctl.studies.robust.trajectory import Sensitivities, Trajectories, why_not
from drillctl.studies.robust.tuned import Tuned

Array = NDArray[np.float64]

FIRST_REGION = 0.04
"""Half width of the first region, over the bounds' width."""
SMALLEST_REGION = 5e-4
"""And that at which a search ends."""
STEPS = 12
"""Most steps from a start."""
LOOKED_AT = 512
"""Steps at which the model is looked at."""
UPPER = 0.35
"""Realizations from this share below the quantile on are linearised."""
MOST = 300
"""Realizations that are linearised at most."""
WIDER, NARROWER = 1.8, 0.4
"""Of the region after a good and after a bad step."""
GOOD, POOR = 0.5, 0.1
"""Shares of what was promised from which a step is a good one, and under which a bad one."""


@dataclass(eq=False)
class Derivatives:
    """Derivatives of the measures at the realizations of a search."""

    judge: Judge  # whose count of trajectories they add to
    # trajectories of each string, and the positions of its lanes among the realizations
    parts: list[tuple[Trajectories, NDArray[np.int64]]]

    @classmethod
    def of(cls, judge: Judge) -> Derivatives | str:
        """Those of a search, or why there are none.

        Strings that differ take a function each; the first `MOST_STRINGS` realizations are told.
        """
        parts = []
        for ready in judge.runs.groups[:MOST_STRINGS]:
            design, lanes = ready.group.design, ready.group.lanes
            reason = why_not(design, lanes, judge.tuned)
            if reason is not None:
                return f"none: {reason}"
            made = Trajectories(design, lanes, ready.prepared, judge.tuned)
            parts.append((made, np.searchsorted(judge.runs.numbers, ready.group.numbers)))
        return cls(judge, parts)

    def at(self, point: Point) -> Sensitivities:
        """At the realizations that a point was judged at and that its objective turns on.

        The others have no slopes, and neither have those whose string is one too many.
        """
        count = point.realizations
        slopes = {name: np.zeros((count, len(point.values))) for name in point.measures}
        wanted = self._telling(point)
        for trajectories, places in self.parts:
            chosen = np.flatnonzero(np.isin(places, wanted))
            if len(chosen):
                found = trajectories.sensitivities(point.values, chosen)
                for name, column in slopes.items():
                    column[places[chosen]] = found.slopes[name]
                # A run, and as many more as there are directions.
                self.judge.derivatives += len(chosen) * (1 + len(point.values))
        return Sensitivities(point.measures, slopes)

    def _telling(self, point: Point) -> NDArray[np.int64]:
        """Positions of the realizations to be linearised."""
        table, count = self.judge.table, point.realizations
        first = {
            "mean": 0.0, "worst": 1.0 - UPPER,
            "quantile": table.quantile - UPPER, "cvar": table.quantile - UPPER,
        }[table.objective]  # fmt: skip
        order = np.argsort(point.measures["j1"], kind="stable")
        upper = order[max(0, int(first * count)) :]
        return upper[np.linspace(0, len(upper) - 1, min(len(upper), MOST)).astype(int)]


MOST_STRINGS = 32
"""Strings whose trajectories get derivatives: each takes a function of its own."""


def descended(judge: Judge, derivatives: Derivatives, start: Point) -> Point:
    """The end of a search by trust regions from a point."""
    best, region = start, FIRST_REGION
    known: Sensitivities | None = None
    for _ in range(STEPS):
        if known is None:
            known = derivatives.at(best)
        step, promised = _best_step(judge, known, best, region)
        if promised <= 0.0:
            region *= NARROWER
        else:
            trial = judge.points((best.values + step)[None, :], best.realizations)[0]
            gain = best.merit - trial.merit
            region *= (
                WIDER if gain > GOOD * promised else NARROWER if gain < 0.1 * promised else 1.0
            )
            if gain > 0.0:
                best, known = trial, None
        if region < SMALLEST_REGION:
            break
    return best


def _best_step(
    judge: Judge, known: Sensitivities, best: Point, region: float
) -> tuple[Array, float]:
    """The step (SI) of the least modelled merit within a region, and what it promises (s)."""
    n = len(best.values)
    unit = tuple(Tuned("", "", -1.0, 1.0) for _ in range(n))
    shares = judge.shares(best.values) + region * spread(unit, LOOKED_AT)
    steps = judge.values(shares) - best.values
    measures = {
        name: known.values[name] + steps @ known.slopes[name].T for name in judge.objective.needs
    }
    now = {name: known.values[name] for name in judge.objective.needs}
    merit = judge.objective.merit(measures, smooth=True)
    least = int(np.argmin(merit))
    return steps[least], float(judge.objective.merit(now, smooth=True) - merit[least])
