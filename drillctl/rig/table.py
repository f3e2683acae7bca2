"""Field types of the design tables: what is read with a unit, and the ranges allowed.

What every table of a design file is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Union, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from drillctl import units
from drillctl.errors import InputError, shown
from drillctl.text import LONGEST_NAME, one_line
from drillctl.units import Kind

LARGEST_COUNT = 10**9  # of anything that is counted: what is larger is a slip of the pen
FAR, NEAR = 1e9, 1e-9  # beyond any number without a unit, and below any that is not zero
SHORTEST_LAG = 1e-4
"""Shortest time constant (s) but for none: less would cost the solvers much and change nothing."""
SHORTEST_PERIOD = 1e-3  # shortest sampling period (s) but for none


@dataclass(frozen=True)
class Range:
    """What a key takes: of the signs that make sense, a thousand times beyond any rig."""

    least: float  # SI
    most: float
    zero: bool = False  # whether 0 is allowed beside them

    def refusal(self, si: float, kind: Kind | None) -> str:
        """Why a number (SI) is not allowed; empty if it is."""
        if self.least <= si <= self.most or (self.zero and si == 0.0):
            return ""
        if si <= 0.0 <= self.least:
            nought = self.zero or self.least == 0.0
            return "it must be 0 or more" if nought else "it must be greater than 0"
        if self.most == 0.0 < si:
            return "it must be 0 or less"
        if si < self.least:
            return f"it must be {'0 or ' * self.zero}at least {_written(self.least, kind)}"
        return f"it must be at most {_written(self.most, kind)}"

    def text(self, kind: Kind | None) -> str:
        """Both ends, for the documents."""
        low, high = _written(self.least, kind), _written(self.most, kind)
        unit = f" {high.partition(' ')[2]}"
        if low.endswith(unit) or self.least == 0.0:
            low = low.partition(" ")[0]
        return f"{'0 or ' * self.zero}{low} to {high}"


def _written(value: float, kind: Kind | None) -> str:
    """A bound in the unit that makes it shortest."""
    text = f"{value:g}"
    if kind is not None:
        texts = [f"{value / units.factor(unit, kind):.6g} {unit}" for unit in kind.examples]
        text = min((t for t in texts if units.parse(t, kind) == value), key=len)
    return re.sub(r"e([+-])0*", lambda found: f"e{found[1].strip('+')}", text)


@dataclass(frozen=True)
class Reader:
    """Reads a number, with a unit if it is of a kind, and refuses what lies out of its range."""

    kind: Kind | None
    range: Range

    def __call__(self, value: Any) -> Any:
        """The number (SI)."""
        si = number(value) if self.kind is None else units.parse(value, self.kind)
        if not math.isfinite(si):
            raise InputError(f"{shown(value)} is not a finite {self.kind.name}")  # type: ignore[union-attr]
        return self._inside(si, value) + 0.0  # never -0.0: equal designs have equal hashes

    def _inside(self, si: Any, written: object) -> Any:
        refusal = self.range.refusal(si, self.kind)
        if refusal:
            raise InputError(f"{shown(written)} is not allowed: {refusal}")
        return si


class Counter(Reader):
    """Reads a whole number."""

    def __call__(self, value: Any) -> Any:
        """The number."""
        value = units.plain(value)
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int):
            raise InputError(f"{shown(value)} is not a whole number")
        return self._inside(value, value)


class Limiter(Reader):
    """Reads a limit: infinity, in whatever form it is written, is none."""

    def __call__(self, value: Any) -> Any:
        """The number (SI), or None."""
        value = units.plain(value)
        if value is None or (isinstance(value, float) and value == math.inf):
            return None
        first = value.strip().lower().partition(" ")[0] if isinstance(value, str) else ""
        return None if first.lstrip("-") in ("inf", "infinity") else super().__call__(value)


def number(value: object) -> float:
    """Read a number without unit; refused (`InputError`) unless it is finite."""
    value = units.plain(value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(f"{shown(value)} is not a number; write it without quotes or unit")
    try:
        si = float(value)
    except OverflowError:
        si = math.inf
    if not math.isfinite(si):
        raise InputError(f"{shown(value)} is not a finite number")
    return si + 0.0


def _any(most: float, kind: Kind | None = None) -> BeforeValidator:
    return BeforeValidator(Reader(kind, Range(-most, most)))


def _positive(least: float, most: float, kind: Kind | None = None) -> BeforeValidator:
    return BeforeValidator(Reader(kind, Range(least, most)))


def _not_negative(most: float, kind: Kind | None = None) -> BeforeValidator:
    return BeforeValidator(Reader(kind, Range(0.0, most)))


def _zero_or(least: float, most: float, kind: Kind) -> BeforeValidator:
    return BeforeValidator(Reader(kind, Range(least, most, zero=True)))


def _count(least: int) -> BeforeValidator:
    return BeforeValidator(Counter(None, Range(least, LARGEST_COUNT)))


def _limit(least: float, most: float, kind: Kind) -> BeforeValidator:
    return BeforeValidator(Limiter(kind, Range(least, most)))


def _partial(value: float) -> float:
    if not 0.0 < value < 1.0:
        raise InputError(f"must be more than 0 and less than 1, got {value:g}")
    return value


# A float with the `Kind` it is read and written by, and the range (SI) it must lie in. A positive
# number has a least one as well: it stands under a line somewhere.
Number = Annotated[float, _any(FAR)]
PositiveNumber = Annotated[float, _positive(NEAR, FAR)]
NonNegativeNumber = Annotated[float, _not_negative(FAR)]
Factor = Annotated[float, _positive(1e-6, 1e6)]
DampingRatio = Annotated[float, _not_negative(50.0)]
PoissonRatio = Annotated[float, BeforeValidator(Reader(None, Range(-1.0, 0.5)))]
MOST_FRICTION = 10.0
FrictionFactor = Annotated[float, _not_negative(MOST_FRICTION)]
Share = Annotated[float, _not_negative(1.0)]
PartialShare = Annotated[float, _not_negative(1.0), AfterValidator(_partial)]  # not 0, not 1
Spread = Annotated[float, _not_negative(10.0)]  # coefficient of variation
AlongWay = Annotated[float, _positive(1e-6, 1e8)]  # of depth, angle or time: m, rad or s
Arm = Annotated[float, _not_negative(1e3)]  # torque over weight on bit (m)
Decay = Annotated[float, _not_negative(1e4)]  # of a torque with speed (s/rad)
Count = Annotated[int, _count(1)]
Several = Annotated[int, _count(2)]  # from which a scatter follows
CountOrZero = Annotated[int, _count(0)]

SPRING = Range(1e-6, 1e13)  # stiffness (N m/rad) of a section
WHEEL = Range(1e-6, 1e10, zero=True)  # inertia (kg m2) of a section or a body
MOST_TORQUE = 1e9  # (N m)

Speed = Annotated[float, units.SPEED, _any(1e5, units.SPEED)]
PositiveSpeed = Annotated[float, units.SPEED, _positive(1e-9, 1e5, units.SPEED)]
Penetration = Annotated[float, units.VELOCITY, _positive(1e-9, 1.0, units.VELOCITY)]
SpeedOrZero = Annotated[float, units.SPEED, _not_negative(1e5, units.SPEED)]
Weight = Annotated[float, units.FORCE, _not_negative(1e9, units.FORCE)]
PositiveWeight = Annotated[float, units.FORCE, _positive(1e-3, 1e9, units.FORCE)]
Torque = Annotated[float, units.TORQUE, _any(MOST_TORQUE, units.TORQUE)]
TorqueOrZero = Annotated[float, units.TORQUE, _not_negative(MOST_TORQUE, units.TORQUE)]
Length = Annotated[float, units.LENGTH, _positive(1e-4, 1e8, units.LENGTH)]
ShortLength = Annotated[float, units.SHORT_LENGTH, _positive(1e-6, 10.0, units.SHORT_LENGTH)]
Diameter = Annotated[float, units.DIAMETER, _positive(1e-5, 1e3, units.DIAMETER)]
Bore = Annotated[float, units.DIAMETER, _not_negative(1e3, units.DIAMETER)]
Depth = Annotated[float, units.LENGTH, _not_negative(1e8, units.LENGTH)]
Angle = Annotated[float, units.ANGLE, _any(10.0, units.ANGLE)]
Velocity = Annotated[float, units.VELOCITY, _any(1e3, units.VELOCITY)]
LinearMass = Annotated[float, units.LINEAR_MASS, _positive(1e-3, 1e6, units.LINEAR_MASS)]
Duration = Annotated[float, units.TIME, _positive(1e-3, 1e6, units.TIME)]
Time = Annotated[float, units.TIME, _positive(1e-6, 1e6, units.TIME)]
TimeOrZero = Annotated[float, units.TIME, _not_negative(1e6, units.TIME)]
Lag = Annotated[float, units.TIME, _zero_or(SHORTEST_LAG, 1e6, units.TIME)]
SamplingPeriod = Annotated[float, units.TIME, _zero_or(SHORTEST_PERIOD, 1e6, units.TIME)]
Rate = Annotated[float, units.RATE, _not_negative(1e6, units.RATE)]
Inertia = Annotated[float, units.INERTIA, BeforeValidator(Reader(units.INERTIA, WHEEL))]
Mass = Annotated[float, units.MASS, _positive(1e-3, 1e9, units.MASS)]
MassOrZero = Annotated[float, units.MASS, _not_negative(1e9, units.MASS)]
AxialDamping = Annotated[float, units.AXIAL_DAMPING, _not_negative(1e9, units.AXIAL_DAMPING)]
Density = Annotated[float, units.DENSITY, _positive(1e-2, 1e7, units.DENSITY)]
MudDensity = Annotated[float, units.MUD, _positive(1e-2, 1e7, units.MUD)]
Viscosity = Annotated[float, units.VISCOSITY, _positive(1e-9, 1e6, units.VISCOSITY)]
Modulus = Annotated[float, units.MODULUS, _positive(1e3, 1e15, units.MODULUS)]
PolarMoment = Annotated[float, units.POLAR_MOMENT, _positive(1e-15, 1e3, units.POLAR_MOMENT)]
Stiffness = Annotated[float, units.STIFFNESS, BeforeValidator(Reader(units.STIFFNESS, SPRING))]
Damping = Annotated[float, units.DAMPING, _not_negative(1e6, units.DAMPING)]
Drag = Annotated[float, units.DRAG, _not_negative(1e5, units.DRAG)]
Slowness = Annotated[float, units.SLOWNESS, _not_negative(1e6, units.SLOWNESS)]
WeightGain = Annotated[float, units.WEIGHT_GAIN, _not_negative(1e9, units.WEIGHT_GAIN)]
MOST_GAIN = 1e8  # (N m s/rad, N m/rad)
ProportionalGain = Annotated[
    float, units.PROPORTIONAL_GAIN, _any(MOST_GAIN, units.PROPORTIONAL_GAIN)
]
IntegralGain = Annotated[float, units.INTEGRAL_GAIN, _any(MOST_GAIN, units.INTEGRAL_GAIN)]
PositiveProportionalGain = Annotated[
    float, units.PROPORTIONAL_GAIN, _positive(1e-6, MOST_GAIN, units.PROPORTIONAL_GAIN)
]
PositiveIntegralGain = Annotated[
    float, units.INTEGRAL_GAIN, _positive(1e-6, MOST_GAIN, units.INTEGRAL_GAIN)
]

# Limits: None where there is none.
TorqueLimit = Annotated[float | None, units.TORQUE, _limit(1e-3, 1e15, units.TORQUE)]
LeastTorque = Annotated[float | None, units.TORQUE, _limit(-1e15, 0.0, units.TORQUE)]
SpeedLimit = Annotated[float | None, units.SPEED, _limit(1e-9, 1e15, units.SPEED)]
PowerLimit = Annotated[float | None, units.POWER, _limit(1e-3, 1e15, units.POWER)]
TorqueRateLimit = Annotated[float | None, units.TORQUE_RATE, _limit(1e-3, 1e15, units.TORQUE_RATE)]
WeightRateLimit = Annotated[float | None, units.FORCE_RATE, _limit(1e-3, 1e15, units.FORCE_RATE)]


def _name(text: str) -> str:
    if not text.strip():
        raise InputError("a name must hold more than blanks")
    if len(text) > LONGEST_NAME:
        raise InputError(f"a name has at most {LONGEST_NAME} characters, this one {len(text)}")
    if one_line(text) != text:
        raise InputError(f"'{one_line(text)}': a name is of one line, without tabs")
    return text


Name = Annotated[str, AfterValidator(_name)]


class Table(BaseModel):
    """A table of a design: unknown keys refused, frozen when made."""

    # A table inside another is never validated alone: half of the validators need not be built.
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    def kind_by_key(self, key: str) -> Kind | None:
        """What a number measures whose unit follows from another key; None for all others."""
        return None

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
    value = units.plain(value)
    return value if isinstance(value, str) else number(value)
