"""Reference solver: slip and stick as separate smooth systems with located events.

Independent of the batch engine: physical coordinates, adaptive steps, events located on dense
output. No friction law is ever smoothed: the bit is either turning, with the torque of its law, or
at rest, with the torque that holds it, as long as that is within the static one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array, Index
from drillctl.design import Design
from drillctl.errors import InputError, SimulationError
from drillctl.linear.observer import observer_of
from drillctl.progress import SILENT, Progress, reporting_compilation
from drillctl.rig.bit_rock import PrintedThreeBranch
from drillctl.rig.bit_rock.variation import NoVariation, path
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.top_drive import RealDrive, SampledDrive
from drillctl.rig.weight_on_bit import PATHS, AlarmWeight, ObservedWeight
from drillctl.simulation.lanes import single_lane
from drillctl.simulation.measures import EnergyAudit, Event
from drillctl.simulation.room import longer

STEPS = 1_000  # steps from one look at an interruption to the next: some milliseconds
ROOM = 1 << 13  # steps that a tape has room for at first


class Numbers(NamedTuple):
    """A rig as the compiled solver takes it."""

    rig: Any  # one record of `reference_rates.RIG`
    arrays: dict[str, Array]  # what it points to, by the name of the address
    kept: Index  # states that are kept of each step
    sums: Any  # two sums of states, of a bit that is held and of one that is not
    # accelerations of the top by load (rad/s2) and by bit torque, held and free; reaction by load
    # (N m) and per top torque
    ends: Array
    state: Array  # shape (states,): at time zero, and then at the end


@dataclass(frozen=True, eq=False)
class Motion:
    """A whole run as the solver saw it; `run.py` makes signals and measures of it."""

    design: Design  # what was simulated
    numbers: Numbers  # with every step on its tape
    # shape (pieces, 4): begin and end (s), phase and first step of each stretch of one phase
    pieces: Array
    changes: Array  # shape (changes, 4): time (s), 1 for a release, direction, 1 if it is an event
    # shape (crossings, 2): when the bit turns at the set speed (s), its angle (rad)
    crossings: Array
    extremes: Array  # shape (extremes, 2): when its speed has an extreme (s), and that (rad/s)
    energy: EnergyAudit  # over the whole run
    tolerance: float  # relative and absolute tolerance of the steps
    method: str  # how the steps were taken
    steps: int  # how many
    refused: int  # and how many were taken again, shorter

    @property
    def events(self) -> tuple[Event, ...]:
        """Sticks and releases."""
        return tuple(
            Event(float(time), "release" if loose else "stick", int(direction))
            for time, loose, direction, shown in self.changes
            if shown
        )

    @property
    def begins(self) -> Array:
        """When each piece begins (s)."""
        return self.pieces[:, 0]

    @property
    def ends(self) -> Array:
        """When each piece ends (s)."""
        return self.pieces[:, 1]

    @cached_property
    def directions(self) -> Array:
        """Direction of slip in each piece; 0 where the bit counts as stuck."""
        phase = self.pieces[:, 2]
        return np.where(np.abs(phase) == 1.0, phase, 0.0)

    def components(self, components: list[int], time: Array) -> Array:
        """Components of the tape at times (s), shape (components, times)."""
        from drillctl.simulation.reference_signals import components_at

        out = np.empty((len(components), len(time)))
        wanted = np.array(components, dtype=np.int64)
        components_at(self.numbers.rig, wanted, np.ascontiguousarray(time), out)
        return out

    def torques(self, time: Array) -> Array:
        """Torque of the drive, weight, torque on the bit (N m, N, N m), phase; shape (4, times)."""
        from drillctl.simulation.reference_signals import torques_at

        numbers = self.numbers
        state, unused = numbers.state.copy(), numbers.state.copy()
        out = np.empty((4, len(time)))
        torques_at(
            numbers.rig, numbers.kept, numbers.ends, self.pieces, np.ascontiguousarray(time),
            state, unused, out,
        )  # fmt: skip
        return out

    def bit_angle(self, time: Array) -> Array:
        """Angle of the bit in the frame (rad) at times (s)."""
        from drillctl.simulation.reference_rates import BIT_ANGLE

        return self.components([BIT_ANGLE], time)[0]

    def bit_speed(self, time: Array) -> Array:
        """Absolute bit speed (rad/s) at times (s); exactly zero while stuck."""
        from drillctl.simulation.reference_rates import BIT_SPEED

        piece = np.minimum(np.searchsorted(self.ends, time), len(self.ends) - 1)
        speed = self.components([BIT_SPEED], time)[0] + self.design.speed
        return np.where(self.directions[piece] == 0.0, 0.0, speed)

    def top_speed(self, time: Array) -> Array:
        """Absolute speed of the top drive (rad/s) at times (s)."""
        from drillctl.simulation.reference_rates import TOP_SPEED

        return self.components([TOP_SPEED], time)[0] + self.design.speed

    def mean_speed(self, begin: float, end: float) -> float:
        """Mean bit speed between two times (rad/s)."""
        first, last = self.bit_angle(np.array([begin, end]))
        return float(last - first) / (end - begin) + self.design.speed

    def wall_stuck(self, time: Array) -> Array:
        """1 where the wall holds a node, the bit last, at times (s), shape (times, nodes)."""
        piece = np.minimum(np.searchsorted(self.ends, time), len(self.ends) - 1)
        modes = np.column_stack([self.pieces[:, 4:], self.directions])
        return (modes[piece] == 0.0).astype(float)

    def states(self, time: Array) -> Array:
        """Angles and speeds in the frame at times (s), shape (2 nodes, times), of `solve_whole`."""
        size = 2 * self.design.string.nodes
        first = len(self.numbers.kept) - size
        return self.components(list(range(first, first + size)), time)


def stuck_between(motion: Motion, begin: float, end: float) -> float:
    """Time at rest between two times (s)."""
    parts = np.minimum(motion.ends, end) - np.maximum(motion.begins, begin)
    return float(np.maximum(parts, 0.0)[motion.directions == 0.0].sum())


def solve(
    design: Design, tolerance: float = 1e-8, progress: Progress = SILENT, stiff: bool | None = None
) -> Motion:
    """Simulate a design with located events; `stiff` overrules what its string would take."""
    if design.axial is not None:
        from drillctl.simulation.cutting_motion import CuttingMotion, cutting

        with reporting_compilation(progress):
            return CuttingMotion(design, cutting.solve(design, min(0.1 * tolerance, 1e-9)))  # type: ignore[return-value]
    with reporting_compilation(progress):
        return _run(design, numbers_of(design), tolerance, progress, stiff)


def solve_whole(design: Design, tolerance: float = 1e-8) -> Motion:
    """The same, with the motion of every node kept."""
    if design.axial is not None:
        raise InputError("'richard-detournay' has no such run: it never repeats", "bit_rock.law")
    return _run(
        design, numbers_of(design, np.arange(2 * design.string.nodes)), tolerance, SILENT, None
    )


def _run(
    design: Design, numbers: Numbers, tolerance: float, progress: Progress, stiff: bool | None
) -> Motion:
    from drillctl.simulation import reference_run as r

    rig, state = numbers.rig, numbers.state
    stiff = is_stiff(design, rig) if stiff is None else stiff
    work = r.work_for(len(state))
    method, solver = r.method_for(stiff, design.string.nodes, len(state))
    clock = _clock(design, numbers, tolerance)
    r.begin(rig, clock, work, state)
    shown, ended = 0, r.advance(rig, method, solver, clock, work, numbers.sums, state, 0)
    progress.begin("simulated seconds", math.ceil(clock.duration))
    while ended == r.MORE:
        clock = _with_room(numbers, clock)
        ended = r.advance(rig, method, solver, clock, work, numbers.sums, state, STEPS)
        progress.advance(int(clock.now[r.TIME]) - shown)
        shown = int(clock.now[r.TIME])
    time, count = float(clock.now[r.TIME]), clock.count
    if ended == r.CHATTERS:
        raise SimulationError(f"{r.MOST_PHASES} changes of phase by {time:g} s: chattering")
    if ended == r.TOO_SHORT:
        raise SimulationError(f"the integrator failed at {time:g} s: no step is short enough")
    if ended == r.NOT_FINITE:
        raise SimulationError(f"the motion is no longer finite at {time:g} s")
    return Motion(
        design=design,
        numbers=numbers,
        pieces=clock.pieces[: count[r.PIECES]],
        changes=clock.changes[: count[r.CHANGES]],
        crossings=clock.crossings[: count[r.CROSSINGS]],
        extremes=clock.extremes[: count[r.EXTREMES]],
        energy=_audit(design, numbers.arrays["begin"], state, rig[0]),
        tolerance=tolerance,
        method="Rodas5P" if stiff else "DOP853",
        steps=int(rig["steps"][0]),
        refused=int(count[r.REFUSED]),
    )


def _clock(design: Design, numbers: Numbers, tolerance: float) -> Any:
    from drillctl.simulation import reference_run as r

    return r.Clock(
        tolerance, design.tables.simulation.duration, 0, numbers.kept,
        np.array(design.program.breaks()), np.zeros(8), np.zeros(7, dtype=np.int64),
        np.zeros((64, 4 + max(int(numbers.rig["wall_nodes"][0]), 0))), np.zeros((64, 4)),
        np.zeros((256, 2)), np.zeros((1024, 2)),
    )  # fmt: skip


def _with_room(numbers: Numbers, clock: Any) -> Any:
    """Tables twice as long where they are nearly full."""
    from drillctl.simulation import reference_run as r

    count, arrays, time = clock.count, numbers.arrays, float(clock.now[r.TIME])
    arrays["tape"] = longer(arrays["tape"], int(numbers.rig["steps"][0]), time)
    numbers.rig["tape"] = arrays["tape"].ctypes.data
    return clock._replace(
        room=len(arrays["tape"]),
        pieces=longer(clock.pieces, int(count[r.PIECES]), time),
        changes=longer(clock.changes, int(count[r.CHANGES]), time),
        crossings=longer(clock.crossings, int(count[r.CROSSINGS]), time),
        extremes=longer(clock.extremes, int(count[r.EXTREMES]), time),
    )


def _audit(design: Design, before: Array, after: Array, rig: Any) -> EnergyAudit:
    """Energy balance between the first and the final state."""
    string, nodes = design.string, design.string.nodes

    def stored(state: Array) -> float:
        angle, speed = state[:nodes], state[nodes : 2 * nodes] + design.speed
        kinetic = 0.5 * speed @ (string.mass @ speed)
        return float(kinetic + 0.5 * angle @ (string.stiffness @ angle))

    drive, bit, damping = (float(w) for w in after[2 * nodes : 2 * nodes + 3])
    wall = float(rig["wall_work"])
    if rig["drifts"]:  # its power was integrated with that of damping
        damping -= wall
    return EnergyAudit(drive, bit, damping, stored(after) - stored(before), wall=wall)


# Explicit or stiff steps.

FEW = 300.0
"""Explicit steps a second that no string is spared: below that they cost less than stiff ones."""
EXPLICIT_SWING, EXPLICIT_DECAY = 4.5, 6.4
"""Frequency and decay (1/s) of a mode that DOP853 follows in steps of a second, as measured."""
RATIO = 0.005
"""Damping ratio of the fastest mode from which it dies out by itself. Less damped, its swing after
each stick would have to be followed all the same, at which explicit steps are better."""
TURNS = 60  # of the power iteration: the fastest mode within a few per cent


def is_stiff(design: Design, rig: Any) -> bool:
    """Whether explicit steps would follow modes that have died out long before."""
    if rig["tolerance"][0] > 0.0 or rig["full"][0] or not rig["damped"][0]:
        return False
    if rig["wall_nodes"][0] >= 0:  # nodes that stick are in no Jacobian
        return False
    if rig["turns"][0] > 0.0:  # torques that follow the angle are in no Jacobian
        return False
    swing, decay = _fastest(design.string, rig)
    needed = max(swing / EXPLICIT_SWING, decay / EXPLICIT_DECAY)
    return needed > FEW and decay > 2.0 * RATIO * swing


def _fastest(string: Drillstring, rig: Any) -> tuple[float, float]:
    """Largest frequency without damping (1/s), and largest rate of decay without springs (1/s)."""
    from drillctl.simulation.reference_rates import accelerate

    order = np.arange(string.nodes)
    # Of the fastest mode neighbours move apart; no symmetry may leave it out of the start.
    start = np.where(order % 2, 1.0, -1.0) * (1.0 + order / string.nodes)
    largest = []
    for matrix in (string.stiffness, string.damping):
        mode = start
        for _ in range(TURNS):
            mode = matrix @ (mode / np.linalg.norm(mode))
            accelerate(rig, mode, string.nodes)
        largest.append(float(np.linalg.norm(mode)))
    return math.sqrt(largest[0]), largest[1]


# A design in numbers.


def numbers_of(design: Design, also_kept: NDArray[np.integer[Any]] | None = None) -> Numbers:
    """The rig of a design as the compiled solver takes it."""
    from drillctl.simulation import reference_rates as f
    from drillctl.simulation.reference_run import addresses

    n = design.string.nodes
    plain, arrays = _laws_of(design)
    drive_states = f.MEMORIES[int(plain["drive_kind"])]
    weight_states = 0
    if plain["weight_kind"] != f.AT_ONCE:
        weight_states = 2 + (int(plain["observer_states"]) or 1)
    size = 2 * n + f.WORKS + drive_states + weight_states
    kept = np.concatenate([
        [0, n, 1, n + 1, n - 1, 2 * n - 1, n - 2], np.arange(2 * n + f.WORKS, size),
        [] if also_kept is None else also_kept,
    ]).astype(np.int64)  # fmt: skip
    arrays |= _string_arrays(design.string, design.speed)
    numbers, arrays["path"] = _variation_of(design)
    plain |= numbers
    numbers, arrays["wall"] = _wall_of(design)
    plain |= numbers
    components = len(kept) + (3 if plain["wall_nodes"] > 0 else 2)
    arrays |= {
        "begin": np.zeros(size), "scratch": np.zeros(size),
        "tape": np.empty((ROOM, f.FIRST + 8 * components)),
    }  # fmt: skip
    damping = design.string.damping.tocoo()
    rig = np.zeros(1, dtype=f.RIG)
    for name, value in {
        **plain,
        **{name: array.ctypes.data for name, array in arrays.items()},
        "nodes": n, "states": size, "drive_states": drive_states, "weight_states": weight_states,
        "damped": not design.string.undamped,
        "full": bool(np.any(np.abs(damping.row - damping.col) > 1)),
        "coupled": bool(np.any(arrays["bands"][f.SIDE_MASS])),
        **addresses(
            int(plain["drive_kind"]), int(plain["weight_kind"]), bool(plain["wall_nodes"] >= 0)
        ),
        "components": components,
        "set_speed": design.speed,
        "drag": float(design.string.ground_damping.sum()) * design.speed,
    }.items():  # fmt: skip
        rig[name] = value
    sums, ends = _sums(design, arrays["bands"], rig)
    state = _start(design, size, drive_states, weight_states)
    arrays["begin"][:] = state
    return Numbers(rig, arrays, kept, sums, ends, state)


def _string_arrays(string: Drillstring, set_speed: float) -> dict[str, Array]:
    from drillctl.simulation import reference_rates as f

    n = string.nodes
    bands = np.zeros((10, n))
    mass, side_mass = string.mass.diagonal(), string.mass.diagonal(1)
    pivot = mass[0]
    bands[f.PIVOT, 0] = 1.0 / pivot
    for i in range(n - 1):
        bands[f.FACTOR, i] = side_mass[i] / pivot
        pivot = mass[i + 1] - bands[f.FACTOR, i] * side_mass[i]
        bands[f.PIVOT, i + 1] = 1.0 / pivot
    bands[f.MASS] = mass
    bands[f.STIFFNESS, : n - 1] = string.element_stiffness
    bands[f.DAMPING] = string.damping.diagonal()
    bands[f.SIDE_DAMPING, : n - 1] = string.damping.diagonal(1)
    bands[f.LOAD] = string.ground_damping * set_speed
    bands[f.SIDE_MASS, : n - 1] = side_mass
    return {"bands": f.factorised(bands), "full_damping": string.damping.toarray()}


def _laws_of(design: Design) -> tuple[dict[str, Any], dict[str, Array]]:
    """Kinds and addresses of the laws, and their numbers."""
    from drillctl.simulation import reference_rates as f
    from drillctl.simulation.law_calls import address

    drive, weight, program = design.top_drive, design.weight_on_bit, design.program
    rocks: list[Any] = [design.bit_rock_before, design.bit_rock]
    tolerance = 0.0
    if isinstance(rocks[1], PrintedThreeBranch):
        tolerance = float(rocks[1].tolerance)
        rocks = [rock.turning for rock in rocks]
    drive_kind = f.IDEAL
    if isinstance(drive, SampledDrive):
        drive_kind = f.SAMPLED
    elif isinstance(drive, RealDrive):
        drive_kind = f.CONTINUOUS
    weight_kind, method = f.AT_ONCE, "weight"
    if isinstance(weight, PATHS):
        weight_kind, method = f.MEASURED, "command"
        if isinstance(weight, AlarmWeight):
            weight_kind, method = f.ALARMED, "next_level"
        elif isinstance(weight, ObservedWeight):
            weight_kind = f.OBSERVED
    path = ("delay", "period", "sensor", "hoist", "rate", "window")
    rows = {
        f.DRIVE: drive, f.ROCK: rocks[1], f.ROCK_BEFORE: rocks[0], f.WEIGHT: weight,
        f.PRESENT: weight, f.PATH: [getattr(weight, name, 0.0) for name in path],
        f.SPEED_PROGRAM: program.speed, f.WEIGHT_PROGRAM: program.weight,
    }  # fmt: skip
    laws = np.zeros((len(rows), f.MOST_NUMBERS))
    for row, numbers in rows.items():
        laws[row, : len(numbers)] = [float(number) for number in numbers]
    seen = observer_of(design)
    observer = np.zeros((3, 0))
    if seen is not None:
        observer = np.vstack([seen.by_torque, seen.by_speed, seen.read, seen.free])
    plain = {
        "drive_kind": drive_kind,
        "drive_torque": address(drive, "torque") if drive_kind == f.IDEAL else 0,
        "rock_torque": address(rocks[1], "torque_and_slope"),
        "static_torque": address(rocks[1], "static_torque"),
        "set_valued": bool(design.bit_rock.set_valued)
        or (design.wall is not None and not design.wall.drifts),
        "smooth": not (design.bit_rock.set_valued or tolerance > 0.0),
        "weight_kind": weight_kind,
        "weight": address(weight, method),
        "observer_states": observer.shape[1],
        "tolerance": tolerance,
        "rock_until": float(program.rock_until),
    }
    return plain, {"laws": laws, "observer": np.ascontiguousarray(observer)}


def _wall_of(design: Design) -> tuple[dict[str, Any], Array]:
    """Friction of the wall at the bit and at other nodes; -1 nodes where there is none at all."""
    from drillctl.simulation import reference_wall as w

    one = design.wall
    if one is None:
        return {"wall_nodes": -1}, np.zeros((w.ROWS, 1))
    table = np.zeros((w.ROWS, max(len(one.nodes) - 1, 1)))
    table[w.NODE, : len(one.nodes) - 1] = one.nodes[:-1]
    table[w.FRICTION, : len(one.nodes) - 1] = one.torque[:-1]
    table[w.DRIFT, : len(one.nodes) - 1] = drift = one.drift[:-1]
    if math.isfinite(one.critical):
        left = np.sqrt(np.maximum(one.critical**2 - drift**2, 0.0))
        table[w.CRITICAL, : len(one.nodes) - 1] = left
    return {
        "drifts": one.drifts,
        "wall_nodes": len(one.nodes) - 1, "bit_friction": float(one.torque[-1]), "bit_level": 1.0,
        "wall_ratio": one.ratio, "wall_critical": one.critical,
    }, table  # fmt: skip


def _variation_of(design: Design) -> tuple[dict[str, Any], Array]:
    """How the rock varies along the way, and its path."""
    one = design.variation
    if isinstance(one, NoVariation):
        return {"spacing": 1.0}, np.zeros(2)
    nodes = int(one.nodes(design.tables.simulation.duration, design.speed))
    names = ("spread", "spacing", "advance", "turns")
    return {name: getattr(one, name) for name in names} | {"path_nodes": nodes}, path(one, nodes)


def _start(design: Design, size: int, drive_states: int, weight_states: int) -> Array:
    """State at time zero; the weight's reading comes with the first look at it."""
    from drillctl.simulation.reference_rates import WORKS

    n, begin = design.string.nodes, single_lane(design).begin
    state = np.zeros(size)
    state[:n], state[n : 2 * n] = begin.angles[:, 0], begin.speeds[:, 0]
    drive = state[2 * n + WORKS :][:drive_states]
    drive[:1] = state[n]  # speed seen
    drive[7:8] = state[n]  # and last seen
    memory = state[size - weight_states :]
    seen = observer_of(design)
    if seen is not None:
        memory[: seen.states] = seen.state(state[:n], state[n : 2 * n])
    elif weight_states:
        memory[0] = abs(state[2 * n - 1] + design.speed)
    return state


def _sums(design: Design, bands: Array, rig: Any) -> tuple[Any, Array]:
    """What the torques at both ends follow from, as sums of angles and speeds.

    The acceleration of the top without its torque, in stick and in slip, and the torque that
    holds the bit.
    """
    from drillctl.simulation import reference_rates as f

    n = design.string.nodes
    stiffness, damping = design.string.stiffness, design.string.damping
    held, free = bands[f.HELD_TOP], bands[f.FREE_TOP]

    def forces_by(row: Array) -> Array:
        return -np.concatenate([stiffness @ row, damping @ row])

    above, bit = np.eye(n)[n - 2], np.eye(n)[n - 1]
    f.accelerate(rig, above, n - 1)
    coupling, load = bands[f.SIDE_MASS, n - 2], bands[f.LOAD]
    ends = np.array([
        [-held @ load, 0.0], [-free @ load, free[n - 1]],
        [-load[n - 1] + coupling * (above @ load), -coupling * held[n - 2]],
    ])  # fmt: skip
    of_held = np.vstack([forces_by(held), forces_by(bit) - coupling * forces_by(above)])
    # Without a memory a drive needs no acceleration, and a bit that slips no reaction.
    of_free = np.vstack([forces_by(free)]) if rig["drive_states"][0] else np.zeros((0, 2 * n))
    return (np.ascontiguousarray(of_held), np.ascontiguousarray(of_free)), ends
