r"""A bit that cuts its own wake (after Richard, Germay & Detournay 2007).

.. math:: W = \zeta \epsilon a d + a l \sigma g, \qquad
          T = \tfrac12 \epsilon a^2 d + \tfrac12 \gamma \mu a^2 l \sigma g

with d the depth of cut of all blades, each the difference of the bit's depth and of the surface
that the blade before has left, and g the share of the wear flat that bears: 1 where the bit sinks,
any in [0, 1] where it does not, 0 where it rises or is off bottom. The law has states of its
own, the axial motion and the surface: `simulation/cutting.py` moves them. What is here is
the rock of steady drilling, whose torque does not depend on speed.
"""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

from drillctl.rig import table as q
from drillctl.rig.bit_rock.law import Exp, Form, FrictionLaw, RockTable


class RichardDetournay(NamedTuple):
    """Cutting and friction of a drag bit.

    Attributes
    ----------
    blades : float
        Number n of equal blades.
    radius : float
        Of the bit, a (m).
    intrinsic_energy : float
        Intrinsic specific energy of the rock, epsilon (Pa).
    zeta : float
        Weight over torque of the cutters, as zeta a / (a^2 / 2) has it.
    wear_flat_length : float
        Length l of the wear flats (m), summed over the blades.
    contact_stress : float
        Stress sigma on them (Pa).
    gamma : float
        Distribution of the wear flats over the radius; 1 for an even one.
    mu : float
        Coefficient of friction on them.
    """

    blades: Any
    radius: Any
    intrinsic_energy: Any
    zeta: Any
    wear_flat_length: Any
    contact_stress: Any
    gamma: Any
    mu: Any

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    @property
    def force_per_depth(self) -> Any:
        """Force on the cutters per depth of cut (N/m)."""
        return self.zeta * self.intrinsic_energy * self.radius

    @property
    def torque_per_depth(self) -> Any:
        """Torque on the cutters per depth of cut (N m/m)."""
        return 0.5 * self.intrinsic_energy * self.radius**2

    @property
    def flat_force(self) -> Any:
        """Force on the whole wear flat (N)."""
        return self.radius * self.wear_flat_length * self.contact_stress

    @property
    def flat_torque(self) -> Any:
        """Torque on the whole wear flat (N m)."""
        return 0.5 * self.gamma * self.mu * self.radius * self.flat_force

    def depth_of_cut(self, weight: Any) -> Any:
        """Steady depth of cut in a turn (m): nothing under the force of the wear flat."""
        over = weight - self.flat_force
        return 0.5 * (over + abs(over)) / self.force_per_depth

    def rate(self, weight: Any, speed: Any) -> Any:
        """Steady rate of penetration (m/s)."""
        return self.depth_of_cut(weight) / (2.0 * math.pi) * speed

    def static_torque(self, weight: Any) -> Any:
        """Torque on a bit that stands as it drilled (N m)."""
        depth = self.depth_of_cut(weight)
        share = (weight - depth * self.force_per_depth) / self.flat_force
        return self.torque_per_depth * depth + self.flat_torque * share

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """The same (N m)."""
        return self.static_torque(weight)

    def steepest_fall(self, weight: Any) -> Any:
        """No fall with speed (N m s/rad): stick-slip comes from the cutting."""
        return 0.0 * weight * self.radius

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Steady torque (N m), the same at any speed, and its slope, none (N m s/rad)."""
        none = 0.0 * weight * speed
        return self.static_torque(weight) + none, none

    def torque_by_weight(self, weight: Any, speed: Any, exp: Exp) -> Any:
        """Steady torque per weight (m), beyond the force of the wear flat."""
        return self.torque_per_depth / self.force_per_depth + 0.0 * weight * speed


class RichardDetournayTable(RockTable):
    """A bit that cuts its own wake, with axial motion (after Richard, Germay & Detournay 2007).

    `[axial]` describes the string along its axis. `variation` multiplies `intrinsic_energy`;
    over depth, that of the bit itself.
    """

    law: Literal["richard-detournay"]
    blades: q.Count = 4
    radius: q.Diameter
    intrinsic_energy: q.Modulus
    zeta: q.PositiveNumber = 0.6
    wear_flat_length: q.ShortLength
    contact_stress: q.Modulus
    gamma: q.PositiveNumber = 1.0
    mu: q.PositiveNumber = 0.6


def _made(table: RichardDetournayTable, weight: float, moves: bool) -> RichardDetournay:
    return RichardDetournay(
        float(table.blades), table.radius, table.intrinsic_energy, table.zeta,
        table.wear_flat_length, table.contact_stress, table.gamma, table.mu,
    )  # fmt: skip


LAWS = (
    FrictionLaw(
        RichardDetournayTable,
        _made,
        draws=("intrinsic_energy", "contact_stress"),
        forms=(
            Form(
                RichardDetournay,
                keys='`law = "richard-detournay"` (blades, radius, intrinsic_energy, zeta, '
                "wear_flat_length, contact_stress, gamma, mu), `[axial]`",
                sliding=("intrinsic_energy", "contact_stress"),
                use="Where stick-slip comes from the cutting and not from a falling torque.",
            ),
        ),
    ),
)
