"""Reference solver: slip and stick as separate smooth systems with located events.

Slower than the batch engine by orders of magnitude and independent of it: physical
coordinates, an adaptive integrator from SciPy, events found on its dense output. No friction
law is ever smoothed: the bit is either turning, with the torque of its law, or at rest, with
the torque that holds it, as long as that is within the static one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.reference.printed import PrintedSystem
from benchmarks.peers.reference.system import WORKS, Method, System, stored_energy
from drillctl.design import Design
from drillctl.errors import SimulationError
from drillctl.rig.bit_rock import PrintedThreeBranch
from drillctl.simulation.limit_cycle.flow import integrate
from drillctl.simulation.reference import EnergyAudit, Event

Array = NDArray[np.float64]

MOST_PHASES = 100_000
"""Give up beyond this many phases: the bit chatters and time no longer advances."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A stretch of one phase, up to an event or a stop: its dense solution and what was found."""

    # times (s)
    begin: float
    end: float
    phase: int  # as `System` counts them
    direction: int  # +1 or -1 in slip; 0 in stick
    # time (s), shape (n,), to the state of `System`, shape (states, n)
    solution: Callable[[Any], Array]
    steps: Array  # times of the integrator's steps (s)
    crossings: Array  # times at which the bit turns at exactly the set speed (s)
    extremes: Array  # times at which the bit speed has an extreme (s)


@dataclass(frozen=True, eq=False)
class Motion:
    """A whole run as the solver saw it; `trajectory.py` makes signals and measures of it."""

    design: Design  # what was simulated
    system: System  # its equations
    pieces: tuple[Piece, ...]  # the stretches in order
    events: tuple[Event, ...]  # the changes between them
    energy: EnergyAudit  # over the whole run
    tolerance: float  # relative and absolute tolerance of the integrator
    method: str  # SciPy's name of the integrator


def solve(design: Design, tolerance: float = 1e-8, method: Method = "DOP853") -> Motion:
    """Simulate a design with located events."""
    system = system_of(design)
    duration = design.tables.simulation.duration
    first = system.start(design)
    state = system.stop(0.0, 1, first)
    time, phase = 0.0, system.direction_at(0.0, state)
    events: list[Event] = []
    changes = 0
    while True:
        stop = min(system.next_stop(time), duration)
        piece, state, by_itself = _run(system, time, stop, phase, state, tolerance, method)
        system.pieces.append(piece)
        time = piece.end
        if time >= duration:
            break
        before = phase
        if by_itself:
            phase = system.next_direction(time, phase, state)
        else:
            state = system.stop(time, phase, state)
            phase = system.after_stop(time, phase, state)
        if phase != before or by_itself:
            changes += 1
            direction = system.direction_of(phase)
            if direction or system.direction_of(before):
                events.append(Event(time, "release" if direction else "stick", direction))
        if changes >= MOST_PHASES:
            raise SimulationError(f"{MOST_PHASES} changes of phase by {time:g} s: chattering")
    energy = _audit(system, first, state)
    pieces = tuple(system.pieces)
    return Motion(design, system, pieces, tuple(events), energy, tolerance, method)


def system_of(design: Design) -> System:
    """The equations of a design: those that its bit-rock law needs."""
    if isinstance(design.bit_rock, PrintedThreeBranch):
        return PrintedSystem(design)
    return System(design)


def _run(
    system: System,
    begin: float,
    end: float,
    phase: int,
    state: Array,
    tolerance: float,
    method: Method,
) -> tuple[Piece, Array, bool]:
    """Integrate one phase until it ends by itself (then true) or at a time."""
    equations = system.equations(phase)
    result = integrate(
        equations.rates,
        (begin, end),
        state,
        method=method,
        rtol=tolerance,
        atol=tolerance,
        events=equations.events,
        dense_output=True,
        longest_step=equations.longest_step,
    )
    if result.status < 0:
        raise SimulationError(f"the integrator failed at {result.t[-1]:g} s: {result.message}")
    if not np.isfinite(result.y[:, -1]).all():
        raise SimulationError(f"the motion is no longer finite at {result.t[-1]:g} s")
    final = result.y[:, -1].copy()
    if result.status == 1:
        final = system.at_end(float(result.t[-1]), phase, final)
    crossings, extremes = (np.asarray(times) for times in result.t_events[1:3])
    direction = system.direction_of(phase)
    end = float(result.t[-1])
    piece = Piece(begin, end, phase, direction, result.sol, result.t, crossings, extremes)
    return piece, final, result.status == 1


def _audit(system: System, before: Array, after: Array) -> EnergyAudit:
    """Energy balance between the first and the final state."""
    nodes = system.nodes

    def stored(state: Array) -> float:
        speed = state[nodes : 2 * nodes] + system.set_speed
        return stored_energy(system.string, state[:nodes], speed)

    drive, bit, damping = (float(w) for w in after[2 * nodes : 2 * nodes + WORKS])
    return EnergyAudit(drive, bit, damping, stored(after) - stored(before))


def j1(motion: Motion) -> float:
    """J1 of a run (s): the bit's angle in the frame between crossings of the set speed."""
    table = motion.design.tables.simulation
    total = 0.0
    for piece in motion.pieces:
        low, high = max(piece.begin, table.j1_from), min(piece.end, table.duration)
        if high > low:
            inside = piece.crossings[(piece.crossings > low) & (piece.crossings < high)]
            knots = np.concatenate([[low], inside, [high]])
            total += float(np.abs(np.diff(piece.solution(knots)[motion.system.nodes - 1])).sum())
    return total / motion.design.speed
