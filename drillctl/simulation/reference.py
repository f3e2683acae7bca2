"""Reference solver: slip and stick as separate smooth systems with located events.

Slower than the batch engine by orders of magnitude and independent of it: physical
coordinates, an adaptive integrator from SciPy, events found on its dense output. No friction
law is ever smoothed: the bit is either turning, with the torque of its law, or at rest, with
the torque that holds it, as long as that is within the static one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from drillctl.bit_rock import contact
from drillctl.design import Design
from drillctl.errors import SimulationError
from drillctl.simulation.phases import (
    Phase,
    damping_power,
    slip_phase,
    stick_phase,
    stored_energy,
)
from drillctl.simulation.start import start

Array = NDArray[np.float64]
Method = Literal["DOP853", "RK45", "Radau", "BDF"]
"""Integrators of SciPy; not LSODA, whose dense output does not meet its own steps closely
enough to locate events on."""

LONGEST_STEP = 0.05
"""Longest step (s): a touch of zero speed shorter than that could go unseen."""
MOST_PHASES = 100_000
"""Give up beyond this many phases: the bit chatters and time no longer advances."""


@dataclass(frozen=True)
class Event:
    """A change of phase.

    Attributes
    ----------
    time : float
        When (s).
    kind : {'stick', 'slip'}
        The bit came to rest, or broke loose.
    direction : int
        +1 or -1 for a bit that breaks loose forward or backward; 0 for a stick.
    """

    time: float
    kind: Literal["stick", "slip"]
    direction: int


@dataclass(frozen=True, eq=False)
class Piece:
    """One phase of a run: its dense solution and the moments found in it.

    Attributes
    ----------
    begin, end : float
        Times (s).
    direction : int
        +1 or -1 in slip; 0 in stick.
    solution : callable
        Time (s), shape (n,), to state, shape (2 nodes + 3, n).
    steps : ndarray
        Times of the integrator's steps (s).
    crossings : ndarray
        Times at which the bit turns at exactly the set speed (s).
    extremes : ndarray
        Times at which the bit speed has an extreme (s).
    """

    begin: float
    end: float
    direction: int
    solution: Callable[[Any], Array]
    steps: Array
    crossings: Array
    extremes: Array


@dataclass(frozen=True)
class EnergyAudit:
    """Where the energy of a run went (J).

    Attributes
    ----------
    drive, bit, damping : float
        Work of the drive, work taken by the bit, work taken by damping.
    stored : float
        Change of kinetic plus elastic energy.
    """

    drive: float
    bit: float
    damping: float
    stored: float

    @property
    def residual(self) -> float:
        """What does not balance (J)."""
        return self.drive - self.bit - self.damping - self.stored

    @property
    def relative_residual(self) -> float:
        """The residual over the largest of the terms; 0 for a run without any work."""
        largest = max(abs(self.drive), abs(self.bit), abs(self.damping), abs(self.stored))
        return abs(self.residual) / largest if largest > 0.0 else 0.0

    def summary(self) -> dict[str, float]:
        """The terms (J) and the relative residual, by name."""
        return {
            "drive": self.drive,
            "bit": self.bit,
            "damping": self.damping,
            "stored": self.stored,
            "relative_residual": self.relative_residual,
        }


@dataclass(frozen=True, eq=False)
class Motion:
    """A whole run as the solver saw it; `trajectory.py` makes signals and measures of it.

    Attributes
    ----------
    design : Design
        What was simulated.
    pieces : tuple of Piece
        The phases in order.
    events : tuple of Event
        The changes between them.
    energy : EnergyAudit
        Over the whole run.
    tolerance : float
        Relative and absolute tolerance of the integrator.
    method : str
        SciPy's name of the integrator.
    """

    design: Design
    pieces: tuple[Piece, ...]
    events: tuple[Event, ...]
    energy: EnergyAudit
    tolerance: float
    method: str


def solve(design: Design, tolerance: float = 1e-8, method: Method = "DOP853") -> Motion:
    """Simulate a design with located events.

    Parameters
    ----------
    design : Design
        Rig, control, start and duration.
    tolerance : float
        Relative and absolute tolerance of the integrator (angles rad, speeds rad/s).
    method : str
        Integrator of `scipy.integrate.solve_ivp`; an implicit one for stiff damping.

    Returns
    -------
    Motion
        The phases with their dense solutions.

    Raises
    ------
    SimulationError
        The integrator failed, or phases followed each other without time advancing.
    """
    system = System(design)
    duration = design.tables.simulation.duration
    angle, speed = _start(design)
    state = np.concatenate([angle, speed, np.zeros(3)])
    time, direction = 0.0, system.direction_at(state)
    pieces: list[Piece] = []
    events: list[Event] = []
    while True:
        piece, state = system.run(time, duration, direction, state, tolerance, method)
        pieces.append(piece)
        time = piece.end
        if time >= duration:
            break
        if len(pieces) >= MOST_PHASES:
            raise SimulationError(f"{MOST_PHASES} changes of phase by {time:g} s: chattering")
        direction = system.next_direction(direction, state)
        events.append(Event(time, "slip" if direction else "stick", direction))
    energy = system.audit(angle, speed, state)
    return Motion(design, tuple(pieces), tuple(events), energy, tolerance, method)


def _start(design: Design) -> tuple[Array, Array]:
    """Angles and speeds of the nodes at time zero, in the frame."""
    table = design.tables.start
    turning = design.speed if table.speed is None else table.speed
    static = design.bit_rock.static_torque(design.weight_on_bit.weight(0.0))
    angle, speed = start(
        design.string, table.kind, *(np.array([x]) for x in (design.speed, turning, static))
    )
    return angle[:, 0], speed[:, 0]


class System:
    """The equations of one design, as SciPy wants them."""

    def __init__(self, design: Design) -> None:
        self.nodes = design.string.nodes
        self.set_speed = design.speed
        self.string = design.string
        self.drive = design.top_drive
        self.friction = design.bit_rock
        self.weight = design.weight_on_bit
        self.slip = slip_phase(design.string, design.speed)
        self.stick, self.reaction = stick_phase(design.string, design.speed)
        self.damping_power = damping_power(design.string)

    def bit_speed(self, state: Array) -> float:
        """Absolute speed of the bit (rad/s)."""
        return float(state[2 * self.nodes - 1]) + self.set_speed

    def top_torque(self, state: Array) -> float:
        """Torque of the drive (N m)."""
        return float(self.drive.torque(float(state[0]), float(state[self.nodes])))

    def static_torque(self) -> float:
        """Largest torque on a bit at rest (N m)."""
        return float(self.friction.static_torque(self.weight.weight(0.0)))

    def slip_torque(self, state: Array, direction: int) -> float:
        """Torque on a bit that turns (N m)."""
        speed = self.bit_speed(state)
        if not self.friction.set_valued:
            direction = 1 if speed >= 0.0 else -1
        # Past zero speed a set-valued law is continued smoothly, so that the event can be located.
        torque, _ = contact(self.friction, self.weight, direction * speed, _exp)
        return direction * float(torque)

    def holding_torque(self, state: Array) -> float:
        """Torque that holds a bit at rest (N m)."""
        return self.reaction.torque(state[: 2 * self.nodes], self.top_torque(state))

    def rates(self, phase: Phase, state: Array, bit_torque: float) -> Array:
        """Time derivative of [angles, speeds, work of drive, of bit, of damping]."""
        end = 2 * self.nodes
        top_torque = self.top_torque(state)
        inputs = np.empty(end + 3)
        inputs[:end] = state[:end]
        inputs[end:] = top_torque, bit_torque, 1.0
        rates = np.empty(end + 3)
        np.dot(phase.first_order, inputs, out=rates[:end])
        rates[end] = top_torque * (state[self.nodes] + self.set_speed)
        rates[end + 1] = bit_torque * (state[end - 1] + self.set_speed)
        rates[end + 2] = self.damping_power(state[self.nodes : end] + self.set_speed)
        return rates

    def direction_at(self, state: Array) -> int:
        """Phase at the very start: +1 or -1 turning, 0 stuck; under a smooth law always +1."""
        if not self.friction.set_valued:
            return 1
        speed = self.bit_speed(state)
        if speed != 0.0:
            return 1 if speed > 0.0 else -1
        return self.next_direction(1, state)

    def next_direction(self, direction: int, state: Array) -> int:
        """What follows a phase: a stuck bit slips, a bit at zero speed sticks if it can."""
        holding = self.holding_torque(state)
        if direction != 0 and abs(holding) <= self.static_torque():
            return 0
        return 1 if holding > 0.0 else -1

    def run(
        self,
        begin: float,
        end: float,
        direction: int,
        state: Array,
        tolerance: float,
        method: Method,
    ) -> tuple[Piece, Array]:
        """Integrate one phase until it ends by itself or time is over."""
        equations = self._sticking() if direction == 0 else self._slipping(direction)
        result = integrate(
            equations.rates,
            (begin, end),
            state,
            method=method,
            rtol=tolerance,
            atol=tolerance,
            events=equations.events,
            dense_output=True,
        )
        if result.status < 0:
            raise SimulationError(f"the integrator failed at {result.t[-1]:g} s: {result.message}")
        if not np.isfinite(result.y[:, -1]).all():
            raise SimulationError(f"the motion is no longer finite at {result.t[-1]:g} s")
        final = result.y[:, -1].copy()
        if result.status == 1:  # at rest exactly, not to the locator's rounding
            final[2 * self.nodes - 1] = -self.set_speed
        found = [np.asarray(times) for times in result.t_events]
        piece = Piece(
            begin, float(result.t[-1]), direction, result.sol, result.t, found[1], found[2]
        )
        return piece, final

    def _slipping(self, direction: int) -> _Equations:
        def rates(time: float, state: Array) -> Array:
            return self.rates(self.slip, state, self.slip_torque(state, direction))

        def comes_to_rest(time: float, state: Array) -> float:
            if not self.friction.set_valued:
                return 1.0
            # Exactly zero is the release itself, in a step too short to move the bit.
            return direction * self.bit_speed(state) or 1e-300

        def at_set_speed(time: float, state: Array) -> float:
            return float(state[2 * self.nodes - 1])

        def extreme(time: float, state: Array) -> float:
            return float(rates(time, state)[2 * self.nodes - 1])

        return _Equations(rates, ending(comes_to_rest), [at_set_speed, extreme])

    def _sticking(self) -> _Equations:
        limit = self.static_torque()

        def rates(time: float, state: Array) -> Array:
            return self.rates(self.stick, state, self.holding_torque(state))

        def breaks_loose(time: float, state: Array) -> float:
            return limit - abs(self.holding_torque(state))

        def never(time: float, state: Array) -> float:
            return 1.0

        return _Equations(rates, ending(breaks_loose), [never, never])

    def audit(self, angle: Array, speed: Array, state: Array) -> EnergyAudit:
        """Energy balance between the start and the final state."""
        nodes = self.nodes
        before = stored_energy(self.string, angle, speed + self.set_speed)
        after = stored_energy(self.string, state[:nodes], state[nodes : 2 * nodes] + self.set_speed)
        drive, bit, damping = (float(work) for work in state[2 * nodes :])
        return EnergyAudit(drive, bit, damping, after - before)


def _exp(x: float) -> float:
    """exp(x), finite: a trial step far past zero speed is to be rejected, not to raise."""
    return math.exp(min(x, 100.0))


def integrate(*arguments: Any, **options: Any) -> Any:
    """`solve_ivp` with steps of at most `LONGEST_STEP`; a little shorter if an event is missed.

    SciPy finds events on its dense output, which at the ends of a step may differ from the step
    itself by rounding; an event that lies just there is then not bracketed. Other steps move it
    inside.
    """
    for share in (1.0, 0.83, 0.71, 0.59, 0.47):
        try:
            return solve_ivp(*arguments, max_step=share * LONGEST_STEP, **options)
        except ValueError as error:
            failure = error
    raise SimulationError(f"an event could not be located: {failure}") from failure


class _Equations:
    """Right-hand side and events of one phase; the first event ends it."""

    def __init__(self, rates: Callable[[float, Array], Array], end: Any, others: list[Any]) -> None:
        self.rates = rates
        self.events = [end, *others]


def ending(event: Any) -> Any:
    """Mark an event as the end of its phase, reached from above."""
    event.terminal = True
    event.direction = -1
    return event
