"""Gains judged at draws that no search has seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble.cases import Interval, share_interval
from drillctl.ensemble.draws import Failures
from drillctl.studies.robust.evaluation import Evaluation
from drillctl.studies.robust.judge import Judge, Point
from drillctl.studies.robust.objective import rank_weights
from drillctl.studies.robust.tuned import Tuned

Array = NDArray[np.float64]

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
"""Of J1, as they are reported."""


@dataclass(frozen=True, eq=False)
class FreshRuns:
    """J1 of one rig at the fresh draws."""

    # shape (draws,): Seconds; infinite for a run without an answer, NaN for a draw that no rig
    # has
    j1: Array
    value: float  # objective of `[tune]` over the draws that a rig can have (s)
    level: float  # of J1 (s)

    @property
    def hits(self) -> int:
        """Draws with J1 at or under the level; one that no rig has is not."""
        return int(np.count_nonzero(self.j1 <= self.level))

    @property
    def probability(self) -> float:
        """Their share of all draws."""
        return self.hits / len(self.j1)

    @property
    def interval(self) -> Interval:
        """Clopper-Pearson interval of that probability, 95 %."""
        return share_interval(self.hits, len(self.j1))

    @property
    def quantiles(self) -> dict[str, float]:
        """Quantiles of J1 (s) over the draws that a rig can have, by name; infinite ones too."""
        possible = np.sort(self.j1[~np.isnan(self.j1)])
        found = {}
        for q in QUANTILES:
            weights = rank_weights("quantile", q, len(possible))
            used = weights > 0.0  # no weight on what is infinite
            found[f"q{round(100 * q):02d}"] = float(possible[used] @ weights[used])
        return found


def fresh_design(design: Design) -> Design:
    """The design with the draws of its certificate in place of those of the search.

    They are independent draws, whatever the sampling of the search: the interval is exact for
    these alone.
    """
    table = design.tables.tune
    return design.replace(
        {
            "tune.realizations": table.certificate.realizations,
            "tune.seed": table.fresh_seed,
            # The seed of the certificate must differ from that of a search, which this is not.
            "tune.certificate.seed": table.seed,
            "uncertainty.sampling": "monte-carlo",
        }
    )


class Fresh:
    """Runs of any gains and any law at the fresh draws of a design."""

    def __init__(self, design: Design, tuned: tuple[Tuned, ...]) -> None:
        self.design = fresh_design(design)
        self.judge = Judge(self.design, tuned)
        self._others = 0

    @property
    def count(self) -> int:
        """Draws, those that no rig has included."""
        return len(self.judge.runs.draws)

    @property
    def failures(self) -> tuple[Failures, ...]:
        """Draws that no rig has."""
        return self.judge.runs.failures

    @property
    def drawn(self) -> dict[str, Array]:
        """Drawn values by path (SI), shape (draws,)."""
        return self.judge.runs.draws.values

    @property
    def trajectories(self) -> int:
        """Runs so far."""
        return self.judge.trajectories + self._others

    def of_gains(self, values: Array) -> tuple[Point, FreshRuns]:
        """Tuned values (SI), shape (parameters,), as they are judged, and their J1."""
        (point,) = self.judge.points(values[None, :], len(self.judge))
        return point, self._spread(self.judge.runs, point.measures["j1"], point.value)

    def of_design(self, design: Design) -> FreshRuns:
        """A design of any law, at the same draws."""
        table, objective = self.judge.table, self.judge.objective
        sampled = design.replace({"uncertainty.sampling": "monte-carlo"})
        runs = Evaluation(sampled, (), table.realizations, table.seed)
        measures = runs.measures(np.empty((1, 0)), objective.needs)
        self._others += runs.trajectories
        value = float(objective.value({k: v[0] for k, v in measures.items()}))
        return self._spread(runs, measures["j1"][0], value)

    def shares(self, points: Array, realizations: int | None = None) -> Array:
        """Share of the first draws, all by default, with J1 at or under the level."""
        level, judge = self.judge.table.level, self.judge
        count = self.count if realizations is None else min(realizations, self.count)
        possible = int(np.searchsorted(judge.runs.numbers, count))
        j1 = judge.runs.measures(points, ("j1",), 0, possible, give_up=level)["j1"]
        return np.asarray((j1 <= level).sum(axis=1) / count)

    def _spread(self, runs: Evaluation, j1: Array, value: float) -> FreshRuns:
        """Over all draws, those that no rig has included."""
        whole = np.full(self.count, np.nan)
        whole[runs.numbers] = j1
        return FreshRuns(whole, value, self.judge.table.level)
