"""Intervals of what was found from a finite number of draws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Interval = tuple[float, float]

CONFIDENCE = 0.95
"""Of every interval."""
RESAMPLES = 4000
"""Of a bootstrap: its own scatter is then a few percent of the interval's width."""
AT_A_TIME = 2_000_000
"""Numbers resampled at a time: bounds the memory."""


def share_interval(hits: int, total: int) -> Interval:
    """Clopper-Pearson interval of a probability, given `hits` of `total` independent draws."""
    low, high = share_intervals(np.array([hits]), total)
    return float(low[0]), float(high[0])


def share_intervals(
    hits: NDArray[np.int64], total: int, confidence: float = CONFIDENCE
) -> tuple[Array, Array]:
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
