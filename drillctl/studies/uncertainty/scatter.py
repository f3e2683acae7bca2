"""How the error of what was found from realizations is told: by draws, or by replicates.

Monte Carlo draws are independent of each other. Points of a scrambled Sobol sequence or of a
Latin hypercube are not, on purpose; but whole replicates of them are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scatter:
    """Which realizations are independent of each other."""

    replicates: int  # independent sets that take turns; 1 where every realization is independent
    # of the realizations that are looked at, where those are not all from the first on
    numbers: NDArray[np.int64] | None = None

    @property
    def independent(self) -> bool:
        """Whether every realization is independent of the others."""
        return self.replicates == 1

    def of(self, chosen: NDArray[np.bool_]) -> Scatter:
        """The same of some of the realizations."""
        return self if chosen.all() else Scatter(self.replicates, np.flatnonzero(chosen))

    def rows(self, count: int) -> list[Any]:
        """The realizations of each replicate, among the first `count` that are looked at."""
        if self.numbers is None:
            return [slice(k, count, self.replicates) for k in range(self.replicates)]
        of = self.numbers[:count] % self.replicates
        return [np.flatnonzero(of == k) for k in range(self.replicates)]

    def standard_error(self, influence: Array) -> Array:
        """Standard error of the mean of an influence function."""
        if self.independent:
            error: Array = influence.std(axis=0, ddof=1) / np.sqrt(len(influence))
            return error
        means = np.stack([influence[rows].mean(axis=0) for rows in self.rows(len(influence))])
        spread: Array = means.std(axis=0, ddof=1) / np.sqrt(self.replicates)
        return spread

    def quantile(self, confidence: float) -> float:
        """Half-width of a two-sided interval over the standard error."""
        from scipy.stats import norm, t

        at = 0.5 * (1.0 + confidence)
        return float(norm.ppf(at) if self.independent else t.ppf(at, self.replicates - 1))
