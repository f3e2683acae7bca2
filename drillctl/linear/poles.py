"""Poles of a string and the shapes that go with them, in coordinates of its undamped modes.

In modal coordinates q the string is q'' + D q' + w^2 q = 0 with D = Phi^T C Phi. Where D is
diagonal each mode is a quadratic with roots in closed form; else the first-order matrix in
(w q, q') is solved, in which all entries are of the size of frequencies.

Natural frequencies of a string of lines, none missed (after Wittrick & Williams 1971).

Walk down the string with the dynamic stiffness of all that lies above. How often it passes
through infinity is how many natural frequencies lie under the one looked at, were the string held
there; where the end is free, one more if the stiffness there is negative. Along a line the
stiffness is a tangent whose angle falls by the phase of the wave, so that nothing is lost near
its poles. Bisection on that count finds each frequency, however close to the next, at any number
of elements and for the continuum alike. Losses are left out: these are undamped frequencies.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from drillctl.linear.transmission import Model, element_stiffness
from drillctl.rig.drillstring import Drillstring, Parts, Section

Array = NDArray[np.float64]
Shape = NDArray[np.complex128]

DIAGONAL = 1e-10
"""Largest off-diagonal entry of a modal damping matrix taken as rounding, over the largest."""


class Pole(NamedTuple):
    """One pole in the upper half plane, the real axis included."""

    value: complex  # of the pole (rad/s)
    shape: Shape  # shape (nodes,): Angles of the nodes, to a complex factor


def free_free_poles(string: Drillstring) -> list[Pole]:
    """Poles of the string with both ends free, by magnitude; the rigid body is the first."""
    frequency, shapes = string.undamped_modes
    damping = shapes.T @ (string.damping @ shapes)
    rigid = Pole(0.0, shapes[:, 0].astype(complex))
    braked = bool(string.ground_damping.any())
    kept = slice(0 if braked else 1, None)
    found = _poles(frequency[kept], damping[kept, kept], shapes[:, kept])
    return [rigid, *sorted(found, key=_size)]


def fixed_top_poles(string: Drillstring) -> list[Pole]:
    """Poles of the string with the top drive held, by magnitude."""
    from threadpoolctl import threadpool_limits

    # One BLAS thread, since another count gives other bits.
    with threadpool_limits(limits=1, user_api="blas"):
        squares, below = scipy.linalg.eigh(
            string.stiffness.toarray()[1:, 1:], string.mass.toarray()[1:, 1:]
        )
    shapes = np.vstack([np.zeros(len(squares)), below])
    damping = shapes.T @ (string.damping @ shapes)
    return sorted(_poles(np.sqrt(squares), damping, shapes), key=_size)


def _size(pole: Pole) -> float:
    return abs(pole.value)


def _poles(frequency: Array, damping: Array, shapes: Array) -> list[Pole]:
    """Poles of q'' + D q' + w^2 q = 0; of a mode with w = 0 that of its speed alone."""
    # Which modes a damping matrix couples depends on the boundary: it is asked here for each.
    off_diagonal = damping - np.diag(np.diagonal(damping))
    if np.all(np.abs(off_diagonal) <= DIAGONAL * np.abs(damping).max(initial=0.0)):
        return [
            Pole(value, shapes[:, i].astype(complex))
            for i, w in enumerate(frequency)
            for value in quadratic_poles(float(w), float(damping[i, i]))
        ]
    return _coupled_poles(frequency, damping, shapes)


def quadratic_poles(frequency: float, damping: float) -> list[complex]:
    """Roots of s^2 + damping s + frequency^2, of a conjugate pair the upper one."""
    half = damping / 2.0
    if half < frequency:
        return [complex(-half, math.sqrt((frequency - half) * (frequency + half)))]
    # The smaller root from the product of both: their difference would cancel.
    fast = half + math.sqrt((half - frequency) * (half + frequency))
    return (
        [complex(-fast)] if frequency == 0.0 else [complex(-fast), complex(-(frequency**2) / fast)]
    )


def _coupled_poles(frequency: Array, damping: Array, shapes: Array) -> list[Pole]:
    modes = len(frequency)
    elastic = np.flatnonzero(frequency)
    stiffness = np.zeros((len(elastic), modes))
    stiffness[np.arange(len(elastic)), elastic] = frequency[elastic]
    matrix = np.block(
        [[np.zeros((len(elastic), len(elastic))), stiffness], [-stiffness.T, -damping]]
    )
    values, vectors = scipy.linalg.eig(matrix)
    # The speeds of a pole, q' = s q, have the shape of its angles.
    return [
        Pole(complex(value), shapes @ vectors[len(elastic) :, i])
        for i, value in enumerate(values)
        if value.imag >= 0.0
    ]


Counts = NDArray[np.int64]

TINY = 1e-140
"""In place of a zero that is divided by."""
HELD = 1e250
"""Stiffness of an end that stands still (N m/rad)."""
BISECTIONS = 80
"""Halvings of a bracket: the last bit of a double."""


def natural_frequencies(
    parts: Parts, model: Model, count: int, top_held: bool = False, bit_held: bool = False
) -> Array:
    """Undamped natural frequencies, lowest first."""
    still = _Lossless(parts, model, top_held, bit_held)
    high = 1.0
    while still.below(np.array([high]))[0] < min(count, still.most):
        high *= 2.0
        if high > 1e12:  # a spring without inertia at both its ends has no more
            break
    found = min(count, int(still.below(np.array([high]))[0]))
    number = np.arange(found)
    lower, upper = np.zeros(found), np.full(found, high)
    for _ in range(BISECTIONS):
        middle = 0.5 * (lower + upper)
        under = still.below(middle) > number
        upper = np.where(under, middle, upper)
        lower = np.where(under, lower, middle)
    rigid = not (top_held or bit_held)
    return np.where(rigid & (number == 0), 0.0, upper)


class _Lossless:
    """Counts the natural frequencies of a string without its damping."""

    def __init__(self, parts: Parts, model: Model, top_held: bool, bit_held: bool) -> None:
        self.sections = [
            replace(x, coupling_damping=0.0, stiffness_damping=0.0, mass_damping=0.0, drag=0.0)
            for x in parts.sections
        ]
        self.model, self.mass = model, parts.mass
        self.top_inertia, self.bit_inertia = parts.top_inertia, parts.bit_inertia
        self.top_held, self.bit_held = top_held, bit_held
        nodes = 1 + sum(x.elements for x in self.sections) - top_held - bit_held
        self.most = 10**9 if model == "wave" and any(x.inertia for x in self.sections) else nodes

    def below(self, omega: Array) -> Counts:
        """Number of natural frequencies under each frequency (rad/s, more than zero).

        From the top down the dynamic stiffness S that everything above a point has (N m/rad),
        and how often it has passed through infinity on the way.
        """
        above = HELD if self.top_held else -(omega**2) * self.top_inertia
        stiffness = np.broadcast_to(np.asarray(above, dtype=float), omega.shape)
        passed = np.zeros(len(omega), dtype=np.int64)
        for section in self.sections:
            stiffness, more = self._through(section, omega, stiffness)
            passed += more
            stiffness = stiffness - omega**2 * section.end_inertia
        if self.bit_held:
            return passed
        return passed + (stiffness - omega**2 * self.bit_inertia < 0.0)

    def _through(self, section: Section, omega: Array, above: Array) -> tuple[Array, Counts]:
        """Stiffness below a section from that above it, and its passages through infinity."""
        if section.inertia == 0.0:
            spring = np.full(len(omega), section.stiffness)
            return _across(spring, spring, above)
        if self.model == "wave":
            return _travelled(omega * section.impedance, omega * section.travel_time, above)
        n = section.elements
        between, total = element_stiffness(section, 1j * omega, self.mass)
        square = (total / (2.0 * between)).real  # of the sine of half an element's phase
        half = np.arcsin(np.sqrt(np.minimum(square, 1.0)))
        scale = np.maximum(-between.real * np.sin(2.0 * half), TINY)
        stiffness, passed = _travelled(scale, 2.0 * n * half, above)
        beyond = np.flatnonzero(square >= 1.0)  # above the cut-off of a chain nothing travels
        fast = 2.0 * np.arccosh(np.sqrt(square[beyond]))
        scale = np.maximum(-between.real[beyond] * np.sinh(fast), TINY)
        grown = np.clip(n * fast, 1e-12, 300.0)
        own, link = -scale / np.tanh(grown), scale / np.sinh(grown)
        stiffness[beyond], once = _across(own, link, above[beyond])
        passed[beyond] = n - 1 + once
        return stiffness, passed


def _travelled(scale: Array, phase: Array, above: Array) -> tuple[Array, Counts]:
    """Behind a line S = scale tan(angle), and on the way the angle falls by the phase."""
    angle = np.arctan2(above, scale) - phase
    turns = np.rint(angle / np.pi)
    return scale * np.tan(angle - np.pi * turns), -turns.astype(np.int64)


def _across(own: Array, link: Array, above: Array) -> tuple[Array, Counts]:
    """Behind a section with stiffness [[own, -link], [-link, own]] in which nothing travels."""
    pivot = above + own
    pivot = np.where(pivot == 0.0, TINY, pivot)
    return own - link * (link / pivot), (pivot < 0.0).astype(np.int64)
