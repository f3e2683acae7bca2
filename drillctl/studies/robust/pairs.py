"""Complex numbers as pairs of symbols: CasADi has no complex type, the laws' equations need one."""

from __future__ import annotations

from typing import Any


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
