"""The printed friction of Monteiro & Trindade in the reference solver, with its edges located.

The torque of the rock jumps where the bit's speed passes the tolerance delta; within it the
torque has a kink where the pipe's torque passes the static one. Between these borders
everything is smooth, and they are located as events:

- a bit that turns (`+1`, `-1`): Equation 5, outside the tolerance;
- `CREEPING`: Equation 3, the torque of the pipe, so that next to nothing is left to move the bit;
- `PUSHED`: Equation 4, the static torque against a larger one of the pipe;
- `FORWARD_EDGE`, `BACKWARD_EDGE`: at exactly plus or minus delta. There Equation 5 drives the bit
  into the tolerance and Equation 3 drives it out again, at once: an integrator that does not
  know would chatter in ever shorter steps. What such chatter tends to is the motion in between,
  in the sense of Filippov: the bit keeps the speed delta, under the torque that this takes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.reference.system import Equations, Forces, System, ending, never
from drillctl.simulation.phases import Phase

Array = NDArray[np.float64]

CREEPING, PUSHED, FORWARD_EDGE, BACKWARD_EDGE = 2, 3, 4, 5
"""Phases of a bit within the tolerance, beside +1 and -1 of one that turns."""
EDGES = {FORWARD_EDGE: 1, BACKWARD_EDGE: -1}  # side of the tolerance of each edge
EDGE_OF = {side: edge for edge, side in EDGES.items()}  # edge of each side
WITHIN_STEP = 2e-3
"""Longest step (s) within the tolerance: a bit passes through it in some milliseconds."""
AHEAD = 1e-6
"""How far ahead (s) the pipe's torque is looked at, to tell on which side of its limit it is."""
ROUNDING = 1e-10
"""Share of the static torque under which nothing drives a bit away from an edge.

With lumped masses and no damping exactly nothing does, but for rounding.
"""


class PrintedSystem(System):
    """A rig under `PrintedThreeBranch`; the bit counts as stuck within the tolerance."""

    @property
    def tolerance(self) -> float:
        """Speed within which the bit counts as stuck (rad/s)."""
        law: Any = self.rocks[1]
        return float(law.tolerance)

    @property
    def simple(self) -> bool:
        """Torque within the tolerance is not a function of speed: told one by one."""
        return False

    def direction_of(self, phase: int) -> int:
        """Direction of slip; 0 within the tolerance and at its edges."""
        return phase if abs(phase) == 1 else 0

    def border(self, side: int) -> float:
        """Bit speed in the frame (rad/s) at an edge of the tolerance."""
        return side * self.tolerance - self.set_speed

    def beyond(self, state: Array, side: int) -> float:
        """How far the bit turns beyond an edge (rad/s), exactly zero at it."""
        return side * (float(state[2 * self.nodes - 1]) - self.border(side))

    def pipe_torque(self, state: Array) -> float:
        """Torque of the element next to the bit (N m), its stiffness times its twist."""
        twist = float(state[self.nodes - 2] - state[self.nodes - 1])
        return float(self.string.element_stiffness[-1]) * twist

    def overload(self, time: float, state: Array) -> float:
        """Pipe torque beyond the static one (N m)."""
        return abs(self.pipe_torque(state)) - self.static_torque(time, state)

    def string_in(self, phase: int) -> Phase:
        """Accelerations of the string in a phase."""
        return self.stick if phase in EDGES else self.slip

    def forces(self, time: float, state: Array, phase: int) -> Forces:
        """What acts on the string in a phase."""
        if phase in EDGES:
            return self.held(time, state)
        return self.driven(time, state, self._rock_torque(time, state, phase))

    def _rock_torque(self, time: float, state: Array, phase: int) -> float:
        """Torque of Equation 3, 4 or 5 (N m)."""
        if phase == CREEPING:
            return self.pipe_torque(state)
        if phase == PUSHED:
            return math.copysign(self.static_torque(time, state), self.pipe_torque(state))
        return self.continued_torque(time, state, phase)

    def told(self, time: float, state: Array, phase: int) -> tuple[float, float, float]:
        """Top torque (N m), weight on bit (N) and bit torque (N m) in a phase."""
        forces = self.forces(time, state, phase)
        weight = self.weight_law(time, state).weight(abs(self.bit_speed(state)))
        return forces.top_torque, float(weight), forces.bit_torque

    def bit_speeds(self, state: Array, direction: Array) -> Array:
        """Bit speeds (rad/s) of states, shape (states, samples): a stuck bit creeps."""
        return np.asarray(state[2 * self.nodes - 1] + self.set_speed)

    def direction_at(self, time: float, state: Array) -> int:
        """Phase at the very start."""
        for side in (1, -1):
            beyond = self.beyond(state, side)
            if beyond > 0.0:
                return side
            if beyond == 0.0:
                return self._at_edge(time, state, side)
        return self._within(time, state)

    def next_direction(self, time: float, direction: int, state: Array) -> int:
        """Phase after one that ended by itself."""
        phase = direction
        if phase in EDGES:
            outward, inward = self._margins(time, state, EDGES[phase])
            return EDGES[phase] if outward <= inward else self._within(time, state)
        return self.direction_at(time, state)

    def after_stop(self, time: float, direction: int, state: Array) -> int:
        """Phase after a stop: within the tolerance weight or rock may have changed."""
        return direction if abs(direction) == 1 else self.direction_at(time, state)

    def at_end(self, time: float, phase: int, state: Array) -> Array:
        """State after a phase that ended by itself: at an edge exactly, if it ended there."""
        side = EDGES.get(phase, phase)
        if phase in (CREEPING, PUSHED):
            side = 1 if self.bit_speed(state) > 0.0 else -1
            to_edge = abs(self.beyond(state, side)) / self.tolerance
            if abs(self.overload(time, state)) / self.static_torque(time, state) < to_edge:
                return state  # Equations 3 and 4 met
        state = state.copy()
        state[2 * self.nodes - 1] = self.border(side)
        return state

    def before_rest(self, state: Array, direction: int) -> float:
        """How much faster a bit turns (rad/s) than where its slip ends, at the tolerance."""
        return self.beyond(state, direction)

    def equations(self, direction: int) -> Equations:
        """Right-hand side and events of a phase."""
        phase = direction
        if phase in EDGES:
            return self._along_edge(phase)
        if phase in (CREEPING, PUSHED):
            return self._between_edges(phase)
        return super().equations(phase)

    def _along_edge(self, phase: int) -> Equations:
        def rates(time: float, state: Array) -> Array:
            return self.rates(time, state, phase)

        def leaves(time: float, state: Array) -> float:
            return min(self._margins(time, state, EDGES[phase]))

        return Equations(rates, ending(leaves), [never, never], WITHIN_STEP)

    def _between_edges(self, phase: int) -> Equations:
        sign = 1.0 if phase == PUSHED else -1.0

        def rates(time: float, state: Array) -> Array:
            return self.rates(time, state, phase)

        def to_edge(time: float, state: Array) -> float:
            # Exactly zero is the edge that the bit comes from.
            return min(-self.beyond(state, 1), -self.beyond(state, -1)) or 1e-300

        def to_limit(time: float, state: Array) -> float:
            return sign * self.overload(time, state)

        others = [never, never, ending(to_limit)]
        return Equations(rates, ending(to_edge), others, WITHIN_STEP)

    def _within(self, time: float, state: Array) -> int:
        """Equation 3 or 4: by the pipe's torque in a moment, as now it may be at its limit."""
        ahead = state + AHEAD * self.rates(time, state, CREEPING)
        return PUSHED if self.overload(time + AHEAD, ahead) > 0.0 else CREEPING

    def _at_edge(self, time: float, state: Array, side: int) -> int:
        """Phase of a bit at an edge: out of the tolerance, into it, or along the edge."""
        outward, inward = self._margins(time, state, side)
        if outward < 0.0:
            return side
        return self._within(time, state) if inward < 0.0 else EDGE_OF[side]

    def _margins(self, time: float, state: Array, side: int) -> tuple[float, float]:
        """What keeps a bit at an edge (N m): against leaving outward, and inward.

        The bit keeps its speed under the holding torque. It turns faster where Equation 5 takes
        less than that, and falls back where Equation 3 or 4 takes more.
        """
        holding = self.holding_torque(time, state)
        static = self.static_torque(time, state)
        within = float(np.clip(self.pipe_torque(state), -static, static))
        outward = side * (self.continued_torque(time, state, side) - holding)
        return outward, side * (holding - within) + ROUNDING * static
