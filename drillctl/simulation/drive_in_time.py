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
from drillctl.top_drive.motion import (
    MEMORY,
    SAMPLED_MEMORY,
    begin,
    begin_sampled,
    respond,
    respond_held,
    sample,
)

Array = NDArray[np.float64]
NOTHING: Array = np.empty(0)


class Top(NamedTuple):
    """What a drive sees of the string at a moment, in the frame."""

    time: float  # since the start (s)
    # of the top drive (rad, rad/s)
    angle: float
    speed: float
    # its acceleration were there no torque of the drive (rad/s2), and per torque (1/(kg m2))
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
    """`RealDrive`."""

    states = len(MEMORY)
    period = math.inf

    def __init__(self, law: RealDrive, set_speed: float, program: Ramp) -> None:
        self.law, self.set_speed, self.program = law, set_speed, program

    def start(self, speed: float) -> Array:
        return begin(speed)

    def respond(self, memory: Array, top: Top) -> tuple[float, Array]:
        return respond(
            self.law, memory, top.speed, self.program.at(top.time), top.speed + self.set_speed,
            (top.free, top.gain),
        )  # fmt: skip

    def sample(self, memory: Array, top: Top) -> Array:
        return memory


class _Sampled:
    """`SampledDrive`."""

    states = len(SAMPLED_MEMORY)

    def __init__(self, law: SampledDrive, set_speed: float, program: Ramp) -> None:
        self.law, self.set_speed, self.program = law, set_speed, program
        self.period = float(law.period)

    def start(self, speed: float) -> Array:
        return begin_sampled(speed)

    def respond(self, memory: Array, top: Top) -> tuple[float, Array]:
        return respond_held(self.law, memory, top.speed)

    def sample(self, memory: Array, top: Top) -> Array:
        lead = self.program.at(top.time)
        return sample(self.law, memory, top.speed, lead, top.speed + self.set_speed)
