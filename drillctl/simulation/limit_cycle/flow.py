r"""Motion of the string through slip and stick, and what a small change of its start becomes.

Within a phase the monodromy matrix obeys the linearised equations; it is integrated together
with the state. At a change of phase a neighbour changes a little sooner or later, so that it
jumps by the saltation matrix

.. math:: S = I + \frac{(f_2 - f_1)\, n^T}{n^T f_1}

with the rates before and after, and n the gradient of what ends the phase. Sticking loses one
direction, the bit's own, for good.

Where the drive does not act on the angle, nothing does: all angles may turn together. The
motion is then described by the twists of the elements instead of the angles of the nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np

from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.errors import SimulationError
from drillctl.rig.bit_rock import contact
from drillctl.simulation.phases import slip_phase, stick_phase

TOLERANCE = 1e-10  # relative and absolute tolerance of the integrator (rad, rad/s)
LONGEST_STEP = 0.05  # longest step (s): a touch of zero speed shorter than that could go unseen
MOST_PHASES = 2000  # give up beyond this many phases within one flight
SPEED_STEP = 1e-5  # step (rad/s) of the difference that gives the rock's slope, weight law included


@dataclass(frozen=True, eq=False)
class Leg:
    """One phase of a flight."""

    # times (s)
    begin: float
    end: float
    direction: int  # +1 or -1 in slip; 0 in stick
    # time (s), shape (n,), to angles and speeds in the frame, shape (2 nodes, n), where asked for
    solution: Callable[[Any], Array] | None
    extremes: Array  # times at which the bit speed has an extreme (s)


@dataclass(frozen=True, eq=False)
class Flight:
    """Where a motion has come to."""

    point: Array  # shape (coordinates,): At the end
    rates: Array  # shape (coordinates,): Its rate of change there (1/s)
    # shape (coordinates, coordinates): Change of the end per change of the start, where asked for
    matrix: Array | None
    legs: tuple[Leg, ...]  # the phases on the way


class Flow:
    """The motion of one design as a map of its coordinates.

    A point is [angles, speeds] in the frame (rad, rad/s), 2 nodes numbers; or [twists, speeds],
    one less, where the drive does not act on the angle. No program acts any more: the laws are
    functions of the motion alone.
    """

    def __init__(self, design: Design, tolerance: float = TOLERANCE) -> None:
        self.tolerance = tolerance
        self.nodes, self.set_speed = design.string.nodes, design.speed
        self.drive, self.rock = design.top_drive, design.bit_rock
        self.weight = cast("Any", design.weight_on_bit)
        self.shift = design.program.speed.integral(math.inf)  # angle (rad) that a ramp has left
        self.slip = slip_phase(design.string, design.speed)
        self.stick, self.reaction = stick_phase(design.string, design.speed)
        kp, ki = (float(gain) for gain in design.top_drive.gains())
        self.projection, self.embedding = _coordinates(self.nodes, free=ki == 0.0)
        drive = np.zeros(2 * self.nodes)
        drive[0], drive[self.nodes] = -ki, -kp
        self.slip_jacobian = _jacobian(self.slip.first_order, drive)
        self.stick_jacobian = _jacobian(self.stick.first_order, drive)
        self.holding = self.reaction.motion + self.reaction.top * drive

    @cached_property
    def static_torque(self) -> float:
        """Largest torque of a bit at rest (N m)."""
        return float(self.rock.static_torque(self.weight.weight(0.0)))

    def bit_speed(self, state: Array) -> float:
        """Absolute speed of the bit (rad/s)."""
        return float(state[2 * self.nodes - 1]) + self.set_speed

    def top_torque(self, state: Array) -> float:
        """Torque of the drive (N m)."""
        return float(self.drive.torque(state[0] - self.shift, state[self.nodes]))

    def holding_torque(self, state: Array) -> float:
        """Torque that holds a bit at rest (N m)."""
        return self.reaction.torque(state[: 2 * self.nodes], self.top_torque(state))

    def slip_torque(self, state: Array, direction: int) -> float:
        """Torque (N m) on a bit that turns, continued smoothly past zero speed."""
        speed = self.bit_speed(state)
        if not self.rock.set_valued:
            direction = 1 if speed >= 0.0 else -1
        return direction * float(contact(self.rock, self.weight, direction * speed, _exp)[0])

    def direction_at(self, state: Array) -> int:
        """Direction at any moment; under a smooth law always +1."""
        if not self.rock.set_valued:
            return 1
        speed = self.bit_speed(state)
        return int(np.sign(speed)) if speed != 0.0 else self.next_direction(1, state)

    def next_direction(self, direction: int, state: Array) -> int:
        """What follows a phase: a stuck bit slips, a bit at zero speed sticks if it can."""
        holding = self.holding_torque(state)
        if direction != 0 and abs(holding) <= self.static_torque:
            return 0
        return 1 if holding > 0.0 else -1

    def point(self, state: Array) -> Array:
        """Coordinates of angles and speeds; anything behind these is left out."""
        return np.asarray(self.projection @ state[: 2 * self.nodes])

    def state(self, point: Array) -> Array:
        """Angles and speeds; the top drive is at angle zero where no angle matters."""
        return np.asarray(self.embedding @ point)

    def rates(self, state: Array, direction: int) -> Array:
        """Rates of angles and speeds in a phase."""
        phase = self.slip if direction else self.stick
        rock = self.slip_torque(state, direction) if direction else 0.0
        inputs = np.concatenate([state, [self.top_torque(state), rock, 1.0]])
        return np.asarray(phase.first_order @ inputs)

    def tangents(self, state: Array, matrix: Array, direction: int) -> Array:
        """Rates of neighbours, one a column."""
        if direction == 0:
            return np.asarray(self.stick_jacobian @ matrix)
        grown = self.slip_jacobian @ matrix
        grown[self.nodes :] -= np.outer(
            self.slip.bit * self._rock_slope(state, direction), matrix[-1]
        )
        return np.asarray(grown)

    def follow(
        self, point: Array, duration: float, matrix: bool = True, dense: bool = False
    ) -> Flight:
        """Follow a motion for a given time."""
        state = self.state(point)
        near = self.embedding.copy() if matrix else None
        direction, time = self.direction_at(state), 0.0
        legs: list[Leg] = []
        while True:
            leg, state, near = self._leg(time, duration, direction, state, near, dense)
            legs.append(leg)
            time = leg.end
            if time >= duration:
                break
            if len(legs) >= MOST_PHASES:
                raise SimulationError(f"{MOST_PHASES} changes of phase by {time:g} s: chattering")
            after = self.next_direction(direction, state)
            if near is not None:
                near = self._salted(state, near, direction, after)
            direction = after
        rates = self.projection @ self.rates(state, direction)
        ended = None if near is None else self.projection @ near
        return Flight(self.projection @ state, rates, ended, tuple(legs))

    def _leg(
        self, begin: float, end: float, direction: int, state: Array, near: Array | None,
        dense: bool,
    ) -> tuple[Leg, Array, Array | None]:  # fmt: skip
        size = 2 * self.nodes

        def rates(time: float, both: Array) -> Array:
            own = self.rates(both[:size], direction)
            if near is None:
                return own
            grown = self.tangents(both[:size], both[size:].reshape(near.shape), direction)
            return np.concatenate([own, grown.ravel()])

        both = state if near is None else np.concatenate([state, near.ravel()])
        result = integrate(
            rates, (begin, end), both, method="DOP853", rtol=self.tolerance, atol=self.tolerance,
            events=self._events(direction), dense_output=dense,
        )  # fmt: skip
        if result.status < 0 or not np.isfinite(result.y[:, -1]).all():
            raise SimulationError(f"the integrator failed at {result.t[-1]:g} s: {result.message}")
        final = result.y[:size, -1].copy()
        if result.status == 1:  # at rest exactly, not to the locator's rounding
            final[-1] = -self.set_speed
        extremes = np.asarray(result.t_events[1]) if direction else np.zeros(0)
        leg = Leg(begin, float(result.t[-1]), direction, result.sol, extremes)
        return leg, final, None if near is None else result.y[size:, -1].reshape(near.shape)

    def _events(self, direction: int) -> list[Any]:
        size = 2 * self.nodes

        def comes_to_rest(time: float, both: Array) -> float:
            # Exactly zero is the release itself, in a step too short to move the bit.
            return direction * self.bit_speed(both[:size]) or 1e-300

        def breaks_loose(time: float, both: Array) -> float:
            return self.static_torque - abs(self.holding_torque(both[:size]))

        def extreme(time: float, both: Array) -> float:
            return float(self.rates(both[:size], direction)[-1])

        return [ending(comes_to_rest), extreme] if direction else [ending(breaks_loose)]

    def _salted(self, state: Array, near: Array, before: int, after: int) -> Array:
        """Neighbours after a change of phase."""
        normal = self.holding
        if before != 0:
            normal = np.zeros(2 * self.nodes)
            normal[-1] = 1.0
        first, second = self.rates(state, before), self.rates(state, after)
        approach = float(normal @ first)
        if approach == 0.0:
            raise SimulationError("a change of phase at a tangent: neighbours do not change alike")
        return near + np.outer(second - first, normal @ near) / approach

    def _rock_slope(self, state: Array, direction: int) -> float:
        """Slope of the bit torque against bit speed (N m s/rad)."""
        ahead, behind = state.copy(), state.copy()
        ahead[-1] += SPEED_STEP
        behind[-1] -= SPEED_STEP
        torque = self.slip_torque
        return (torque(ahead, direction) - torque(behind, direction)) / (2.0 * SPEED_STEP)


def _exp(x: float) -> float:
    """exp(x), finite: a trial step far past zero speed is to be rejected, not to raise."""
    return math.exp(min(x, 100.0))


def integrate(*arguments: Any, longest_step: float = LONGEST_STEP, **options: Any) -> Any:
    """`solve_ivp` with steps of at most `longest_step` (s); a little shorter if an event is missed.

    SciPy finds events on its dense output, which at the ends of a step may differ from the step
    itself by rounding; an event that lies just there is then not bracketed. Other steps move it
    inside.
    """
    from scipy.integrate import solve_ivp  # a third of a second that maps need not wait for

    for share in (1.0, 0.83, 0.71, 0.59, 0.47):
        try:
            return solve_ivp(*arguments, max_step=share * longest_step, **options)
        except ValueError as error:
            failure = error
    raise SimulationError(f"an event could not be located: {failure}") from failure


def ending(event: Any) -> Any:
    """Mark an event as the end of its phase, reached from above."""
    event.terminal = True
    event.direction = -1
    return event


def _jacobian(first_order: Array, drive: Array) -> Array:
    """Rates per angles and speeds with the drive closed, the rock apart."""
    size = len(drive)
    return np.asarray(first_order[:, :size] + np.outer(first_order[:, size], drive))


def _coordinates(nodes: int, free: bool) -> tuple[Array, Array]:
    """Matrices from [angles, speeds] to coordinates and back."""
    if not free:
        return np.eye(2 * nodes), np.eye(2 * nodes)
    projection = np.zeros((2 * nodes - 1, 2 * nodes))
    embedding = np.zeros((2 * nodes, 2 * nodes - 1))
    for element in range(nodes - 1):
        projection[element, element : element + 2] = 1.0, -1.0
        embedding[element + 1 : nodes, element] = -1.0
    projection[nodes - 1 :, nodes:] = np.eye(nodes)
    embedding[nodes:, nodes - 1 :] = np.eye(nodes)
    return projection, embedding
