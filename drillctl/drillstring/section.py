"""One section of a drillstring: a run of equal torsional elements."""

from __future__ import annotations

import math
from dataclasses import dataclass


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
    yield_torque : float
        Torque at which the pipe body begins to yield (N m); infinite when unknown.
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
    yield_torque: float = math.inf

    @property
    def impedance(self) -> float:
        """Characteristic impedance, sqrt(stiffness x inertia) (N m s/rad): J sqrt(G rho)."""
        return math.sqrt(self.stiffness * self.inertia)

    @property
    def travel_time(self) -> float:
        """Time a torsional wave takes from end to end (s)."""
        return math.sqrt(self.inertia / self.stiffness)
