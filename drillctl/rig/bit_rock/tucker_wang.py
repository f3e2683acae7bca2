"""The continuous friction of the Tucker & Wang family."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from drillctl.rig import table as q
from drillctl.rig.bit_rock.law import Exp, Form, FrictionLaw, RockTable


class TuckerWang(NamedTuple):
    r"""Smooth friction with a hump at low speed.

    .. math:: T(\omega) = a W \Big[ \tanh b_1 \omega
              + \frac{b_2 \omega}{1 + b_3 \omega^2} \Big]

    Of the family of Tucker & Wang, J. Sound Vib. 224 (1999) 123-165, with the numbers of a
    public model of it. A bit never stands still under it: it creeps.

    Attributes
    ----------
    a : float
        Torque at high speed over weight on bit (m).
    b1, b2 : float
        Slope at rest of the step and of the hump (s/rad).
    b3 : float
        Decay of the hump (s2/rad2).
    """

    a: Any
    b1: Any
    b2: Any
    b3: Any

    @property
    def set_valued(self) -> bool:
        """A bit creeps under this law where it should stand still."""
        return False

    def static_torque(self, weight: Any) -> Any:
        """Torque that a bit at rest can bear (N m): none, it creeps."""
        return 0.0 * weight

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque in the limit of zero speed (N m): none."""
        return 0.0 * weight

    def steepest_fall(self, weight: Any) -> Any:
        """A bound of the falling slope (N m s/rad): `a b2 W / 8`, where the hump falls fastest.

        The slope of x / (1 + b x^2) is (1 - b x^2) / (1 + b x^2)^2, least at b x^2 = 3.
        """
        return self.a * self.b2 * weight / 8.0

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s) under `weight` (N)."""
        fade = exp(-2.0 * self.b1 * speed)
        tanh = (1.0 - fade) / (1.0 + fade)
        under = 1.0 / (1.0 + self.b3 * speed * speed)
        scale = self.a * weight
        torque = scale * (tanh + self.b2 * speed * under)
        hump = self.b2 * (1.0 - self.b3 * speed * speed) * under * under
        return torque, scale * (self.b1 * (1.0 - tanh * tanh) + hump)


class TuckerWangTable(RockTable):
    """Smooth friction with a hump (Tucker & Wang family); defaults of a public model."""

    law: Literal["tucker-wang"]
    a: q.NonNegativeNumber = 0.0239
    b1: q.PositiveNumber = 1.91
    b2: q.NonNegativeNumber = 8.5
    b3: q.NonNegativeNumber = 5.47


LAWS = (
    FrictionLaw(
        TuckerWangTable,
        lambda table, weight, moves: TuckerWang(table.a, table.b1, table.b2, table.b3),
        draws=("a",),
        forms=(
            Form(
                TuckerWang,
                sliding=("a",),
                keys='`law = "tucker-wang"` (a, b1, b2, b3)',
                use="To compare with the literature.",
                curves=(("Tucker & Wang", TuckerWang(0.0239, 1.91, 8.5, 5.47)),),
            ),
        ),
    ),
)
