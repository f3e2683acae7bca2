"""Drives as the reference solver runs them: torque and memory in continuous time.

A drive in time has `states` numbers of memory, which join the state of the rig; `respond` gives
its torque and the rates of its memory; one that works at equal intervals has a `period`, at whose
multiples the solver stops and calls `sample`.

Weight on bit as the reference solver runs it: law of the moment, memory, delays, readings.

A weight in time has `states` numbers of memory, which join the state of the rig, and a law for
each moment that the rock is asked with. What comes late is looked up in the past of the very run;
the solver stops wherever a reading or the method of steps asks for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from drillctl.linear.observer import Observer
from drillctl.rig.program import Ramp
from drillctl.rig.top_drive import RealDrive, SampledDrive
from drillctl.rig.top_drive.real_drive import (
    MEMORY,
    SAMPLED_MEMORY,
    respond,
    respond_held,
    sample,
)
from drillctl.rig.weight_on_bit import PATHS, AlarmWeight, ConstantWeight, ObservedWeight

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
    if isinstance(law, SampledDrive):
        return _Sampled(law, set_speed, program)
    if isinstance(law, RealDrive):
        return _Continuous(law, set_speed, program)
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
        return np.array([speed, 0.0, 0.0, 0.0, 0.0])

    def respond(self, memory: Array, top: Top) -> tuple[float, Array]:
        torque, rates = respond(
            self.law, memory, top.speed, self.program.at(top.time), top.speed + self.set_speed,
            (top.free, top.gain),
        )  # fmt: skip
        return torque, np.array(rates)

    def sample(self, memory: Array, top: Top) -> Array:
        return memory


class _Sampled:
    """`SampledDrive`."""

    states = len(SAMPLED_MEMORY)

    def __init__(self, law: SampledDrive, set_speed: float, program: Ramp) -> None:
        self.law, self.set_speed, self.program = law, set_speed, program
        self.period = float(law.period)

    def start(self, speed: float) -> Array:
        return np.array([speed, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, speed, 0.0])

    def respond(self, memory: Array, top: Top) -> tuple[float, Array]:
        torque, seen, motor, impulse = respond_held(self.law, memory, top.speed)
        rates = np.zeros(self.states)
        rates[0], rates[4], rates[8] = seen, motor, impulse
        return torque, rates

    def sample(self, memory: Array, top: Top) -> Array:
        lead = self.program.at(top.time)
        return np.array(sample(self.law, memory, top.speed, lead, top.speed + self.set_speed))


Past = Callable[[Any], Array]  # times (s) to the signal that stood for the bit speed then (rad/s)
READ_EVERY = 0.01  # interval (s) at which the extremes of a window are looked for
LATE = 1e-9  # how much after its time (s) a stop is taken to be at it


class Moment(NamedTuple):
    """When it is, how fast the bit turns, and what was before."""

    time: float  # since the start (s)
    bit: float  # absolute bit speed (rad/s)
    past: Past  # the signal at earlier times


class WeightInTime(Protocol):
    """Weight on bit as the reference solver runs it."""

    @property
    def states(self) -> int:
        """Numbers of memory."""
        ...

    def start(self, bit_speed: float, angle: Array, speed: Array) -> Array:
        """Memory at time zero: bit speed (rad/s), angles and speeds of the nodes in the frame."""
        ...

    def law(self, now: Moment, memory: Array) -> Any:
        """The law of the moment."""
        ...

    def rates(self, now: Moment, memory: Array, top: float, torque: float) -> Array:
        """Rates of the memory.

        `top`: top speed in the frame (rad/s); `torque`: of the drive, less all damping to ground
        at the set speed (N m).
        """
        ...

    def signal(self, memory: Array, bit_speed: Array) -> Array:
        """What stands for the bit speed (rad/s)."""
        ...

    def next_stop(self, time: float) -> float:
        """Next time (s) at which the solver must stop."""
        ...

    def read(self, time: float, memory: Array, past: Past) -> Array:
        """Memory after a stop."""
        ...


def weight_in_time(law: Any, program: Ramp, observer: Observer | None) -> WeightInTime:
    """The weight of a law, under a program of its nominal value."""
    if not isinstance(law, PATHS):
        return _AtOnce(law, program)
    if isinstance(law, AlarmWeight):
        return _OnAlarm(law, program)
    if isinstance(law, ObservedWeight):
        assert observer is not None
        return _Observed(law, program, observer)
    return _Measured(law, program)


class _AtOnce:
    """A law that is a function of the bit speed."""

    states = 0

    def __init__(self, law: Any, program: Ramp) -> None:
        self.own, self.program = law, program

    def start(self, bit_speed: float, angle: Array, speed: Array) -> Array:
        return NOTHING

    def law(self, now: Moment, memory: Array) -> Any:
        if self.program.first == 0.0:
            return self.own
        # The nominal weight is the first number of a law.
        nominal = self.own[0] * (1.0 + self.program.at(now.time))
        return self.own._replace(**{self.own._fields[0]: nominal})

    def rates(self, now: Moment, memory: Array, top: float, torque: float) -> Array:
        return NOTHING

    def signal(self, memory: Array, bit_speed: Array) -> Array:
        return np.abs(bit_speed)

    def next_stop(self, time: float) -> float:
        return math.inf

    def read(self, time: float, memory: Array, past: Past) -> Array:
        return memory


class _Hoisted:
    """What all laws with a memory share. The last two numbers: the reading held, the weight."""

    first = 1  # numbers of memory of the signal itself

    def __init__(self, law: Any, program: Ramp) -> None:
        self.own, self.program = law, program

    @property
    def states(self) -> int:
        return self.first + 2

    def start(self, bit_speed: float, angle: Array, speed: Array) -> Array:
        signal = self._signal_at_start(bit_speed, angle, speed)
        memory = np.array([*signal, 0.0, 0.0])
        memory[-2] = self._first_reading(float(self.signal(memory, np.array(bit_speed))))
        memory[-1] = self._command(memory[-2], 0.0)
        return memory

    def _signal_at_start(self, bit_speed: float, angle: Array, speed: Array) -> Array:
        return np.array([abs(bit_speed)])

    def _first_reading(self, signal: float) -> float:
        return signal

    def _command(self, seen: float, time: float) -> float:
        nominal = self.own.nominal * (1.0 + self.program.at(time))
        return float(self.own.command(seen, nominal))

    def _seen(self, now: Moment, memory: Array) -> float:
        """The signal as it is known at the surface (rad/s)."""
        if self.own.period > 0.0:
            return float(memory[-2])
        if self.own.delay > 0.0:
            return float(now.past(now.time - self.own.delay))
        return float(self.signal(memory, np.array(now.bit)))

    def _asked(self, now: Moment, memory: Array) -> float:
        return self._command(self._seen(now, memory), now.time)

    def law(self, now: Moment, memory: Array) -> Any:
        if self.own.hoist > 0.0:
            return ConstantWeight(float(memory[-1]))
        return ConstantWeight(self._asked(now, memory))

    def rates(self, now: Moment, memory: Array, top: float, torque: float) -> Array:
        rates = np.zeros(self.states)
        rates[: self.first] = self._signal_rates(now, memory, top, torque)
        if self.own.hoist > 0.0:
            rate = (self._asked(now, memory) - memory[-1]) / self.own.hoist
            rates[-1] = min(max(rate, -self.own.rate), self.own.rate)
        return rates

    def _signal_rates(self, now: Moment, memory: Array, top: float, torque: float) -> Any:
        if self.own.sensor == 0.0:
            return 0.0
        return (abs(now.bit) - memory[0]) / self.own.sensor

    def signal(self, memory: Array, bit_speed: Array) -> Array:
        return np.abs(bit_speed) if self.own.sensor == 0.0 else memory[0]

    def next_stop(self, time: float) -> float:
        law = self.own
        if law.period > 0.0:
            k = math.floor((time - law.delay + LATE) / law.period) + 1
            return float(max(k, 0) * law.period + law.delay)
        return time + law.delay if law.delay > 0.0 else math.inf

    def read(self, time: float, memory: Array, past: Past) -> Array:
        law = self.own
        if law.period == 0.0:
            return memory
        k = math.floor((time - law.delay + LATE) / law.period)
        if k < 0:
            return memory
        memory = memory.copy()
        memory[-2] = past(k * law.period)
        return memory


class _Measured(_Hoisted):
    """`RealWeight`. Memory: filtered bit speed, reading held, weight."""


class _Observed(_Hoisted):
    """`ObservedWeight`. Memory: state of the observer, reading held, weight."""

    def __init__(self, law: ObservedWeight, program: Ramp, observer: Observer) -> None:
        super().__init__(law, program)
        self.observer = observer
        self.first = observer.states

    def _signal_at_start(self, bit_speed: float, angle: Array, speed: Array) -> Array:
        return self.observer.state(angle, speed)

    def _signal_rates(self, now: Moment, memory: Array, top: float, torque: float) -> Any:
        seen = self.observer
        return seen.free @ memory[: self.first] + seen.by_torque * torque + seen.by_speed * top

    def signal(self, memory: Array, bit_speed: Array) -> Array:
        estimate = np.tensordot(self.observer.read, memory[: self.first], 1)
        return np.abs(estimate + self.own.set_speed)


class _OnAlarm(_Hoisted):
    """`AlarmWeight`. Memory: filtered bit speed, weight asked for over nominal, weight."""

    def _first_reading(self, signal: float) -> float:
        return 1.0

    def _command(self, seen: float, time: float) -> float:
        return float(self.own.nominal * (1.0 + self.program.at(time)) * seen)

    def _seen(self, now: Moment, memory: Array) -> float:
        return float(memory[-2])

    def next_stop(self, time: float) -> float:
        law = self.own
        k = max(1, math.floor((time - law.delay + LATE) / law.window) + 1)
        return float(k * law.window + law.delay)

    def read(self, time: float, memory: Array, past: Past) -> Array:
        law = self.own
        k = (time - law.delay) / law.window
        if abs(k - round(k)) * law.window > LATE or round(k) < 1:
            return memory
        end = round(k) * law.window
        samples = max(2, math.ceil(law.window / READ_EVERY) + 1)
        speed = past(np.linspace(end - law.window, end, samples))
        memory = memory.copy()
        memory[-2] = law.next_level(
            memory[-2], float(speed.min()), float(speed.max()), float(speed.mean())
        )
        return memory
