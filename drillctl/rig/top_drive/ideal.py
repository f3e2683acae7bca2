"""Ideal top drives: proportional-integral speed control, and constant torque."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table
from drillctl.rig.top_drive.law import Controller, DriveLaw, DriveTable, Ranges


class PI(NamedTuple):
    r"""Proportional-integral control of the top-drive speed.

    .. math:: T_m = K_p (\Omega - \omega_m) + K_i \int_0^t (\Omega - \omega_m)\, dt
                  = -K_p \dot\varphi_m - K_i \varphi_m

    Equation 2 of Monteiro & Trindade (2012), with :math:`\varphi_m` the angle in the frame
    that turns at the set speed :math:`\Omega`.

    Attributes
    ----------
    kp : float
        Proportional gain (N m s/rad).
    ki : float
        Integral gain (N m/rad).
    """

    kp: Any
    ki: Any

    def torque(self, angle: Any, speed: Any) -> Any:
        """Torque on the drive (N m) at `angle` (rad) and `speed` (rad/s) in the frame."""
        return -self.kp * speed - self.ki * angle

    def mean_torque(self, angle: Any, rate: Any) -> tuple[Any, Any]:
        """Offset (N m) and slope (N m/rad) of the mean torque over a step of 1 / `rate` (s).

        The mean speed over a step is the change of angle over its length, exactly, so that
        the discrete controller can only take from the string what it takes on paper.
        """
        proportional = self.kp * rate
        half_integral = 0.5 * self.ki
        return (proportional - half_integral) * angle, proportional + half_integral

    def gains(self) -> tuple[Any, Any]:
        """Proportional (N m s/rad) and integral (N m/rad) gain."""
        return self.kp, self.ki

    def impedance(self, s: Any) -> Any:
        """Torque that the drive takes per speed of the string (N m s/rad) at `s` (1/s)."""
        return self.kp + self.ki / s


class PITable(Table):
    """Proportional-integral speed control."""

    law: Literal["pi"]
    kp: q.ProportionalGain
    ki: q.IntegralGain
    drive: DriveTable = DriveTable()


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


def _pi_ranges(table: PITable, string: Any) -> Ranges:
    """Where the best gains of five rigs are: 2.1 to 4.5 zeta, 0.40 to 0.85 w_s^2 J_d; and beyond.

    In place of the impedance that a lumped spring lacks stands k / w_s. Of a drive so heavy that
    nothing slows it down, no more than the keys allow.
    """
    lumped = string.parts.sections[0].inertia == 0.0
    spring = string.static_stiffness / string.stick_slip_frequency
    impedance = spring if lumped else string.pipe_impedance
    most = {"kp": 6.0 * impedance, "ki": 1.5 * string.drive_spring}
    return {key: (0.0, min(value, q.MOST_GAIN)) for key, value in most.items()}


LAWS = (
    DriveLaw(
        PITable,
        lambda table, string: Controller(table.kp, table.ki),
        ideal=lambda controller: PI(controller.kp, controller.ki),
        tuned=("kp", "ki"),
        ranges=_pi_ranges,
        tuned_to_string=False,
        forms=((PI, '`law = "pi"` (kp, ki)', "Speed control as in the paper."),),
    ),
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
