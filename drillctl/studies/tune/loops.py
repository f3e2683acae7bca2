r"""Loops of a linear design; a string as data, on a frequency grid and near any one frequency.

With s the complex frequency, c the impedance of the drive and b that of the rock the string is

.. math:: Z_{bit} = \frac{\alpha + c\,\beta}{\gamma + c\,\delta}, \qquad
          Z_{top} = \frac{\alpha + b\,\gamma}{\beta + b\,\delta}, \qquad
          \text{poles at} \quad \alpha + c \beta + b\,(\gamma + c\,\delta) = 0

(the ends' own inertias and dampers in it). Of the mobilities t at the top, h at the bit, x across
and their determinant d: alpha = 1/x, beta = t/x, gamma = h/x, delta = d/x. Mobilities have poles
at every resonance; these four have none, whatever the damping, and change over the frequency
1 / travel time of the pipe. A few numbers on a circle about a frequency therefore give all of
them inside it to rounding, off the axis too: an NLP gets the string as data.

A loop, for which a linear design must hold, is a design at one realization, seen from its ends:
the string as data on a frequency grid, the slope of the rock, what a moving weight adds. Drive and
weight are closed by functions that take numbers, arrays or pairs of symbols alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array, ComplexArray, Index
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import Ends, WeightPath, ends_of, telling_grid, weight_path
from drillctl.linear.loop_margins import TURNS
from drillctl.linear.operating_point import at_speed
from drillctl.rig.weight_on_bit import FollowingSpeed, ObservedWeight, RealWeight
from drillctl.studies.tune.tuned import (
    WEIGHT_KEYS,
    StringNumbers,
    Tuned,
    controller_paths,
    drive_numbers,
    middle,
    string_numbers,
)

TERMS = 16  # terms of the power series within a circle
WITHIN = 0.6
"""Share of the circle's radius within which the series is used: 0.6^16 / 16! is under rounding."""


class Chain(NamedTuple):
    """Alpha, beta, gamma, delta of a string; N m s/rad, 1, 1, rad/(N m s)."""

    alpha: Any
    beta: Any
    gamma: Any
    delta: Any

    def bit(self, drive: Any) -> tuple[Any, Any]:
        """Numerator and denominator of the impedance at the bit, the drive closed."""
        return self.alpha + drive * self.beta, self.gamma + drive * self.delta

    def characteristic(self, drive: Any, rock: Any) -> Any:
        """Zero at the poles of the loop."""
        over, under = self.bit(drive)
        return over + rock * under


def chain(ends: Ends, s: ComplexArray) -> Chain:
    """Chain parameters of a string at complex frequencies `s` (1/s, not zero)."""
    # Between resistors at both ends no resonance is near; what they add is taken off again.
    first = ends.parts.sections[0]
    resistor = first.impedance or math.sqrt(first.stiffness * _inertia(ends))
    seen = ends.mobility(s, top=resistor + 0.0 * s, bit=resistor + 0.0 * s)
    t, h, x = seen.top, seen.bit, seen.transfer
    d = t * h - x**2
    alpha = (1.0 - resistor * (t + h) + resistor**2 * d) / x
    return Chain(alpha, (t - resistor * d) / x, (h - resistor * d) / x, d / x)


def _inertia(ends: Ends) -> float:
    return ends.parts.top_inertia + ends.parts.bit_inertia


class Grid(NamedTuple):
    """A string on a frequency grid."""

    omega: Array  # shape (frequencies,): rad/s, increasing
    chain: Chain  # of arrays of that shape


def grid_of(ends: Ends, apart: float = math.inf) -> Grid:
    """The string where every resonance is resolved."""
    omega = telling_grid(ends)
    if math.isfinite(apart):
        omega = np.union1d(omega, np.arange(apart, omega[-1], apart))
    return Grid(omega, chain(ends, 1j * omega))


class Circle(NamedTuple):
    """A string near one complex frequency: power series of its chain parameters."""

    centre: complex  # where (1/s)
    radius: float  # of the circle it was read on (1/s)
    terms: ComplexArray  # shape (4, TERMS): Coefficients over powers of (s - centre) / radius


def circles(ends: Ends, centres: ComplexArray) -> list[Circle]:
    """The string near complex frequencies (1/s, not zero), shape (places,)."""
    travel = sum(x.travel_time for x in ends.parts.sections if x.inertia > 0.0)
    widest = 1.0 / travel if travel > 0.0 else math.inf
    # The origin, where nothing turns, stays outside.
    radius = np.minimum(widest, 0.8 * np.abs(centres))
    turns = np.exp(2j * math.pi * (np.arange(TERMS) + 0.5) / TERMS)
    read = chain(ends, centres[:, None] + radius[:, None] * turns)
    powers = turns[:, None] ** -np.arange(TERMS) / TERMS
    terms = np.stack([np.asarray(part) @ powers for part in read], axis=1)
    return [Circle(complex(c), float(r), x) for c, r, x in zip(centres, radius, terms, strict=True)]


def chain_at(terms: tuple[Any, Any], u: Pair) -> Chain:
    """Chain parameters at centre + radius u, symbolically."""
    real, imaginary = terms
    values = []
    for row in range(4):
        total = pair(0.0)
        for k in reversed(range(TERMS)):
            total = total * u + Pair(real[row, k], imaginary[row, k])
        values.append(total)
    return Chain(*values)


class Pair:
    """A complex number whose real and imaginary part are numbers or CasADi symbols."""

    # Enough arithmetic for the laws' `impedance(s)` and for `np.exp`, so that the linear design
    # calls the very functions that the rest of the package calls with arrays.
    __array_priority__ = 2000  # numbers of NumPy leave the operation to this class

    def __init__(self, re: Any, im: Any = 0.0) -> None:
        self.re, self.im = re, im

    def __neg__(self) -> Pair:
        return Pair(-self.re, -self.im)

    def __add__(self, other: Any) -> Pair:
        o = pair(other)
        return Pair(self.re + o.re, self.im + o.im)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Pair:
        return self + (-pair(other))

    def __rsub__(self, other: Any) -> Pair:
        return pair(other) - self

    def __mul__(self, other: Any) -> Pair:
        o = pair(other)
        return Pair(self.re * o.re - self.im * o.im, self.re * o.im + self.im * o.re)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Pair:
        o = pair(other)
        return self * o.conjugate() * (1.0 / o.square)

    def __rtruediv__(self, other: Any) -> Pair:
        return pair(other) / self

    def conjugate(self) -> Pair:
        """The complex conjugate."""
        return Pair(self.re, -self.im)

    @property
    def square(self) -> Any:
        """The square of the magnitude."""
        return self.re * self.re + self.im * self.im

    def exp(self) -> Pair:
        """The exponential; `numpy.exp` of a pair comes here."""
        import casadi as ca

        size = ca.exp(self.re)
        return Pair(size * ca.cos(self.im), size * ca.sin(self.im))


def pair(value: Any) -> Pair:
    """A number, complex or real, or a symbol, as a pair."""
    if isinstance(value, Pair):
        return value
    if isinstance(value, complex):
        return Pair(value.real, value.imag)
    return Pair(value)


@dataclass(frozen=True, eq=False)
class WeightSide:
    """A weight on bit that follows the bit speed."""

    # torque of the rock per weight at constant speed (m)
    torque: Any  # these two may be symbols
    gain: Any  # K_w (N s/rad)
    path: WeightPath  # its lags


@dataclass(frozen=True, eq=False)
class Loop:
    """One loop that gains must hold for."""

    design: Design  # with the tuned parameters halfway, which gives laws their types
    ends: Ends  # its string
    grid: Grid  # the string on a frequency grid
    string: StringNumbers  # what drives are tuned to
    # falling slope of the rock at constant weight (N m s/rad)
    slope: Any  # may be a symbol
    weight: WeightSide | None  # of a weight that follows the bit speed

    def drive(self, values: Mapping[str, Any], s: Any) -> Any:
        """Impedance of the drive (N m s/rad) at `s`, with tuned values by path."""
        law: Any = self.design.top_drive
        numbers = drive_numbers(self.design, values, self.string)
        law = law._replace(**{k: v for k, v in numbers.items() if k in law._fields})
        return law.impedance(s)

    def rock(self, values: Mapping[str, Any], s: Any) -> Any:
        """What the moving weight adds to the impedance of the bit (N m s/rad)."""
        if self.weight is None:
            return 0.0 * s
        side = self.weight
        gain = values.get("weight_on_bit.gain", side.gain)
        delay = values.get("weight_on_bit.path.delay")
        path = side.path if delay is None else replace(side.path, delay=delay + _held(self.design))
        return replace(path, gain=side.torque * gain).feedback(s).bit + 0.0 * s


def _held(design: Design) -> float:
    """Mean age of a reading (s)."""
    return 0.5 * float(getattr(design.weight_on_bit, "period", 0.0))


def refuse_not_linear(design: Design, tuned: tuple[Tuned, ...]) -> None:
    """Refuse (`InputError`) what the linear loop does not depend on, or not in a known way."""
    law = design.tables.controller.law
    if law == "constant-torque":
        raise InputError("a constant torque has no loop that could be tuned", "controller.law")
    allowed = [*controller_paths(design)]
    if isinstance(design.weight_on_bit, (FollowingSpeed, RealWeight)):
        allowed += WEIGHT_KEYS
    for t in tuned:
        if t.path not in allowed:
            raise InputError(
                f"{t.path!r} is not tuned in the linear loop; allowed: {', '.join(allowed)}",
                "tune.parameters",
            )
    if isinstance(design.weight_on_bit, ObservedWeight):
        raise InputError(
            "the linear design takes a weight that follows the bit speed itself, not an observer",
            "weight_on_bit.law",
        )


def loops_of(designs: Iterable[Design], tuned: tuple[Tuned, ...]) -> list[Loop]:
    """Loops of a number of realizations of a design."""
    results: dict[tuple[Any, ...], Loop] = {}
    strings: dict[Any, tuple[Ends, Grid, StringNumbers]] = {}
    for design in designs:
        loop = _loop(middle(design, tuned), strings, tuned)
        side = None if loop.weight is None else (loop.weight.torque, loop.weight.path, loop.slope)
        key = (design.string.parts, design.tables.controller.model_dump_json(), side)
        if key not in results or results[key].slope < loop.slope:
            results[key] = loop
    return list(results.values())


def _loop(
    design: Design, strings: dict[Any, tuple[Ends, Grid, StringNumbers]], tuned: tuple[Tuned, ...]
) -> Loop:
    point = at_speed(design, design.speed)
    side, slope = _weight(design, point.slope)
    longest = max([t.high for t in tuned if t.path == WEIGHT_KEYS[1]], default=0.0)
    if side is not None:
        longest = max(longest, side.path.delay)
    parts = design.string.parts
    if parts not in strings:
        ends = ends_of(design.string)
        apart = 2.0 * math.pi / (TURNS * longest) if longest > 0.0 else math.inf
        strings[parts] = (ends, grid_of(ends, apart), string_numbers(design.string))
    return Loop(design, *strings[parts], slope, side)


def _weight(design: Design, slope: float) -> tuple[WeightSide | None, float]:
    """The side of the weight, and the slope of the rock at constant weight."""
    path = weight_path(design, design.speed)
    if path is None:
        return None, slope
    law: Any = design.weight_on_bit
    if law.moves:  # its part in the slope is the path's here
        slope += path.gain
    return WeightSide(path.gain / float(law.gain), float(law.gain), path), slope


KEPT = 16  # crossings of a loop that are refined at least: the lowest, as seen on the grid
ALIKE = 1.05
"""And all that are lowest but for this factor: high modes have margins of nearly one size."""


class Crossing(NamedTuple):
    """A slope at which poles of a loop reach the imaginary axis."""

    slope: float  # N m s/rad
    omega: float  # rad/s
    circle: Circle  # the string about it


class Seen(NamedTuple):
    """Crossings as a grid shows them: places before them, frequencies and slopes."""

    place: Index
    omega: Array
    slope: Array


def seen_on_grid(loop: Loop, values: Mapping[str, float]) -> Seen:
    """All crossings of a loop, to the resolution of its grid."""
    omega, chain = loop.grid
    s = 1j * omega
    over, under = chain.bit(loop.drive(values, s))
    # Times the square of the denominator: no poles, and zero only where the impedance is real.
    size = np.abs(under) ** 2
    product = over * under.conj() + loop.rock(values, s) * size
    signs = product.imag > 0.0
    place = np.flatnonzero(signs[1:] != signs[:-1])
    left, right = product.imag[place], product.imag[place + 1]
    share = left / (left - right)
    at = omega[place] + share * (omega[place + 1] - omega[place])
    real = product.real[place] + share * (product.real[place + 1] - product.real[place])
    level = real / (size[place] + share * (size[place + 1] - size[place]))
    return Seen(place, at, level)


def least_seen(loop: Loop, values: Mapping[str, float]) -> float:
    """Slope margin (N m s/rad) to the resolution of the grid; infinite if none crosses."""
    slope = seen_on_grid(loop, values).slope
    return float(np.min(slope[slope > 0.0], initial=np.inf))


def crossings_of(loop: Loop, values: Mapping[str, float]) -> list[Crossing]:
    """The lowest crossings of a loop, refined, by rising slope; negative ones too."""
    seen = seen_on_grid(loop, values)
    size = np.abs(seen.slope)
    order = np.argsort(size, kind="stable")
    alike = int((size <= ALIKE * np.min(size[seen.slope > 0.0], initial=np.inf)).sum())
    order = order[: max(KEPT, alike)]
    if len(seen.place) and (first := int(np.argmin(seen.omega))) not in order:
        order = np.append(order, first)  # high modes of one margin would crowd it out
    if len(order) == 0:
        return []
    around = circles(loop.ends, 1j * seen.omega[order])
    results = []
    for circle, place in zip(around, seen.place[order], strict=True):
        bracket = loop.grid.omega[place], loop.grid.omega[place + 1]
        omega = _refined(loop, values, circle, *bracket)
        results.append(Crossing(float(_impedance(loop, values, circle, omega).real), omega, circle))
    return sorted(results, key=lambda crossing: crossing.slope)


def _impedance(loop: Loop, values: Mapping[str, float], circle: Circle, omega: float) -> complex:
    u = (1j * omega - circle.centre) / circle.radius
    a, b, c, d = (np.polynomial.polynomial.polyval(u, row) for row in circle.terms)
    s = np.array([1j * omega])
    drive = complex(loop.drive(values, s)[0])
    rock = complex(loop.rock(values, s)[0])
    return complex((a + drive * b) / (c + drive * d) + rock)


def _refined(
    loop: Loop, values: Mapping[str, float], circle: Circle, low: float, high: float
) -> float:
    """The frequency within a bracket at which the impedance is real."""
    from scipy.optimize import brentq

    reach = WITHIN * circle.radius
    low, high = max(low, circle.centre.imag - reach), min(high, circle.centre.imag + reach)

    def reactance(omega: float) -> float:
        return _impedance(loop, values, circle, omega).imag

    if reactance(low) * reactance(high) > 0.0:  # within rounding of an end of the bracket
        return min(low, high, key=lambda omega: abs(reactance(omega)))
    return float(brentq(reactance, low, high, xtol=1e-14, rtol=1e-14))


def slope_margin_of(crossings: list[Crossing]) -> float:
    """The least positive slope (N m s/rad); infinite if there is none."""
    return min((c.slope for c in crossings if c.slope > 0.0), default=float("inf"))
