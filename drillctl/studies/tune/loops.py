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
weight are closed by functions that take numbers, arrays or pairs of symbols alike. At given gains
loops have slope margins, and miss requirements by so much.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array, ComplexArray, Index
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import BitSide, Ends, WeightPath, ends_of, telling_grid, weight_path
from drillctl.linear.loop_analysis import ROUNDING
from drillctl.linear.loop_margins import TURNS, pole_grid
from drillctl.linear.loop_model import loop_poles, model_poles
from drillctl.linear.operating_point import at_speed
from drillctl.rig.drillstring.frequencies import natural_frequencies
from drillctl.rig.weight_on_bit import FollowingSpeed, ObservedWeight, RealWeight
from drillctl.studies.tune.settings import TuneConstraintsTable
from drillctl.studies.tune.tuned import (
    WEIGHT_KEYS,
    StringNumbers,
    Tuned,
    by_path,
    controller_paths,
    drive_numbers,
    middle,
    put,
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
    inertia = ends.parts.top_inertia + ends.parts.bit_inertia
    resistor = first.impedance or math.sqrt(first.stiffness * inertia)
    seen = ends.mobility(s, top=resistor + 0.0 * s, bit=resistor + 0.0 * s)
    t, h, x = seen.top, seen.bit, seen.transfer
    d = t * h - x**2
    alpha = (1.0 - resistor * (t + h) + resistor**2 * d) / x
    return Chain(alpha, (t - resistor * d) / x, (h - resistor * d) / x, d / x)


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
        law: Any = self.design.linear_drive
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
        path = side.path
        if delay is not None:
            held = 0.5 * float(getattr(self.design.weight_on_bit, "period", 0.0))  # a reading's age
            path = replace(path, delay=delay + held)
        return replace(path, gain=side.torque * gain).feedback(s).bit + 0.0 * s


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
        key = (design.sliding_string.parts, design.tables.controller.model_dump_json(), side)
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
    parts = design.sliding_string.parts
    if parts not in strings:
        ends = ends_of(design.sliding_string)
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


PEAKS = 6  # peaks of a sensitivity, and delays, that are kept: the worst


class Peak(NamedTuple):
    """A peak of the sensitivity: its angular frequency (rad/s) and height."""

    omega: float
    height: float


class Late(NamedTuple):
    """A delay (s) of the drive at which poles lie on the axis, and their frequency (rad/s)."""

    omega: float
    delay: float


@dataclass(frozen=True, eq=False)
class LoopState:
    """One loop at given gains."""

    loop: Loop  # which
    crossings: list[Crossing]  # the lowest, by rising slope
    stable: bool  # whether it is stable without slope
    # of the first modes (1/s), upper half plane; asked for where damping is required
    poles: ComplexArray = field(default_factory=lambda: np.empty(0, dtype=complex))
    # highest ones; asked for where the sensitivity is limited
    peaks: list[Peak] = field(default_factory=list)
    # the shortest that the loop does not bear; asked for where one is required
    delays: list[Late] = field(default_factory=list)

    @property
    def margin(self) -> float:
        """Slope margin (N m s/rad); NaN for a loop that is not stable without slope."""
        return slope_margin_of(self.crossings) if self.stable else math.nan

    @property
    def excess(self) -> float:
        """Slope margin less the slope of the rock (N m s/rad)."""
        return self.margin - self.loop.slope if self.stable else -math.inf

    @property
    def damping(self) -> float:
        """Least damping ratio of its first modes; 1 where none is a pair."""
        return float(np.min(-self.poles.real / np.abs(self.poles), initial=1.0))

    @property
    def peak(self) -> float:
        """Largest sensitivity; at least 1."""
        return max([1.0, *(p.height for p in self.peaks)])


@dataclass(frozen=True, eq=False)
class Loops:
    """What gains must hold for, and what is asked of them."""

    tuned: tuple[Tuned, ...]  # what is tuned
    loops: list[Loop]  # their slope margin is what counts
    asked: TuneConstraintsTable  # requirements

    @property
    def scale(self) -> float:
        """What slopes are measured in (N m s/rad)."""
        return max(max(abs(loop.slope) for loop in self.loops), 1.0)

    @property
    def needs_stability(self) -> bool:
        """Whether something is asked that an unstable loop does not have."""
        asked = (self.asked.peak_sensitivity, self.asked.damping_ratio, self.asked.delay)
        return any(one is not None for one in asked)

    def at(self, values: Array) -> LoopsState:
        """All loops at values (SI), shape (parameters,)."""
        named = by_path(self.tuned, values)
        return LoopsState(self, values, [self._state(x, values, named) for x in self.loops])

    def _stable(self, loop: Loop, values: Array) -> bool:
        """Whether a loop is stable without slope; ideal gains only take energy."""
        if loop.design.simple_drive and (loop.weight is None or loop.design.simple_loop):
            return True
        poles = self._poles(loop, put(loop.design, self.tuned, values), 0.0)
        return bool(poles.real.max() < ROUNDING * np.abs(poles).max())

    def _state(self, loop: Loop, values: Array, named: Mapping[str, float]) -> LoopState:
        result = crossings_of(loop, named)
        stable = self._stable(loop, values)
        if not (self.needs_stability and stable):
            return LoopState(loop, result, stable)
        variant = put(loop.design, self.tuned, values)
        if variant.simple_drive and loop.weight is None:
            poles = loop_poles(variant.sliding_string, *variant.linear_drive.gains(), loop.slope)
        else:
            poles = self._poles(loop, variant, loop.slope)
        asked, omega = self.asked, pole_grid(loop.ends, poles)
        first = self._first(loop, poles) if asked.damping_ratio is not None else poles[:0]
        peaks = _peaks(loop, named, omega) if asked.peak_sensitivity is not None else []
        delays = _delays(loop, named, omega) if asked.delay is not None else []
        return LoopState(loop, result, stable, first, peaks, delays)

    def _poles(self, loop: Loop, variant: Design, slope: float) -> ComplexArray:
        """Poles of a loop with a slope of the rock (1/s)."""
        path = None if loop.weight is None else weight_path(variant, variant.speed)
        return model_poles(variant, BitSide(slope, path))

    def _first(self, loop: Loop, poles: ComplexArray) -> ComplexArray:
        """Poles of the drive's mode and the first elastic ones, the upper of each pair."""
        count = self.asked.modes
        held = natural_frequencies(loop.ends.parts, "finite-elements", count + 1, top_held=True)
        limit = math.sqrt(held[count - 1] * held[count]) if len(held) > count else math.inf
        return poles[(poles.imag > 0.0) & (np.abs(poles) < limit)]


@dataclass(frozen=True, eq=False)
class LoopsState:
    """All loops at given gains."""

    problem: Loops  # what is asked
    values: Array  # shape (parameters,): Tuned values (SI)
    loops: list[LoopState]  # as in `Loops`

    @property
    def excess(self) -> float:
        """Least slope margin less slope (N m s/rad)."""
        return min(state.excess for state in self.loops)

    @property
    def violations(self) -> dict[str, float]:
        """How far each requirement is missed, in its own scale; what is kept is not listed."""
        asked, scale = self.problem.asked, self.problem.scale
        results = {}
        if asked.slope_reserve is not None:
            results["slope_reserve"] = (asked.slope_reserve - self.excess) / scale
        elif self.problem.needs_stability:
            results["slope"] = -self.excess / scale
        if asked.peak_sensitivity is not None:
            peak = max(state.peak for state in self.loops)
            results["peak_sensitivity"] = peak / asked.peak_sensitivity - 1.0
        if asked.damping_ratio is not None:
            results["damping_ratio"] = asked.damping_ratio - min(s.damping for s in self.loops)
        if asked.delay is not None:
            borne = min([asked.delay, *(d.delay for state in self.loops for d in state.delays)])
            results["delay"] = 1.0 - borne / asked.delay
        return {key: value for key, value in results.items() if value > 0.0}

    @property
    def violation(self) -> float:
        """The largest of them; 0 if all is kept."""
        return max(self.violations.values(), default=0.0)


def _sides(loop: Loop, values: Mapping[str, float], omega: Array) -> tuple[Any, Any]:
    """Impedances of string, with the rock, and drive at the top, over a common factor."""
    s = 1j * omega
    known = chain(loop.ends, s)
    rock = loop.rock(values, s) - loop.slope
    below = known.beta + rock * known.delta
    return known.alpha + rock * known.gamma, loop.drive(values, s) * below


def _peaks(loop: Loop, values: Mapping[str, float], omega: Array) -> list[Peak]:
    """The highest peaks of the sensitivity at the top torque, on frequencies that resolve poles."""
    string, drive = _sides(loop, values, omega)
    height = np.abs(string / (string + drive))
    top = 1 + np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:]))
    best = top[np.argsort(-height[top])][:PEAKS]
    return [Peak(float(omega[k]), float(height[k])) for k in best]


def _delays(loop: Loop, values: Mapping[str, float], grid: Array) -> list[Late]:
    """The shortest delays of the drive that the loop does not bear: where it crosses over."""
    from scipy.optimize import elementwise

    def ratio(omega: Array) -> Array:
        string, drive = _sides(loop, values, omega)
        return np.asarray(np.log(np.abs(drive / string)))

    with np.errstate(divide="ignore"):
        over = ratio(grid) > 0.0
        place = np.flatnonzero(over[1:] != over[:-1])
        if len(place) == 0:
            return []
        omega = elementwise.find_root(ratio, (grid[place], grid[place + 1])).x
    string, drive = _sides(loop, values, omega)
    delay = np.mod(np.angle(drive / string) + math.pi, 2.0 * math.pi) / omega
    return [Late(float(omega[k]), float(delay[k])) for k in np.argsort(delay)[:PEAKS]]
