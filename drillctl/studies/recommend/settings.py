"""Keys of `[recommend]`: what is considered, and what gains must keep to pass."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, field_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table
from drillctl.units import RPM

KEY = "recommend"
Considered = Literal["stiff-speed", "soft-torque", "pi", "z-torque", "active-damping"]


class Settings(Table):
    """What is considered, and what a setting must keep to pass, all of it.

    `present`: keys of `[controller]` that are in the drive now, by default those of the design.
    `laws` that the drive can run. `dynamic_weight`: keys of `[weight_on_bit]`, such as its gain, of
    a weight that follows the bit speed; with it each drive stands in the table once more.

    Level of J1 and its probability are those of `[tune]`. `slope_reserve`: least slope margin over
    the slope of the rock, which is known to some 5 %, twice. `peak_sensitivity`: the largest at the
    top torque with the share `slope_share` of that slope. With the whole slope a falling rock alone
    keeps it high, 5.6 for any PI on the paper's rig at 140 kN, and with none of it every loop has
    1.05; a usual limit of a drive is 2. `delay`: how late the drive may be besides what it is; by
    default once more its own delay and lags, which is what a wrong guess of them amounts to.
    `time_at_limit`: largest share of a run at the limit of torque or power, where the drive is no
    controller.

    A setting that passes is fragile where one number may be off by less than `fragile_tolerance`,
    where the loop bears less than `fragile_delay` (two samples of a usual drive), or where speed or
    weight may change by less than `fragile_window` before the bit sticks. `rated_torque` and
    `rated_speed` are the units of the numbers per unit; by default those of the drive.
    """

    present: dict[str, Any] = Field(default_factory=dict)
    laws: tuple[Considered, ...] = (
        "stiff-speed", "soft-torque", "pi", "z-torque", "active-damping",
    )  # fmt: skip
    dynamic_weight: dict[str, Any] = Field(default_factory=dict)
    slope_reserve: q.PositiveNumber = 1.10
    peak_sensitivity: q.PositiveNumber = 2.5
    slope_share: q.Share = 0.5
    delay: q.TimeOrZero | None = None
    time_at_limit: q.Share = 0.01
    fragile_tolerance: q.Share = 0.05
    fragile_delay: q.TimeOrZero = 0.02
    fragile_window: q.Share = 0.02
    rated_torque: q.TorqueLimit = None
    rated_speed: q.PositiveSpeed | None = None
    speed_step: q.PositiveSpeed = RPM
    weight_step: q.PositiveWeight = 1e3

    @field_validator("present")
    @classmethod
    def _numbers(cls, given: dict[str, Any]) -> dict[str, Any]:
        if "drive" in given:
            raise InputError("drive: limits and lags are those of [controller.drive]")
        return given
