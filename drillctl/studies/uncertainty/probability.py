"""Probability that J1 is at or under a level, cell by cell: variability and sampling error.

Two things that are never mixed. *Variability* is what the uncertain parameters do: the inner
region holds the cells whose probability is at least 95 %, the outer one those of at least 5 %.
*Sampling error* is what is not known because realizations are finite in number: intervals of
each cell's probability, and of all cells' at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.cases import CONFIDENCE, share_intervals
from drillctl.studies.uncertainty.scatter import Scatter

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

INNER, MEDIAN, OUTER = 0.95, 0.5, 0.05
"""Probabilities that bound the inner, the median and the outer region."""


def needed(probability: float, total: int) -> int:
    """Fewest of `total` realizations that are a share of at least `probability`."""
    return int(np.ceil(probability * total * (1.0 - 1e-12)))


@dataclass(frozen=True, eq=False)
class ProbabilityMap:
    """How many realizations have J1 at or under a level, in each cell."""

    level: float  # level of J1 (s)
    # shape of the map: Realizations at or under it; one that failed is not
    counts: NDArray[np.int64]
    # shape (replicates, ...): The same of every replicate; of Monte Carlo there is one
    by_replicate: NDArray[np.int64]
    total: int  # realizations

    @property
    def probability(self) -> Array:
        """Share of the realizations."""
        share: Array = self.counts / self.total
        return share

    def region(self, probability: float) -> Mask:
        """Cells where the level is kept with at least this probability."""
        mask: Mask = self.counts >= needed(probability, self.total)
        return mask

    @property
    def always(self) -> Mask:
        """Cells under the level in every realization."""
        return np.asarray(self.counts == self.total)

    @property
    def ever(self) -> Mask:
        """Cells under the level in some realization: the envelope of all regions."""
        return np.asarray(self.counts > 0)

    @property
    def interval(self) -> tuple[Array, Array]:
        """95 % interval of each cell's probability, by itself."""
        return self.interval_at(CONFIDENCE)

    @property
    def simultaneous(self) -> tuple[Array, Array]:
        """Intervals that hold the probabilities of all cells at once, with 95 % (Bonferroni)."""
        return self.interval_at(1.0 - (1.0 - CONFIDENCE) / self.counts.size)

    def interval_at(self, confidence: float) -> tuple[Array, Array]:
        """Interval of each cell's probability, by itself, of any confidence."""
        exact = share_intervals(self.counts, self.total, confidence)
        replicates = len(self.by_replicate)
        if replicates == 1:
            return exact
        from scipy.stats import t

        each = self.by_replicate / (self.total // replicates)
        error = each.std(axis=0, ddof=1) / np.sqrt(replicates)
        half = t.ppf(0.5 * (1.0 + confidence), replicates - 1) * error
        # Replicates that agree to the last realization tell no error; nor is it none.
        alike = error == 0.0
        low = np.where(alike, exact[0], np.maximum(self.probability - half, 0.0))
        high = np.where(alike, exact[1], np.minimum(self.probability + half, 1.0))
        return low, high


def probability_map(j1: Array, level: float, scatter: Scatter) -> ProbabilityMap:
    """Count realizations at or under a level."""
    hits = j1 <= level
    by_replicate = np.stack([hits[rows].sum(axis=0) for rows in scatter.rows(len(j1))])
    return ProbabilityMap(level, by_replicate.sum(axis=0), by_replicate, len(j1))
