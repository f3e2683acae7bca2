"""Points of the unit cube that draws are made from, each a function of seed and number alone.

Monte Carlo: independent numbers, a stream for each parameter. Sobol: as many independently
scrambled sequences as there are replicates, which take turns, so that their scatter tells the
error of what was found from all. Latin hypercube: the same with stratified points, of a number
that is fixed. Correlations are those of a Gaussian copula.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drillctl.design.uncertain_tables import UncertaintyTable
from drillctl.errors import InputError

Array = NDArray[np.float64]

_PER_COUNTER = 4  # numbers that Philox makes of one state of its counter
_BITS = 30  # of a Sobol point; of more, SciPy does not skip any
_EDGE = 2.0**-53  # nearest to 0 and to 1 that a number comes, where quantiles are infinite


@dataclass(frozen=True)
class Sampling:
    """Which points are drawn."""

    # {'monte-carlo', 'sobol', 'latin-hypercube'}: Method
    kind: Literal["monte-carlo", "sobol", "latin-hypercube"]
    seed: int  # what they follow from
    # independent point sets that take turns; realization i is of set i mod replicates. 1 for
    # Monte Carlo, whose draws are all independent.
    replicates: int
    total: int  # number of points of a Latin hypercube; the others have no end

    @property
    def extendable(self) -> bool:
        """Whether more realizations begin with the same ones."""
        return self.kind != "latin-hypercube"

    def points(self, paths: tuple[str, ...], count: int, first: int = 0) -> dict[str, Array]:
        """Numbers strictly between 0 and 1 for each parameter, by path."""
        if self.kind == "monte-carlo":
            return {path: probabilities(self.seed, path, count, first) for path in paths}
        if not self.extendable and first + count > self.total:
            raise InputError(
                f"{first + count} realizations of a latin-hypercube of {self.total}: its number "
                "is fixed; use sobol or monte-carlo",
                "uncertainty.sampling",
            )
        order = sorted(paths)  # the file's own order is a matter of taste
        table = np.empty((count, len(order)))
        for replicate in range(self.replicates):
            skipped = -(-(first - replicate) // self.replicates) if first > replicate else 0
            rows = slice(skipped * self.replicates + replicate - first, None, self.replicates)
            number = len(table[rows])
            if number:
                table[rows] = self._replicate(replicate, len(order), number, skipped)
        inside = np.clip(table, _EDGE, 1.0 - _EDGE)
        return {path: np.ascontiguousarray(inside[:, order.index(path)]) for path in paths}

    def _replicate(self, replicate: int, dimensions: int, count: int, first: int) -> Array:
        """Points of one replicate, shape (count, dimensions)."""
        from scipy.stats import qmc

        seed = np.random.SeedSequence([self.seed, replicate, dimensions])
        random = np.random.Generator(np.random.Philox(seed))
        if self.kind == "latin-hypercube":
            each = self.total // self.replicates
            points = qmc.LatinHypercube(dimensions, rng=random).random(each)
            return np.asarray(points[first : first + count])
        engine = qmc.Sobol(dimensions, scramble=True, bits=_BITS, rng=random)
        with warnings.catch_warnings():
            # Numbers that are no powers of two are balanced a little less; docs say so.
            warnings.simplefilter("ignore", UserWarning)
            if first:
                engine.fast_forward(first)
            return np.asarray(engine.random(count)) + 0.5 * 2.0**-_BITS


def sampling_of(table: UncertaintyTable, seed: int | None = None) -> Sampling:
    """The sampling that a design asks for."""
    replicates = 1 if table.sampling == "monte-carlo" else table.replicates
    return Sampling(
        table.sampling, table.seed if seed is None else seed, replicates, table.realizations
    )


def probabilities(seed: int, path: str, count: int, first: int = 0) -> Array:
    """Independent uniform numbers of a parameter, strictly between 0 and 1."""
    words = hashlib.sha256(path.encode()).digest()[:8]
    bits = np.random.Philox(np.random.SeedSequence([seed, int.from_bytes(words)]))
    bits.advance(first // _PER_COUNTER)
    skipped = first % _PER_COUNTER
    raw = bits.random_raw(skipped + count)[skipped:]
    # The middles of 2^52 equal intervals: neither 0 nor 1, where quantiles are infinite.
    return ((raw >> np.uint64(12)).astype(float) + 0.5) * 2.0**-52


def correlation_root(table: UncertaintyTable, paths: tuple[str, ...]) -> Array | None:
    """Lower Cholesky factor of the correlation matrix of all parameters; None if independent."""
    from drillctl.errors import nearest

    if not table.correlations:
        return None
    matrix = np.eye(len(paths))
    for entry in table.correlations:
        where = "uncertainty.correlations"
        for path in entry.between:
            if path not in paths:
                raise InputError(f"{path!r} is not uncertain; {nearest(path, paths)}", where)
        i, j = (paths.index(path) for path in entry.between)
        if matrix[i, j] != 0.0:
            raise InputError(f"{entry.between[0]} and {entry.between[1]} are named twice", where)
        matrix[i, j] = matrix[j, i] = entry.value
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < 1e-10:
        raise InputError(
            "the correlations contradict each other: their matrix is not positive definite, its "
            f"smallest eigenvalue is {least:.3g}",
            "uncertainty.correlations",
        )
    root: Array = np.asarray(np.linalg.cholesky(matrix), dtype=float)
    return root


def correlated(points: Mapping[str, Array], root: Array) -> dict[str, Array]:
    """Points with the dependence of a Gaussian copula."""
    from scipy.special import ndtr, ndtri

    scores = [ndtri(column) for column in points.values()]
    results = {}
    for path, weights in zip(points, root, strict=True):
        # Term by term: a matrix product would round by the number of rows.
        total = np.zeros_like(scores[0])
        for weight, score in zip(weights, scores, strict=True):
            total += weight * score
        results[path] = np.clip(ndtr(total), _EDGE, 1.0 - _EDGE)
    return results
