"""What a top-drive law must offer, and what a design file and the studies know of it.

Gains given or tuned to the string, on an ideal drive or on one as it is built.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from pydantic import model_validator

from drillctl import registry
from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table, law_name
from drillctl.rig.top_drive.real_drive import (
    FADE,
    KNOTS,
    RealDrive,
    SampledDrive,
    curve_numbers,
)

SHORTEST_LAG = 0.01
"""Time constant (s) of a motor whose torque rate is limited, where the design gives a shorter
one: a rate is limited on its way to a command, which takes a way."""


class TopDriveLaw(Protocol):
    """Torque of the drive against angle and speed in the turning frame, in steady motion."""

    def torque(self, angle: Any, speed: Any) -> Any:
        """Torque on the drive (N m) at `angle` (rad) and `speed` (rad/s)."""
        ...

    def gains(self) -> tuple[Any, Any]:
        """Proportional (N m s/rad) and integral (N m/rad) gain of the linearised law."""
        ...

    def impedance(self, s: Any) -> Any:
        """Torque against the motion per speed (N m s/rad) at complex frequencies `s` (1/s)."""
        ...


class DriveTable(Table):
    """What makes a drive real; the ideal drive where nothing is given.

    Lags and filters are time constants. Without `minimum_torque` a drive with a torque limit does
    not brake. A limit of `"inf"` is none. With `torque_rate_limit` the motor follows with a lag of
    10 ms at least. `anti_windup` takes effect where torque, power or rate is limited;
    `tracking_time` is by default kp / ki. All limits count at the pipe. Beyond `maximum_speed` the
    largest torque falls to zero over a tenth of it. `continuous_torque` limits nothing: the time
    above it is measured.
    """

    torque_limit: q.TorqueLimit = None
    minimum_torque: q.LeastTorque = None
    power_limit: q.PowerLimit = None
    maximum_speed: q.SpeedLimit = None
    continuous_torque: q.TorqueLimit = None
    torque_rate_limit: q.TorqueRateLimit = None
    anti_windup: Literal["back-calculation", "none"] = "back-calculation"
    tracking_time: q.Time | None = None
    sampling_period: q.SamplingPeriod = 0.0
    one_sample_delay: bool = False
    lag: q.Lag = 0.0
    encoder_lag: q.Lag = 0.0
    torque_lag: q.Lag = 0.0

    @model_validator(mode="after")
    def _late_samples(self) -> DriveTable:
        if self.one_sample_delay and self.sampling_period == 0.0:
            raise InputError("one_sample_delay needs a sampling_period")
        return self

    @model_validator(mode="after")
    def _torque_that_falls(self) -> DriveTable:
        if self.maximum_speed is not None and self.torque_limit is None:
            raise InputError("maximum_speed needs a torque_limit: it falls to zero beyond")
        return self

    @property
    def ideal(self) -> bool:
        """Whether nothing of it acts."""
        limits = (
            self.torque_limit, self.minimum_torque, self.power_limit, self.torque_rate_limit,
            self.maximum_speed, self.continuous_torque,
        )  # fmt: skip
        lags = (self.sampling_period, self.lag, self.encoder_lag, self.torque_lag)
        return all(limit is None for limit in limits) and not any(lags)

    @property
    def motor_lag(self) -> float:
        """Time constant (s) with which the motor follows its command, however small that is."""
        return self.lag if self.torque_rate_limit is None else max(self.lag, SHORTEST_LAG)

    @property
    def unlimited(self) -> DriveTable:
        """The drive inside its limits: those of torque, power and rate, and the way back to them.

        Its motor follows with the same lag: small motions of a run are those of the linear loop.
        """
        return DriveTable.model_construct(
            lag=self.motor_lag, encoder_lag=self.encoder_lag, torque_lag=self.torque_lag,
            sampling_period=self.sampling_period, one_sample_delay=self.one_sample_delay,
        )  # fmt: skip


Points = tuple[tuple[float, float], ...]  # of speed (rad/s) and torque (N m)


class CurvedDriveTable(DriveTable):
    """A drive with the curve of its motors, which is a key of the top drive; not of a file."""

    curve: Points = ()


class DriveLimits(NamedTuple):
    """What a drive can give at the pipe; infinite where nothing limits it."""

    torque: float = math.inf  # at low speed (N m)
    power: float = math.inf  # at higher speed (W)
    speed: float = math.inf  # (rad/s)
    continuous: float = math.inf  # torque that it bears for any time (N m)
    curve: Points = ()  # in place of a power, where that does not go through what was given
    off: tuple[float, float] = (0.0, 0.0)  # share by which a point is off it at most, its speed

    def within(self, drive: DriveTable) -> DriveTable:
        """The keys of a drive with these limits where they are narrower."""

        def least(own: float | None, other: float) -> float | None:
            result = min(math.inf if own is None else own, other)
            return None if math.isinf(result) else result

        narrower = {
            "torque_limit": least(drive.torque_limit, self.torque),
            "power_limit": least(drive.power_limit, self.power),
            "maximum_speed": least(drive.maximum_speed, self.speed),
            "continuous_torque": least(drive.continuous_torque, self.continuous),
        }
        if not self.curve:
            return drive.model_copy(update=narrower)
        return CurvedDriveTable.model_construct(**dict(drive) | narrower, curve=self.curve)


OFF_THE_CURVE = 0.03  # how far a point may lie from constant torque and constant power


@lru_cache(maxsize=16)
def curve_limits(points: Points) -> DriveLimits:
    """Constant torque, then constant power, where that goes through the points; else the points.

    Within `OFF_THE_CURVE`, as rounded points of such a curve lie on either side of it.
    """
    key = "torque_speed"
    if not points:
        return DriveLimits()
    speeds, torques = zip(*points, strict=True)
    if list(speeds) != sorted(set(speeds)) or list(torques) != sorted(torques, reverse=True):
        raise InputError(f"{key}: speeds must rise and torques must not, from point to point")
    if torques[0] <= 0.0 or speeds[-1] == 0.0:
        raise InputError(f"{key}: needs a torque above 0 at its begin and a speed at its end")
    while points[-1][1] == 0.0 and points[-1][0] <= (1.0 + FADE) * points[-2][0]:
        points = points[:-1]  # how a curve may be closed at its end
    torque, speed = points[0][1], points[-1][0]
    falling = [w * one for w, one in points if one < torque * (1.0 - OFF_THE_CURVE)]
    power = min(falling, default=math.inf)
    lost = max(one - min(torque, power / max(w, 1e-9)) - OFF_THE_CURVE * one for w, one in points)
    if lost <= 0.0:
        return DriveLimits(torque, power, speed)
    kept = points
    while len(kept) > KNOTS:  # without the point that is the least off the line past it
        w, one = np.array(kept).T
        past = one[:-2] + (one[2:] - one[:-2]) * (w[1:-1] - w[:-2]) / (w[2:] - w[:-2])
        least = int(np.argmin(np.abs(past - one[1:-1]))) + 1
        kept = kept[:least] + kept[least + 1 :]
    w, one = np.array(points).T
    share = np.abs(np.interp(w, *np.array(kept).T) - one) / torque
    off = float(share.max()), float(w[share.argmax()])
    return DriveLimits(torque, speed=speed, curve=kept, off=off)


class Controller(NamedTuple):
    """Numbers of a speed controller before the drive around it; see `RealDrive`."""

    kp: Any
    ki: Any
    feedforward: Any = 0.0
    mobility: Any = 0.0
    sensed_inertia: Any = 0.0
    corner: Any = 0.0


class StringNumbers(NamedTuple):
    """What drives are tuned to of a string, by the names that a `Drillstring` has for it."""

    pipe_impedance: Any  # of the uppermost pipe (N m s/rad); NaN of a lumped spring
    top_inertia: Any  # (kg m2)
    drive_spring: Any  # w_s^2 J_d, with w_s the lowest frequency with the top held (N m/rad)
    drive_damper: Any  # of active damping by its own rule (N m s/rad)


Ranges = Mapping[str, tuple[float, float]]  # least and largest value (SI) by key


@dataclass(frozen=True)
class DriveLaw:
    """A top-drive law as a design file names it."""

    table: type[Table]  # its keys: `law` with its name, `drive`, and numbers
    # Of the table and the string (a `Drillstring` or `StringNumbers`). Pure: its numbers may be
    # floats, arrays, or symbols of CasADi.
    controller: Callable[[Any, Any], Controller]
    ideal: Callable[[Controller], TopDriveLaw]  # law of an ideal drive without torque feedback
    tuned: tuple[str, ...]  # keys that may be tuned
    ranges: Callable[[Any, Any], Ranges]  # of table and string: what is tuned by default, and where
    tuned_to_string: bool = True  # whether anything follows from the string
    # for docs/laws.md: class or rule, how a design requests it, when it is of use
    forms: tuple[tuple[Callable[..., Any], str, str], ...] = ()

    @property
    def name(self) -> str:
        """`law` in a design file."""
        return law_name(self.table)


@cache
def drive_laws() -> dict[str, DriveLaw]:
    """All top-drive laws by name."""
    return {law.name: law for law in registry.gathered(registry.DRIVE_LAWS, "LAWS")}


def top_drive(table: Any, string: Callable[[], Any]) -> TopDriveLaw:
    """Law with its numbers, of its table; the string is assembled for a law that is tuned to it."""
    law = drive_laws()[table.law]
    try:
        controller = law.controller(table, string() if law.tuned_to_string else None)
    except InputError as error:
        raise InputError(
            f"{table.law} is tuned to the pipe: {error.problem}", "controller.law"
        ) from None
    if table.drive.ideal and controller.mobility == 0.0:
        return law.ideal(controller)
    return _real(controller, table.drive)


def _real(controller: Controller, drive: DriveTable) -> RealDrive:
    least, most = limits(drive)
    rate = math.inf if drive.torque_rate_limit is None else drive.torque_rate_limit
    numbers = {
        **controller._asdict(),
        "encoder": drive.encoder_lag,
        "torque_filter": drive.torque_lag,
        "lag": drive.motor_lag,
        "least": least,
        "most": most,
        "power": math.inf if drive.power_limit is None else drive.power_limit,
        "rate": rate,
        "tracking": float(tracking(controller.kp, controller.ki, drive)),
        "slowness": 0.0 if drive.maximum_speed is None else 1.0 / drive.maximum_speed,
        "continuous": math.inf if drive.continuous_torque is None else drive.continuous_torque,
    }
    if isinstance(drive, CurvedDriveTable):
        numbers |= curve_numbers(drive.curve)
    if drive.sampling_period == 0.0:
        return RealDrive(**numbers)
    late = float(drive.one_sample_delay)
    return SampledDrive(**numbers, period=drive.sampling_period, late=late)


def limits(drive: DriveTable) -> tuple[float, float]:
    """Least and largest torque (N m); a drive with a torque limit does not brake by default."""
    most = math.inf if drive.torque_limit is None else drive.torque_limit
    unlimited = -math.inf if drive.torque_limit is None else 0.0
    return (unlimited if drive.minimum_torque is None else drive.minimum_torque), most


def tracking(kp: Any, ki: Any, drive: DriveTable) -> Any:
    """Rate (1/s) of back-calculation of a limited integral; gains may be arrays or symbols."""
    if drive.anti_windup == "none":
        return 0.0 * (kp + ki)
    if drive.tracking_time is not None:
        return (ki != 0.0) * (1.0 / drive.tracking_time) + 0.0 * kp
    # ki / kp, and 1 without kp: comparisons count as one or zero, so that nothing branches.
    positive = kp > 0.0
    divisor = positive * kp + (kp <= 0.0) * 1.0
    return (ki != 0.0) * (positive * (ki / divisor) + (kp <= 0.0) * 1.0)
