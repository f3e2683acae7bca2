r"""A rock whose strength varies along the way (after Ritto, Soize & Sampaio 2009; form ours).

Static and sliding torque are multiplied with Y = exp(s X - s^2 / 2), s^2 = ln(1 + cv^2), of mean 1
and coefficient of variation cv. X is a stationary Ornstein-Uhlenbeck process of unit variance with
correlation length l over drilled depth, angle of the bit or time, on nodes of its own,

.. math:: X_0 = \xi_0, \quad X_{k+1} = a X_k + \sqrt{1 - a^2}\, \xi_{k+1}, \quad a = e^{-D/l},

and straight between them. The normal numbers xi are those of Philox with the key [seed, draw]: a
path depends on nothing but these, and a longer one begins with the shorter.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import model_validator

from drillctl import units
from drillctl.arrays import Array, Index
from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table

FINEST = 10.0  # fewest nodes in a correlation length
UNITS = {"depth": units.LENGTH, "angle": units.ANGLE, "time": units.TIME}
ALONG = ("length", "spacing")  # keys whose unit follows from what they are over
MOST_NODES = 10_000_000  # of a path: a run can mean no more
AHEAD = 3.0  # a path over angle or depth is this much longer than steady drilling; then it stays
HIGHEST = 4.5  # normal numbers beyond it do not matter: one in 300,000
RATE_OF_PENETRATION = 20.0 / 3600.0  # m/s, where a design gives none


class VariationTable(Table):
    """A rock that varies: its torques times a lognormal process along the way.

    `cv`: coefficient of variation, 0 for a rock that is the same everywhere. `length`: correlation
    length, of drilled depth, of the bit's angle or of time, as `over` says (`"10 cm"`,
    `"2 rev"`, `"5 s"`). `spacing`: of the nodes between which it is straight, a tenth of that by
    default, which is the most. `realization`: number of the draw, `uncertainty.seed` its seed.
    """

    cv: q.Spread = 0.0
    length: q.AlongWay | None = None
    over: Literal["depth", "angle", "time"] = "depth"
    spacing: q.AlongWay | None = None
    realization: q.CountOrZero = 0

    def kind_by_key(self, key: str) -> units.Kind | None:
        """Depth, angle or time."""
        return UNITS[self.over] if key in ALONG else None

    @model_validator(mode="before")
    @classmethod
    def _in_units_of_way(cls, data: Any) -> Any:
        over = data.get("over", "depth") if isinstance(data, dict) else None
        kind = UNITS.get(over) if isinstance(over, str) else None
        if kind is None:
            return data
        read = {key: data[key] for key in ALONG if data.get(key) is not None}
        return {**data, **{key: units.SI(_read(key, v, kind)) for key, v in read.items()}}

    @model_validator(mode="after")
    def _whole(self) -> VariationTable:
        if self.cv > 0.0 and self.length is None:
            raise InputError("length is missing: over which the rock stays much the same")
        most = math.inf if self.length is None else self.length / FINEST
        if self.spacing is not None and self.spacing > most * (1.0 + 1e-9):
            raise InputError(
                f"spacing {self.spacing:g} is more than a tenth of the correlation length "
                f"{self.length:g}"
            )
        return self


def _read(key: str, value: object, kind: units.Kind) -> float:
    try:
        return units.parse(value, kind)
    except InputError as error:
        raise InputError(f"{key}: {error.problem}") from None


class NoVariation(NamedTuple):
    """A rock that is the same everywhere."""

    def sinking(self) -> NoVariation:
        """The same."""
        return self


class Variation(NamedTuple):
    """A rock that varies; positions in m, rad or s.

    Attributes
    ----------
    spread : float
        Standard deviation of the logarithm.
    length, spacing : float
        Correlation length, and distance of the nodes.
    advance : float
        Way per time (m/s, or 1 over time).
    turns : float
        Way per angle of the bit: 1 over angle.
    seed, realization : float
        Key of the path.
    sinks : float
        Way per depth that the bit itself has drilled: 1 where it has axial motion.
    """

    spread: Any
    length: Any
    spacing: Any
    advance: Any
    turns: Any
    seed: Any
    realization: Any
    sinks: Any = 0.0

    def sinking(self) -> Variation:
        """The same over the depth of a bit that drills by itself."""
        return self._replace(advance=0.0, sinks=1.0)

    @property
    def highest(self) -> Any:
        """Factor that the rock hardly ever exceeds."""
        return np.exp(HIGHEST * self.spread - 0.5 * self.spread**2)

    def nodes(self, duration: float, set_speed: Any, rate: Any = 0.0) -> Any:
        """Number of nodes of the path of a run, its bit sinking at `rate` (m/s) by itself."""
        way = duration * (self.advance + AHEAD * (self.turns * set_speed + self.sinks * rate))
        return np.ceil(way / self.spacing).astype(int) + 2

    def longest_step(self, set_speed: Any, rate: Any = 0.0) -> Any:
        """Longest step (s) that sees every node, at twice the set speed and `rate` (m/s) too."""
        return self.spacing / (self.advance + 2.0 * (self.turns * set_speed + self.sinks * rate))


def variation_of(table: VariationTable | None, rate: float, seed: int) -> Variation | NoVariation:
    """The variation that a table asks for, the bit drilling at `rate` (m/s)."""
    if table is None or table.cv == 0.0:
        return NoVariation()
    assert table.length is not None
    return Variation(
        math.sqrt(math.log1p(table.cv**2)), table.length, table.spacing or table.length / FINEST,
        {"depth": rate, "time": 1.0, "angle": 0.0}[table.over], float(table.over == "angle"),
        float(seed), float(table.realization),
    )  # fmt: skip


def path(variation: Variation, nodes: int) -> Array:
    """X at the first nodes."""
    from scipy.signal import lfilter

    if nodes > MOST_NODES:
        raise InputError(
            f"{nodes:.3g} nodes in a run are too many: at most {MOST_NODES:.0e}",
            "bit_rock.variation.spacing",
        )
    random = np.random.Generator(
        np.random.Philox(key=[int(variation.seed), int(variation.realization)])
    )
    kept = math.exp(-variation.spacing / variation.length)
    numbers = random.standard_normal(nodes)
    numbers[1:] *= math.sqrt(1.0 - kept * kept)
    return np.asarray(lfilter([1.0], [1.0, -kept], numbers))


def paths(variation: Variation, nodes: int) -> tuple[Array, Index]:
    """Paths of many lanes, shape (paths, nodes), and the row of each lane's, (lanes,)."""
    columns = np.stack([*variation]).T
    unlike, which = np.unique(columns, axis=0, return_inverse=True)
    return np.stack([path(Variation(*row), nodes) for row in unlike]), which.reshape(-1)
