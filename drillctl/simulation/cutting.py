"""Runs of a bit that cuts its own wake: torsion and axial motion, in both engines.

`cutting_events.py` locates events, `kernels/cutting_step.py` takes fixed steps of many lanes. Here
is what both begin with: two strings as linear systems, the bit, the start.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from drillctl.arrays import Array
from drillctl.errors import InputError, SimulationError
from drillctl.linear.observer import observer_of
from drillctl.rig.axial import AxialString
from drillctl.rig.bit_rock.richard_detournay import RichardDetournay
from drillctl.rig.bit_rock.variation import NoVariation, Variation, path
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.program import OF_A_PATH
from drillctl.rig.top_drive import RealDrive, SampledDrive
from drillctl.rig.top_drive.real_drive import MEMORY, SAMPLED_MEMORY
from drillctl.rig.weight_on_bit import PATHS, AlarmWeight, FollowingSpeed
from drillctl.simulation.lanes import Start, single_lane
from drillctl.simulation.room import longer

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.simulation.lanes import Lanes


class Steady(NamedTuple):
    """Steady drilling; numbers, or arrays over lanes."""

    depth_of_cut: Any  # in a turn (m)
    velocity: Any  # rate of penetration (m/s)
    torque: Any  # N m
    slope: Any  # of the surface (m/rad)


def steady(rock: RichardDetournay, weight: Any, speed: Any) -> Steady:
    """Steady drilling under a weight (N) at a set speed (rad/s)."""
    depth = rock.depth_of_cut(weight)
    slope = depth / (2.0 * math.pi)
    return Steady(depth, slope * speed, rock.static_torque(weight), slope)


# Both strings as linear systems.


class System(NamedTuple):
    """x' = A x + by_top f_top + by_bit f_bit + load, x = [modal coordinates, their rates]."""

    a: Array
    by_top: Array
    by_bit: Array
    drag: Array  # load per set speed, or per steady velocity
    # shape (6, states): displacement and velocity of the bit, the top, the node below it
    read: Array
    damping: Array  # shape (states, states): quadratic form of the dampers' power
    modal: Array  # shape (modes, nodes): modal coordinates per displacement of the nodes
    ground: float  # sum of dampers to ground


def torsional(string: Drillstring, modes: int) -> System:
    """The string in its frame; a torque of the rock brakes."""
    frequency, shapes = string.undamped_modes
    mass, damping = string.mass.toarray(), string.damping.toarray()
    ground = string.ground_damping
    return _system(frequency[:modes], shapes[:, :modes], mass, damping, -ground, -1.0)


def along(string: AxialString, modes: int) -> System:
    """The axial string; a force at the bit pushes down, what differs from it the rock's."""
    frequency, shapes = string.modes
    ground = string.damping.sum(axis=1)
    return _system(frequency[:modes], shapes[:, :modes], string.mass, string.damping, ground, 1.0)


def _system(
    frequency: Array, shapes: Array, mass: Array, damping: Array, drag: Array, sign: float
) -> System:
    n = len(frequency)
    modal = shapes.T @ damping @ shapes
    if not drag.any():  # all damping is internal: none of the rigid body
        modal[0] = modal[:, 0] = 0.0
    zero = np.zeros(n)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(frequency**2), -modal]])
    rows = [shapes[-1], shapes[0], shapes[1] if len(shapes) > 1 else shapes[0]]
    read = [[*row, *zero] for row in rows], [[*zero, *row] for row in rows]
    quadratic = np.zeros((2 * n, 2 * n))
    quadratic[n:, n:] = modal
    return System(
        a, np.concatenate([zero, shapes[0]]), sign * np.concatenate([zero, shapes[-1]]),
        np.concatenate([zero, shapes.T @ drag]),
        np.array([one for pair in zip(*read, strict=True) for one in pair]), quadratic,
        shapes.T @ mass, float(abs(drag.sum())),
    )  # fmt: skip


# The reference solver.


class Located(NamedTuple):
    """A run with located events."""

    task: Any
    memory: Any
    before: Array  # state at time zero


def solve(design: Design, tolerance: float = 1e-9) -> Located:
    """Simulate a design with located events."""
    from drillctl.simulation import cutting_events as e

    assert design.axial is not None
    lane = single_lane(design)
    rock, speed, program = design.bit_rock, design.speed, design.program
    assert isinstance(rock, RichardDetournay)
    first: Any = design.bit_rock_before if program.rock_until > 0.0 else rock
    nominal = design.tables.operating_point.weight_on_bit
    begins = float(lane.weight_at_rest[0])
    point, start = steady(rock, nominal, speed), steady(first, begins, float(lane.begin_speed[0]))
    torsion, axial = (
        torsional(design.string, design.string.nodes),
        along(design.axial, design.axial.nodes),
    )
    angles, speeds = lane.begin.angles[:, 0], lane.begin.speeds[:, 0]
    n, m = len(torsion.by_bit), len(axial.by_bit)
    stands = speeds[-1] + speed == 0.0
    drive = _drive(e, design.top_drive)
    hook, followed, sizes = _hook(design, lane.begin, n + m + drive.states, point.torque)
    state = np.zeros(n + m + drive.states + hook.states + e.WORKS)
    state[: n // 2], state[n // 2 : n] = torsion.modal @ angles, torsion.modal @ speeds
    if not stands:
        state[n + m // 2 : n + m] = axial.modal @ np.full(axial.modal.shape[1], start.velocity)
    if drive.states:
        held = float(lane.begin_torque[0]) if design.tables.start.kind == "steady" else 0.0
        state[n + m :][: drive.states] = _memory(design.top_drive, drive.states, held, speeds[0])
    state[hook.first : hook.first + hook.states] = followed
    vary = _varying(design.variation, design.tables.simulation.duration, speed, point.velocity)
    between = 2.0 * math.pi / rock.blades
    # A bit that does not drill is small against one that does.
    sized = point if point.velocity else steady(rock, 2.0 * rock.flat_force, speed)
    scale = np.concatenate([
        np.full(n // 2, _size(torsion.modal, sized.torque / design.string.static_stiffness)),
        np.full(n // 2, _size(torsion.modal, speed)),
        np.full(m // 2, _size(axial.modal, sized.depth_of_cut / rock.blades)),
        np.full(m // 2, _size(axial.modal, sized.velocity)),
        np.array([
            speed, sized.torque, sized.torque, 1.0, sized.torque, sized.torque, sized.torque, speed,
            sized.torque,
        ])[: drive.states],
        sizes,
        np.array([*[sized.torque * speed] * 5, speed, nominal or rock.flat_force]) + 1e-300,
    ])  # fmt: skip
    task = e.Task(
        _side(e, torsion, speed, torque=True), _side(e, axial, point.velocity, torque=False),
        e.Bit(between, rock.blades), drive, hook,
        _path(program.speed), _path(program.weight), _rock(rock), program.rock_until,
        np.array([*program.breaks(), math.inf]), speed,
        design.tables.simulation.duration, tolerance, scale, start.slope,
        np.array([axial.read[1] @ axial.by_bit, -torsion.read[1] @ torsion.by_bit]), *vary,
    )  # fmt: skip
    rests = stands or start.velocity == 0.0
    return _run(e, task, state, (e.STUCK if rests else e.DOWN, int(not stands)), _rock(first))


def _rock(rock: RichardDetournay) -> Array:
    """Numbers of a rock in the order of `cutting_events`."""
    return np.array([
        rock.blades * rock.force_per_depth, rock.blades * rock.torque_per_depth,
        rock.flat_force, rock.flat_torque,
    ])  # fmt: skip


def _path(path: Any) -> Array:
    """Numbers of a program, zeros behind those of a single ramp."""
    numbers = np.zeros(len(OF_A_PATH))
    numbers[: len(path)] = path
    return numbers


def _hook(design: Design, begin: Start, first: int, torque: float) -> tuple[Any, Array, Array]:
    """The hook, its memory at time zero, and below which errors in that do not matter."""
    from drillctl.simulation import reference_rates as f
    from drillctl.simulation.cutting_hook import Hook

    law, angles, speeds = design.weight_on_bit, begin.angles[:, 0], begin.speeds[:, 0]
    nominal = float(law[0])  # type: ignore[index]
    given: dict[str, Any] = dict.fromkeys(Hook._fields, 0.0)
    given |= {key: float(x) for key, x in law._asdict().items() if key in given}
    given |= {"kind": f.AT_ONCE, "first": first, "states": 0, "nominal": nominal}
    given |= {"observer": np.zeros((3, 0))}
    if not isinstance(law, PATHS):
        if not isinstance(law, FollowingSpeed):
            given |= {"least": -math.inf, "most": math.inf}
        return Hook(**given), np.zeros(0), np.zeros(0)
    signal, sizes = np.array([abs(speeds[-1] + design.speed)]), np.array([design.speed])
    given |= {"kind": f.ALARMED if isinstance(law, AlarmWeight) else f.MEASURED}
    seen, now = observer_of(design), float(signal[0])
    if seen is not None:
        signal, modal = seen.state(angles, speeds), seen.from_speed
        sizes = np.full(seen.states, _size(modal, design.speed))
        sizes[1 : seen.states // 2] = _size(modal, torque / design.string.static_stiffness)
        sizes[-1] = torque
        now = abs(design.speed + float(seen.read @ signal))
        given |= {
            "kind": f.OBSERVED, "drag": float(design.string.ground_damping.sum()) * design.speed,
            "observer": np.vstack([seen.by_torque, seen.by_speed, seen.read, seen.free]),
        }  # fmt: skip
    present = nominal * (1.0 + design.program.weight.at(0.0))
    reading, asked = now, present
    if isinstance(law, AlarmWeight):
        reading = 1.0
    else:
        asked = float(law.command(now, present))
    given |= {"begin": now, "states": len(signal) + 2}
    size = 1.0 if isinstance(law, AlarmWeight) else design.speed
    return (
        Hook(**given), np.concatenate([signal, [reading, asked]]),
        np.concatenate([sizes, [size, nominal]]),
    )  # fmt: skip


def _drive(e: Any, drive: Any) -> Any:
    kp, ki = (float(x) for x in drive.gains())
    if not isinstance(drive, RealDrive):
        return e.Drive(e.IDEAL, float(drive.torque(0.0, 0.0)), kp, ki, np.zeros(1), 0)
    sampled = isinstance(drive, SampledDrive)
    kind, memory = (e.SAMPLED, SAMPLED_MEMORY) if sampled else (e.CONTINUOUS, MEMORY)
    return e.Drive(kind, 0.0, kp, ki, np.array([float(x) for x in drive]), len(memory))


def _memory(drive: Any, states: int, held: float, speed: float) -> Array:
    """Memory of a drive at time zero, by the names of `SAMPLED_MEMORY`."""
    memory = np.zeros(9)
    memory[0] = memory[7] = speed
    if held != 0.0 and drive.ki != 0.0:
        memory[3] = (held - drive.feedforward) / drive.ki
        memory[[1, 2, 4, 5, 6]] = held
    return memory[:states]


def _side(e: Any, system: System, speed: float, torque: bool) -> Any:
    """A system at its steady speed, with the power that its dampers take there."""
    sign = 1.0 if torque else -1.0
    power = -sign * system.drag * speed
    return e.Side(
        system.a, system.by_top, -system.by_bit if torque else system.by_bit, system.drag * speed,
        np.vstack([system.read, power]), system.damping,
        system.ground * speed**2 if torque else 0.0,
    )  # fmt: skip


def _size(modal: Array, displacement: float) -> float:
    """Size of modal coordinates that such a displacement of the nodes makes."""
    return float(np.abs(modal).sum(axis=1).max() * displacement) + 1e-300


def _varying(
    variation: Variation | NoVariation, duration: float, speed: float, velocity: float
) -> tuple[Array, Array]:
    if isinstance(variation, NoVariation):
        return np.zeros(2), np.array([0.0, 1.0, 0.0, 0.0, 0.0])
    one, nodes = variation, int(variation.nodes(duration, speed, velocity))
    return path(one, nodes), np.array([one.spread, one.spacing, one.advance, one.turns, one.sinks])


def _run(e: Any, task: Any, state: Array, phases: tuple[int, int], rock: Array) -> Located:
    from drillctl.simulation.cutting_tape import COLUMNS, Memory

    room, size = 1 << 14, len(state)
    n, m = len(task.torsion.by_bit), len(task.axial.by_bit)
    place = task.torsion.read[0] @ state[:n], task.axial.read[0] @ state[n : n + m]
    memory = Memory(
        np.array([0.0, 1e-3 * task.bit.between / task.set_speed, *place, 0.0]),
        np.array([*phases, 0, 0, 0, 0, 0]), rock, np.zeros((room, COLUMNS)),
        np.zeros((4096, 2)), state.copy(), np.zeros((9, size)),
    )  # fmt: skip
    while True:
        ended = e.advance(task, memory, 2000)
        if ended == e.DONE:
            return Located(task, memory, state)
        if ended in (e.TOO_SHORT, e.CHATTERS):
            what = "no step is short enough" if ended == e.TOO_SHORT else "the bit chatters"
            raise SimulationError(f"{what} at {memory.now[0]:g} s")
        if not np.isfinite(memory.state).all():
            raise SimulationError(f"the motion is no longer finite at {memory.now[0]:g} s")
        time = float(memory.now[0])
        memory = memory._replace(
            tape=longer(memory.tape, int(memory.count[2]), time),
            events=longer(memory.events, int(memory.count[3]), time),
        )


# The batch engine.

AXIAL_PHASE = 1.0  # axial modes that turn more than this (rad) in a step are left out
FINEST = 3000.0  # most points of the surface between two blades
SPACED = 0.25  # of what the bit turns in a step at the set speed, the least distance of two


def cutting_step(lanes: Lanes, step: float) -> tuple[Any, Any, int]:
    """What the kernel takes of bit and axial string, of the bit in the rock before, and points."""
    from drillctl.simulation.kernels.cutting_step import Bit, CuttingStep

    assert lanes.axial is not None
    rock, first = lanes.friction, lanes.before
    if not np.any(lanes.program.rock_until > 0.0):
        first = rock
    begin, weight = lanes.weight_at_rest, lanes.weight[0]
    between = 2.0 * math.pi / rock.blades
    closest = np.maximum(between / FINEST, SPACED * step * lanes.set_speed)
    rate = first.rate(begin, lanes.begin_speed)
    torque = lanes.begin_torque if lanes.start == "steady" else 0.0 * rate
    bits = [
        Bit(*(np.ascontiguousarray(x, dtype=float) for x in (
            one.blades * one.force_per_depth, one.torque_per_depth / one.force_per_depth,
            one.flat_force, one.flat_torque, between,
            first.depth_of_cut(begin) / (2.0 * math.pi), rate, torque,
            rock.rate(weight, lanes.set_speed), closest,
        )))
        for one in (rock, first)
    ]  # fmt: skip
    (free, push, by_force), to_block = _axial_blocks(lanes.axial, step)
    nodes = lanes.axial.nodes
    moving = to_block @ np.concatenate([np.zeros(nodes), np.ones(nodes)])
    points = 1 << int(np.ceil(np.log2(np.max(between / closest) + 16.0)))
    made = CuttingStep(bits[0], free, push, by_force, np.outer(moving, rate))
    return made, bits[1], points


@lru_cache(maxsize=8)
def _axial_blocks(axial: AxialString, step: float) -> tuple[tuple[Array, ...], Array]:
    """The exact step of an axial string in blocks, and states per displacement and velocity."""
    from drillctl.simulation.propagator import Modal, blocks

    carried = max(1, int((axial.modes[0] * step <= AXIAL_PHASE).sum()))
    one = along(axial, carried)
    n = carried
    damping = one.damping[n:, n:]
    classical = bool(np.abs(damping - np.diag(np.diag(damping))).max() <= 1e-12 * max(
        np.abs(damping).max(), 1.0))  # fmt: skip
    none = np.zeros(2 * n)
    signals = np.array([one.read[0], one.read[1], none, none, none])
    inputs = np.column_stack([one.by_bit, one.drag])
    found = blocks(Modal(one.a, inputs, signals, classical, not one.ground), step)
    if found is None:
        raise InputError("the dampers of this string do not let it fall into modes", "axial")
    fields, basis = found
    to_modal = np.kron(np.eye(2), one.modal)
    by_force = np.array([fields["angle_by_top"], fields["speed_by_top"]])
    arrays = (fields["free"], fields["push"], by_force)
    return tuple(np.ascontiguousarray(x) for x in arrays), basis @ to_modal


def axial_measures(
    rock: Any, duration: float, drilled: Any, cut: Any, at_rest: Any, off: Any, work: Any
) -> dict[str, Any]:  # fmt: skip
    """Measures of axial motion by name, SI; numbers or arrays."""
    area = np.pi * rock.radius**2
    with np.errstate(all="ignore"):
        energy = np.where(np.asarray(drilled) > 0.0, work / (area * np.asarray(drilled)), np.nan)
    return {
        "rate_of_penetration": drilled / duration,
        "depth_of_cut": cut,
        "axial_stick_time": at_rest,
        "lost_contact_time": off,
        "specific_energy": energy if np.ndim(energy) else float(energy),
    }
