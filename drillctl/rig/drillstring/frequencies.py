"""Natural frequencies of a string of lines, none missed (after Wittrick & Williams 1971).

Walk down the string with the dynamic stiffness of all that lies above. How often it passes
through infinity is how many natural frequencies lie below a given one with the string held
there; where the end is free, one more if the stiffness there is negative. Along a line the
stiffness is a tangent whose angle falls by the phase of the wave, so that nothing is lost near
its poles. Bisection on that count finds each frequency, however close to the next, at any number
of elements and for the continuum alike. Losses are left out: these are undamped frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drillctl.rig.drillstring.section import Parts, Section

Array = NDArray[np.float64]
Model = Literal["finite-elements", "wave"]
"""How a section is described: by its elements, or as the continuum they stand for."""
Counts = NDArray[np.int64]

TINY = 1e-140  # in place of a zero that is divided by
HELD = 1e250  # stiffness of an end that stands still (N m/rad)
BISECTIONS = 80  # halvings of a bracket: the last bit of a double
FOLLOWED = 1.0  # phase of a wave from node to node (rad): a frequency is 4 % too high there


def followed(parts: Parts) -> float:
    """Highest angular frequency (rad/s) that the elements follow; infinite without a mesh."""
    longest = max(x.travel_time / x.elements for x in parts.sections)
    return math.inf if longest == 0.0 else FOLLOWED / longest


def natural_frequencies(
    parts: Parts,
    model: Model,
    count: int,
    top_held: bool = False,
    bit_held: bool = False,
    bisections: int = BISECTIONS,
) -> Array:
    """Undamped natural frequencies, lowest first."""
    still = _Lossless(parts, model, top_held, bit_held)
    high = 1.0
    while still.below(np.array([high]))[0] < min(count, still.most):
        high *= 2.0
        if high > 1e12:  # a spring without inertia at both its ends has no more
            break
    total = min(count, int(still.below(np.array([high]))[0]))
    number = np.arange(total)
    lower, upper = np.zeros(total), np.full(total, high)
    for _ in range(bisections):
        middle = 0.5 * (lower + upper)
        under = still.below(middle) > number
        upper = np.where(under, middle, upper)
        lower = np.where(under, lower, middle)
    rigid = not (top_held or bit_held)
    return np.where(rigid & (number == 0), 0.0, upper)


def frequency_counter(
    parts: Parts, model: Model, top_held: bool = False, bit_held: bool = False
) -> Callable[[Array], Counts]:
    """How many natural frequencies lie below each frequency (rad/s, more than zero)."""
    return _Lossless(parts, model, top_held, bit_held).below


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
        between, total = section.element_stiffness(1j * omega, self.mass)
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


@lru_cache(maxsize=16)  # thousands of draws of a rock share a string
def stick_slip_frequency(parts: Parts) -> float:
    """Lowest angular frequency with the top held (rad/s)."""
    return float(natural_frequencies(parts, "finite-elements", 1, top_held=True)[0])
