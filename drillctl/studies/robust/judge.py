"""Points of a search: gains with their measures, judged by the objective and the requirements."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design, parameter
from drillctl.errors import InputError
from drillctl.studies.robust.evaluation import Evaluation
from drillctl.studies.robust.loops import loops_of, refuse_not_linear
from drillctl.studies.robust.objective import PRICE, objective_of
from drillctl.studies.robust.realizations import designs_at
from drillctl.studies.robust.requirements import Loops
from drillctl.studies.robust.tuned import Tuned

Array = NDArray[np.float64]

STRINGS = 16
"""Realizations at which requirements of the linear loop are asked for."""
ROUNDING = 1e-6
"""A violation of less is none."""


@dataclass(frozen=True, eq=False)
class Point:
    """Gains as they were judged."""

    values: Array  # shape (parameters,): SI
    measures: dict[str, Array]  # shape (realizations,): SI
    value: float  # objective (s)
    # what a search compares (s): the objective, a quantile smoothed, with what requirements are
    # missed by
    merit: float
    share: float  # share of realizations with J1 at or under the level

    @property
    def realizations(self) -> int:
        """At how many it was judged."""
        return len(self.measures["j1"])


class Judge:
    """Judges gains."""

    def __init__(self, design: Design, tuned: tuple[Tuned, ...]) -> None:
        self.design, self.tuned, self.table = design, tuned, design.tables.tune
        self.runs = Evaluation(design, tuned, self.table.realizations, self.table.seed)
        self.objective = objective_of(design)
        self.low = np.array([t.low for t in tuned])
        self.width = np.array([t.high - t.low for t in tuned])
        self.derivatives = 0
        _ = self.loops  # requirements that cannot be asked of these parameters are refused now

    def __len__(self) -> int:
        return len(self.runs)

    @property
    def trajectories(self) -> int:
        """Runs so far, with each direction of a derivative as one more."""
        return self.runs.trajectories + self.derivatives

    def shares(self, values: Array) -> Array:
        """Values over the width of their bounds."""
        return np.asarray((values - self.low) / self.width)

    def values(self, shares: Array) -> Array:
        """Values (SI) of shares, kept within the bounds."""
        return np.asarray(self.low + self.width * np.clip(shares, 0.0, 1.0))

    def own(self, design: Design) -> Array | None:
        """The design's own values, where it has them and they lie within the bounds."""
        found = [parameter(design, t.path).value for t in self.tuned]
        if any(value is None for value in found):
            return None
        values = np.array(found, dtype=float)
        inside = np.all((values >= self.low) & (values <= self.low + self.width))
        return values if inside else None

    @cached_property
    def loops(self) -> Loops | None:
        """Linear loops, where something is asked of them."""
        asked = self.table.constraints
        linear = (asked.slope_reserve, asked.peak_sensitivity, asked.damping_ratio, asked.delay)
        if all(one is None for one in linear):
            return None
        try:
            refuse_not_linear(self.design, self.tuned)
        except InputError as error:
            raise InputError(
                f"requirements of the linear loop: {error}", "tune.constraints"
            ) from None
        some = self.runs.draws
        designs = [self.design, *list(designs_at(self.design, some))[:STRINGS]]
        return Loops(self.tuned, loops_of(designs, self.tuned), asked)

    def points(self, values: Array, count: int, first: int = 0) -> list[Point]:
        """Points at the first realizations, `values` of shape (points, parameters)."""
        measures = self.runs.measures(values, self.objective.needs, first, first + count)
        found = []
        for row, one in enumerate(values):
            own = {name: column[row] for name, column in measures.items()}
            found.append(self._judged(one, own))
        return found

    def at_all(self, point: Point) -> Point:
        """A point at all realizations; those that it met already are not run again."""
        done = point.realizations
        if done == len(self):
            return point
        more = self.runs.measures(point.values[None, :], self.objective.needs, done)
        own = {k: np.concatenate([v, more[k][0]]) for k, v in point.measures.items()}
        return self._judged(point.values, own)

    def _judged(self, values: Array, measures: dict[str, Array]) -> Point:
        linear = self._linear(values)
        return Point(
            values,
            measures,
            float(self.objective.value(measures)),
            float(self.objective.merit(measures, smooth=True)) + PRICE * sum(linear.values()),
            float(self.objective.share(measures)),
        )

    def _linear(self, values: Array) -> dict[str, float]:
        if self.loops is None:
            return {}
        return {k: v for k, v in self.loops.at(values).violations.items() if v > ROUNDING}

    def violations(self, point: Point) -> dict[str, float]:
        """Requirements that a point misses, over their limits."""
        runs = {k: float(v) for k, v in self.objective.violations(point.measures).items()}
        return {k: v for k, v in runs.items() if v > ROUNDING} | self._linear(point.values)
