"""Natural frequencies of a string of lines, none missed (Wittrick & Williams 1971).

How many natural frequencies lie under a frequency is the number of those of the sections with
both their ends held, plus the number of negative pivots of the dynamic stiffness at the joints.
Bisection on that count finds each, however close to the next, at any number of elements and for
the continuum alike. All losses are left out: these are undamped frequencies.
"""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from drillctl.drillstring import Parts, Section
from drillctl.linear.transmission import Model, continuous_line, element_line, element_stiffness

Array = NDArray[np.float64]
Counts = NDArray[np.int64]

BISECTIONS = 80
"""Halvings of a bracket: the last bit of a double."""


def natural_frequencies(
    parts: Parts, model: Model, count: int, top_held: bool = False, bit_held: bool = False
) -> Array:
    """Undamped natural frequencies, lowest first.

    Parameters
    ----------
    parts : Parts
        Sections and end inertias; damping is left out.
    model : {'finite-elements', 'wave'}
        Elements, or the continuum.
    count : int
        How many; fewer where the elements have no more.
    top_held, bit_held : bool
        Whether that end stands still.

    Returns
    -------
    ndarray, shape (at most count,)
        rad/s. With both ends free the first is zero, the rigid body.
    """
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
        self.model = model
        self.mass = parts.mass
        inertias = [parts.top_inertia, *(x.end_inertia for x in self.sections)]
        inertias[-1] += parts.bit_inertia
        self.inertias = inertias
        self.free = slice(1 if top_held else 0, len(inertias) - (1 if bit_held else 0))
        nodes = 1 + sum(x.elements for x in self.sections) - top_held - bit_held
        self.most = 10**9 if model == "wave" and any(x.inertia for x in self.sections) else nodes

    def below(self, omega: Array) -> Counts:
        """Number of natural frequencies under each frequency (rad/s, more than zero)."""
        diagonal = [-(omega**2) * inertia for inertia in self.inertias]
        off = []
        counts = np.zeros(len(omega), dtype=np.int64)
        for joint, section in enumerate(self.sections):
            own, across, inside = self._section(section, omega)
            diagonal[joint] = diagonal[joint] + own
            diagonal[joint + 1] = diagonal[joint + 1] + own
            off.append(across)
            counts += inside
        kept, links = diagonal[self.free], off[self.free.start : self.free.stop - 1]
        pivot = kept[0] if kept else np.ones(len(omega))
        counts += pivot < 0.0
        for entry, link in zip(kept[1:], links, strict=True):
            pivot = entry - link**2 / _not_zero(pivot)
            counts += pivot < 0.0
        return counts

    def _section(self, section: Section, omega: Array) -> tuple[Array, Array, Counts]:
        """Dynamic stiffness at the ends (N m/rad) and modes with both ends held."""
        s = 1j * omega
        spring = section.inertia == 0.0
        if self.model == "wave" or spring:
            line = continuous_line(section, s)
            angle = np.asarray(omega * (0.0 if spring else section.travel_time))
            most = 0 if spring else 10**9
        else:
            line = element_line(section, s, self.mass)
            between, total = element_stiffness(section, s, self.mass)
            sine = np.sqrt(np.clip((total / (2.0 * between)).real, 0.0, 1.0))
            angle = 2.0 * section.elements * np.arcsin(sine)
            most = section.elements - 1
        compliance = line.shunt / s
        compliance = np.where(compliance == 0.0, 1e-300, compliance)
        own = ((1.0 + line.decay**2) / compliance).real
        across = (-2.0 * line.decay / compliance).real
        return own, across, np.minimum(np.floor(angle / np.pi).astype(np.int64), most)


def _not_zero(value: Array) -> Array:
    """A pivot that is exactly zero, moved by less than its rounding."""
    return cast(Array, np.where(value == 0.0, 1e-300, value))
