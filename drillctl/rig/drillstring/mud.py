"""Viscous torque of the mud in the annulus on a pipe that turns.

Newtonian mud, laminar flow between concentric cylinders of which the inner one turns (Bird, Stewart
& Lightfoot, Transport Phenomena, 2nd ed., section 3.6): per length and per speed

    c = 4 pi mu r^2 R^2 / (R^2 - r^2),

with r the outer radius of the pipe and R that of the hole. The flow is laminar below a Taylor
number of about 41 (narrow gap, Taylor 1923); above it vortices take more than this. What fills
its hole, bit or blades, is left out: it cuts or rubs, and no mud flows around it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from drillctl.errors import InputError
from drillctl.rig.drillstring.catalogue import Joint

FILLS = 0.97  # of the hole's diameter, from which on a component fills it
LAMINAR = 41.2  # largest Taylor number of a laminar flow


def annulus_drag(viscosity: float, outer_diameter: float, hole: float) -> float:
    """Drag per length (N s/rad) of mud (Pa s) on a pipe in a hole (diameters in m)."""
    if outer_diameter > hole * (1.0 + 1e-6):
        raise InputError(
            f"{outer_diameter * 1e3:.4g} mm wide, does not fit the hole of {hole * 1e3:.4g} mm"
        )
    if outer_diameter > FILLS * hole:
        return 0.0
    inner, outer = 0.25 * outer_diameter**2, 0.25 * hole**2  # radii squared
    return 4.0 * math.pi * viscosity * inner * outer / (outer - inner)


def jointed_drag(
    viscosity: float, outer_diameter: float, spacing: float, thick: Iterable[Joint], hole: float
) -> float:
    """The same of a pipe with its tool joints, one in each `spacing` (m)."""
    pieces = [(one.length, one.outer_diameter) for one in thick]
    pieces.append((spacing - sum(length for length, _ in pieces), outer_diameter))
    total = sum(length * annulus_drag(viscosity, outer, hole) for length, outer in pieces)
    return total / spacing


def taylor_number(
    viscosity: float, density: float, outer_diameter: float, hole: float, speed: float
) -> float:
    """Taylor number of the annulus at a speed (rad/s): rho w r d / mu sqrt(d / r), d the gap."""
    radius, gap = 0.5 * outer_diameter, 0.5 * (hole - outer_diameter)
    return density * speed * radius * gap / viscosity * math.sqrt(gap / radius)
