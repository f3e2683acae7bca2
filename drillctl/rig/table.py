"""Field types of the design tables: what is read with a unit, and the ranges allowed.

What every table of a design file is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Annotated, Any, Union, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from drillctl import units
from drillctl.errors import InputError, shown
from drillctl.units import Kind

Check = Callable[[float, object], None]
"""Refuses a number (SI) out of its range; the message quotes what was written."""

LARGEST_COUNT = 10**9  # of anything that is counted: what is larger is a slip of the pen


def _any(si: float, written: object) -> None:
    pass


def _positive(si: float, written: object) -> None:
    if not si > 0:
        raise InputError(f"{shown(written)} is not allowed: it must be greater than 0")


def _not_negative(si: float, written: object) -> None:
    if not si >= 0:
        raise InputError(f"{shown(written)} is not allowed: it must be 0 or more")


def _read(kind: Kind, check: Check = _any) -> BeforeValidator:
    def read(value: object) -> float:
        si = units.parse(value, kind)
        if not math.isfinite(si):
            raise InputError(f"{shown(value)} is not a finite {kind.name}")
        check(si, value)
        return si + 0.0  # never -0.0: equal designs have equal hashes

    return BeforeValidator(read)


def number(value: object) -> float:
    """Read a number without unit; refused (`InputError`) unless it is finite."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{shown(value)} is not a number; write it without quotes or unit")
    try:
        si = float(value)
    except OverflowError:
        si = math.inf
    if not math.isfinite(si):
        raise InputError(f"{shown(value)} is not a finite number")
    return si + 0.0


def _number(check: Check = _any) -> BeforeValidator:
    def read(value: object) -> float:
        si = number(value)
        check(si, value)
        return si

    return BeforeValidator(read)


def _count(check: Check) -> BeforeValidator:
    def read(value: object) -> int:
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int):
            raise InputError(f"{shown(value)} is not a whole number")
        if value > LARGEST_COUNT:
            raise InputError(f"{shown(value)} is not allowed: at most {LARGEST_COUNT}")
        check(value, value)
        return value

    return BeforeValidator(read)


SHORTEST_LAG = 1e-4
"""Shortest time constant (s) but for none: less would cost the solvers much and change nothing."""
SHORTEST_PERIOD = 1e-3  # shortest sampling period (s) but for none


def _none_or_lag(si: float, written: object) -> None:
    if si != 0.0 and not si >= SHORTEST_LAG:
        raise InputError(f"{shown(written)} is not allowed: it must be 0 or at least 0.1 ms")


def _none_or_period(si: float, written: object) -> None:
    if si != 0.0 and not si >= SHORTEST_PERIOD:
        raise InputError(f"{shown(written)} is not allowed: it must be 0 or at least 1 ms")


def _not_positive(si: float, written: object) -> None:
    if not si <= 0:
        raise InputError(f"{shown(written)} is not allowed: it must be 0 or less")


def _limit(kind: Kind, check: Check = _positive) -> BeforeValidator:
    """A limit: infinity, in whatever form it is written, is none."""
    read = _read(kind, check).func

    def reads(value: object) -> float | None:
        if value is None or (isinstance(value, float) and value == math.inf):
            return None
        if isinstance(value, str) and value.strip().lower().split(" ")[0] in (
            "inf", "infinity", "-inf", "-infinity"
        ):  # fmt: skip
            return None
        return float(read(value))  # type: ignore[call-arg]

    return BeforeValidator(reads)


def _share(si: float, written: object) -> None:
    if not 0.0 <= si <= 1.0:
        raise InputError(f"{shown(written)} is not allowed: it must lie between 0 and 1")


# A float with the `Kind` it is read and written by, and the range it must lie in.
Number = Annotated[float, _number()]
PositiveNumber = Annotated[float, _number(_positive)]
NonNegativeNumber = Annotated[float, _number(_not_negative)]
Count = Annotated[int, _count(_positive)]
CountOrZero = Annotated[int, _count(_not_negative)]

Speed = Annotated[float, units.SPEED, _read(units.SPEED)]
PositiveSpeed = Annotated[float, units.SPEED, _read(units.SPEED, _positive)]
SpeedOrZero = Annotated[float, units.SPEED, _read(units.SPEED, _not_negative)]
Weight = Annotated[float, units.FORCE, _read(units.FORCE, _not_negative)]
Torque = Annotated[float, units.TORQUE, _read(units.TORQUE)]
TorqueOrZero = Annotated[float, units.TORQUE, _read(units.TORQUE, _not_negative)]
Length = Annotated[float, units.LENGTH, _read(units.LENGTH, _positive)]
Diameter = Annotated[float, units.DIAMETER, _read(units.DIAMETER, _positive)]
Bore = Annotated[float, units.DIAMETER, _read(units.DIAMETER, _not_negative)]
Time = Annotated[float, units.TIME, _read(units.TIME, _positive)]
TimeOrZero = Annotated[float, units.TIME, _read(units.TIME, _not_negative)]
Lag = Annotated[float, units.TIME, _read(units.TIME, _none_or_lag)]
SamplingPeriod = Annotated[float, units.TIME, _read(units.TIME, _none_or_period)]
Rate = Annotated[float, units.RATE, _read(units.RATE, _not_negative)]
Inertia = Annotated[float, units.INERTIA, _read(units.INERTIA, _not_negative)]
Density = Annotated[float, units.DENSITY, _read(units.DENSITY, _positive)]
Viscosity = Annotated[float, units.VISCOSITY, _read(units.VISCOSITY, _positive)]
Modulus = Annotated[float, units.MODULUS, _read(units.MODULUS, _positive)]
PolarMoment = Annotated[float, units.POLAR_MOMENT, _read(units.POLAR_MOMENT, _positive)]
Stiffness = Annotated[float, units.STIFFNESS, _read(units.STIFFNESS, _positive)]
Damping = Annotated[float, units.DAMPING, _read(units.DAMPING, _not_negative)]
Drag = Annotated[float, units.DRAG, _read(units.DRAG, _not_negative)]
Slowness = Annotated[float, units.SLOWNESS, _read(units.SLOWNESS, _not_negative)]
WeightGain = Annotated[float, units.WEIGHT_GAIN, _read(units.WEIGHT_GAIN, _not_negative)]
ProportionalGain = Annotated[float, units.PROPORTIONAL_GAIN, _read(units.PROPORTIONAL_GAIN)]
IntegralGain = Annotated[float, units.INTEGRAL_GAIN, _read(units.INTEGRAL_GAIN)]
PositiveProportionalGain = Annotated[
    float, units.PROPORTIONAL_GAIN, _read(units.PROPORTIONAL_GAIN, _positive)
]
PositiveIntegralGain = Annotated[float, units.INTEGRAL_GAIN, _read(units.INTEGRAL_GAIN, _positive)]
PositiveWeight = Annotated[float, units.FORCE, _read(units.FORCE, _positive)]
Share = Annotated[float, _number(_share)]

# Limits: None where there is none.
TorqueLimit = Annotated[float | None, units.TORQUE, _limit(units.TORQUE)]
LeastTorque = Annotated[float | None, units.TORQUE, _limit(units.TORQUE, _not_positive)]
SpeedLimit = Annotated[float | None, units.SPEED, _limit(units.SPEED)]
PowerLimit = Annotated[float | None, units.POWER, _limit(units.POWER)]
TorqueRateLimit = Annotated[float | None, units.TORQUE_RATE, _limit(units.TORQUE_RATE)]
WeightRateLimit = Annotated[float | None, units.FORCE_RATE, _limit(units.FORCE_RATE)]


class Table(BaseModel):
    """A table of a design: unknown keys refused, frozen when made."""

    # A table inside another is never validated alone: half of the validators need not be built.
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Table:
        """Itself, as it is frozen: a default is handed to each of thousands of draws."""
        return self


def law_name(table: type[Table]) -> str:
    """The law that a table is of: the one word that its `law` allows."""
    return str(get_args(table.model_fields["law"].annotation)[0])


def one_of(laws: Iterable[Any]) -> Any:
    """The type of a table that is one of several, as its `law` says."""
    return Annotated[Union[tuple(law.table for law in laws)], Field(discriminator="law")]  # noqa: UP007


def number_or_quantity(value: object) -> object:
    """Text as it came, or a finite number: what may stand for a value at any path."""
    return value if isinstance(value, str) else number(value)
