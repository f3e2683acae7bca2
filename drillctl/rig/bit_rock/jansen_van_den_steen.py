"""A static peak over a constant sliding torque (Jansen & van den Steen 1995), and Coulomb's law."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from pydantic import model_validator

from drillctl.rig import table as q
from drillctl.rig.bit_rock.law import Exp, Form, FrictionLaw, RockTable, refuse_rising


class JansenVanDenSteen(NamedTuple):
    r"""Set-valued friction with a static peak and a constant sliding torque.

    .. math:: T(\omega) = a_1 W \, \mathrm{sign}\,\omega, \qquad T(0) \in [-a_2 W, a_2 W]

    After Jansen & van den Steen, J. Sound Vib. 179 (1995) 647-668. With a1 = a2 it is Coulomb's
    law. The torque on a turning bit does not fall with speed: every equilibrium is locally stable,
    and the peak alone causes stick-slip.

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


class JansenVanDenSteenTable(RockTable):
    """A static peak over a constant sliding torque (after Jansen & van den Steen 1995)."""

    law: Literal["jansen-van-den-steen"]
    a1: q.Arm
    a2: q.Arm

    @model_validator(mode="after")
    def _peak(self) -> JansenVanDenSteenTable:
        refuse_rising(self.a2, self.a1)
        return self


class CoulombTable(RockTable):
    """The same torque at rest and at any speed: a x weight on bit."""

    law: Literal["coulomb"]
    a: q.Arm


LAWS = (
    FrictionLaw(
        JansenVanDenSteenTable,
        lambda table, weight, moves: JansenVanDenSteen(table.a1, table.a2),
        draws=("a1", "a2"),
        forms=(
            Form(
                JansenVanDenSteen,
                static=("a2",),
                sliding=("a1",),
                keys='`law = "jansen-van-den-steen"` (a1, a2), `law = "coulomb"` (a)',
                use="To separate the effect of the static peak from that of the falling slope.",
                curves=(("Jansen & van den Steen", JansenVanDenSteen(0.047, 0.085)),),
            ),
        ),
    ),
    FrictionLaw(
        CoulombTable, lambda table, weight, moves: JansenVanDenSteen(table.a, table.a), draws=("a",)
    ),
)
