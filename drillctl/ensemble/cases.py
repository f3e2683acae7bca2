"""Cases at common draws: means, paired differences and shares, each with its interval.

A paired difference is taken draw by draw, one case less the other, and then averaged: most of what
the draws scatter is common to both cases and drops out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array, Index, Mask
from drillctl.simulation.measures import MEASURES, STATUSES, status_counts
from drillctl.store.codec import label
from drillctl.store.tables import Estimate, open_estimate

Interval = tuple[float, float]

CONFIDENCE = 0.95  # of every interval
TAIL = 0.5 * (1.0 - CONFIDENCE)  # probability beyond each end of an interval
RESAMPLES = 4000
"""Of the bootstrap of a mean: its own scatter is then a few percent of the interval's width."""
OBJECTIVE_RESAMPLES = 1000  # of the bootstrap of an objective, each of which sorts all draws
AT_A_TIME = 2_000_000  # numbers resampled at a time: bounds the memory
QUANTILES = {"p05": 0.05, "p50": 0.5, "p95": 0.95}
"""Of the distribution of a measure over the draws."""


class Share(NamedTuple):
    """Share of the draws in which something holds."""

    hits: int
    total: int  # all draws, failed ones included

    @property
    def value(self) -> float:
        """The share."""
        return self.hits / self.total

    @property
    def interval(self) -> Interval:
        """Clopper-Pearson interval of the probability that the share estimates."""
        return share_interval(self.hits, self.total)

    @property
    def estimate(self) -> Estimate:
        """The share with its interval."""
        return Estimate(self.value, self.interval, self.total)

    def summary(self, name: str) -> dict[str, Any]:
        """As strict JSON values: the share by a name, and its interval."""
        return {name: self.value, "interval_95": list(self.interval)}


class Crossing(NamedTuple):
    """Where along an increasing axis a difference first stops being negative."""

    at: float | None  # on straight lines between the points; None if it never does
    interval: tuple[float | None, float | None]  # None for an end beyond the axis
    within: float | None = None  # share of the resamples in which it does

    @property
    def estimate(self) -> Estimate:
        """The place with its interval."""
        return open_estimate(self.at, self.interval)

    def words(self, longest: str) -> str:
        """For people, on an axis of times (s) that ends at `longest`."""
        if self.at is None:
            share = (
                "" if self.within is None else f" (before in {self.within:.1%} of the resamples)"
            )
            return f"beyond {longest}{share}"
        low, high = (f"beyond {longest}" if end is None else f"{end:.3f}" for end in self.interval)
        return f"{self.at:.3f} s (95 % interval {low} to {high})"

    def summary(self, name: str) -> dict[str, Any]:
        """As strict JSON values: the place by a name, and its interval."""
        results = {name: self.at, "interval_95": list(self.interval)}
        return results if self.within is None else {**results, "within": self.within}


@dataclass(frozen=True, eq=False)
class Runs:
    """Runs at common draws: of one case, or of several along the first dimensions."""

    # shape (..., draws): by name of the measure (SI); NaN where undefined
    measures: dict[str, Array] = label(
        "realization", unit=lambda name: MEASURES[name].unit,
        means=lambda name: MEASURES[name].label, flat=True,
    )  # fmt: skip
    # shape (..., draws): index into `simulation.measures.STATUSES`
    status: NDArray[np.int8] = label("realization", flags=STATUSES)
    step: float | None = label(unit="s", means="of the batch engine; None where draws differ")
    modes: int | None = label(means="of the batch engine; None where draws differ")

    def at(self, *place: int) -> Runs:
        """Those at a place along the first dimensions."""
        measures = {name: values[place] for name, values in self.measures.items()}
        return Runs(measures, np.asarray(self.status[place]), self.step, self.modes)

    def over(self, shape: tuple[int, ...], measures: Iterable[str]) -> Runs:
        """Some measures of the same runs over another shape, repeated along new dimensions."""

        def shaped(values: NDArray[Any]) -> NDArray[Any]:
            return np.broadcast_to(values.reshape(-1, shape[-1]), shape)

        kept = {name: shaped(self.measures[name]) for name in measures}
        return Runs(kept, shaped(self.status), self.step, self.modes)

    def defined(self, measure: str) -> Array:
        """Values (SI) at the draws that define a measure."""
        values = self.measures[measure]
        return values[~np.isnan(values)]

    def mean(self, measure: str) -> float | None:
        """Mean (SI) over the draws that define a measure."""
        values = self.defined(measure)
        return float(values.mean()) if values.size else None

    def mean_estimate(self, measure: str, seed: int) -> Estimate:
        """The same with its bootstrap interval."""
        return mean_estimate(self.measures[measure], seed)

    def difference(self, baseline: Runs, measure: str, seed: int) -> Estimate:
        """Mean over the draws of a measure less that of another case (SI)."""
        return mean_estimate(self.measures[measure] - baseline.measures[measure], seed)

    def distribution(self, measure: str) -> dict[str, Any]:
        """Mean, standard deviation, quantiles (SI) and number of draws that define a measure."""
        values = self.defined(measure)
        if not values.size:
            return {"mean": None, "std": None, **dict.fromkeys(QUANTILES), "defined": 0}
        quantiles = np.quantile(values, list(QUANTILES.values()))
        return {
            "mean": float(values.mean()),
            "std": float(values.std(ddof=1)) if values.size > 1 else None,
            **dict(zip(QUANTILES, map(float, quantiles), strict=True)),
            "defined": int(values.size),
        }

    def under(self, level: float) -> Mask:
        """Draws with J1 at or under a level (s); one that failed is not."""
        return np.asarray(np.nan_to_num(self.measures["j1"], nan=np.inf) <= level)

    def share(self, level: float) -> Share:
        """Share of the draws with J1 at or under a level (s)."""
        return share_of(self.under(level))

    def share_difference(self, baseline: Runs, level: float, seed: int) -> Estimate:
        """The share less that of another case, draw by draw."""
        return mean_estimate(self.under(level).astype(float) - baseline.under(level), seed)

    @property
    def ended(self) -> Mask:
        """Draws in which stick-slip has ended; one that failed is not."""
        still = [STATUSES.index(name) for name in ("sticking", "stalled", "failed")]
        return ~np.isin(self.status, still)

    def counts(self) -> dict[str, int]:
        """Number of draws by status, those that occur."""
        return status_counts(self.status)


def joined(runs: Sequence[Runs], join: Callable[[list[NDArray[Any]]], NDArray[Any]]) -> Runs:
    """Runs of several cases in one, by `numpy.concatenate` or `numpy.stack`."""
    measures = {name: join([one.measures[name] for one in runs]) for name in runs[0].measures}
    return Runs(measures, join([one.status for one in runs]), *scheme_of(runs))


def scheme_of(runs: Iterable[Runs]) -> tuple[float | None, int | None]:
    """Step and modes that all runs have in common; None where they differ."""
    schemes = {(one.step, one.modes) for one in runs}
    return schemes.pop() if len(schemes) == 1 else (None, None)


def share_of(hits: Mask) -> Share:
    """Share of the draws in which something holds."""
    return Share(int(hits.sum()), len(hits))


def share_interval(hits: int, total: int) -> Interval:
    """Clopper-Pearson interval of a probability, given `hits` of `total` independent draws."""
    low, high = share_intervals(np.array([hits]), total)
    return float(low[0]), float(high[0])


def share_intervals(hits: Index, total: int, confidence: float = CONFIDENCE) -> tuple[Array, Array]:
    """Clopper-Pearson intervals of many probabilities.

    Clopper & Pearson, Biometrika 26 (1934) 404-413: each holds the probability with at least
    the confidence, whatever the probability is.
    """
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - confidence)
    with np.errstate(invalid="ignore"):  # of the ends that are 0 and 1
        low = np.where(hits > 0, betaincinv(np.maximum(hits, 1), total - hits + 1, tail), 0.0)
        missed = np.maximum(total - hits, 1)
        high = np.where(hits < total, betaincinv(hits + 1, missed, 1.0 - tail), 1.0)
    return low, high


def mean_estimate(values: Array, seed: int) -> Estimate:
    """Mean over the draws that define a number, with its bootstrap interval."""
    values = values[~np.isnan(values)]
    if not values.size:
        return Estimate(None, None, 0)
    return Estimate(float(values.mean()), mean_interval(values, seed), int(values.size))


def mean_interval(values: Array, seed: int) -> Interval | None:
    """Bootstrap interval of a mean, bias-corrected and accelerated.

    Efron & Tibshirani, An Introduction to the Bootstrap (1993), section 14.3; of a mean the
    acceleration, which they take from the jackknife, is a sixth of the skewness of the values
    over the root of their number.
    """
    from scipy.special import ndtr, ndtri

    if len(values) < 2:
        return None
    centre = float(values.mean())
    away = values - centre
    if np.ptp(values) == 0.0:
        return float(values[0]), float(values[0])
    means = _resampled_means(values, seed)
    below = 0.5 * ((means < centre).mean() + (means <= centre).mean())
    bias = ndtri(np.clip(below, 0.5 / RESAMPLES, 1.0 - 0.5 / RESAMPLES))
    acceleration = (away**3).sum() / (6.0 * (away**2).sum() ** 1.5)
    normal = bias + ndtri(np.array([1.0 - CONFIDENCE, 1.0 + CONFIDENCE]) / 2.0)
    levels = ndtr(bias + normal / (1.0 - acceleration * normal))
    low, high = np.quantile(means, levels)
    return float(low), float(high)


def _resampled_means(values: Array, seed: int) -> Array:
    generator = np.random.Generator(np.random.Philox(seed))
    rows = max(1, AT_A_TIME // len(values))
    means = []
    for done in range(0, RESAMPLES, rows):
        size = (min(rows, RESAMPLES - done), len(values))
        means.append(values[generator.integers(len(values), size=size)].mean(axis=1))
    return np.concatenate(means)


def resampled_draws(count: int, seed: int) -> Index:
    """Draws of each resample of an objective, shape (resamples, draws).

    The same for all cases: the difference of two objectives is then resampled by pairs.
    """
    generator = np.random.Generator(np.random.Philox(seed))
    return generator.integers(count, size=(OBJECTIVE_RESAMPLES, count))


def percentile_estimate(values: Array) -> Estimate:
    """A number and the percentiles of its resamples, shape (1 + resamples,)."""
    value, resampled = float(values[0]), values[1:]
    if not np.isfinite(value):
        return Estimate(None, None)
    if not np.isfinite(resampled).all():
        return Estimate(value, None)
    low, high = np.quantile(resampled, [TAIL, 1.0 - TAIL])
    return Estimate(value, (float(low), float(high)))


def crossing(axis: Array, values: Array, low: Array, high: Array) -> Crossing:
    """Where a difference, and the ends of its interval, first stop being negative."""
    ends = first_not_negative(axis, high), first_not_negative(axis, low)
    return Crossing(first_not_negative(axis, values), ends)


def resampled_crossing(axis: Array, values: Array) -> Crossing:
    """The same of a difference and its resamples, shape (points, 1 + resamples)."""
    results = [first_not_negative(axis, column) for column in values.T]
    again = np.sort([np.inf if one is None else one for one in results[1:]])
    # Order statistics: between a place and none there is nothing to interpolate.
    ends = np.quantile(again, [TAIL, 1.0 - TAIL], method="inverted_cdf")
    low, high = (float(end) if np.isfinite(end) else None for end in ends)
    return Crossing(results[0], (low, high), float(np.isfinite(again).mean()))


def first_not_negative(axis: Array, values: Array) -> float | None:
    """First place on an axis where values are not negative, straight lines between the points.

    What lies further along the axis, where they may be negative again, does not count.
    """
    known = ~np.isnan(values)
    axis, values = axis[known], values[known]
    over = np.flatnonzero(values >= 0.0)
    if not over.size:
        return None
    k = int(over[0])
    if k == 0:
        return float(axis[0])
    rise = values[k] - values[k - 1]
    return float(axis[k - 1] - values[k - 1] * (axis[k] - axis[k - 1]) / rise)
