"""How a real drive moves: torque and rates of its memory, written once for every reader.

The reference solver integrates these equations, the linear side reads its matrices off them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drillctl.rig.top_drive.real_drive import RealDrive, SampledDrive

Array = NDArray[np.float64]

MEMORY = ("speed seen", "torque felt", "its slow part", "integral", "motor torque")
"""Memory of a `RealDrive` (rad/s, N m, N m, rad, N m)."""
SAMPLED_MEMORY = (*MEMORY, "command", "next command", "speed last seen", "impulse since")
"""Memory of a `SampledDrive` (... N m, N m, rad/s, N m s)."""


def begin(speed: float) -> Array:
    """Memory of a `RealDrive` at time zero, given the top speed in the frame (rad/s)."""
    return np.array([speed, 0.0, 0.0, 0.0, 0.0])


def begin_sampled(speed: float) -> Array:
    """Memory of a `SampledDrive` at time zero."""
    return np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, speed, 0.0])


def respond(
    drive: RealDrive,
    memory: Array,
    speed: float,
    lead: float,
    absolute: float,
    acceleration: tuple[float, float],
) -> tuple[float, Array]:
    """Torque of a `RealDrive` and the rates of its memory."""
    encoder, filtered, slow, integral, motor = memory.tolist()
    seen = encoder if drive.encoder > 0.0 else speed
    # The torque felt is a T + b: the motor's, less what the sensed inertia takes.
    a, b = _felt(drive, speed, encoder, acceleration)
    error = lead - seen + drive.mobility * slow
    fixed = drive.feedforward + drive.kp * error + drive.ki * integral
    by_motor = 0.0
    if drive.torque_filter > 0.0:
        fixed -= drive.kp * drive.mobility * filtered
    elif drive.lag > 0.0:
        fixed -= drive.kp * drive.mobility * (a * motor + b)
    else:  # the command acts on the torque that it follows from
        fixed -= drive.kp * drive.mobility * b
        by_motor = drive.kp * drive.mobility * a
    given = clipped(fixed / (1.0 + by_motor), *limits(drive, absolute))
    torque = motor if drive.lag > 0.0 else given
    command = fixed - by_motor * torque
    felt = a * torque + b
    shown = filtered if drive.torque_filter > 0.0 else felt
    error -= drive.mobility * shown
    return torque, np.array([
        (speed - encoder) / drive.encoder if drive.encoder > 0.0 else 0.0,
        (felt - filtered) / drive.torque_filter if drive.torque_filter > 0.0 else 0.0,
        drive.corner * (shown - slow),
        _integral_rate(drive, error, command, given),
        _motor_rate(drive, given, motor) if drive.lag > 0.0 else 0.0,
    ])  # fmt: skip


def _felt(
    drive: RealDrive, speed: float, encoder: float, acceleration: tuple[float, float]
) -> tuple[float, float]:
    inertia = drive.sensed_inertia
    if drive.encoder > 0.0:
        return 1.0, -inertia * (speed - encoder) / drive.encoder
    free, gain = acceleration
    return 1.0 - inertia * gain, -inertia * free


def respond_held(drive: SampledDrive, memory: Array, speed: float) -> tuple[float, Array]:
    """Torque of a `SampledDrive` between two samples and the rates of its memory.

    `memory`, shape (9,), by `SAMPLED_MEMORY`; `speed` of the top drive in the frame (rad/s).
    """
    encoder, motor, command = memory[0], memory[4], memory[5]
    torque = motor if drive.lag > 0.0 else command
    rates = np.zeros(len(SAMPLED_MEMORY))
    if drive.encoder > 0.0:
        rates[0] = (speed - encoder) / drive.encoder
    if drive.lag > 0.0:
        rates[4] = _motor_rate(drive, command, motor)
    rates[8] = torque
    return float(torque), rates


def sample(drive: SampledDrive, memory: Array, speed: float, lead: float, absolute: float) -> Array:
    """Memory of a `SampledDrive` after its controller has worked; arguments as in `respond`."""
    encoder, filtered, slow, integral, motor, _, pending, last, impulse = memory.tolist()
    seen = encoder if drive.encoder > 0.0 else speed
    felt = (impulse - drive.sensed_inertia * (seen - last)) / drive.period
    fade = math.exp(-drive.period / drive.torque_filter) if drive.torque_filter > 0.0 else 0.0
    filtered = fade * filtered + (1.0 - fade) * felt
    error = lead - seen - drive.mobility * (filtered - slow)
    slow += (1.0 - math.exp(-drive.corner * drive.period)) * (filtered - slow)
    wanted = drive.feedforward + drive.kp * error + drive.ki * integral
    given = clipped(wanted, *limits(drive, absolute))
    integral += drive.period * _integral_rate(drive, error, wanted, given)
    command = pending if drive.late else given
    return np.array([encoder, filtered, slow, integral, motor, command, given, seen, 0.0])


def limits(drive: RealDrive | SampledDrive, speed: float) -> tuple[float, float]:
    """Least and largest torque (N m) that a drive gives at an absolute speed (rad/s)."""
    by_power = drive.power / max(abs(speed), 1e-9)
    return max(drive.least, -by_power), min(drive.most, by_power)


def clipped(value: float, low: float, high: float) -> float:
    """The value within its limits."""
    return min(max(value, low), high)


def _integral_rate(
    drive: RealDrive | SampledDrive, error: float, command: float, given: float
) -> float:
    """Rate of the integral (rad/s) at an error (rad/s), a command and what is given of it (N m)."""
    if drive.ki == 0.0:
        return error
    return error + drive.tracking * (given - command) / drive.ki


def _motor_rate(drive: RealDrive | SampledDrive, command: float, torque: float) -> float:
    """Rate of the motor torque (N m/s) of a drive with a lag."""
    wanted = (command - torque) / drive.lag
    return clipped(wanted, -drive.rate, drive.rate) if math.isfinite(drive.rate) else wanted
