"""Field types of the design tables: what is read with a unit, and the ranges allowed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from drillctl import units
from drillctl.errors import InputError
from drillctl.units import Kind


def _reader(kind: Kind) -> Callable[[object], float]:
    def read(value: object) -> float:
        number = units.parse(value, kind)
        if not math.isfinite(number):
            raise InputError(f"{value!r} is not a finite {kind.name}")
        return number

    return read


def _positive(value: float) -> float:
    if not value > 0:
        raise InputError(f"{value:g} is not allowed: it must be greater than 0")
    return value


def _not_negative(value: float) -> float:
    if not value >= 0:
        raise InputError(f"{value:g} is not allowed: it must be 0 or more")
    return value


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{value!r} is not a number; write it without quotes or unit")
    if not math.isfinite(value):
        raise InputError(f"{value!r} is not a finite number")
    return float(value)


def _whole(value: object) -> int:
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{value!r} is not a whole number")
    return value


def _quantity(kind: Kind, allowed: Callable[[float], float] | None = None) -> Any:
    """Annotated float that is read from text with a unit; `kind` is kept for writing it out."""
    checks = [BeforeValidator(_reader(kind))]
    if allowed is not None:
        checks.append(AfterValidator(allowed))  # type: ignore[arg-type]
    return Annotated[float, kind, *checks]


Number = Annotated[float, BeforeValidator(_number)]
PositiveNumber = Annotated[float, BeforeValidator(_number), AfterValidator(_positive)]
NonNegativeNumber = Annotated[float, BeforeValidator(_number), AfterValidator(_not_negative)]
Count = Annotated[int, BeforeValidator(_whole), AfterValidator(_positive)]
CountOrZero = Annotated[int, BeforeValidator(_whole), AfterValidator(_not_negative)]

Speed = _quantity(units.SPEED)
PositiveSpeed = _quantity(units.SPEED, _positive)
Weight = _quantity(units.FORCE, _not_negative)
Torque = _quantity(units.TORQUE)
Length = _quantity(units.LENGTH, _positive)
Diameter = _quantity(units.DIAMETER, _positive)
Bore = _quantity(units.DIAMETER, _not_negative)
Time = _quantity(units.TIME, _positive)
TimeOrZero = _quantity(units.TIME, _not_negative)
Rate = _quantity(units.RATE, _not_negative)
Inertia = _quantity(units.INERTIA, _not_negative)
Density = _quantity(units.DENSITY, _positive)
Modulus = _quantity(units.MODULUS, _positive)
PolarMoment = _quantity(units.POLAR_MOMENT, _positive)
Stiffness = _quantity(units.STIFFNESS, _positive)
Damping = _quantity(units.DAMPING, _not_negative)
Drag = _quantity(units.DRAG, _not_negative)
Slowness = _quantity(units.SLOWNESS, _not_negative)
ProportionalGain = _quantity(units.PROPORTIONAL_GAIN)
IntegralGain = _quantity(units.INTEGRAL_GAIN)
