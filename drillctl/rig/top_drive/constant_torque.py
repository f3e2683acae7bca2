"""A drive that gives the same torque whatever the string does."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table
from drillctl.rig.top_drive.law import Controller, DriveLaw, DriveTable, Ranges


class ConstantTorque(NamedTuple):
    """Constant torque, no speed control: :math:`T_m = u`.

    Attributes
    ----------
    level : float
        Torque u on the drive (N m).
    """

    level: Any

    def torque(self, angle: Any, speed: Any) -> Any:
        """Torque on the drive (N m); the same at any `angle` (rad) and `speed` (rad/s)."""
        return self.level

    def mean_torque(self, angle: Any, rate: Any) -> tuple[Any, Any]:
        """Offset (N m) and slope (N m/rad) of the mean torque over a step of 1 / `rate` (s)."""
        return self.level, 0.0

    def gains(self) -> tuple[Any, Any]:
        """No speed control: both gains are zero."""
        return 0.0, 0.0

    def impedance(self, s: Any) -> Any:
        """Torque that the drive takes per speed (N m s/rad) at `s` (1/s): none."""
        return 0.0 * s


class ConstantTorqueTable(Table):
    """A drive at constant torque."""

    law: Literal["constant-torque"]
    torque: q.Torque
    drive: DriveTable = DriveTable()


def _ranges(table: ConstantTorqueTable, string: Any) -> Ranges:
    """From half to twice what the design has."""
    torque = table.torque
    if torque == 0.0:
        raise InputError("a torque of 0 has no bounds about it: give some", "tune.parameters")
    return {"torque": (min(0.5 * torque, 2 * torque), max(0.5 * torque, 2 * torque))}


LAWS = (
    DriveLaw(
        ConstantTorqueTable,
        lambda table, string: Controller(0.0, 0.0, feedforward=table.torque),
        ideal=lambda controller: ConstantTorque(controller.feedforward),
        tuned=("torque",),
        ranges=_ranges,
        tuned_to_string=False,
        forms=(
            (ConstantTorque, '`law = "constant-torque"` (torque)', "A drive at its torque limit."),
        ),
    ),
)
