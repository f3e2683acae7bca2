"""Keys of `[torque_drag]`: how the string is moved, and what was measured."""

from __future__ import annotations

from pydantic import field_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table

KEY = "torque_drag"


class Settings(Table):
    """How the string is moved in its well, for `drillctl torque-drag`.

    `friction_factor`: of wells that give none. `off_bottom_torque`: measured at the rig while the
    string turned off bottom; the friction factor of all holes without one of their own follows.
    `friction_factors`: swept over. `tripping_speed` and `tripping_rotation`: of a string that is
    pulled out or run in; without rotation the speed does not count.
    """

    friction_factor: q.FrictionFactor = 0.25
    off_bottom_torque: q.TorqueOrZero | None = None
    friction_factors: tuple[q.FrictionFactor, ...] = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)
    tripping_speed: q.Velocity = 0.5
    tripping_rotation: q.SpeedOrZero = 0.0

    @field_validator("friction_factors")
    @classmethod
    def _some(cls, factors: tuple[float, ...]) -> tuple[float, ...]:
        if not factors:
            raise InputError("a sweep needs at least one friction factor")
        return factors
