r"""A string as data: its chain parameters on a frequency grid, and near any one frequency.

With s the complex frequency, c the impedance of the drive and b that of the rock the string is

.. math:: Z_{bit} = \frac{\alpha + c\,\beta}{\gamma + c\,\delta}, \qquad
          Z_{top} = \frac{\alpha + b\,\gamma}{\beta + b\,\delta}, \qquad
          \text{poles at} \quad \alpha + c \beta + b\,(\gamma + c\,\delta) = 0

(the ends' own inertias and dampers in it). Of the mobilities t at the top, h at the bit, x across
and their determinant d: alpha = 1/x, beta = t/x, gamma = h/x, delta = d/x. Mobilities have poles
at every resonance; these four have none, whatever the damping, and change over the frequency
1 / travel time of the pipe. A few numbers on a circle about a frequency therefore tell all of
them inside it to rounding, off the axis too: an NLP gets the string as data.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.linear.ends import Ends, telling_grid

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]

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
    """The string where nothing of it goes unseen."""
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
    """A complex number whose real and imaginary part are numbers or CasADi symbols.

    Enough arithmetic for the laws' `impedance(s)` and for `np.exp`, so that the linear design
    calls the very functions that the rest of the package calls with arrays.
    """

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
