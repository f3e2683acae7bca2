"""Stribeck friction regularised by tanh: the literature's smooth law, for comparison."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from pydantic import model_validator

from drillctl.rig import table as q
from drillctl.rig.bit_rock.law import Exp, Form, FrictionLaw, RockTable, refuse_rising

COEFFICIENTS = ("static_coefficient", "sliding_coefficient")


class Stribeck(NamedTuple):
    r"""Smooth friction that falls exponentially and changes sign over a small speed.

    .. math:: T(\omega) = W R [\mu_k + (\mu_s - \mu_k) e^{-|\omega| / v_s}]
              \tanh(\omega / \varepsilon)

    As in public simulators of drilling. A bit never stands still under it: it creeps.

    Attributes
    ----------
    static, sliding : float
        mu_s R and mu_k R, torque over weight on bit (m); static not less than sliding.
    decay : float
        1 / v_s (s/rad).
    sharpness : float
        1 / epsilon (s/rad): the sign changes over the speed epsilon.
    """

    static: Any
    sliding: Any
    decay: Any
    sharpness: Any

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
        """A bound of the falling slope (N m s/rad): that of the exponential at rest."""
        return self.decay * (self.static - self.sliding) * weight

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s) under `weight` (N)."""
        # Of an argument that is not negative exp(-2 x) never overflows.
        fade = exp(-2.0 * self.sharpness * speed)
        tanh = (1.0 - fade) / (1.0 + fade)
        falling = (self.static - self.sliding) * weight * exp(-self.decay * speed)
        level = self.sliding * weight + falling
        rise = self.sharpness * (1.0 - tanh * tanh)
        return level * tanh, level * rise - self.decay * falling * tanh


class StribeckTable(RockTable):
    """Stribeck friction regularised by tanh, smooth; defaults of a public simulator."""

    law: Literal["stribeck"]
    bit_radius: q.Diameter
    static_coefficient: q.NonNegativeNumber = 0.8
    sliding_coefficient: q.NonNegativeNumber = 0.5
    stribeck_speed: q.PositiveSpeed = 1.0
    regularised_over: q.PositiveSpeed = 0.05

    @model_validator(mode="after")
    def _falling(self) -> StribeckTable:
        refuse_rising(self.static_coefficient, self.sliding_coefficient, COEFFICIENTS)
        return self


def _law(table: StribeckTable, weight: float, moves: bool) -> Stribeck:
    return Stribeck(
        static=table.bit_radius * table.static_coefficient,
        sliding=table.bit_radius * table.sliding_coefficient,
        decay=1.0 / table.stribeck_speed,
        sharpness=1.0 / table.regularised_over,
    )


LAWS = (
    FrictionLaw(
        StribeckTable,
        _law,
        draws=("sliding_coefficient", "static_coefficient"),
        forms=(
            Form(
                Stribeck,
                static=("static",),
                sliding=("sliding",),
                decay=("decay",),
                keys='`law = "stribeck"`, or `regularised_over` with either form of the first law',
                use="To compare with simulators that regularise; `drillctl regularisation` says "
                "what that costs.",
                curves=(("Stribeck, R 0.1 m", Stribeck(0.08, 0.05, 1.0, 20.0)),),
            ),
        ),
    ),
)
