"""One section of a drillstring: a run of equal torsional elements; yield strength of grades."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal


def polar_moment(outer_diameter: float, inner_diameter: float) -> float:
    """Polar moment of area of a pipe (m^4), pi/32 (OD^4 - ID^4), diameters in m."""
    return math.pi / 32.0 * (outer_diameter**4 - inner_diameter**4)


def torsional_yield(outer_diameter: float, inner_diameter: float, yield_strength: float) -> float:
    """Torque at which a pipe body begins to yield (N m), after API RP 7G.

    The shear yield strength is `yield_strength` / sqrt(3) (Pa, von Mises); diameters in m.
    """
    moment = polar_moment(outer_diameter, inner_diameter)
    return yield_strength / math.sqrt(3.0) * moment / (outer_diameter / 2.0)


@dataclass(frozen=True)
class Section:
    """A uniform run of the string, split into equal elements. Totals, not per element.

    Attributes
    ----------
    name : str
        As in the design.
    elements : int
        Number of elements.
    stiffness : float
        Torsional stiffness end to end (N m/rad).
    inertia : float
        Inertia spread evenly over the length (kg m2).
    end_inertia : float
        Inertia lumped at the lower end (kg m2).
    length : float
        Length (m); 0 for a lumped spring.
    coupling_damping : float
        Damper between the two ends of the section (N m s/rad).
    stiffness_damping : float
        Damping of an element over its stiffness (s).
    mass_damping : float
        Damping to ground over inertia (1/s).
    drag : float
        Damping to ground, spread evenly over the length (N m s/rad).
    end_drag : float
        The same at the lower end alone (N m s/rad).
    yield_torque : float
        Torque at which the pipe body begins to yield (N m); infinite when unknown.
    lumped : tuple of str
        Names of short pieces that it holds as well.
    """

    name: str
    elements: int
    stiffness: float
    inertia: float = 0.0
    end_inertia: float = 0.0
    length: float = 0.0
    coupling_damping: float = 0.0
    stiffness_damping: float = 0.0
    mass_damping: float = 0.0
    drag: float = 0.0
    end_drag: float = 0.0
    yield_torque: float = math.inf
    lumped: tuple[str, ...] = ()

    @property
    def impedance(self) -> float:
        """Characteristic impedance, sqrt(stiffness x inertia) (N m s/rad): J sqrt(G rho)."""
        return math.sqrt(self.stiffness * self.inertia)

    @property
    def travel_time(self) -> float:
        """Time a torsional wave takes from end to end (s)."""
        return math.sqrt(self.inertia / self.stiffness)

    def spring(self, s: Any) -> Any:
        """Stiffness with its dampers (N m/rad) at complex frequencies `s` (1/s)."""
        damping = self.coupling_damping + self.stiffness_damping * self.stiffness
        return self.stiffness + s * damping

    def shunt(self, s: Any) -> Any:
        """Impedance to ground when it turns as one body (N m s/rad)."""
        return s * self.inertia + self.mass_damping * self.inertia + self.drag

    def element_stiffness(self, s: Any, mass: Literal["consistent", "lumped"]) -> tuple[Any, Any]:
        """B and a + b of the dynamic stiffness [[a, b], [b, a]] of one element (N m/rad)."""
        inertia = s * self.shunt(s) / self.elements
        share = 1 / 6 if mass == "consistent" else 0.0
        return share * inertia - self.elements * self.spring(s), 0.5 * inertia


@dataclass(frozen=True)
class Parts:
    """Sections and ends of a string, before they become matrices.

    Attributes
    ----------
    sections : tuple of Section
        From top to bottom.
    top_inertia, bit_inertia : float
        Of the top drive and of the BHA with the bit (kg m2).
    top_damping, bit_damping : float
        Viscous dampers to ground at the two ends (N m s/rad).
    modal_damping : float
        Damping ratio added to every elastic free-free mode.
    mass : {'consistent', 'lumped'}
        Mass of an element, m/6 [[2, 1], [1, 2]] or m/2 at each end.
    """

    sections: tuple[Section, ...]
    top_inertia: float
    bit_inertia: float
    top_damping: float
    bit_damping: float
    modal_damping: float
    mass: Literal["consistent", "lumped"]


PSI = 6894.757293168361

GRADES: dict[str, float] = {
    "E-75": 75e3 * PSI,
    "X-95": 95e3 * PSI,
    "G-105": 105e3 * PSI,
    "S-135": 135e3 * PSI,
}
"""Minimum yield strength (Pa)."""
