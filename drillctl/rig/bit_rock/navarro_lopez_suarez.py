"""Dry friction that decays exponentially with bit speed (Navarro-Lopez & Suarez 2004)."""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.bit_rock.protocol import Exp


class NavarroLopezSuarez(NamedTuple):
    r"""Set-valued friction with exponential decay.

    .. math:: T(\omega) = [a_1 + (a_2 - a_1) e^{-\beta |\omega|}] \, W \, \mathrm{sign}\,\omega,
              \qquad T(0) \in [-a_2 W, a_2 W]

    Equation 5 of Monteiro & Trindade (2012), with W the weight on bit.

    Attributes
    ----------
    a1 : float
        Torque at high speed over weight on bit (m).
    a2 : float
        Static torque over weight on bit (m); not less than `a1`.
    beta : float
        Decay of the torque with speed (s/rad).
    """

    a1: Any
    a2: Any
    beta: Any

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m), `a2 W`."""
        return self.a2 * weight

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m): the static torque, this law has no peak."""
        return self.a2 * weight

    def steepest_fall(self, weight: Any) -> Any:
        """Largest falling slope (N m s/rad), at zero speed: `beta (a2 - a1) W`."""
        return self.beta * (self.a2 - self.a1) * weight

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s) under `weight` (N)."""
        falling = (self.a2 - self.a1) * weight * exp(-self.beta * speed)
        return self.a1 * weight + falling, -self.beta * falling
