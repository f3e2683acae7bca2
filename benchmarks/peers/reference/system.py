"""The equations of one design as SciPy wants them: string, drive, weight and rock together."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.reference.laws_in_time import Moment, Top, drive_in_time, weight_in_time
from drillctl.design import Design
from drillctl.linear.observer import observer_of
from drillctl.rig.bit_rock import contact
from drillctl.rig.drillstring import Drillstring
from drillctl.simulation.lanes import single_lane
from drillctl.simulation.limit_cycle.flow import LONGEST_STEP, ending
from drillctl.simulation.phases import Phase, slip_phase, stick_phase

Array = NDArray[np.float64]
Method = Literal["DOP853", "RK45", "Radau", "BDF"]
"""Integrators of SciPy; not LSODA, whose dense output does not meet its own steps closely
enough to locate events on."""

WORKS = 3  # integrals of power that every state carries: work of the drive, of the bit, of damping


class Forces(NamedTuple):
    """What acts on the string at a moment."""

    string: Phase  # accelerations as a function of motion and end torques
    # torques of drive and rock (N m)
    top_torque: float
    bit_torque: float
    drive: Array  # shape (drive states,): Rates of the drive's memory


class System:
    """A rig in motion.

    Its state: angles and speeds of the nodes in the frame, the works of drive, bit and damping,
    then the memories of drive and weight. Its phases: +1 and -1 for a bit that turns, 0 for one
    that is stuck; a law that needs others has a system of its own.
    """

    def __init__(self, design: Design) -> None:
        self.nodes = design.string.nodes
        self.set_speed = design.speed
        self.string = design.string
        self.program = design.program
        self.drive = drive_in_time(design.top_drive, design.speed, design.program.speed)
        self.weight = weight_in_time(
            design.weight_on_bit, design.program.weight, observer_of(design)
        )
        self.rocks = (design.bit_rock_before, design.bit_rock)
        self.slip = slip_phase(design.string, design.speed)
        self.stick, self.reaction = stick_phase(design.string, design.speed)
        self.damping_power = damping_power(design.string)
        self.drag = float(design.string.ground_damping.sum()) * design.speed
        self.pieces: list[Any] = []
        works = 2 * self.nodes + WORKS
        self.of_drive = slice(works, works + self.drive.states)
        self.of_weight = slice(self.of_drive.stop, self.of_drive.stop + self.weight.states)
        self.size = self.of_weight.stop
        self._begin: Array = np.empty(0)

    def string_in(self, phase: int) -> Phase:
        """Accelerations of the string in a phase."""
        return self.slip if phase else self.stick

    def direction_of(self, phase: int) -> int:
        """Direction of slip in a phase; 0 where the bit counts as stuck."""
        return phase

    @property
    def simple(self) -> bool:
        """Whether all laws are functions of the motion alone, at any time the same."""
        return not (self.drive.states or self.weight.states or self.program.moves)

    def start(self, design: Design) -> Array:
        """State at time zero."""
        begin = single_lane(design).begin
        angle, speed = begin.angles[:, 0], begin.speeds[:, 0]
        bit = float(speed[-1]) + self.set_speed
        memories = (self.drive.start(float(speed[0])), self.weight.start(bit, angle, speed))
        self._begin = np.concatenate([angle, speed, np.zeros(WORKS), *memories])
        return self._begin

    def rock(self, time: float) -> Any:
        """Bit-rock law of the moment."""
        return self.rocks[0 if time < self.program.rock_until else 1]

    def bit_speed(self, state: Array) -> float:
        """Absolute speed of the bit (rad/s)."""
        return float(state[2 * self.nodes - 1]) + self.set_speed

    def past(self, time: Any) -> Array:
        """The signal of the weight law at times (s) before; before the start, that of the start."""
        times = np.atleast_1d(np.asarray(time, dtype=float))
        signals = np.empty(len(times))
        for i, moment in enumerate(times):
            state = self._begin if moment <= 0.0 else self._piece_at(moment).solution(moment)
            signals[i] = self.weight.signal(state[self.of_weight], np.array(self.bit_speed(state)))
        return signals if np.ndim(time) else signals[0]

    def _piece_at(self, time: float) -> Any:
        low, high = 0, len(self.pieces) - 1
        while low < high:
            middle = (low + high) // 2
            if self.pieces[middle].end < time:
                low = middle + 1
            else:
                high = middle
        return self.pieces[low]

    def weight_law(self, time: float, state: Array) -> Any:
        """Weight law of the moment."""
        return self.weight.law(self._moment(time, state), state[self.of_weight])

    def _moment(self, time: float, state: Array) -> Moment:
        return Moment(time, self.bit_speed(state), self.past)

    def static_torque(self, time: float, state: Array) -> float:
        """Largest torque on a bit at rest (N m)."""
        law = self.weight_law(time, state)
        return float(self.rock(time).static_torque(law.weight(0.0)))

    def slip_torque(self, time: float, state: Array, direction: int) -> float:
        """Torque on a bit that turns (N m)."""
        if not self.rock(time).set_valued:
            direction = 1 if self.bit_speed(state) >= 0.0 else -1
        return self.continued_torque(time, state, direction)

    def continued_torque(self, time: float, state: Array, direction: int) -> float:
        """Torque (N m) of one direction, continued smoothly past zero speed.

        So the event can be located that ends the phase.
        """
        speed = direction * self.bit_speed(state)
        torque, _ = contact(self.rock(time), self.weight_law(time, state), speed, _exp)
        return direction * float(torque)

    def respond(self, time: float, state: Array, phase: Phase, bit: float) -> tuple[float, Array]:
        """Torque of the drive (N m) and the rates of its memory, under a bit torque (N m)."""
        nodes = self.nodes
        free = gain = 0.0
        if self.drive.states:
            free = phase.motion[0] @ state[: 2 * nodes] + phase.load[0] - phase.bit[0] * bit
            gain = phase.top[0]
        top = Top(time, float(state[0]), float(state[nodes]), float(free), float(gain))
        return self.drive.respond(state[self.of_drive], top)

    def holding_torque(self, time: float, state: Array) -> float:
        """Torque that holds a bit at rest (N m)."""
        top_torque, _ = self.respond(time, state, self.stick, 0.0)
        return self.reaction.torque(state[: 2 * self.nodes], top_torque)

    def forces(self, time: float, state: Array, phase: int) -> Forces:
        """What acts on the string in a phase."""
        if phase == 0:
            return self.held(time, state)
        return self.driven(time, state, self.slip_torque(time, state, phase))

    def held(self, time: float, state: Array) -> Forces:
        """What acts on the string while the bit keeps its speed."""
        top_torque, drive = self.respond(time, state, self.stick, 0.0)
        reaction = self.reaction.torque(state[: 2 * self.nodes], top_torque)
        return Forces(self.stick, top_torque, reaction, drive)

    def driven(self, time: float, state: Array, bit_torque: float) -> Forces:
        """What acts on the string under a bit torque (N m)."""
        top_torque, drive = self.respond(time, state, self.slip, bit_torque)
        return Forces(self.slip, top_torque, bit_torque, drive)

    def rates(self, time: float, state: Array, phase: int) -> Array:
        """Time derivative of the state in a phase."""
        end = 2 * self.nodes
        motion = state[:end]
        string, top_torque, bit_torque, drive = self.forces(time, state, phase)
        inputs = np.empty(end + 3)
        inputs[:end] = motion
        inputs[end:] = top_torque, bit_torque, 1.0
        rates = np.empty(self.size)
        np.dot(string.first_order, inputs, out=rates[:end])
        rates[end] = top_torque * (state[self.nodes] + self.set_speed)
        rates[end + 1] = bit_torque * (state[end - 1] + self.set_speed)
        rates[end + 2] = self.damping_power(state[self.nodes : end] + self.set_speed)
        rates[self.of_drive] = drive
        if self.weight.states:
            rates[self.of_weight] = self.weight.rates(
                self._moment(time, state),
                state[self.of_weight],
                float(state[self.nodes]),
                top_torque - self.drag,
            )
        return rates

    def at_end(self, time: float, phase: int, state: Array) -> Array:
        """State after a phase that ended by itself: at rest, not to the locator's rounding."""
        state = state.copy()
        state[2 * self.nodes - 1] = -self.set_speed
        return state

    def bit_speeds(self, state: Array, direction: Array) -> Array:
        """Bit speeds (rad/s) of states, shape (states, samples); exactly zero while stuck."""
        return np.where(direction == 0.0, 0.0, state[2 * self.nodes - 1] + self.set_speed)

    def told(self, time: float, state: Array, phase: int) -> tuple[float, float, float]:
        """Top torque (N m), weight on bit (N) and bit torque (N m) in a phase."""
        bit_speed = self.bit_speed(state)
        speed = 0.0 if phase == 0 else abs(bit_speed)
        weight = float(self.weight_law(time, state).weight(speed))
        friction = float(self.rock(time).torque_and_slope(weight, speed, np.exp)[0])
        rock = 0.0 if phase == 0 else phase * friction
        torque, _ = self.respond(time, state, self.slip if phase else self.stick, rock)
        if phase == 0:
            return torque, weight, self.holding_torque(time, state)
        turning = phase if self.rocks[1].set_valued else float(np.sign(bit_speed))
        return torque, weight, turning * friction

    def direction_at(self, time: float, state: Array) -> int:
        """Phase at the very start: +1 or -1 turning, 0 stuck; under a smooth law always +1."""
        if not self.rock(time).set_valued:
            return 1
        speed = self.bit_speed(state)
        if speed != 0.0:
            return 1 if speed > 0.0 else -1
        return self.next_direction(time, 1, state)

    def next_direction(self, time: float, direction: int, state: Array) -> int:
        """What follows a phase: a stuck bit slips, a bit at zero speed sticks if it can."""
        holding = self.holding_torque(time, state)
        if direction != 0 and abs(holding) <= self.static_torque(time, state):
            return 0
        return 1 if holding > 0.0 else -1

    def after_stop(self, time: float, direction: int, state: Array) -> int:
        """Phase after a stop: a stuck bit may be loose at once, by a jump of weight or torque."""
        if direction != 0:
            return direction
        holding = self.holding_torque(time, state)
        if abs(holding) <= self.static_torque(time, state) * (1.0 + 1e-12):
            return 0
        return 1 if holding > 0.0 else -1

    def next_stop(self, time: float) -> float:
        """Next time (s) at which a controller works, a signal is read or a program turns."""
        stops = [self.weight.next_stop(time)]
        if math.isfinite(self.drive.period):
            stops.append(
                (math.floor(time / self.drive.period * (1 + 1e-12)) + 1) * self.drive.period
            )
        stops += [t for t in self.program.breaks() if t > time][:1]
        return min(stops)

    def stop(self, time: float, direction: int, state: Array) -> Array:
        """State after what happens at a stop."""
        state = state.copy()
        if math.isfinite(self.drive.period):
            turns = time / self.drive.period
            if abs(turns - round(turns)) < 1e-6:
                gain = float(self.string_in(direction).top[0])
                top = Top(time, float(state[0]), float(state[self.nodes]), 0.0, gain)
                state[self.of_drive] = self.drive.sample(state[self.of_drive], top)
        if self.weight.states:
            state[self.of_weight] = self.weight.read(time, state[self.of_weight], self.past)
        return state

    def equations(self, direction: int) -> Equations:
        """Right-hand side and events of a phase."""
        return self._sticking() if direction == 0 else self._slipping(direction)

    def before_rest(self, state: Array, direction: int) -> float:
        """How much faster a bit turns (rad/s) than where its slip ends; smooth laws know no end."""
        return direction * self.bit_speed(state) if self.rocks[1].set_valued else 1.0

    def _slipping(self, direction: int) -> Equations:
        def rates(time: float, state: Array) -> Array:
            return self.rates(time, state, direction)

        def comes_to_rest(time: float, state: Array) -> float:
            # Exactly zero is the release itself, in a step too short to move the bit.
            return self.before_rest(state, direction) or 1e-300

        def at_set_speed(time: float, state: Array) -> float:
            return float(state[2 * self.nodes - 1])

        def extreme(time: float, state: Array) -> float:
            return float(rates(time, state)[2 * self.nodes - 1])

        return Equations(rates, ending(comes_to_rest), [at_set_speed, extreme])

    def _sticking(self) -> Equations:
        def rates(time: float, state: Array) -> Array:
            return self.rates(time, state, 0)

        def breaks_loose(time: float, state: Array) -> float:
            return self.static_torque(time, state) - abs(self.holding_torque(time, state))

        return Equations(rates, ending(breaks_loose), [never, never])


def never(time: float, state: Array) -> float:
    """An event that does not occur."""
    return 1.0


def _exp(x: float) -> float:
    """exp(x), finite: a trial step far past zero speed is to be rejected, not to raise."""
    return math.exp(min(x, 100.0))


class Equations:
    """Right-hand side and events of one phase; the first event ends it."""

    def __init__(
        self,
        rates: Callable[[float, Array], Array],
        end: Any,
        others: list[Any],
        longest_step: float = LONGEST_STEP,
    ) -> None:
        self.rates = rates
        self.events = [end, *others]
        self.longest_step = longest_step


def damping_power(string: Drillstring) -> Callable[[Array], float]:
    """Power that damping takes (W) as a function of the absolute speeds (rad/s)."""
    if string.undamped:
        return lambda speed: 0.0
    if string.nodes < 200:
        dense = string.damping.toarray()
        return lambda speed: float(speed @ dense @ speed)
    return lambda speed: float(speed @ (string.damping @ speed))


def stored_energy(string: Drillstring, angle: Array, speed: Array) -> float:
    """Kinetic plus elastic energy (J) at angles (rad) and absolute speeds (rad/s)."""
    kinetic = 0.5 * speed @ (string.mass @ speed)
    elastic = 0.5 * angle @ (string.stiffness @ angle)
    return float(kinetic + elastic)
