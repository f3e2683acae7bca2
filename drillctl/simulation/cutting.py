"""Runs of a bit that cuts its own wake: torsion and axial motion, in both engines.

`cutting_events.py` locates events, `cutting_step.py` takes fixed steps of many lanes. Here is what
both begin with: two strings as linear systems, the bit, the start, and the limits of the model: a
PI or a constant torque at the top, a constant force or velocity of the hook.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.linalg

from drillctl.arrays import Array
from drillctl.errors import InputError, SimulationError
from drillctl.rig.axial import AxialString
from drillctl.rig.bit_rock.richard_detournay import RichardDetournay
from drillctl.rig.bit_rock.variation import NoVariation, Variation, path, paths
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.top_drive import PI, ConstantTorque
from drillctl.rig.weight_on_bit import ConstantWeight

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.simulation.lanes import Lanes


def refuse_others(drive: Any, weight: Any, moves: bool) -> None:
    """Refuse (`InputError`) what this law does not go with yet."""
    if not isinstance(drive, (PI, ConstantTorque)):
        raise InputError(
            "'richard-detournay' goes with a PI or a constant torque without limits, lags, "
            "filters and sampling",
            "controller",
        )
    if not isinstance(weight, ConstantWeight):
        raise InputError(
            "'richard-detournay' has an axial string: the weight on the bit follows from its "
            "motion, and the hook's law is 'constant'",
            "weight_on_bit.law",
        )
    if moves:
        raise InputError("'richard-detournay' goes with no program yet", "scenario")


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


def begin(
    kind: str, string: Drillstring, drive: Any, torque: Array, set_speed: Array, turning: Array,
    bit_speed: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Angles and speeds of every node in the frame at time zero, shape (nodes, lanes) each."""
    compliance = np.concatenate([[0.0], np.cumsum(1.0 / string.element_stiffness)])
    ones, last = np.ones(string.nodes), np.eye(string.nodes)[-1]
    if kind == "rest":
        return np.zeros((string.nodes, len(torque))), np.outer(ones, -set_speed)
    if kind == "turning":
        return np.zeros((string.nodes, len(torque))), np.outer(ones, turning - set_speed)
    if kind == "wound_up":
        shape = compliance / compliance[-1]
        return np.outer(compliance, -torque), np.outer(shape, -set_speed)
    # The drive gives what rock and drag take; its angle in the frame is what its integral holds.
    rest = np.concatenate([[0.0], -np.cumsum(
        (string.ground_damping.sum() - np.cumsum(string.ground_damping)[:-1])
        / string.element_stiffness)])  # fmt: skip
    whole = torque + string.ground_damping.sum() * set_speed
    _, ki = drive.gains()
    ki = np.broadcast_to(np.asarray(ki, dtype=float), whole.shape)
    top = np.where(ki > 0.0, -whole / np.where(ki > 0.0, ki, 1.0), 0.0)
    angles = np.outer(compliance, -torque) + np.outer(rest, set_speed) + np.outer(ones, top)
    return angles, np.outer(last, bit_speed - set_speed)


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

    refuse_others(design.top_drive, design.weight_on_bit, design.program.moves)
    assert design.axial is not None
    rock, speed = design.bit_rock, design.speed
    assert isinstance(rock, RichardDetournay)
    weight = design.tables.operating_point.weight_on_bit
    point = steady(rock, weight, speed)
    torsion, axial = (
        torsional(design.string, design.string.nodes),
        along(design.axial, design.axial.nodes),
    )
    start = design.tables.start
    turning = speed if start.speed is None else start.speed
    bit_speed = speed if start.bit_speed is None else start.bit_speed
    angles, speeds = begin(
        start.kind, design.string, design.top_drive,
        *(np.array([x]) for x in (point.torque, speed, turning, bit_speed)),
    )  # fmt: skip
    n, m = len(torsion.by_bit), len(axial.by_bit)
    stands = speeds[-1, 0] + speed == 0.0
    state = np.zeros(n + m + e.WORKS)
    state[: n // 2], state[n // 2 : n] = torsion.modal @ angles[:, 0], torsion.modal @ speeds[:, 0]
    if not stands:
        state[n + m // 2 : n + m] = axial.modal @ np.full(axial.modal.shape[1], point.velocity)
    kp, ki = design.top_drive.gains()
    constant = float(design.top_drive.torque(0.0, 0.0))
    vary = _varying(design.variation, design.tables.simulation.duration, speed, point.velocity)
    between = 2.0 * math.pi / rock.blades
    scale = np.concatenate([
        np.full(n // 2, _size(torsion.modal, point.torque / design.string.static_stiffness)),
        np.full(n // 2, _size(torsion.modal, speed)),
        np.full(m // 2, _size(axial.modal, point.depth_of_cut / rock.blades)),
        np.full(m // 2, _size(axial.modal, point.velocity)),
        np.array([*[point.torque * speed] * 5, speed, weight]) + 1e-300,
    ])  # fmt: skip
    task = e.Task(
        _side(e, torsion, speed, torque=True), _side(e, axial, point.velocity, torque=False),
        e.Rock(
            rock.blades * rock.force_per_depth, rock.blades * rock.torque_per_depth,
            rock.flat_force, rock.flat_torque, between, rock.blades,
        ),
        e.Drive(constant, float(kp), float(ki)), weight, speed,
        design.tables.simulation.duration, tolerance, scale, point.slope,
        np.array([axial.read[1] @ axial.by_bit, -torsion.read[1] @ torsion.by_bit]), *vary,
    )  # fmt: skip
    return _run(e, task, state, stands)


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


def _run(e: Any, task: Any, state: Array, stands: bool) -> Located:
    room, size = 1 << 14, len(state)
    phase = e.STUCK if stands else e.DOWN
    n = len(task.torsion.by_bit)
    place = task.torsion.read[0] @ state[:n], task.axial.read[0] @ state[n : size - e.WORKS]
    memory = e.Memory(
        np.array([0.0, 1e-3 * task.rock.between / task.set_speed, *place, 0.0]),
        np.array([phase, int(not stands), 0, 0]), np.zeros((room, 34)),
        np.zeros((4096, 2)), state.copy(), np.zeros((8, size)),
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
        memory = memory._replace(
            tape=_longer(memory.tape, int(memory.count[2])),
            events=_longer(memory.events, int(memory.count[3])),
        )


def _longer(table: Array, used: int) -> Array:
    """A table twice as long where it is nearly full."""
    if used + 8 < len(table) - 2000 or (used + 8 < len(table) and len(table) < 8000):
        return table
    more = np.zeros((2 * len(table), table.shape[1]))
    more[: len(table)] = table
    return more


# The batch engine.

AXIAL_PHASE = 1.0  # axial modes that turn more than this (rad) in a step are left out


def blocks(system: System, step: float) -> Any:
    """The exact step of a system in 2 x 2 blocks; refused where it does not fall into any."""
    from drillctl.simulation.cutting_step import Blocks

    n = len(system.a) // 2
    inputs = np.column_stack([system.by_top, system.by_bit, system.drag])
    basis = _pairs(system, n)
    inverse = np.linalg.inv(basis)
    a, b, read = inverse @ system.a @ basis, inverse @ inputs, system.read @ basis
    free, push = np.empty((n, 4)), np.empty((n, 2, 3))
    for k in range(n):
        at = slice(2 * k, 2 * k + 2)
        held = np.zeros((5, 5))
        held[:2, :2], held[:2, 2:] = a[at, at] * step, b[at] * step
        moved = scipy.linalg.expm(held)
        free[k], push[k] = moved[:2, :2].ravel(), moved[:2, 2:]
    rows = np.stack([read[2], read[3], read[0], read[1], read[4], read[5]]).reshape(6, n, 2)
    top, bit, load = (np.ascontiguousarray(push[:, :, k]) for k in range(3))
    made = Blocks(free, top, bit, load, rows)
    return made, inverse


def _pairs(system: System, n: int) -> Array:
    """States by columns in which A falls into 2 x 2 blocks."""
    order = np.arange(2 * n).reshape(2, n).T.ravel()
    damping = system.damping[n:, n:]
    if np.abs(damping - np.diag(np.diag(damping))).max() <= 1e-9 * max(np.abs(damping).max(), 1.0):
        return np.eye(2 * n)[:, order]
    poles, vectors = np.linalg.eig(system.a)
    # Two zero poles of a rigid body without dampers are no pair of eigenvectors.
    kept = np.abs(poles) > 1e-9 * np.abs(poles).max()
    if (~kept).sum() == 1:  # a damper to ground leaves the place alone free
        kept[:] = True
    columns = [] if kept.all() else [np.eye(2 * n)[0], np.eye(2 * n)[n]]
    pairs = [k for k in np.flatnonzero(poles.imag > 0.0) if kept[k]]
    real = [k for k in np.flatnonzero(poles.imag == 0.0) if kept[k]]
    columns += [part for k in pairs for part in (vectors[:, k].real, vectors[:, k].imag)]
    columns += [vectors[:, k].real for k in sorted(real, key=lambda k: -abs(poles[k]))]
    basis = np.array(columns).T
    if basis.shape != (2 * n, 2 * n) or np.linalg.cond(basis) > 1e9:
        raise InputError("the dampers of this string do not let it fall into modes", "drillstring")
    return basis


@lru_cache(maxsize=8)
def _prepared(string: Drillstring, axial: AxialString, step: float, modes: int) -> Any:
    carried = max(1, int((axial.modes[0] * step <= AXIAL_PHASE).sum()))
    one, two = torsional(string, modes), along(axial, carried)
    return one, two, blocks(one, step), blocks(two, step)


def run(
    lanes: Lanes, scheme: Any, duration: float, j1_from: float, window: float, every: int,
    give_up: float, watch: Any, in_threads: Any,
) -> tuple[Array, Array]:  # fmt: skip
    """What was measured, shape (`MEASURED`, lanes), and traces, shape (samples, signals, lanes)."""
    from drillctl.simulation import cutting_step as c

    refuse_others(lanes.drive, lanes.weight, lanes.program.moves)
    count, rock, weight = len(lanes), lanes.friction, lanes.weight[0]
    torsion, axial, (tied, into), (sunk, down) = _prepared(
        lanes.string, lanes.axial, scheme.step, scheme.modes
    )
    point = steady(rock, weight, lanes.set_speed)
    angles, speeds = begin(
        lanes.start, lanes.string, lanes.drive, point.torque, lanes.set_speed,
        lanes.turning_speed, lanes.bit_speed,
    )  # fmt: skip
    z = _each(into, np.vstack([_each(torsion.modal, angles), _each(torsion.modal, speeds)]))
    stands = speeds[-1] + lanes.set_speed == 0.0
    rigid = axial.modal.sum(axis=1)
    velocity = np.where(stands, 0.0, point.velocity)
    y = _each(down, np.vstack([np.zeros((len(rigid), count)), np.outer(rigid, velocity)]))
    one, (table, first) = lanes.variation, _tables(lanes, duration, point.velocity)
    none = np.zeros(count)
    varies = not isinstance(one, NoVariation)
    way = [np.broadcast_to(getattr(one, name), count) if varies else none + (name == "spacing")
           for name in ("spread", "spacing", "advance", "turns", "sinks")]  # fmt: skip
    kp, ki = (np.broadcast_to(np.asarray(x, dtype=float), count) for x in lanes.drive.gains())
    numbers = np.stack([
        rock.blades * rock.force_per_depth, rock.blades * rock.torque_per_depth,
        rock.flat_force, rock.flat_torque, 2.0 * math.pi / rock.blades, weight, lanes.set_speed,
        none + lanes.drive.torque(none, none), kp, ki, point.slope, *way, first,
        point.velocity,
    ], axis=1)  # fmt: skip
    samples = scheme.steps // every + 1 if every else 0
    out = np.zeros((count, c.MEASURED))
    traces = np.zeros((count, samples, c.SIGNALS))
    clock = c.Clock(scheme.step, scheme.steps, j1_from, duration - window, every, give_up)
    element = np.array([lanes.string.element_stiffness[0], lanes.string.element_damping[0]])
    starts = np.ascontiguousarray(z.T.reshape(count, -1, 2))
    depths = np.ascontiguousarray(y.T.reshape(count, -1, 2))

    def advance(begin: int, end: int) -> None:
        c.run(begin, end, numbers, tied, sunk, clock, table, element, starts, depths, out, traces,
              watch)  # fmt: skip

    in_threads(advance, count, watch)
    return np.ascontiguousarray(out.T), np.ascontiguousarray(traces.transpose(1, 2, 0))


def _each(matrix: Array, columns: Array) -> Array:
    """Their product lane by lane: that of two matrices would round by the number of lanes."""
    return np.stack([matrix @ column for column in np.ascontiguousarray(columns.T)], axis=1)


def _tables(lanes: Lanes, duration: float, velocity: Array) -> tuple[Array, Array]:
    """Paths of a rock that varies, and the row of each lane."""
    one = lanes.variation
    if isinstance(one, NoVariation):
        return np.zeros((1, 2)), np.zeros(len(lanes))
    table, row = paths(one, int(np.max(one.nodes(duration, lanes.set_speed, velocity))))
    return table, row.astype(float)


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
