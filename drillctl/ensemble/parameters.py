"""Uncertain parameters of a design, and draws from them that anyone can make again.

The numbers behind a draw, points of the unit cube, are a function of seed and number of the draw
alone: draw 17 is the same whether 20 or 20,000 are asked for, in one go or in blocks. Two designs
drawn with one seed are thus under the same conditions (common random numbers), and their
difference is known far better than either of them. Monte Carlo: independent numbers, a stream for
each parameter. Sobol: as many independently scrambled sequences as there are replicates, which
take turns, so that their scatter gives the error of what follows from all. Latin hypercube: the
same with stratified points, of a number that is fixed. Correlations are those of a Gaussian copula.

A draw that no rig has, such as a static friction below the sliding one, is neither clipped nor
drawn again: that would change the distribution that was asked for. It is a failed run with a
reason, counted; see `draws.py`. Only a normal distribution, which has no ends of its own,
is truncated at what its key allows; one with ends beyond that is refused.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from drillctl.arrays import Array, own_errstate
from drillctl.design import Design, Parameter, parameter
from drillctl.design.tables import DistributionTable
from drillctl.design.uncertain_tables import UncertaintyTable
from drillctl.errors import InputError, nearest
from drillctl.rig.bit_rock.law import friction_laws
from drillctl.rig.bit_rock.variation import NoVariation
from drillctl.store.codec import documented, label

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
    return np.asarray(np.linalg.cholesky(matrix), dtype=float)


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


DEFAULT_COV = 0.05
"""Coefficient of variation of the rock where a design names nothing uncertain: lognormal draws of
sliding and static torque about its own values."""

REALIZATION = "bit_rock.variation.realization"
"""Number of the path of a rock that varies along the way: each draw has its own."""
FAR = 8.0  # standard deviations beyond which a limit cuts nothing off a normal distribution


@dataclass(frozen=True)
class Uncertain:
    """An uncertain parameter, its numbers read and checked."""

    path: str  # dotted path of the parameter
    unit: str  # unit of its values, empty for factors
    distribution: str  # {'lognormal', 'normal', 'uniform', 'beta', 'triangular', 'samples'}: Family
    # mean (SI) and coefficient of variation; None for a distribution between limits
    mean: float | None
    cov: float | None
    # limits and mode (SI); None for a distribution without limits, or without mode
    low: float | None
    high: float | None
    mode: float | None
    own_mean: bool  # whether the mean is the design's own value, not one that was written
    # of a distribution that is these (SI); increasing, or as they came where rows belong together
    samples: tuple[float, ...] = ()
    joint: bool = False  # whether they are drawn by the same rows as those of others

    def law(self) -> Any:
        """The distribution as SciPy has it, frozen; samples have none."""
        from scipy import stats  # half a second that a map need not wait for

        return getattr(self, f"_{self.distribution}")(stats)

    def values(self, probabilities: Array) -> Array:
        """Values (SI) at probabilities within (0, 1), of the same shape."""
        if self.samples:
            number = np.ceil(probabilities * len(self.samples)).astype(int) - 1
            return np.asarray(self.samples)[np.maximum(number, 0)]
        if self.distribution == "lognormal":  # the usual one, without the wait for `stats`
            from scipy.special import ndtri  # a quarter of a second that a check of a file can save

            spread, scale = self._lognormal_numbers
            return np.asarray(np.exp(spread * ndtri(probabilities)) * scale)
        return np.asarray(self.law().ppf(probabilities), dtype=float)

    def _normal(self, stats: Any) -> Any:
        deviation = self.cov * abs(self.mean)  # type: ignore[operator, arg-type]
        ends = [
            sign * np.inf if end is None else (end - self.mean) / deviation  # type: ignore[operator]
            for end, sign in ((self.low, -1.0), (self.high, 1.0))
        ]
        if ends[0] < -FAR and ends[1] > FAR:
            return stats.norm(self.mean, deviation)
        return stats.truncnorm(*ends, self.mean, deviation)

    @property
    def _lognormal_numbers(self) -> tuple[float, float]:
        variance = np.log1p(self.cov**2)  # type: ignore[operator]
        return np.sqrt(variance), self.mean * np.exp(-0.5 * variance)

    def _lognormal(self, stats: Any) -> Any:
        spread, scale = self._lognormal_numbers
        return stats.lognorm(spread, scale=scale)

    def _uniform(self, stats: Any) -> Any:
        return stats.uniform(self.low, self.high - self.low)  # type: ignore[operator]

    def _triangular(self, stats: Any) -> Any:
        width = self.high - self.low  # type: ignore[operator]
        place = (self.mode - self.low) / width  # type: ignore[operator]
        return stats.triang(place, self.low, width)

    def _beta(self, stats: Any) -> Any:
        width = self.high - self.low  # type: ignore[operator]
        place = (self.mean - self.low) / width  # type: ignore[operator]
        total = place * (1.0 - place) / (self.cov * self.mean / width) ** 2 - 1.0  # type: ignore[operator]
        return stats.beta(place * total, (1.0 - place) * total, self.low, width)


@dataclass(frozen=True, eq=False)
@documented
class Draws:
    """Draws of the uncertain parameters of a design."""

    seed: int = label(means="what they follow from")
    first: int = label(means="number of the first of them")
    parameters: tuple[Uncertain, ...] = label(means="what was drawn")
    values: dict[str, Array] = label("draw", means="drawn values by dotted path, SI")

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


@own_errstate()
def draw(design: Design, count: int, seed: int, first: int = 0) -> Draws:
    """Draw the uncertain parameters of a design.

    Parameters
    ----------
    design : Design
        Its `[uncertain]` tables, or the default draws of its friction law.
    count : int
        How many draws.
    seed : int
        What they follow from.
    first : int
        Number of the first: blocks of draws are pieces of one sequence.

    Raises
    ------
    InputError
        As for `uncertain_parameters` and `correlation_root`.
    """
    return drawing(design, seed)(count, first)


def refuse_dependent(design: Design) -> None:
    """Refuse (`InputError`) a sampling whose draws are not independent of each other."""
    kind = design.tables.uncertainty.sampling
    if kind != "monte-carlo":
        raise InputError(
            f"{kind!r} is for `drillctl uncertainty`; intervals here are of independent draws: "
            "monte-carlo",
            "uncertainty.sampling",
        )


def drawing(design: Design, seed: int) -> Callable[[int, int], Draws]:
    """A function of count and first that draws; what it draws from is read once."""
    result = uncertain_parameters(design)
    table = design.tables.uncertainty
    paths = tuple(p.path for p in result)
    root = correlation_root(table, paths)
    sampling = sampling_of(table, seed)
    together = [p.path for p in result if p.joint]

    def drawn(count: int, first: int) -> Draws:
        points = sampling.points(paths, count, first)
        if root is not None:
            points = correlated(points, root)
        if together:  # one row for all of them
            points |= dict.fromkeys(together, points[together[0]])
        values = {p.path: p.values(points[p.path]) for p in result}
        if not isinstance(design.variation, NoVariation):  # a path of its own for each
            values[REALIZATION] = np.arange(first, first + count, dtype=float)
        return Draws(seed, first, result, values)

    return drawn


def uncertain_parameters(design: Design) -> tuple[Uncertain, ...]:
    """What is uncertain in a design.

    Parameters
    ----------
    design : Design
        Its `[uncertain]` tables, or the default draws of its friction law.

    Raises
    ------
    InputError
        An unknown path, one that is not a number of the rig, a wrong unit, or a distribution
        that does not exist; or nothing named and no default for the law of the rock.
    """
    tables = design.tables.uncertain or _defaults(design)
    results = []
    for path, table in tables.items():
        try:
            results.append(_read(design, path, table))
        except InputError as error:
            key = f".{error.where}" if error.where not in ("", path) else ""
            raise InputError(error.problem, design.where(f"uncertain.{path}{key}")) from None
    _refuse_uneven(design, [one for one in results if one.joint])
    return tuple(results)


def _refuse_uneven(design: Design, joint: list[Uncertain]) -> None:
    """Refuse joint samples that are not rows of one table, or that are correlated once more."""
    for one in joint:
        where = f"uncertain.{one.path}"
        if len(one.samples) != len(joint[0].samples):
            raise InputError(
                f"{len(one.samples)} samples, but {len(joint[0].samples)} of {joint[0].path}: "
                "joint samples are rows of one table",
                design.where(f"{where}.samples"),
            )
        if any(one.path in entry.between for entry in design.tables.uncertainty.correlations):
            raise InputError(
                "is joint: its samples hold their correlations already", design.where(where)
            )


def _defaults(design: Design) -> dict[str, DistributionTable]:
    rock = design.tables.bit_rock
    law = friction_laws()[rock.law]
    spread = law.spread(rock) or dict.fromkeys(law.draws, DEFAULT_COV)
    if not spread:
        raise InputError(
            f"nothing is named uncertain, and there is no default for the friction law "
            f"{rock.law!r}; "
            'give a table such as [uncertain."operating_point.weight_on_bit"]',
            "uncertain",
        )
    return {
        f"bit_rock.{key}": DistributionTable(distribution="lognormal", cov=cov)
        for key, cov in spread.items()
    }


def _read(design: Design, path: str, table: DistributionTable) -> Uncertain:
    target = parameter(design, path)
    if path.startswith("simulation."):
        raise InputError("is how a run is computed, not a parameter of the rig")
    if target.whole:
        raise InputError("takes whole numbers only and cannot be drawn")
    numbers = {key: _number(target, key, getattr(table, key)) for key in _NUMBERS}
    mean, low, high, mode = numbers.values()
    samples = tuple(_sample(target, value) for value in table.samples or ())
    samples = samples if table.joint else tuple(sorted(samples))
    own = table.cov is not None and mean is None
    if own:
        if target.value is None:
            raise InputError("the design gives it no value of its own: give a mean", "mean")
        mean = target.value
    one = Uncertain(
        path, target.si_unit, table.distribution, mean, table.cov, low, high, mode, own, samples,
        bool(table.joint),
    )  # fmt: skip
    _refuse_impossible(table, one)
    low, high = _limits(target, one)
    if table.distribution == "triangular" and mode is None:
        mode = 0.5 * (low + high)  # type: ignore[operator]
    one = replace(one, low=low, high=high, mode=mode)
    _refuse_ends(target, table, one)
    return one


_NUMBERS = ("mean", "min", "max", "mode")
_SYMMETRIC = {"uniform": 3.0**0.5, "triangular": 6.0**0.5}
"""Half the width of a distribution over its standard deviation."""


def _number(target: Parameter, key: str, written: object) -> float | None:
    try:
        return None if written is None else target.parse(written)
    except InputError as error:
        raise InputError(error.problem, key) from None


def _sample(target: Parameter, written: object) -> float:
    result = _number(target, "samples", written)
    problem = target.refusal(result or 0.0)
    if problem:
        raise InputError(f"{written}: {problem}", "samples")
    return result or 0.0


def _limits(target: Parameter, one: Uncertain) -> tuple[float | None, float | None]:
    """Limits: those given, else by mean and deviation, of a normal law by what its key allows."""
    mean, low, high = one.mean or 0.0, one.low, one.high
    if one.distribution in _SYMMETRIC and one.cov is not None:
        half = _SYMMETRIC[one.distribution] * one.cov * abs(mean)
        return mean - half, mean + half
    if one.distribution == "normal":
        if low is None and target.refusal(-1e-6 * abs(mean)):
            low = 0.0
        if high is None and not target.refusal(1.0) and target.refusal(1.0 + 1e-6):
            high = 1.0
    return low, high


def _refuse_impossible(table: DistributionTable, one: Uncertain) -> None:
    """Refuse numbers (SI) that no distribution has."""
    mean, low, high, mode = one.mean, one.low, one.high, one.mode
    if mean is not None and table.distribution == "lognormal" and not mean > 0.0:
        raise InputError(f"{mean:g} is impossible: a lognormal mean is greater than 0", "mean")
    if mean is not None and mean == 0.0:
        raise InputError("0 with a coefficient of variation does not vary; give uniform", "mean")
    if low is not None and high is not None and not low < high:
        raise InputError(f"{table.min} must be less than max {table.max}", "min")
    if mode is not None and not (low or 0.0) <= mode <= (high or 0.0):
        raise InputError(f"{table.mode} must lie between min and max", "mode")
    if table.distribution == "beta":
        _refuse_impossible_beta(mean or 0.0, table.cov or 0.0, low or 0.0, high or 0.0)


def _refuse_impossible_beta(mean: float, cov: float, low: float, high: float) -> None:
    if not low < mean < high:
        raise InputError(f"{mean:g} must lie between min and max", "mean")
    widest = ((mean - low) * (high - mean)) ** 0.5 / abs(mean)
    if not cov < widest:
        raise InputError(
            f"{cov:g} is impossible: between these limits, about this mean, it is less than "
            f"{widest:.3g}",
            "cov",
        )


def _refuse_ends(target: Parameter, table: DistributionTable, one: Uncertain) -> None:
    """Refuse a distribution that reaches values which its key does not allow."""
    mean, low, high = one.mean, one.low, one.high
    if table.distribution == "normal":
        assert mean is not None
        inside = (low is None or low <= mean) and (high is None or mean <= high)
        if not inside or target.refusal(mean):
            problem = target.refusal(mean) or "it must lie between min and max"
            raise InputError(f"{mean:g} {target.si_unit}".strip() + f": {problem}", "mean")
    open_end = table.distribution in ("normal", "beta", "uniform", "triangular")
    for key, end, inward in (("min", low, 1.0), ("max", high, -1.0)):
        # An end itself is drawn with probability zero: just inside is what counts.
        span = abs(mean or 1.0) if low is None or high is None else high - low
        own = table.distribution == "normal" and getattr(table, key) is None  # of its key
        if end is None or own or not open_end:
            continue
        impossible = target.refusal(end + inward * 1e-9 * span)
        if impossible:
            written = getattr(table, key) or f"a spread down to {end:g}"
            reason = impossible.partition(": ")[2] or impossible
            raise InputError(f"{written} reaches impossible values: {reason}", key)
