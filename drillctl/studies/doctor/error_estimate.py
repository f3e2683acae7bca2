"""Errors of the batch engine estimated from itself: the same lanes at finer schemes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design.tables import SimulationTable
from drillctl.rig.drillstring import Drillstring
from drillctl.simulation.batch import Prepared
from drillctl.simulation.propagator import string_step
from drillctl.simulation.scheme import ACCURACIES, Scheme
from drillctl.store.labels import label

Array = NDArray[np.float64]

REFINEMENTS = (1, 2, 4)
"""Parts into which the step of the scheme is divided."""
ORDER_TWO = 4.0 / 3.0
"""Error of a scheme of order 2 per difference to the same at half the step (Richardson)."""
SMALLEST = 1e-7
"""J1 (s) under which errors are taken in parts of this: a rig that never leaves its set speed."""
ROUNDING = 1e-9
"""Relative difference of two schemes that may be rounding."""
ENOUGH = 8
"""Lanes from which an order says something."""
UNLIKELY = 0.025
"""Chance of a sample that speaks against a promise."""


@dataclass(frozen=True)
class Promise:
    """What a named accuracy promises of the relative error of J1, over the paper's map."""

    # median and 99th percentile; None for no promise
    median: float | None
    p99: float

    def kept(self, errors: Array) -> bool:
        """Whether a sample of errors, shape (lanes,), leaves it standing.

        It does unless so many of them lie over a percentile as chance has in less than one of
        forty samples of a map that keeps it (binomial, one-sided).
        """
        known = errors[np.isfinite(errors)]
        asked = [(self.p99, 0.01)] + ([] if self.median is None else [(self.median, 0.5)])
        return known.size > 0 and all(
            _chance(int((known > bar).sum()), known.size, share) >= UNLIKELY for bar, share in asked
        )


def _chance(over: int, count: int, share: float) -> float:
    """Chance of so many or more of `count` where each is one with the chance `share`."""
    from scipy.stats import binom

    return float(binom.sf(over - 1, count, share))


PROMISES = {
    "fast": Promise(1.5e-4, 7e-3),
    "standard": Promise(5e-5, 2e-3),
    "fine": Promise(None, 1e-4),
}


@dataclass(frozen=True)
class Errors:
    """Relative errors of J1 over a sample of lanes."""

    lanes: int  # lanes that have one
    # percentiles, and the largest
    median: float
    p90: float
    p99: float
    worst: float

    def summary(self) -> dict[str, float]:
        """By name."""
        return {"median": self.median, "p90": self.p90, "p99": self.p99, "worst": self.worst}


def errors_of(values: Array) -> Errors:
    """Percentiles of those relative errors that are numbers; all NaN if none is."""
    known = values[np.isfinite(values)]
    if not known.size:
        return Errors(0, np.nan, np.nan, np.nan, np.nan)
    median, p90, p99 = (float(v) for v in np.percentile(known, (50, 90, 99)))
    return Errors(len(known), median, p90, p99, float(known.max()))


@dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """J1 of a sample of lanes at a scheme and at finer ones."""

    # shape (3, lanes): At the scheme, at half and at a quarter of its step (s); NaN where a lane
    # failed
    j1: Array = label("refinement", "lane", unit="s")

    @cached_property
    def best(self) -> Array:
        """J1 extrapolated from the two finest, shape (lanes,) (s)."""
        return self.j1[2] + (ORDER_TWO - 1.0) * (self.j1[2] - self.j1[1])

    @cached_property
    def of_lanes(self) -> Array:
        """Estimated relative error of each lane at the scheme, shape (lanes,)."""
        return self._between(0)

    @property
    def errors(self) -> Errors:
        """At the scheme."""
        return errors_of(self.of_lanes)

    @property
    def of_lanes_at_half(self) -> Array:
        """At half its step, shape (lanes,)."""
        return self._between(1)

    def _between(self, row: int) -> Array:
        apart = ORDER_TWO * np.abs(self.j1[row] - self.j1[row + 1])
        return apart / np.maximum(np.abs(self.best), SMALLEST)

    def of_other(self, j1: Array) -> Array:
        """Errors of J1 by another scheme, shape (lanes,), beside the best known."""
        return np.abs(j1 - self.best) / np.maximum(np.abs(self.best), SMALLEST)

    @property
    def order(self) -> float | None:
        """Median over lanes of the order that three steps show; None where it cannot be seen."""
        first, second = np.abs(np.diff(self.j1, axis=0)) / np.maximum(np.abs(self.best), SMALLEST)
        seen = (first > ROUNDING) & (second > ROUNDING)
        if seen.sum() < ENOUGH:
            return None
        return float(np.median(np.log2(first[seen] / second[seen])))


def refined(string: Drillstring, table: SimulationTable, prepared: Prepared, parts: int) -> Any:
    """The same run with each step in parts, and as many times the modes."""
    if parts == 1:
        return prepared
    old = prepared.scheme
    step = old.step / parts
    followed = int((string.undamped_modes[0] * step <= ACCURACIES[table.accuracy].phase).sum())
    modes = min(string.nodes, max(parts * old.modes, followed))
    scheme = Scheme(step, parts * old.steps, modes, parts * old.sampling)
    stepper = string_step(string, step, modes)
    return Prepared(stepper, scheme, prepared.duration, prepared.j1_from)
