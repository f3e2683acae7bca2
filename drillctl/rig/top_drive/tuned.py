"""Top drives tuned to the string: stiff, soft torque, Z-torque, rectification, active damping.

Each rule is a pure function of the string (a `Drillstring`, or `StringNumbers`, whose numbers may
be arrays or symbols) and of numbers of the design.
"""

from __future__ import annotations

import math
from typing import Any, Literal

from pydantic import field_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table
from drillctl.rig.top_drive.ideal import PI
from drillctl.rig.top_drive.law import Controller, DriveLaw, DriveTable, Ranges, TopDriveLaw

# The rules.


def stiff_speed(string: Any, stiffness: Any = 50.0, rate: Any = 5.0) -> tuple[Any, Any]:
    """Gains of a stiff speed controller: Kp = 50 zeta, Ki = 5 J_d."""
    return stiffness * string.pipe_impedance, rate * string.top_inertia


def soft_torque(string: Any, share: Any = 0.25) -> tuple[Any, Any]:
    """Gains of a tuned PI (soft torque): P = zeta / share, I = w_s^2 J_d.

    With this I the drive is a pure resistor at the stick-slip frequency w_s, and reflects
    (1 - share) / (1 + share) of a wave there.
    """
    if isinstance(share, (int, float)) and not 0.0 < share <= 1.0:
        raise InputError(f"must be above 0 and at most 1, got {share:g}", "share")
    return string.pipe_impedance / share, string.drive_spring


def z_torque(string: Any, absorption: Any = 1.0) -> Any:
    r"""Mobility of an impedance-matched drive (Z-torque): m = a / zeta.

    The set speed of a stiff speed controller is lowered by the torque that the pipe takes,

    .. math:: e = \Omega - \omega - \frac{a}{\zeta} (T_p - \bar T_p), \qquad
              T_p = T - J_d \dot\omega,

    so that above the high-pass of that torque the drive acts as the resistor zeta / a, its own
    inertia compensated, and reflects (1 - a) / (1 + a) of every wave from below. The filters of a
    public model of it: motor lag 5 ms, encoder 2 ms, high-pass 20 s, as periods (time constant:
    that over 2 pi).
    """
    return absorption / string.pipe_impedance


def torsional_rectification(string: Any) -> Any:
    """Mobility of torsional rectification: that of `z_torque` with a = 1.

    After Tucker & Wang, J. Sound Vib. 224 (1999) 123-165: the top speed is made to follow the set
    speed less (pipe torque - its mean) / zeta, which absorbs each up-going wave. With an ideal
    drive it is the limit of impedance matching, and runs as such here.
    """
    return z_torque(string, 1.0)


def active_damping(string: Any) -> tuple[Any, Any]:
    r"""Damper and spring of an actively damped drive: c_f = 2 sqrt(k J_d), k_f = w_s^2 J_d.

    Of the two-body model bit - pipe - drive - spring and damper, with k the stiffness of the whole
    string and w_s its lowest frequency with the top held, the characteristic polynomial is then

    .. math:: (s^2 + 2 \zeta w_s s + w_s^2)^2, \qquad \zeta = \frac{\sqrt{k / J_d}}{2 w_s}:

    both pairs of poles coincide, which is as much damping as the softer of two modes can have.
    After Jansen & van den Steen, J. Sound Vib. 179 (1995) 647-668, who tune their drive as an
    absorber of the first mode; the rule is ours.
    """
    return string.drive_damper, string.drive_spring


# Keys of a design.


class StiffSpeedTable(Table):
    """Stiff speed control: kp = stiffness x pipe impedance, ki = rate x drive inertia.

    The defaults are those of a public drilling simulator (NORCE).
    """

    law: Literal["stiff-speed"]
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0
    drive: DriveTable = DriveTable()


class SoftTorqueTable(Table):
    """Soft torque, a PI tuned to the string: kp = pipe impedance / share, ki = w_s^2 J_d.

    w_s is the lowest frequency of the string with the top held, J_d the inertia of the drive.
    """

    law: Literal["soft-torque"]
    share: q.PositiveNumber = 0.25
    drive: DriveTable = DriveTable()

    @field_validator("share")
    @classmethod
    def _up_to_one(cls, value: float) -> float:
        if value > 1.0:
            raise InputError(f"must be at most 1, got {value:g}")
        return value


class ZTorqueTable(Table):
    """Z-torque (impedance matching): the pipe torque lowers the set speed.

    The speed controller is that of `stiff-speed`. `absorption` 1 absorbs every wave from below,
    0 none. The pipe torque is fed back without its slow part: `high_pass` is the period below which
    it passes (time constant: that over 2 pi).
    """

    law: Literal["z-torque"]
    absorption: q.Share = 1.0
    high_pass: q.Time = 20.0
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0
    drive: DriveTable = DriveTable()


class TorsionalRectificationTable(Table):
    """Torsional rectification (after Tucker & Wang 1999): Z-torque that absorbs every wave.

    The ideal limit of impedance matching, on an ideal drive; `high_pass` as there.
    """

    law: Literal["torsional-rectification"]
    high_pass: q.Time = 20.0
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0
    drive: DriveTable = DriveTable()


class ActiveDampingTable(Table):
    """Active damping (after Jansen & van den Steen 1995): the motor torque lowers the set speed.

    The drive then acts as a spring k_f and a damper c_f, by default those that make the
    lowest two pairs of poles of pipe, bit and drive coincide. The speed controller is that of
    `stiff-speed`.
    """

    law: Literal["active-damping"]
    spring: q.PositiveIntegralGain | None = None
    damper: q.PositiveProportionalGain | None = None
    stiffness: q.PositiveNumber = 50.0
    rate: q.PositiveNumber = 5.0
    drive: DriveTable = DriveTable()


# Laws.


def _matched(table: Any, string: Any, mobility: Any) -> Controller:
    """A stiff controller whose set speed the pipe torque lowers."""
    kp, ki = stiff_speed(string, table.stiffness, table.rate)
    corner = 2.0 * math.pi / table.high_pass
    return Controller(kp, ki, 0.0, mobility, string.top_inertia, corner)


def _damping(table: Any, string: Any) -> Controller:
    damper, spring = active_damping(string)
    damper = damper if table.damper is None else table.damper
    spring = spring if table.spring is None else table.spring
    kp, ki = stiff_speed(string, table.stiffness, table.rate)
    return Controller(kp, ki, mobility=1.0 / damper, corner=spring / damper)


def _damping_ranges(table: Any, string: Any) -> Ranges:
    """From a quarter to four times the values that follow from the string."""
    damper, spring = active_damping(string)
    return {"spring": (spring / 4, 4 * spring), "damper": (damper / 4, 4 * damper)}


def _pi(controller: Controller) -> TopDriveLaw:
    return PI(controller.kp, controller.ki)


LAWS = (
    DriveLaw(
        StiffSpeedTable,
        lambda table, string: Controller(*stiff_speed(string, table.stiffness, table.rate)),
        ideal=_pi,
        tuned=("stiffness", "rate"),
        ranges=lambda table, string: {"stiffness": (0.5, 50.0), "rate": (0.01, 5.0)},
        forms=(
            (stiff_speed, '`law = "stiff-speed"` (stiffness, rate)', "A PI; reflects all waves."),
        ),
    ),
    DriveLaw(
        SoftTorqueTable,
        lambda table, string: Controller(*soft_torque(string, table.share)),
        ideal=_pi,
        tuned=("share",),
        ranges=lambda table, string: {"share": (0.05, 1.0)},
        forms=(
            (
                soft_torque,
                '`law = "soft-torque"` (share)',
                "A PI; takes waves at the stick-slip frequency.",
            ),
        ),
    ),
    DriveLaw(
        ZTorqueTable,
        lambda table, string: _matched(table, string, z_torque(string, table.absorption)),
        ideal=_pi,
        tuned=("absorption", "high_pass", "stiffness", "rate"),
        ranges=lambda table, string: {"absorption": (0.0, 1.0)},
        forms=(
            (
                z_torque,
                '`law = "z-torque"` (absorption, high_pass, stiffness, rate)',
                "Impedance matching; takes waves of all frequencies above the high-pass.",
            ),
        ),
    ),
    DriveLaw(
        TorsionalRectificationTable,
        lambda table, string: _matched(table, string, torsional_rectification(string)),
        ideal=_pi,
        tuned=("high_pass", "stiffness", "rate"),
        ranges=lambda table, string: {"high_pass": (5.0, 60.0)},
        forms=(
            (
                torsional_rectification,
                '`law = "torsional-rectification"` (high_pass, stiffness, rate)',
                "The ideal limit of impedance matching.",
            ),
        ),
    ),
    DriveLaw(
        ActiveDampingTable,
        _damping,
        ideal=_pi,
        tuned=("spring", "damper", "stiffness", "rate"),
        ranges=_damping_ranges,
        forms=(
            (
                active_damping,
                '`law = "active-damping"` (spring, damper, stiffness, rate)',
                "Damping of the lowest modes through the motor torque.",
            ),
        ),
    ),
)
