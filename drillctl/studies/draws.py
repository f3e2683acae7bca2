"""Uncertain parameters of a design, and draws from them that anyone can make again.

Plain Monte Carlo. The number behind a draw is a function of seed, parameter and number of the
draw alone: draw 17 is the same whether 20 or 20,000 are asked for, in one go or in blocks, and
whatever else is uncertain. Two designs drawn with one seed are thus under the same conditions
(common random numbers), and their difference is known far better than either of them.

Parameters are drawn independently. A draw that no rig has, such as a static friction below the
sliding one, is neither clipped nor drawn again: that would change the distribution that was
asked for. It is a failed run with a reason, counted; see `drawn_lanes.py`.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design, Parameter, parameter
from drillctl.design.tables import DistributionTable
from drillctl.errors import InputError

Array = NDArray[np.float64]

DEFAULT_COV = 0.05
"""Coefficient of variation of the rock where a design names nothing uncertain."""
DEFAULT_PATHS = {
    "navarro-lopez-suarez": ("bit_rock.a1_factor", "bit_rock.a2_factor"),
    "printed-three-branch": ("bit_rock.a1_factor", "bit_rock.a2_factor"),
    "bit-radius-friction": ("bit_rock.sliding_coefficient", "bit_rock.static_coefficient"),
    "stribeck": ("bit_rock.sliding_coefficient", "bit_rock.static_coefficient"),
    "jansen-van-den-steen": ("bit_rock.a1", "bit_rock.a2"),
    "coulomb": ("bit_rock.a",),
    "tucker-wang": ("bit_rock.a",),
}
"""What is uncertain where a design names nothing: sliding and static torque of the rock,
lognormal about the design's own values."""

_PER_COUNTER = 4
"""Numbers that Philox makes of one state of its counter."""


@dataclass(frozen=True)
class Uncertain:
    """An uncertain parameter, its numbers read and checked.

    Attributes
    ----------
    path : str
        Dotted path of the parameter.
    unit : str
        Unit of its values, empty for factors.
    distribution : {'lognormal', 'normal', 'uniform', 'triangular'}
        Family.
    mean, cov : float or None
        Mean (SI) and coefficient of variation; None for a distribution between limits.
    low, high, mode : float or None
        Limits and mode (SI); None for a distribution without limits, or without mode.
    own_mean : bool
        Whether the mean is the design's own value, not one that was written.
    """

    path: str
    unit: str
    distribution: str
    mean: float | None
    cov: float | None
    low: float | None
    high: float | None
    mode: float | None
    own_mean: bool

    def law(self) -> Any:
        """The distribution as SciPy has it, frozen."""
        from scipy import stats  # half a second that a map need not wait for

        if self.low is not None and self.high is not None:
            width = self.high - self.low
            if self.mode is None:
                return stats.uniform(self.low, width)
            return stats.triang((self.mode - self.low) / width, self.low, width)
        assert self.mean is not None
        assert self.cov is not None
        if self.distribution == "normal":
            return stats.norm(self.mean, self.cov * abs(self.mean))
        variance = np.log1p(self.cov**2)
        return stats.lognorm(np.sqrt(variance), scale=self.mean * np.exp(-0.5 * variance))

    def values(self, probabilities: Array) -> Array:
        """Values (SI) at probabilities within (0, 1), of the same shape."""
        found: Array = np.asarray(self.law().ppf(probabilities), dtype=float)
        return found


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of the uncertain parameters of a design.

    Attributes
    ----------
    seed : int
        What they follow from.
    first : int
        Number of the first of them.
    parameters : tuple of Uncertain
        What was drawn.
    values : dict of ndarray, shape (draws,)
        By dotted path, SI.
    """

    seed: int
    first: int
    parameters: tuple[Uncertain, ...]
    values: dict[str, Array]

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))


def probabilities(seed: int, path: str, count: int, first: int = 0) -> Array:
    """Independent uniform numbers of a parameter, strictly between 0 and 1.

    Parameters
    ----------
    seed : int
        Not negative, less than 2^32.
    path : str
        Parameter that they are for; each has a stream of its own.
    count, first : int
        How many, from which on.

    Returns
    -------
    ndarray, shape (count,)
        The same for the same seed, path and number, on any machine: Philox, counter-based, its
        raw bits turned into numbers here and not by a method that a release of NumPy may change.
    """
    words = hashlib.sha256(path.encode()).digest()[:8]
    bits = np.random.Philox(np.random.SeedSequence([seed, int.from_bytes(words)]))
    bits.advance(first // _PER_COUNTER)
    skipped = first % _PER_COUNTER
    raw = bits.random_raw(skipped + count)[skipped:]
    # The middles of 2^52 equal intervals: neither 0 nor 1, where quantiles are infinite.
    return ((raw >> np.uint64(12)).astype(float) + 0.5) * 2.0**-52


def draw(design: Design, count: int, seed: int, first: int = 0) -> Draws:
    """Draw the uncertain parameters of a design.

    Parameters
    ----------
    design : Design
        Its `[uncertain]` tables, or the defaults of `DEFAULT_PATHS`.
    count : int
        How many draws.
    seed : int
        What they follow from.
    first : int
        Number of the first: blocks of draws are pieces of one sequence.

    Raises
    ------
    InputError
        As for `uncertain_parameters`.
    """
    found = uncertain_parameters(design)
    values = {p.path: p.values(probabilities(seed, p.path, count, first)) for p in found}
    return Draws(seed, first, found, values)


def uncertain_parameters(design: Design) -> tuple[Uncertain, ...]:
    """What is uncertain in a design.

    Parameters
    ----------
    design : Design
        Its `[uncertain]` tables, or the defaults of `DEFAULT_PATHS`.

    Raises
    ------
    InputError
        An unknown path, one that is not a number of the rig, a wrong unit, or a distribution
        that does not exist; or nothing named and no default for the law of the rock.
    """
    tables = design.tables.uncertain or _defaults(design)
    found = []
    for path, table in tables.items():
        where = f"{design.origin}: uncertain.{path}" if design.origin else f"uncertain.{path}"
        try:
            found.append(_read(design, path, table))
        except InputError as error:
            key = error.where if error.where != path else ""
            raise InputError(error.problem, f"{where}.{key}" if key else where) from None
    return tuple(found)


def _defaults(design: Design) -> dict[str, DistributionTable]:
    law = design.tables.bit_rock.law
    if law not in DEFAULT_PATHS:
        raise InputError(
            f"nothing is named uncertain, and there is no default for the friction law {law!r}; "
            'give a table such as [uncertain."operating_point.weight_on_bit"]',
            "uncertain",
        )
    table = DistributionTable(distribution="lognormal", cov=DEFAULT_COV)
    return dict.fromkeys(DEFAULT_PATHS[law], table)


def _read(design: Design, path: str, table: DistributionTable) -> Uncertain:
    target = parameter(design, path)
    if path.startswith("simulation."):
        raise InputError("is how a run is computed, not a parameter of the rig")
    if target.whole:
        raise InputError("takes whole numbers only and cannot be drawn")
    numbers = {key: _number(target, key, getattr(table, key)) for key in ("mean", "min", "max")}
    mean, low, high = numbers.values()
    mode = _number(target, "mode", table.mode)
    own = table.cov is not None and mean is None
    if own:
        if target.value is None:
            raise InputError("the design gives it no value of its own: give a mean", "mean")
        mean = target.value
    if table.distribution == "triangular" and mode is None and low is not None and high is not None:
        mode = 0.5 * (low + high)
    _refuse_impossible(table, mean, low, high, mode)
    return Uncertain(
        path, target.si_unit, table.distribution, mean, table.cov, low, high, mode, own
    )


def _number(target: Parameter, key: str, written: object) -> float | None:
    try:
        return None if written is None else target.parse(written)
    except InputError as error:
        raise InputError(error.problem, key) from None


def _refuse_impossible(
    table: DistributionTable,
    mean: float | None,
    low: float | None,
    high: float | None,
    mode: float | None,
) -> None:
    """Refuse numbers (SI) that no distribution has."""
    if mean is not None and table.distribution == "lognormal" and not mean > 0.0:
        raise InputError(f"{mean:g} is impossible: a lognormal mean is greater than 0", "mean")
    if mean is not None and mean == 0.0:
        raise InputError("0 with a coefficient of variation does not vary; give uniform", "mean")
    if low is None or high is None:
        return
    if not low < high:
        raise InputError(f"{table.min} must be less than max {table.max}", "min")
    if mode is not None and not low <= mode <= high:
        raise InputError(f"{table.mode} must lie between min and max", "mode")
