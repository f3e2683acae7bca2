"""Tables of the bit-rock laws."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.bit_rock.over_weight import KNOTS as KNOTS_OVER_WEIGHT
from drillctl.rig.bit_rock.tabulated import KNOTS
from drillctl.rig.table import Table


class FrictionRow(Table):
    """Friction coefficients at one weight on bit."""

    weight_on_bit: q.Weight
    a1: q.NonNegativeNumber
    a2: q.NonNegativeNumber
    beta: q.NonNegativeNumber

    @model_validator(mode="after")
    def _falling(self) -> FrictionRow:
        _refuse_rising(self.a1, self.a2)
        return self


MOST_ROWS = KNOTS_OVER_WEIGHT + 1
"""Most rows of a friction table over the weight on bit."""


def _refuse_rising(a1: float, a2: float) -> None:
    if a2 < a1:
        raise InputError(f"a2 = {a2:g} must not be less than a1 = {a1:g}")


class FrictionCoefficients(Table):
    """What laws have in common that decay exponentially: coefficients, or a table over WOB."""

    law: str
    a1: q.NonNegativeNumber | None = None
    a2: q.NonNegativeNumber | None = None
    beta: q.NonNegativeNumber | None = None
    table: tuple[FrictionRow, ...] | None = None
    a1_factor: q.PositiveNumber = 1.0
    a2_factor: q.PositiveNumber = 1.0
    beta_factor: q.PositiveNumber = 1.0
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
            _refuse_rising(self.a1 * self.a1_factor, self.a2 * self.a2_factor)
        return self


class NavarroLopezSuarezTable(FrictionCoefficients):
    """Friction of Navarro-Lopez & Suarez: coefficients, or a table of them over WOB."""

    law: Literal["navarro-lopez-suarez"]
    regularised_over: q.PositiveSpeed | None = None


class PrintedThreeBranchTable(FrictionCoefficients):
    """The same in three branches as Monteiro & Trindade print it; reference solver only."""

    law: Literal["printed-three-branch"]
    tolerance: q.PositiveSpeed = 1e-4


class BitRadiusFrictionTable(Table):
    """The same law with a bit radius and friction coefficients (Navarro-Lopez & Cortes 2007).

    T = W R_b [mu_c + (mu_s - mu_c) exp(-gamma |w| / v_f)].
    """

    law: Literal["bit-radius-friction"]
    bit_radius: q.Diameter
    static_coefficient: q.NonNegativeNumber
    sliding_coefficient: q.NonNegativeNumber
    decay: q.NonNegativeNumber
    reference_speed: q.PositiveSpeed = 1.0
    regularised_over: q.PositiveSpeed | None = None

    @model_validator(mode="after")
    def _falling(self) -> BitRadiusFrictionTable:
        if self.static_coefficient < self.sliding_coefficient:
            raise InputError(
                f"static_coefficient = {self.static_coefficient:g} must not be less than "
                f"sliding_coefficient = {self.sliding_coefficient:g}"
            )
        return self


class JansenVanDenSteenTable(Table):
    """A static peak over a constant sliding torque (after Jansen & van den Steen 1995)."""

    law: Literal["jansen-van-den-steen"]
    a1: q.NonNegativeNumber
    a2: q.NonNegativeNumber

    @model_validator(mode="after")
    def _peak(self) -> JansenVanDenSteenTable:
        _refuse_rising(self.a1, self.a2)
        return self


class CoulombTable(Table):
    """The same torque at rest and at any speed: a x weight on bit."""

    law: Literal["coulomb"]
    a: q.NonNegativeNumber


class TuckerWangTable(Table):
    """Smooth friction with a hump (Tucker & Wang family); defaults of a public model."""

    law: Literal["tucker-wang"]
    a: q.NonNegativeNumber = 0.0239
    b1: q.PositiveNumber = 1.91
    b2: q.NonNegativeNumber = 8.5
    b3: q.NonNegativeNumber = 5.47


class StribeckTable(Table):
    """Stribeck friction regularised by tanh, smooth; defaults of a public simulator."""

    law: Literal["stribeck"]
    bit_radius: q.Diameter
    static_coefficient: q.NonNegativeNumber = 0.8
    sliding_coefficient: q.NonNegativeNumber = 0.5
    stribeck_speed: q.PositiveSpeed = 1.0
    regularised_over: q.PositiveSpeed = 0.05

    @model_validator(mode="after")
    def _falling(self) -> StribeckTable:
        if self.static_coefficient < self.sliding_coefficient:
            raise InputError(
                f"static_coefficient = {self.static_coefficient:g} must not be less than "
                f"sliding_coefficient = {self.sliding_coefficient:g}"
            )
        return self


class FrictionPoint(Table):
    """Torque over weight on bit at one speed."""

    speed: q.Speed
    a: q.NonNegativeNumber


class TabulatedFrictionTable(Table):
    """Measured points of torque over weight, straight lines between them."""

    law: Literal["tabulated"]
    points: tuple[FrictionPoint, ...]
    static: q.NonNegativeNumber | None = None

    @model_validator(mode="after")
    def _ordered(self) -> TabulatedFrictionTable:
        if not 2 <= len(self.points) <= KNOTS + 1:
            raise InputError(f"needs 2 to {KNOTS + 1} points, got {len(self.points)}")
        speeds = [point.speed for point in self.points]
        if speeds[0] != 0.0 or any(b <= a for a, b in pairwise(speeds)):
            raise InputError("speeds of the points must begin at 0 and increase")
        if self.static is not None and self.static < self.points[0].a:
            raise InputError(
                f"static = {self.static:g} must not be less than the first a = {self.points[0].a:g}"
            )
        return self


BitRockTable = Annotated[
    NavarroLopezSuarezTable
    | PrintedThreeBranchTable
    | BitRadiusFrictionTable
    | JansenVanDenSteenTable
    | CoulombTable
    | TuckerWangTable
    | StribeckTable
    | TabulatedFrictionTable,
    Field(discriminator="law"),
]
