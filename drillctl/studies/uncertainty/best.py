"""The best cell of a map under uncertainty, and the cells that are as good as far as is known.

Each objective is a functional of the distribution of J1 in a cell. Its influence function is
what every realization adds to it, so that its sampling error, and that of a difference between
two cells at the same realizations, is that of a mean (Hampel, J. Am. Stat. Assoc. 69 (1974)
383-393). Smaller is better for all of them.

All cells saw the same realizations, so cells are compared by differences, realization by
realization. A cell is worse than the best one when its difference is above zero beyond the
sampling error, corrected for the number of cells (Bonferroni): the truly best cell is among those
that are left with at least 95 % (Gupta, Technometrics 7 (1965) 225-245).

The J1 of a lane that was stopped early is a lower bound. An objective is still certain
where no such lane enters it, and the best cell is still certain where every other cell is worse
even by what is known; otherwise the answer is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.special import bdtr, ndtri

from drillctl.arrays import Array, Mask
from drillctl.ensemble.cases import CONFIDENCE, mean_interval, share_interval
from drillctl.ensemble.probability import Scatter, needed
from drillctl.errors import InputError

FEWEST_BEYOND = 10.0 - 1e-9
"""Realizations that are to be expected beyond a quantile for its error to follow from them."""


def enough(objective: Objective, count: int) -> bool:
    """Whether so many realizations give an error by way of the influence function."""
    # Two have a scatter; of a quantile and a tail some must be expected beyond it.
    if isinstance(objective, (Quantile, TailMean)):
        return count * (1.0 - objective.probability) >= FEWEST_BEYOND
    return count > 1


class Mean(NamedTuple):
    """The mean of J1 (s)."""

    name: str = "mean"

    def values(self, ordered: Array) -> Array:
        """Means."""
        return np.asarray(ordered.mean(axis=0))

    def influence(self, j1: Array, ordered: Array) -> Array:
        """Deviations from the mean."""
        return np.asarray(j1 - ordered.mean(axis=0))


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
        """(p - 1[J1 <= q]) times the sparsity, a difference quotient of the order statistics."""
        # Its width after Bofinger, Austral. J. Stat. 17 (1975) 1-7, for normal tails.
        count, p = len(ordered), self.probability
        z = ndtri(p)
        density = np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi)
        width = (4.5 * density**4 / (2.0 * z * z + 1.0) ** 2 / count) ** 0.2
        low = max(int(np.floor(count * (p - width))), 0)
        high = min(int(np.ceil(count * (p + width))), count - 1)
        sparsity = (ordered[high] - ordered[low]) * count / max(high - low, 1)
        return np.asarray((p - (j1 <= self.values(ordered))) * sparsity)


class TailMean(NamedTuple):
    """The mean of J1 (s) over the worst realizations: conditional value at risk."""

    # Rockafellar & Uryasev, J. Risk 2 (2000) 21-41.
    probability: float = 0.95

    @property
    def name(self) -> str:
        """`cvar95`, for instance."""
        return f"cvar{100 * self.probability:g}"

    def values(self, ordered: Array) -> Array:
        """Quantile and mean excess over it."""
        at = Quantile(self.probability).values(ordered)
        excess = np.maximum(ordered - at, 0.0).mean(axis=0)
        return np.asarray(at + excess / (1.0 - self.probability))

    def influence(self, j1: Array, ordered: Array) -> Array:
        """Excess over the quantile less the tail mean's; no density is needed."""
        at = Quantile(self.probability).values(ordered)
        each = at + np.maximum(j1 - at, 0.0) / (1.0 - self.probability)
        return np.asarray(each - self.values(ordered))


class Exceedance(NamedTuple):
    """The probability that J1 is above a level (s)."""

    level: float

    @property
    def name(self) -> str:
        """`probability_40`, for instance: of the level being kept."""
        return f"probability_{self.level:g}"

    def values(self, ordered: Array) -> Array:
        """Shares of the realizations."""
        return np.asarray((ordered > self.level).mean(axis=0))

    def influence(self, j1: Array, ordered: Array) -> Array:
        """Whether above, less how often."""
        return np.asarray((j1 > self.level) - self.values(ordered))


Objective = Mean | Quantile | TailMean | Exceedance
"""A functional of the distribution of J1: its values from realizations in increasing order, shape
(realizations, cells), and the influence of each realization, whose mean is about 0."""
CELLS = 128  # cells looked at at a time: bounds the memory
NEEDS_FULL = "lanes were stopped at the highest level: run with --full"


@dataclass(frozen=True, eq=False)
class Best:
    """The best cell of a map by one objective."""

    name: str  # of the objective
    cell: int  # in the flattened map
    value: float  # objective there: s, or a probability
    # 95 % interval of the value in that cell, which was chosen on the same realizations; None for
    # an end that is not known
    interval: tuple[float | None, float | None]
    # shape (cells,): Cells that are not significantly worse, itself included; None if lanes were
    # stopped or realizations are too few to say
    alike: Mask | None


@dataclass(frozen=True, eq=False)
class Values:
    """An objective in every cell."""

    values: Array  # shape (cells,): What is known at least; NaN in a cell where a lane failed
    certain: Mask  # shape (cells,): Where no stopped lane enters the value


def objectives(levels: tuple[float, ...]) -> tuple[Objective, ...]:
    """What the best cells are looked for by."""
    return (Mean(), Quantile(), TailMean(), *(Exceedance(level) for level in levels))


def values_of(asked: Iterable[Objective], j1: Array, censored: Mask) -> dict[str, Values]:
    """Objectives in every cell, by name."""
    asked, cells = tuple(asked), j1.shape[1]
    values = {one.name: np.empty(cells) for one in asked}
    bound = np.full(cells, np.inf)
    for some in _slabs(cells):
        ordered = np.sort(j1[:, some], axis=0)
        for one in asked:
            values[one.name][some] = one.values(ordered)
        if censored[:, some].any():
            bound[some] = np.where(censored[:, some], j1[:, some], np.inf).min(axis=0)
    failed = np.isnan(j1).any(axis=0)
    results = {}
    for one in asked:
        known = values[one.name]
        if isinstance(one, Exceedance):
            certain = bound > one.level
        elif isinstance(one, Quantile):
            certain = known < bound
        else:
            certain = np.isinf(bound)
        results[one.name] = Values(np.where(failed, np.nan, known), certain | failed)
    return results


def best_cells(
    asked: Iterable[Objective], known: Mapping[str, Values], j1: Array, censored: Mask,
    scatter: Scatter, seed: int,
) -> dict[str, Best | InputError]:  # fmt: skip
    """The best cell by each objective, or why it is not known."""
    asked = tuple(asked)
    cells: dict[str, int | InputError] = {
        one.name: _cell(one, known[one.name], j1) for one in asked
    }
    certain = [one for one in asked if isinstance(cells[one.name], int)]
    alike = _alike(certain, known, cells, j1, censored, scatter)
    best: dict[str, Best | InputError] = {}
    for one in asked:
        cell = cells[one.name]
        if isinstance(cell, InputError):
            best[one.name] = cell
            continue
        low, high = _interval(one, j1[:, cell], censored[:, cell], scatter, seed)
        value = float(known[one.name].values[cell])
        if isinstance(one, Exceedance):  # reported as the probability of the level being kept
            low, high = (None if end is None else 1.0 - end for end in (high, low))
            value = 1.0 - value
        best[one.name] = Best(one.name, cell, value, (low, high), alike.get(one.name))
    return best


def _cell(objective: Objective, result: Values, j1: Array) -> int | InputError:
    known = np.where(result.certain, result.values, np.nan)
    if np.isnan(result.values).all():
        return InputError("every cell has failed lanes", objective.name)
    if np.isnan(known).all() or np.nanmin(known) > np.nanmin(result.values):
        return InputError(NEEDS_FULL, objective.name)
    # Among equals, as probabilities often are, that of the smallest mean.
    equal = np.flatnonzero(known == np.nanmin(known))
    return int(equal[np.argmin(j1[:, equal].mean(axis=0))])


def _alike(
    asked: Iterable[Objective], result: Mapping[str, Values], chosen: Mapping[str, Any], j1: Array,
    censored: Mask, scatter: Scatter,
) -> dict[str, Mask]:  # fmt: skip
    """Cells not significantly worse than the best, for the objectives where that is known."""
    count, cells = j1.shape
    asked = [] if censored.any() else [one for one in asked if enough(one, count)]
    reference = {}
    for one in asked:
        own = j1[:, chosen[one.name], None]
        reference[one.name] = one.influence(own, np.sort(own, axis=0))
    # One side only: nothing is better than the best but by chance.
    quantile = scatter.quantile(1.0 - 2.0 * (1.0 - CONFIDENCE) / max(cells - 1, 1))
    alike = {one.name: np.zeros(cells, dtype=bool) for one in asked}
    for some in _slabs(cells) if asked else ():
        columns = j1[:, some]
        ordered = np.sort(columns, axis=0)
        for one in asked:
            values = result[one.name].values
            apart = one.influence(columns, ordered)
            apart -= reference[one.name]
            error = scatter.standard_error(apart)
            with np.errstate(invalid="ignore"):  # of cells with failed lanes
                alike[one.name][some] = values[some] - values[chosen[one.name]] <= quantile * error
    return alike


def _interval(
    objective: Objective, j1: Array, censored: Mask, scatter: Scatter, seed: int
) -> tuple[float | None, float | None]:
    if scatter.independent and isinstance(objective, Exceedance):
        return share_interval(int((j1 > objective.level).sum()), len(j1))
    if scatter.independent and isinstance(objective, Mean):
        return mean_interval(j1, seed) or (None, None)
    if scatter.independent and isinstance(objective, Quantile):
        bound = float(np.where(censored, j1, np.inf).min())
        return quantile_interval(np.sort(j1), objective.probability, bound)
    if censored.any() or not enough(objective, len(j1)):
        return None, None
    column = j1[:, None]
    ordered = np.sort(column, axis=0)
    value = float(objective.values(ordered)[0])
    error = float(scatter.standard_error(objective.influence(column, ordered))[0])
    half = scatter.quantile(CONFIDENCE) * error
    return value - half, value + half


def quantile_interval(
    ordered: Array, probability: float, bound: float = np.inf
) -> tuple[float | None, float | None]:
    """Interval of a quantile by order statistics, whatever the distribution."""
    # David & Nagaraja, Order Statistics (2003), section 7.1.
    count, tail = len(ordered), 0.5 * (1.0 - CONFIDENCE)
    at_most = bdtr(np.arange(count + 1), count, probability)
    low, high = (int(k) for k in np.searchsorted(at_most, [tail, 1.0 - tail]))
    high += 1
    known = high <= count and ordered[high - 1] < bound
    upper = float(ordered[high - 1]) if known else None
    return (float(ordered[low - 1]) if low > 0 else None), upper


def _slabs(cells: int) -> Iterator[slice]:
    for first in range(0, cells, CELLS):
        yield slice(first, first + CELLS)
