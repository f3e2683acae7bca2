"""Designs measured at fresh draws, and what of it would be otherwise with other draws."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble.draws import DrawnLanes, DrawnRuns, Failures, drawn_lanes, run_draws
from drillctl.ensemble.intervals import CONFIDENCE, Interval
from drillctl.ensemble.parameters import draw
from drillctl.studies.robust.objective import Objective, objective_of

Array = NDArray[np.float64]

RESAMPLES = 1000
"""Of a bootstrap over draws."""


class Estimate(NamedTuple):
    """A number found from draws."""

    value: float | None  # of these draws; None where it is not finite
    interval: Interval | None  # percentiles of the bootstrap; None where a resample is not finite

    @property
    def excludes_zero(self) -> bool:
        """Whether the interval lies on one side of zero."""
        return self.interval is not None and self.interval[0] * self.interval[1] > 0.0

    def summary(self) -> dict[str, object]:
        """As strict JSON values."""
        interval = None if self.interval is None else list(self.interval)
        return {"value": self.value, "interval_95": interval}


def estimate(value: float, resampled: Array) -> Estimate:
    """A number and the percentiles of its resamples, shape (resamples,)."""
    if not np.isfinite(value):
        return Estimate(None, None)
    if not np.isfinite(resampled).all():
        return Estimate(float(value), None)
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(resampled, [tail, 1.0 - tail])
    return Estimate(float(value), (float(low), float(high)))


class Fresh:
    """Fresh draws of a design, the same numbers for every policy, weight and speed."""

    def __init__(self, design: Design) -> None:
        table = design.tables.advantage
        self.count, self.seed = table.realizations, table.seed

    def lanes(self, design: Design) -> DrawnLanes:
        """Lanes of a design at these draws."""
        return drawn_lanes(design, draw(design, self.count, self.seed))

    def run(self, design: Design, shift: float = 0.0) -> Measured:
        """A design at these draws, its nominal weight shifted (N)."""
        lanes = self.lanes(design)
        return Measured(run_draws(lanes, self.count, shift), objective_of(design), lanes.failures)

    @cached_property
    def resamples(self) -> NDArray[np.int64]:
        """Draws of each resample, the same for all that is compared."""
        random = np.random.Generator(np.random.Philox(self.seed))
        return random.integers(self.count, size=(RESAMPLES, self.count))


@dataclass(frozen=True, eq=False)
class Measured:
    """A design at fresh draws."""

    runs: DrawnRuns  # measures and statuses
    objective: Objective  # that it was tuned to
    failures: tuple[Failures, ...]  # why draws came to nothing

    @property
    def j1(self) -> Array:
        """J1 (s); infinite where a draw came to nothing."""
        found = self.runs.measures["j1"]
        return np.where(np.isnan(found), np.inf, found)

    @property
    def value(self) -> float:
        """Objective (s)."""
        return float(self.objective.value(self._needed))

    def resampled(self, fresh: Fresh) -> Array:
        """Objective (s) of every resample, shape (resamples,)."""
        needed = self._needed
        return self.objective.value({k: v[fresh.resamples] for k, v in needed.items()})

    def mean(self, measure: str) -> float:
        """Mean of a measure (SI) over the draws that define it."""
        values = self.runs.measures[measure]
        return float(np.nanmean(values)) if not np.isnan(values).all() else float("nan")

    @property
    def _needed(self) -> dict[str, Array]:
        found = {name: self.runs.measures[name] for name in self.objective.needs}
        return {**found, "j1": self.j1}


def less(one: Array, other: Array) -> Array:
    """One less the other; nothing where both are infinite."""
    with np.errstate(invalid="ignore"):
        return np.where(one == other, 0.0, one - other)
