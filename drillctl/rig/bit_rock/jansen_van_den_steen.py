"""A static peak over a constant sliding torque (Jansen & van den Steen 1995, simplified)."""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.bit_rock.protocol import Exp


class JansenVanDenSteen(NamedTuple):
    r"""Set-valued friction with a static peak and a constant sliding torque.

    .. math:: T(\omega) = a_1 W \, \mathrm{sign}\,\omega, \qquad T(0) \in [-a_2 W, a_2 W]

    After Jansen & van den Steen, J. Sound Vib. 179 (1995) 647-668. With a1 = a2 it is Coulomb's
    law. A turning bit feels no falling slope: every equilibrium is locally stable, and
    stick-slip lives on the peak alone.

    Attributes
    ----------
    a1 : float
        Sliding torque over weight on bit (m).
    a2 : float
        Static torque over weight on bit (m); not less than `a1`.
    """

    a1: Any
    a2: Any

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m), `a2 W`."""
        return self.a2 * weight

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m), `a1 W`: the peak is lost at once."""
        return self.a1 * weight

    def steepest_fall(self, weight: Any) -> Any:
        """Largest falling slope of a turning bit (N m s/rad): none."""
        return 0.0 * weight

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s) under `weight` (N)."""
        none = 0.0 * weight * speed
        return self.a1 * weight + none, none
