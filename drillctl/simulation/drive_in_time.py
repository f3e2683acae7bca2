"""Drives as the reference solver runs them: torque and memory in continuous time.

A drive in time has `states` numbers of memory, which join the state of the rig; `respond` gives
its torque and the rates of its memory; one that works at equal intervals has a `period`, at whose
multiples the solver stops and calls `sample`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from drillctl.program import Ramp
from drillctl.top_drive import RealDrive, SampledDrive
from drillctl.top_drive.real_drive import clipped, integral_rate, limits, motor_rate

Array = NDArray[np.float64]
NOTHING: Array = np.empty(0)


class Top(NamedTuple):
    """What a drive sees of the string at a moment, in the frame.

    Attributes
    ----------
    time : float
        Since the start (s).
    angle, speed : float
        Of the top drive (rad, rad/s).
    free, gain : float
        Its acceleration were there no torque of the drive (rad/s2), and per torque
        (1/(kg m2)).
    """

    time: float
    angle: float
    speed: float
    free: float
    gain: float


class DriveInTime(Protocol):
    """A drive as the reference solver runs it."""

    states: int
    period: float

    def start(self, speed: float) -> Array:
        """Memory at time zero, given the top speed in the frame (rad/s)."""
        ...

    def respond(self, memory: Array, top: Top) -> tuple[float, Array]:
        """Torque (N m) and rates of the memory."""
        ...

    def sample(self, memory: Array, top: Top) -> Array:
        """Memory after the controller has worked."""
        ...


def drive_in_time(law: Any, set_speed: float, program: Ramp) -> DriveInTime:
    """The drive of a law; `set_speed` is the final one (rad/s), `program` what leads to it."""
    if isinstance(law, RealDrive):
        return _Continuous(law, set_speed, program)
    if isinstance(law, SampledDrive):
        return _Sampled(law, set_speed, program)
    return _Ideal(law, program)


class _Ideal:
    """A law that is a function of angle and speed."""

    states = 0
    period = math.inf

    def __init__(self, law: Any, program: Ramp) -> None:
        self.law, self.program = law, program

    def start(self, speed: float) -> Array:
        return NOTHING

    def respond(self, memory: Array, top: Top) -> tuple[float, Array]:
        angle = top.angle - self.program.integral(top.time)
        return float(self.law.torque(angle, top.speed - self.program.at(top.time))), NOTHING

    def sample(self, memory: Array, top: Top) -> Array:
        return memory


class _Continuous:
    """`RealDrive`. Memory: speed seen, torque felt, its slow part, integral, motor torque."""

    states = 5
    period = math.inf

    def __init__(self, law: RealDrive, set_speed: float, program: Ramp) -> None:
        self.law, self.set_speed, self.program = law, set_speed, program

    def start(self, speed: float) -> Array:
        return np.array([speed, 0.0, 0.0, 0.0, 0.0])

    def respond(self, memory: Array, top: Top) -> tuple[float, Array]:
        law = self.law
        encoder, filtered, slow, integral, motor = memory.tolist()
        speed = encoder if law.encoder > 0.0 else top.speed
        low, high = limits(law, top.speed + self.set_speed)
        sought = self.program.at(top.time) - speed
        # The torque felt is x = a T + b: the motor's, less what the sensed inertia takes.
        a, b = self._felt(top, encoder)
        error = sought + law.mobility * slow
        fixed = law.feedforward + law.kp * error + law.ki * integral
        by_motor = 0.0
        if law.torque_filter > 0.0:
            fixed -= law.kp * law.mobility * filtered
        elif law.lag > 0.0:
            fixed -= law.kp * law.mobility * (a * motor + b)
        else:  # the command acts on the torque that it follows from
            fixed -= law.kp * law.mobility * b
            by_motor = law.kp * law.mobility * a
        given = clipped(fixed / (1.0 + by_motor), low, high)
        torque = motor if law.lag > 0.0 else given
        command = fixed - by_motor * torque
        felt = a * torque + b
        shown = filtered if law.torque_filter > 0.0 else felt
        error -= law.mobility * shown
        return torque, np.array([
            (top.speed - encoder) / law.encoder if law.encoder > 0.0 else 0.0,
            (felt - filtered) / law.torque_filter if law.torque_filter > 0.0 else 0.0,
            law.corner * (shown - slow),
            integral_rate(law, error, command, given),
            motor_rate(law, given, motor) if law.lag > 0.0 else 0.0,
        ])  # fmt: skip

    def _felt(self, top: Top, encoder: float) -> tuple[float, float]:
        law = self.law
        if law.encoder > 0.0:
            return 1.0, -law.sensed_inertia * (top.speed - encoder) / law.encoder
        return 1.0 - law.sensed_inertia * top.gain, -law.sensed_inertia * top.free

    def sample(self, memory: Array, top: Top) -> Array:
        return memory


class _Sampled:
    """`SampledDrive`. Memory as above, then command, next command, speed and impulse last seen."""

    states = 9

    def __init__(self, law: SampledDrive, set_speed: float, program: Ramp) -> None:
        self.law, self.set_speed, self.program = law, set_speed, program
        self.period = float(law.period)

    def start(self, speed: float) -> Array:
        return np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, speed, 0.0])

    def respond(self, memory: Array, top: Top) -> tuple[float, Array]:
        law = self.law
        encoder, motor, command = memory[0], memory[4], memory[5]
        torque = motor if law.lag > 0.0 else command
        rates = np.zeros(self.states)
        if law.encoder > 0.0:
            rates[0] = (top.speed - encoder) / law.encoder
        if law.lag > 0.0:
            rates[4] = motor_rate(law, command, motor)
        rates[8] = torque
        return float(torque), rates

    def sample(self, memory: Array, top: Top) -> Array:
        law = self.law
        encoder, filtered, slow, integral, motor, _, pending, seen, impulse = memory.tolist()
        speed = encoder if law.encoder > 0.0 else top.speed
        felt = (impulse - law.sensed_inertia * (speed - seen)) / law.period
        fade = math.exp(-law.period / law.torque_filter) if law.torque_filter > 0.0 else 0.0
        filtered = fade * filtered + (1.0 - fade) * felt
        error = self.program.at(top.time) - speed - law.mobility * (filtered - slow)
        slow += (1.0 - math.exp(-law.corner * law.period)) * (filtered - slow)
        wanted = law.feedforward + law.kp * error + law.ki * integral
        given = clipped(wanted, *limits(law, top.speed + self.set_speed))
        integral += law.period * integral_rate(law, error, wanted, given)
        command = pending if law.late else given
        return np.array([encoder, filtered, slow, integral, motor, command, given, speed, 0.0])
