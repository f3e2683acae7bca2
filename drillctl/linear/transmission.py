"""Sections as transmission lines: the same two numbers for finite elements and the continuum.

Seen from its ends a uniform section is given by its characteristic impedance Z and its
propagation G, both functions of frequency: an impedance z at one end appears at the other as
(z cosh G + Z sinh G) / (cosh G + z/Z sinh G). For the continuum, with K the stiffness of the
whole section and I its inertia (losses make both complex), Z = sqrt(K I) and G = i w sqrt(I/K).
A chain of n equal elements with dynamic stiffness [[a, b], [b, a]] is a line as well, with
cosh(G/n) = -a/b and i w Z = -b sinh(G/n): any number of elements costs as much as one, and no
matrix is solved. After Wittrick & Williams (1971) for the exact elements; the chain is the
discrete line of Brillouin (1946).

Impedances are torque over speed (N m s/rad), time goes with exp(i w t).

A string seen from its ends by solving M, C and K at each frequency.

The slowest of the three ways and the most direct: it takes any viscous damping, does not use
sections, and checks the other two.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.linalg

from drillctl.arrays import Array, ComplexArray
from drillctl.rig.drillstring import Drillstring, Parts, Section
from drillctl.rig.drillstring.frequencies import Model


class Line(NamedTuple):
    """One section at a number of frequencies; each array has their shape."""

    decay: ComplexArray  # exp(-G), of magnitude 1 or less
    series: ComplexArray  # Z (1 - exp(-2 G)) (N m s/rad)
    shunt: ComplexArray  # (1 - exp(-2 G)) / Z (rad/(N m s))

    def seen_through(self, end: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Impedance at one end that an impedance at the other gives, and speed over speed."""
        both = 1.0 + self.decay**2
        ratio = both + end * self.shunt
        return (end * both + self.series) / ratio, 2.0 * self.decay / ratio


def element_line(section: Section, s: ComplexArray, mass: Literal["consistent", "lumped"]) -> Line:
    """The chain of elements of a section at complex frequencies `s` (1/s)."""
    across, total = section.element_stiffness(s, mass)
    n = section.elements
    # cosh(G/n) - 1 = -(a + b)/b, written so that small angles keep their digits.
    half = np.arcsinh(np.sqrt(-total / (2.0 * across)))
    decay = np.exp(-2.0 * n * half)
    sinh = 2.0 * np.sinh(half) * np.cosh(half)
    fall = -np.expm1(-4.0 * n * half)
    impedance = -across * sinh / s
    # A massless spring has neither impedance nor propagation, but their ratio is 1 / sinh.
    with np.errstate(invalid="ignore", divide="ignore"):
        shunt = np.where(sinh == 0.0, 2.0 * n * s / -across, fall / impedance)
    return Line(decay, impedance * fall, shunt)


def continuous_line(section: Section, s: ComplexArray) -> Line:
    """The continuum of a section at complex frequencies `s` (1/s); a lumped spring as it is."""
    if section.inertia == 0.0 and section.drag == 0.0:
        return element_line(section, s, "lumped")
    spring, shunt = section.spring(s), section.shunt(s)
    propagation = np.sqrt(s * shunt / spring)
    impedance = propagation * spring / s
    fall = -np.expm1(-2.0 * propagation)
    return Line(np.exp(-propagation), impedance * fall, fall / impedance)


def _lump(section: Section, s: ComplexArray) -> ComplexArray:
    """Impedance of inertia and damper at the lower end of a section (N m s/rad)."""
    return (s + section.mass_damping) * section.end_inertia + section.end_drag


class EndMobility(NamedTuple):
    """Speeds at the two ends per torque, and the torque that the pipe carries at its top."""

    # speed of an end per forward torque on it (rad/s per N m)
    top: ComplexArray
    bit: ComplexArray
    transfer: ComplexArray  # speed of either end per forward torque on the other (rad/s per N m)
    # pipe torque, positive when the top leads, per torque on either end (1)
    pipe_from_top: ComplexArray
    pipe_from_bit: ComplexArray


@dataclass(frozen=True)
class Lines:
    """A string as transmission lines between inertias."""

    parts: Parts  # sections and ends; modal damping has no place in a line and must be zero
    # {'finite-elements', 'wave'}: Whether a section is its chain of elements, or the continuum
    model: Model

    def mobility(
        self, s: ComplexArray, top: ComplexArray | complex = 0.0, bit: ComplexArray | complex = 0.0
    ) -> EndMobility:
        """Response to torques on the two ends."""
        s = np.asarray(s, dtype=complex)
        above, below = self._ends(s, top, bit)
        down, transfer = self._from_bit(s, below)
        top_mobility = 1.0 / (above + down)
        across = transfer * top_mobility
        near, far = self._pipe_torque(s, down, above)
        return EndMobility(
            top=top_mobility,
            bit=1.0 / (self._from_top(s, above) + below),
            transfer=across,
            pipe_from_top=near * top_mobility,
            pipe_from_bit=far * across,
        )

    def bit_impedance(self, s: ComplexArray, top: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the bit (N m s/rad), with `top` added at the drive."""
        above, below = self._ends(s, top, 0.0)
        return self._from_top(s, above) + below

    def top_impedance(self, s: ComplexArray, bit: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the top (N m s/rad), with `bit` added at the rock."""
        above, below = self._ends(s, 0.0, bit)
        return above + self._from_bit(s, below)[0]

    def _ends(
        self, s: ComplexArray, top: ComplexArray | complex, bit: ComplexArray | complex
    ) -> tuple[ComplexArray, ComplexArray]:
        """Impedance of drive and of BHA with what is added to them."""
        above = s * self.parts.top_inertia + self.parts.top_damping + top
        below = s * self.parts.bit_inertia + self.parts.bit_damping + bit
        return above, below

    def _from_top(self, s: ComplexArray, above: ComplexArray) -> ComplexArray:
        """Impedance of everything above the BHA, looking up."""
        for section in self.parts.sections:
            above = self._line(section, s).seen_through(above)[0] + _lump(section, s)
        return above

    def _from_bit(self, s: ComplexArray, below: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Impedance of everything under the drive, looking down; bit speed over top speed."""
        transfer = np.ones_like(s)
        for section in reversed(self.parts.sections):
            below, share = self._line(section, s).seen_through(below + _lump(section, s))
            transfer = transfer * share
        return below, transfer

    def _line(self, section: Section, s: ComplexArray) -> Line:
        if self.model == "wave":
            return continuous_line(section, s)
        return element_line(section, s, self.parts.mass)

    def _pipe_torque(
        self, s: ComplexArray, down: ComplexArray, above: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Pipe torque per top speed, for a torque on the top and for one on the bit.

        Of the continuum at the very top; of finite elements what spring and damper of the
        first element carry, which is the torque at its middle.
        """
        if self.model == "wave":
            return down, -above
        section = self.parts.sections[0]
        across, total = section.element_stiffness(s, self.parts.mass)
        spring = section.elements * section.spring(s)

        def carried(into: ComplexArray) -> ComplexArray:
            # into = (a u0 + b u1) / v0 with u0 = v0 / s; wanted is spring (u0 - u1) / v0.
            return spring * (total / s - into) / across

        return carried(down), carried(-above)


class FromMobility:
    """A string whose impedances follow from its mobility."""

    string: Drillstring

    @property
    def parts(self) -> Parts:
        """Sections and ends."""
        return self.string.parts

    def mobility(
        self, s: ComplexArray, top: ComplexArray | complex = 0.0, bit: ComplexArray | complex = 0.0
    ) -> EndMobility:
        """Response to torques on the two ends; see `Lines.mobility`."""
        raise NotImplementedError

    def bit_impedance(self, s: ComplexArray, top: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the bit (N m s/rad), with `top` added at the drive."""
        return 1.0 / self.mobility(s, top=top).bit

    def top_impedance(self, s: ComplexArray, bit: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the top (N m s/rad), with `bit` added at the rock."""
        return 1.0 / self.mobility(s, bit=bit).top


class Banded(FromMobility):
    """Mobility of a finite-element string from its matrices."""

    def __init__(self, string: Drillstring) -> None:
        self.string = string
        # Only neighbours are coupled, unless damping is given mode by mode.
        self.tridiagonal = string.parts.modal_damping == 0.0
        self._forces = np.zeros((string.nodes, 2))
        self._forces[0, 0] = self._forces[-1, 1] = 1.0
        matrices = (string.mass, string.damping, string.stiffness)
        shape = _bands if self.tridiagonal else _dense
        self._m, self._c, self._k = (shape(x) for x in matrices)

    def mobility(
        self, s: ComplexArray, top: ComplexArray | complex = 0.0, bit: ComplexArray | complex = 0.0
    ) -> EndMobility:
        """Response to torques on the two ends; see `transmission.Lines.mobility`."""
        s = np.asarray(s, dtype=complex)
        at = s.ravel()
        ends = np.broadcast_arrays(at, np.ravel(top), np.ravel(bit))[1:]
        solve = self._tridiagonal if self.tridiagonal else self._dense
        angle = np.array([solve(x, a, b) for x, a, b in zip(at, *ends, strict=True)])
        speed = (at[:, None, None] * angle).reshape(*s.shape, 3, 2)
        first = self.string.element_stiffness[0] + s * self.string.element_damping[0]
        pipe = (first / s)[..., None] * (speed[..., 0, :] - speed[..., 1, :])
        return EndMobility(
            top=speed[..., 0, 0],
            bit=speed[..., 2, 1],
            transfer=speed[..., 2, 0],
            pipe_from_top=pipe[..., 0],
            pipe_from_bit=pipe[..., 1],
        )

    def _tridiagonal(self, s: complex, top: complex, bit: complex) -> ComplexArray:
        """Angles of nodes 0, 1 and last (rad) per torque on first and last (N m)."""
        bands = self._k + s * (self._c + s * self._m)
        bands[1, 0] += s * top
        bands[1, -1] += s * bit
        angles = scipy.linalg.solve_banded((1, 1), bands, self._forces, overwrite_ab=True)
        return np.asarray(angles[[0, 1, -1]])

    def _dense(self, s: complex, top: complex, bit: complex) -> ComplexArray:
        matrix = self._k + s * (self._c + s * self._m)
        matrix[0, 0] += s * top
        matrix[-1, -1] += s * bit
        return np.asarray(np.linalg.solve(matrix, self._forces)[[0, 1, -1]])


def _dense(matrix: Any) -> Array:
    return np.asarray(matrix.toarray())


def _bands(matrix: Any) -> Array:
    """A tridiagonal matrix in the storage of `scipy.linalg.solve_banded`."""
    bands = np.zeros((3, matrix.shape[0]))
    bands[0, 1:] = matrix.diagonal(1)
    bands[1] = matrix.diagonal()
    bands[2, :-1] = matrix.diagonal(-1)
    return bands
