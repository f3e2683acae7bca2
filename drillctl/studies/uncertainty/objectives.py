"""What gains can be judged by over the realizations of J1, and how well that is known.

Each objective is a functional of the distribution of J1 in a cell. Its influence function says
what every realization adds to it, so that its sampling error, and that of a difference between
two cells at the same realizations, is that of a mean (Hampel, J. Am. Stat. Assoc. 69 (1974)
383-393). Smaller is better for all of them.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.uncertainty.probability import needed

Array = NDArray[np.float64]


FEWEST_BEYOND = 10.0 - 1e-9
"""Realizations that are to be expected beyond a quantile for its error to be told from them."""


class Objective(Protocol):
    """A functional of the distribution of J1."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...

    def values(self, ordered: Array) -> Array:
        """Of each cell, from realizations in increasing order, shape (realizations, cells)."""
        ...

    def influence(self, j1: Array, ordered: Array) -> Array:
        """Influence of every realization, shape (realizations, cells); its mean is about 0."""
        ...

    def enough(self, count: int) -> bool:
        """Whether so many realizations tell an error by way of the influence function."""
        ...


class Mean(NamedTuple):
    """The mean of J1 (s)."""

    name: str = "mean"

    def values(self, ordered: Array) -> Array:
        """Means."""
        found: Array = ordered.mean(axis=0)
        return found

    def influence(self, j1: Array, ordered: Array) -> Array:
        """Deviations from the mean."""
        deviations: Array = j1 - ordered.mean(axis=0)
        return deviations

    def enough(self, count: int) -> bool:
        """Two have a scatter."""
        return count > 1


class Quantile(NamedTuple):
    """The smallest J1 (s) that a share of the realizations keeps to."""

    probability: float = 0.95

    @property
    def name(self) -> str:
        """`q95`, for instance."""
        return f"q{100 * self.probability:g}"

    def values(self, ordered: Array) -> Array:
        """Order statistics."""
        return ordered[needed(self.probability, len(ordered)) - 1]

    def influence(self, j1: Array, ordered: Array) -> Array:
        """(p - 1[J1 <= q]) times the sparsity, a difference quotient of the order statistics.

        Its width after Bofinger, Austral. J. Stat. 17 (1975) 1-7, for normal tails.
        """
        from scipy.stats import norm

        count, p = len(ordered), self.probability
        z = norm.ppf(p)
        width = (4.5 * norm.pdf(z) ** 4 / (2.0 * z * z + 1.0) ** 2 / count) ** 0.2
        low = max(int(np.floor(count * (p - width))), 0)
        high = min(int(np.ceil(count * (p + width))), count - 1)
        sparsity = (ordered[high] - ordered[low]) * count / max(high - low, 1)
        influence: Array = (p - (j1 <= self.values(ordered))) * sparsity
        return influence

    def enough(self, count: int) -> bool:
        """Some must be expected beyond the quantile."""
        return count * (1.0 - self.probability) >= FEWEST_BEYOND


class TailMean(NamedTuple):
    """The mean of J1 (s) over the worst realizations: conditional value at risk.

    Rockafellar & Uryasev, J. Risk 2 (2000) 21-41.
    """

    probability: float = 0.95

    @property
    def name(self) -> str:
        """`cvar95`, for instance."""
        return f"cvar{100 * self.probability:g}"

    def values(self, ordered: Array) -> Array:
        """Quantile and mean excess over it."""
        at = Quantile(self.probability).values(ordered)
        excess = np.maximum(ordered - at, 0.0).mean(axis=0)
        found: Array = at + excess / (1.0 - self.probability)
        return found

    def influence(self, j1: Array, ordered: Array) -> Array:
        """Excess over the quantile less the tail mean's; no density is needed."""
        at = Quantile(self.probability).values(ordered)
        each = at + np.maximum(j1 - at, 0.0) / (1.0 - self.probability)
        influence: Array = each - self.values(ordered)
        return influence

    def enough(self, count: int) -> bool:
        """Some must be expected in the tail."""
        return count * (1.0 - self.probability) >= FEWEST_BEYOND


class Exceedance(NamedTuple):
    """The probability that J1 is above a level (s)."""

    level: float

    @property
    def name(self) -> str:
        """`probability_40`, for instance: of the level being kept."""
        return f"probability_{self.level:g}"

    def values(self, ordered: Array) -> Array:
        """Shares of the realizations."""
        found: Array = (ordered > self.level).mean(axis=0)
        return found

    def influence(self, j1: Array, ordered: Array) -> Array:
        """Whether above, less how often."""
        influence: Array = (j1 > self.level) - self.values(ordered)
        return influence

    def enough(self, count: int) -> bool:
        """Two have a scatter."""
        return count > 1
