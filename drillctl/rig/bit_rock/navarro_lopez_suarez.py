"""Dry friction that decays exponentially with bit speed (Navarro-Lopez & Suarez 2004).

As coefficients, as a table of them over the weight on bit, and with a bit radius.
"""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, NamedTuple

from pydantic import field_validator, model_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.bit_rock.law import Exp, Form, FrictionLaw, RockTable, refuse_rising
from drillctl.rig.bit_rock.stribeck import COEFFICIENTS, Stribeck
from drillctl.rig.table import Table

KNOTS = 7  # most rows at which a piecewise linear function of the weight changes its slope
MOST_ROWS = KNOTS + 1  # most rows of a friction table over the weight on bit


class NavarroLopezSuarez(NamedTuple):
    r"""Set-valued friction with exponential decay.

    .. math:: T(\omega) = [a_1 + (a_2 - a_1) e^{-\beta |\omega|}] \, W \, \mathrm{sign}\,\omega,
              \qquad T(0) \in [-a_2 W, a_2 W]

    Equation 5 of Monteiro & Trindade (2012), with W the weight on bit.

    Attributes
    ----------
    a1 : float
        Torque at high speed over weight on bit (m).
    a2 : float
        Static torque over weight on bit (m); not less than `a1`.
    beta : float
        Decay of the torque with speed (s/rad).
    """

    a1: Any
    a2: Any
    beta: Any

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m), `a2 W`."""
        return self.a2 * weight

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m): the static torque, this law has no peak."""
        return self.a2 * weight

    def steepest_fall(self, weight: Any) -> Any:
        """Largest falling slope (N m s/rad), at zero speed: `beta (a2 - a1) W`."""
        return self.beta * (self.a2 - self.a1) * weight

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s) under `weight` (N)."""
        falling = (self.a2 - self.a1) * weight * exp(-self.beta * speed)
        return self.a1 * weight + falling, -self.beta * falling

    def held(self, weight: Any) -> tuple[Any, Any, Any]:
        """Torque at high speed, static torque (N m) and decay (s/rad) under `weight` (N)."""
        return self.a1 * weight, self.a2 * weight, self.beta


# Coefficients that follow the weight on bit.


@dataclass(frozen=True)
class WeightTable:
    """Coefficients of `NavarroLopezSuarez` at several weights on bit.

    Between rows the torques `a1 W` and `a2 W`, and `beta`, are piecewise linear in W. Below
    the first row its coefficients hold (torque goes to zero with the weight); above the last
    row the last segment is continued.

    Attributes
    ----------
    weight : tuple of float, shape (rows,)
        Weights on bit (N), increasing.
    a1, a2 : tuple of float, shape (rows,)
        Torque over weight (m).
    beta : tuple of float, shape (rows,)
        Decay (s/rad).
    """

    weight: tuple[float, ...]
    a1: tuple[float, ...]
    a2: tuple[float, ...]
    beta: tuple[float, ...]

    def covers(self, weight: float) -> bool:
        """Whether `weight` (N) lies within the rows."""
        return self.weight[0] <= weight <= self.weight[-1]

    def at(self, weight: float) -> NavarroLopezSuarez:
        """Coefficients at `weight` (N)."""
        if weight <= self.weight[0]:
            return NavarroLopezSuarez(self.a1[0], self.a2[0], self.beta[0])
        last = len(self.weight) - 2
        row = min(sum(w < weight for w in self.weight[1:]), last)
        low, high = self.weight[row], self.weight[row + 1]
        share = (weight - low) / (high - low)

        if share == 1.0:  # at a row, its printed coefficients to the last bit
            return NavarroLopezSuarez(self.a1[row + 1], self.a2[row + 1], self.beta[row + 1])

        def between(left: float, right: float) -> float:
            return left + share * (right - left)

        return NavarroLopezSuarez(
            between(self.a1[row] * low, self.a1[row + 1] * high) / weight,
            between(self.a2[row] * low, self.a2[row + 1] * high) / weight,
            between(self.beta[row], self.beta[row + 1]),
        )


class OverWeight(
    namedtuple(
        "OverWeight",
        "w1 w2 w3 w4 w5 w6 w7 p0 p1 p2 p3 p4 p5 p6 p7 q0 q1 q2 q3 q4 q5 q6 q7 "
        "b0 b1 b2 b3 b4 b5 b6 b7",
    )
):
    r"""The law of Navarro-Lopez & Suarez with torques and decay piecewise linear in the weight.

    .. math:: T(\omega, W) = p(W) + [q(W) - p(W)]\, e^{-\beta(W) |\omega|}

    with p = a1 W, q = a2 W and beta as in `WeightTable`: for a weight that moves while the bit
    drills. Made by `over_weight`. A function f of the weight is stored as its value or slope at
    zero and its changes of slope at the rows: f(W) = f0 W + sum f_i max(0, W - w_i) for the
    torques, with b0 in place of b0 W for beta.

    Attributes
    ----------
    w1, ..., w7 : float
        Weights of the rows but the last (N).
    p0, ..., p7, q0, ..., q7 : float
        Of the torque at high speed and of the static torque (m).
    b0, ..., b7 : float
        Of the decay: b0 in s/rad, the others in s/(rad N).
    """

    __slots__ = ()

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m) under `weight` (N)."""
        return _held(self, weight)[1]

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m): the static torque."""
        return _held(self, weight)[1]

    def steepest_fall(self, weight: Any) -> Any:
        """Largest falling slope (N m s/rad) under a constant `weight` (N), at zero speed."""
        spread, decay = (self.q0 - self.p0) * weight, self.b0 + 0.0 * weight
        for k in range(7):
            over = (weight > self[k]) * (weight - self[k])
            spread = spread + (self[16 + k] - self[8 + k]) * over
            decay = decay + self[24 + k] * over
        return decay * spread

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s) under `weight` (N)."""
        level, static, decay = _held(self, weight)
        falling = (static - level) * exp(-decay * speed)
        return level + falling, -decay * falling

    def held(self, weight: Any) -> tuple[Any, Any, Any]:
        """Torque at high speed, static torque (N m) and decay (s/rad) under `weight` (N)."""
        return _held(self, weight)

    def torque_by_weight(self, weight: Any, speed: Any, exp: Exp) -> Any:
        """Torque per weight at constant speed, dT/dW (m); at a row the mean of both sides."""
        spread, decay = (self.q0 - self.p0) * weight, self.b0
        level_rate, static_rate, decay_rate = self.p0, self.q0, 0.0
        for k in range(7):
            half = 0.5 * (weight > self[k]) + 0.5 * (weight >= self[k])
            over = (weight > self[k]) * (weight - self[k])
            spread = spread + (self[16 + k] - self[8 + k]) * over
            decay = decay + self[24 + k] * over
            level_rate = level_rate + self[8 + k] * half
            static_rate = static_rate + self[16 + k] * half
            decay_rate = decay_rate + self[24 + k] * half
        fade = exp(-decay * speed)
        moved = static_rate - level_rate - decay_rate * speed * spread
        return level_rate + moved * fade


def _held(law: Any, weight: Any) -> tuple[Any, Any, Any]:
    level, static, decay = law.p0 * weight, law.q0 * weight, law.b0
    for k in range(7):
        over = (weight > law[k]) * (weight - law[k])
        level = level + law[8 + k] * over
        static = static + law[16 + k] * over
        decay = decay + law[24 + k] * over
    return level, static, decay


def over_weight(
    table: WeightTable, a1_factor: float = 1.0, a2_factor: float = 1.0, beta_factor: float = 1.0
) -> OverWeight:
    """The law through the rows of a table.

    Parameters
    ----------
    table : WeightTable
        At most `KNOTS` + 1 rows.
    a1_factor, a2_factor, beta_factor : float
        On all rows.

    Returns
    -------
    OverWeight
        Below the first row its coefficients hold, above the last the last piece is continued.
    """
    rows = table.weight
    knots = rows[:-1]
    unused = KNOTS - len(knots)
    torques = [
        _slopes(rows, tuple(factor * a * w for a, w in zip(arm, rows, strict=True)), None)
        for arm, factor in ((table.a1, a1_factor), (table.a2, a2_factor))
    ]
    decay = tuple(beta_factor * b for b in table.beta)
    padded = [[*changes, *([0.0] * unused)] for changes in torques]
    decays = [decay[0], *_slopes(rows, decay, 0.0)[1:], *([0.0] * unused)]
    return OverWeight(*knots, *([0.0] * unused), *padded[0], *padded[1], *decays)


def _slopes(rows: tuple[float, ...], values: tuple[float, ...], first: float | None) -> list[float]:
    """Slope below the first row, by default towards zero, and its changes at the rows."""
    slopes = [
        (v1 - v0) / (w1 - w0)
        for (w0, w1), (v0, v1) in zip(pairwise(rows), pairwise(values), strict=True)
    ]
    below = values[0] / rows[0] if first is None else first
    return [below, *(b - a for a, b in zip([below, *slopes], slopes, strict=False))]


# Keys of a design.


class FrictionRow(Table):
    """Friction coefficients at one weight on bit."""

    weight_on_bit: q.Weight
    a1: q.Arm
    a2: q.Arm
    beta: q.Decay

    @model_validator(mode="after")
    def _falling(self) -> FrictionRow:
        refuse_rising(self.a2, self.a1)
        return self


class FrictionCoefficients(RockTable):
    """What laws have in common that decay exponentially: coefficients, or a table over WOB."""

    law: str
    a1: q.Arm | None = None
    a2: q.Arm | None = None
    beta: q.Decay | None = None
    table: tuple[FrictionRow, ...] | None = None
    a1_factor: q.Factor = 1.0
    a2_factor: q.Factor = 1.0
    beta_factor: q.Factor = 1.0
    outside_table: Literal["refuse", "extrapolate"] = "refuse"

    @field_validator("table")
    @classmethod
    def _increasing(cls, table: tuple[FrictionRow, ...] | None) -> tuple[FrictionRow, ...] | None:
        if table is not None:
            if len(table) < 2:
                raise InputError("a table needs two rows or more; give a1, a2 and beta instead")
            if len(table) > MOST_ROWS:
                raise InputError(f"a table has at most {MOST_ROWS} rows, got {len(table)}")
            weights = [row.weight_on_bit for row in table]
            if weights[0] <= 0.0:
                raise InputError("weight_on_bit of the first row must be more than 0")
            if any(b <= a for a, b in pairwise(weights)):
                raise InputError("weight_on_bit must increase from row to row")
        return table

    @model_validator(mode="after")
    def _coefficients_or_table(self) -> FrictionCoefficients:
        numbers = {"a1": self.a1, "a2": self.a2, "beta": self.beta}
        given = [key for key, value in numbers.items() if value is not None]
        if self.table is not None and given:
            raise InputError(f"give table, or a1, a2 and beta; got table and {', '.join(given)}")
        if self.table is None and len(given) < 3:
            missing = [key for key in numbers if key not in given]
            raise InputError(f"{', '.join(missing)} missing: give a1, a2 and beta, or a table")
        if self.table is None:
            assert self.a1 is not None
            assert self.a2 is not None
            refuse_rising(self.a2 * self.a2_factor, self.a1 * self.a1_factor)
        return self

    @property
    def weights(self) -> tuple[float, ...]:
        """Weights on bit of the rows (N); none without a table."""
        return tuple(row.weight_on_bit for row in self.table or ())

    def over_weight(self) -> OverWeight:
        """The law through the rows of the table, for a weight that moves."""
        return over_weight(self._rows(), self.a1_factor, self.a2_factor, self.beta_factor)

    def at(self, weight: float) -> NavarroLopezSuarez:
        """The law at a weight on bit (N)."""
        given = self._coefficients(weight)
        law = NavarroLopezSuarez(
            given.a1 * self.a1_factor, given.a2 * self.a2_factor, given.beta * self.beta_factor
        )
        if law.a2 < law.a1:
            raise InputError(
                f"the factors give a2 = {law.a2:g}, less than a1 = {law.a1:g}", "bit_rock.a2_factor"
            )
        return law

    def _coefficients(self, weight: float) -> NavarroLopezSuarez:
        if self.table is None:
            return NavarroLopezSuarez(self.a1, self.a2, self.beta)
        rows = self._rows()
        if not rows.covers(weight) and self.outside_table == "refuse":
            raise InputError(
                f"{weight / 1e3:g} kN lies outside the friction table "
                f"({rows.weight[0] / 1e3:g} to {rows.weight[-1] / 1e3:g} kN); "
                'allowed with bit_rock.outside_table = "extrapolate"',
                "operating_point.weight_on_bit",
            )
        return rows.at(weight)

    def _rows(self) -> WeightTable:
        rows = self.table or ()
        return WeightTable(
            weight=self.weights,
            a1=tuple(row.a1 for row in rows),
            a2=tuple(row.a2 for row in rows),
            beta=tuple(row.beta for row in rows),
        )


class NavarroLopezSuarezTable(FrictionCoefficients):
    """Friction of Navarro-Lopez & Suarez: coefficients, or a table of them over WOB."""

    law: Literal["navarro-lopez-suarez"]
    regularised_over: q.PositiveSpeed | None = None


class BitRadiusFrictionTable(RockTable):
    """The same law with a bit radius and friction coefficients (Navarro-Lopez & Cortes 2007).

    T = W R_b [mu_c + (mu_s - mu_c) exp(-gamma |w| / v_f)].
    """

    law: Literal["bit-radius-friction"]
    bit_radius: q.Diameter
    static_coefficient: q.NonNegativeNumber
    sliding_coefficient: q.NonNegativeNumber
    decay: q.Decay
    reference_speed: q.PositiveSpeed = 1.0
    regularised_over: q.PositiveSpeed | None = None

    @model_validator(mode="after")
    def _falling(self) -> BitRadiusFrictionTable:
        refuse_rising(self.static_coefficient, self.sliding_coefficient, COEFFICIENTS)
        return self


def _law(table: NavarroLopezSuarezTable, weight: float, moves: bool) -> Any:
    fixed = table.at(weight)  # refused outside of its table, whether the weight moves or not
    return table.over_weight() if table.table is not None and moves else fixed


def _of_radius(table: BitRadiusFrictionTable, weight: float, moves: bool) -> NavarroLopezSuarez:
    return NavarroLopezSuarez(
        a1=table.bit_radius * table.sliding_coefficient,
        a2=table.bit_radius * table.static_coefficient,
        beta=table.decay / table.reference_speed,
    )


def _regularised(law: Any, table: Any) -> Stribeck:
    if not isinstance(law, NavarroLopezSuarez):
        raise InputError(
            "is not allowed with a weight on bit that moves over a friction table",
            "bit_rock.regularised_over",
        )
    return Stribeck(law.a2, law.a1, law.beta, 1.0 / table.regularised_over)


_PAPER = NavarroLopezSuarez(0.026, 0.085, 0.098)
LAWS = (
    FrictionLaw(
        NavarroLopezSuarezTable,
        _law,
        draws=("a1_factor", "a2_factor"),
        regularised=_regularised,
        forms=(
            Form(
                NavarroLopezSuarez,
                static=("a2",),
                sliding=("a1",),
                decay=("beta",),
                keys='`law = "navarro-lopez-suarez"` (a1, a2, beta, or a table over the weight on '
                'bit); `law = "bit-radius-friction"` (the same with bit radius and friction '
                "coefficients)",
                use="The paper's law and the default of the shipped designs.",
                curves=(
                    ("Navarro-Lopez & Suarez, 140 kN", _PAPER),
                    (
                        "the same, regularised over 0.5 rad/s",
                        Stribeck(_PAPER.a2, _PAPER.a1, _PAPER.beta, 2.0),
                    ),
                ),
            ),
            Form(
                OverWeight,
                static=tuple(f"q{k}" for k in range(8)),
                sliding=tuple(f"p{k}" for k in range(8)),
                decay=tuple(f"b{k}" for k in range(8)),
                keys='`law = "navarro-lopez-suarez"` with a `table` and a weight on bit that moves',
                use="Taken by itself wherever the weight changes while the bit drills.",
            ),
        ),
    ),
    FrictionLaw(
        BitRadiusFrictionTable,
        _of_radius,
        draws=("sliding_coefficient", "static_coefficient"),
        regularised=_regularised,
    ),
)
