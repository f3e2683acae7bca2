"""The exact step of modes without damping, in the coordinates that take the fewest operations.

A mode with frequency w turns by theta = w h in a step h, and its free motion obeys

    x(t + h) = x + y(t + h),    y(t + h) = y - kappa x,    kappa = 4 sin(theta/2)^2,

exactly, with x its part of the top angle and y(t) = x(t) - x(t - h) in free motion. That is a
multiply-add and an addition, where a turning vector takes two multiply-adds and two products; and
no number in it is the small difference of large ones, however slow the mode. The torques act on
both through one sum, T_top - ratio T_bit, as x has the top's amplitude for its unit.

The exact step of a string: from M, C and K to the matrices the kernels multiply with.

A string without damping falls into its modes (see `undamped_step.py`). Rayleigh-damped and
modally damped strings fall into 2 x 2 blocks, one a mode. Any
other viscous damping couples the modes: the first-order matrix is brought to real
block-diagonal form, one block a conjugate pair or two real poles. Where that basis is badly
conditioned, or a block cannot be read off the two signals that the laws need, the step is a
dense matrix instead. Off-diagonal damping is never dropped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from drillctl.errors import InputError
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.well.wall import Wall
from drillctl.simulation.kernels.string_step import (
    BlockString,
    DenseString,
    DriftString,
    UndampedString,
    WallString,
)
from drillctl.simulation.lanes import Start, rest_under_drag

Array = NDArray[np.float64]

WEAKEST_TOP = 1e-6  # smallest share of the largest amplitude at the top that a mode can be told by
LARGEST_TURN = 2.5
"""Turn in a step (rad) up to which the two coordinates tell angle and speed of a mode apart."""


def undamped_step(
    frequency: Array, top: Array, bit: Array, below: Array, stiffness: float, step: float
) -> tuple[dict[str, Any], Array] | None:
    """Fields of an `UndampedString` and the matrix from modal to block states; None if unfit."""
    turn = frequency * step
    if turn.max() > LARGEST_TURN or np.abs(top).min() < WEAKEST_TOP * np.abs(top).max():
        return None
    kappa = 4.0 * np.sin(0.5 * turn) ** 2
    glide = step * np.sinc(turn / np.pi)  # sin(w h) / w
    ratio = bit / top
    angle = top**2 * 0.5 * step**2 * np.sinc(0.5 * turn / np.pi) ** 2  # (1 - cos w h) / w^2
    speed = top**2 * glide
    # v = (y - kappa/2 x) / glide is the mode's part of the top speed.
    by_x, by_y = -0.5 * kappa / glide, 1.0 / glide
    fields = {
        "kappa": kappa,
        "ratio": ratio,
        "push": np.stack([angle, 0.5 * kappa * angle + glide * speed], axis=1),
        "bit_speed": np.stack([ratio * by_x, ratio * by_y], axis=1),
        "pipe": stiffness * (top - below) / top,
        "top_speed": np.stack([by_x, by_y], axis=1),
        "angle_by_top": float(angle.sum()),
        "angle_by_bit": float(angle @ ratio),
        "speed_by_top": float(speed @ ratio),
        "speed_by_bit": float(speed @ ratio**2),
        "top_speed_by_top": float(speed.sum()),
        "top_speed_by_bit": float(speed @ ratio),
    }
    modes = len(frequency)
    basis = np.zeros((modes, 2, 2 * modes))
    at = np.arange(modes)
    basis[at, 0, at] = top
    basis[at, 1, at] = 0.5 * kappa * top
    basis[at, 1, modes + at] = glide * top
    return fields, basis.reshape(2 * modes, 2 * modes)


WORST_CONDITION = 1e6
"""Largest condition number of a basis that is used for blocks; beyond, the step is dense."""
WEAKEST_SIGNAL = 1e-40
"""Smallest share of the largest modal amplitude at either end that a block is read off from: for
its own size as good as any. Modes of short stiff pieces at the bit die out in the pipe above it,
and are seen at the top with what rounding leaves, 1e-17: a signal that moves nothing."""


@dataclass(frozen=True, eq=False)
class StringStep:
    """A string ready to be stepped."""

    # what the kernels take
    string: UndampedString | BlockString | DenseString | WallString | DriftString
    # shape (states, nodes): State per nodal angle (1/rad) and per nodal speed (s/rad), both in
    # the frame
    angle_to_state: Array
    speed_to_state: Array
    # shape (nodes,): Angles that damping to ground causes, per set speed (s): they are taken off
    # before
    rest: Array
    modes: int  # undamped modes carried, the rigid body included
    step: float  # length of the step (s)

    def state(self, start: Start, set_speed: Array) -> Array:
        """State of lanes, shape (states, lanes), at their start.

        `set_speed`, shape (lanes,), in rad/s. Shape by shape: the bits of a lane do not depend on
        how many there are, as those of a product of matrices may.
        """
        at_rest = self.angle_to_state @ self.rest
        parts = [np.outer(self.angle_to_state @ shape, x) for shape, x in start.twists]
        parts += [np.outer(self.speed_to_state @ shape, x) for shape, x in start.turns]
        return np.asarray(sum(parts[1:], parts[0]) - np.outer(at_rest, set_speed))


@dataclass(frozen=True, eq=False)
class Modal:
    """z' = A z + B [T_top, T_bit] of the modes carried, z = [modal angles, modal speeds].

    Rows of `signals` read top angle, bit speed, pipe torque, top speed and bit angle off z.
    """

    a: Array
    b: Array
    signals: Array
    classical: bool
    free_rigid_body: bool


def string_step(
    string: Drillstring, step: float, modes: int, wall: Wall | None = None
) -> StringStep:
    """Prepare a string for steps of a given length; with nodes at which the wall rubs."""
    modes = min(modes, string.nodes)
    with threadpool_limits(limits=1, user_api="blas"):
        frequency, shapes = string.undamped_modes
        left_out = _left_out(string, frequency[modes:], shapes[:, modes:])
        frequency, shapes = frequency[:modes], shapes[:, :modes]
        rest = rest_under_drag(string)
        to_modal = shapes.T @ string.mass.toarray()
        if wall is None:
            kind, fields, basis = _stepped(string, frequency, shapes, step)
        else:
            kind, fields, basis = WallString, *_rubbed(string, frequency, shapes, step, wall)
            by_bit = np.append(left_out[:-1], -left_out[-1])
            fields["pipe_by_wall"] = -by_bit[list(wall.nodes[:-1])]
            if wall.drifts:
                kind, fields["drift"] = DriftString, wall.drift[:-1]
    constants = {
        "drag": float(string.ground_damping.sum()),
        "pipe_offset": float(string.element_stiffness[0] * (rest[0] - rest[1])),
        "twist_offset": float(rest[0] - rest[-1]),
        "pipe_by_top": float(left_out[0]),
        "pipe_by_bit": float(left_out[-1]),
    }
    arrays = {name: np.ascontiguousarray(x) for name, x in fields.items() if np.ndim(x)}
    return StringStep(
        string=kind(**(fields | arrays | constants)),
        angle_to_state=basis[:, :modes] @ to_modal,
        speed_to_state=basis[:, modes:] @ to_modal,
        rest=rest,
        modes=modes,
        step=step,
    )


def _left_out(string: Drillstring, frequency: Array, shapes: Array) -> Array:
    """Pipe torque per torque on each node that modes left out carry, at rest (static correction).

    A torque on the bit that brakes counts positive.
    """
    pipe = string.element_stiffness[0] * (shapes[0] - shapes[1])
    by_node = shapes @ (pipe / frequency**2)
    return np.concatenate([by_node[:-1], -by_node[-1:]])


def _stepped(
    string: Drillstring, frequency: Array, shapes: Array, step: float
) -> tuple[Any, dict[str, Any], Array]:
    """The simplest form that is fit: its kind, its fields, and its states per modal state."""
    if string.undamped:
        top, below, bit = shapes[0], shapes[1], shapes[-1]
        result = undamped_step(frequency, top, bit, below, string.element_stiffness[0], step)
        if result is not None:
            return UndampedString, *result
    modal = _modal(string, frequency, shapes)
    result = blocks(modal, step)
    if result is not None:
        return BlockString, *result
    return DenseString, *_dense(modal, step)


def _rubbed(
    string: Drillstring, frequency: Array, shapes: Array, step: float, wall: Wall
) -> tuple[dict[str, Any], Array]:
    """Fields of a `WallString` and the matrix from modal to block states."""
    modal = _modal(string, frequency, shapes)
    result = _block_basis(modal)
    if result is None:
        raise InputError(
            "its modes cannot be told apart, as where one is damped critically: the friction of "
            "the wall needs another damping", "drillstring",
        )  # fmt: skip
    basis, inverse = result
    nodes, n = list(wall.nodes[:-1]), len(frequency)
    count, rubs = len(basis) // 2, len(nodes)
    at_nodes = np.zeros((2 * n, rubs))
    at_nodes[n:] = -shapes[nodes].T
    pairs = range(count)
    a = inverse @ modal.a @ basis
    a = np.array([a[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in pairs])
    inputs = np.hstack([modal.b, at_nodes])
    free, push = _held(a, (inverse @ inputs).reshape(count, 2, 2 + rubs), step)
    signals = np.vstack([modal.signals, -at_nodes.T])
    rows = (signals @ basis).reshape(5 + rubs, count, 2)
    # After a step: signals (top angle, bit speed, pipe, top speed, bit angle, nodes) per torque.
    by = np.einsum("sbi,bit->st", rows, push)
    compliance = np.concatenate([[0.0], np.cumsum(1.0 / string.element_stiffness)])
    fields = {
        "free": free.reshape(count, 4),
        "push": push[:, :, :2].reshape(count, 4),
        "wall_push": push[:, :, 2:].transpose(0, 2, 1).reshape(count, 2 * rubs),
        "read": rows[:5].transpose(1, 0, 2).reshape(count, 10),
        "wall_read": rows[5:].transpose(1, 2, 0).reshape(2 * count, rubs),
        "angle_by_wall": -by[0, 2:],
        "bit_by_wall": -by[1, 2:],
        "top_by_wall": -by[3, 2:],
        "by_top": by[5:, 0],
        "by_bit": -by[5:, 1],
        "by_wall": -by[5:, 2:],
        "place": compliance[nodes] / compliance[-1],
        "ratio": wall.ratio,
        "critical": wall.critical,
        **_by_ends(by[[0, 1, 3]]),
    }
    return fields, inverse


def _by_ends(by: Array) -> dict[str, float]:
    """Fields of top angle, bit speed and top speed after a step per torque on top and bit."""
    names = ("angle", "speed", "top_speed")
    return {f"{name}_by_top": float(row[0]) for name, row in zip(names, by, strict=True)} | {
        f"{name}_by_bit": float(-row[1]) for name, row in zip(names, by, strict=True)
    }


def _modal(string: Drillstring, frequency: Array, shapes: Array) -> Modal:
    n = len(frequency)
    damping = shapes.T @ (string.damping @ shapes)
    if string.classical:
        damping = np.diag(np.diag(damping))
    free = not string.ground_damping.any()
    if free:
        damping[0] = damping[:, 0] = 0.0
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(frequency**2), -damping]])
    b = np.zeros((2 * n, 2))
    b[n:, 0] = shapes[0]
    b[n:, 1] = -shapes[-1]
    zero = np.zeros(n)
    first = shapes[0] - shapes[1]
    signals = np.array([
        [*shapes[0], *zero],
        [*zero, *shapes[-1]],
        [*(string.element_stiffness[0] * first), *(string.element_damping[0] * first)],
        [*zero, *shapes[0]],
        [*shapes[-1], *zero],
    ])  # fmt: skip
    return Modal(a, b, signals, string.classical, free)


def _held(a: Array, b: Array, step: float) -> tuple[Array, Array]:
    """Discrete A and B of z' = A z + B u with u held over a step; stacks of matrices too."""
    states, inputs = b.shape[-2:]
    augmented = np.zeros((*a.shape[:-2], states + inputs, states + inputs))
    augmented[..., :states, :states] = a * step
    augmented[..., :states, states:] = b * step
    propagated = scipy.linalg.expm(augmented)
    return propagated[..., :states, :states], propagated[..., :states, states:]


def blocks(modal: Modal, step: float) -> tuple[dict[str, Any], Array] | None:
    """Fields of a `BlockString` and the matrix from modal to block states; None if unfit."""
    result = _block_basis(modal)
    if result is None:
        return None
    basis, inverse = result
    count = len(basis) // 2
    pairs = range(count)
    a = inverse @ modal.a @ basis
    b = inverse @ modal.b
    signals = modal.signals @ basis
    a = np.array([a[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in pairs])
    b = b.reshape(count, 2, 2)
    rows = signals.reshape(5, count, 2)
    # The block's states become its own contributions to top angle and bit speed.
    reading = np.stack([rows[0], rows[1]], axis=1)
    scale = np.abs(reading).max(axis=2)
    if scale.min(axis=0).min() == 0.0 or (scale < WEAKEST_SIGNAL * scale.max(axis=0)).any():
        return None
    if np.linalg.cond(reading / scale[:, :, None]).max() > WORST_CONDITION:
        return None
    unread = np.linalg.inv(reading)
    free, push = _held(a, b, step)
    free, push = reading @ free @ unread, reading @ push
    others = np.einsum("sbi,bij->sbj", rows[2:], unread)
    fields = {
        "free": free.reshape(count, 4),
        "push": push.reshape(count, 4),
        "pipe": others[0].copy(),
        "top_speed": others[1].copy(),
        "bit_angle": others[2].copy(),
        "angle_by_top": float(push[:, 0, 0].sum()),
        "angle_by_bit": float(-push[:, 0, 1].sum()),
        "speed_by_top": float(push[:, 1, 0].sum()),
        "speed_by_bit": float(-push[:, 1, 1].sum()),
        "top_speed_by_top": float(np.einsum("bi,bi->", others[1], push[:, :, 0])),
        "top_speed_by_bit": float(-np.einsum("bi,bi->", others[1], push[:, :, 1])),
    }
    to_block = np.einsum("bij,bjk->bik", reading, inverse.reshape(count, 2, -1))
    return fields, to_block.reshape(2 * count, -1)


def _block_basis(modal: Modal) -> tuple[Array, Array] | None:
    """Basis of the modal states, by columns, in which A is 2 x 2 block-diagonal; its inverse."""
    states = len(modal.a)
    n = states // 2
    if modal.classical:
        order = np.arange(states).reshape(2, n).T.ravel()
        basis = np.eye(states)[:, order]
        return basis, basis.T
    kept = np.arange(states)
    if modal.free_rigid_body:  # a double zero pole, a block of its own
        kept = np.setdiff1d(kept, [0, n])
    poles, vectors = np.linalg.eig(modal.a[np.ix_(kept, kept)])
    columns = np.zeros((states, len(kept)))
    columns[kept] = _real_columns(poles, vectors)
    if modal.free_rigid_body:
        columns = np.hstack([np.eye(states)[:, [0, n]], columns])
    if np.linalg.cond(columns) > WORST_CONDITION:
        return None
    return columns, np.asarray(np.linalg.inv(columns), dtype=float)


def _real_columns(poles: Array, vectors: Array) -> Array:
    """Real and imaginary part of each conjugate pair, then the real poles two by two."""
    pairs = np.flatnonzero(poles.imag > 0.0)
    real = np.flatnonzero(poles.imag == 0.0)
    real = real[np.argsort(-np.abs(poles[real]))]
    columns = [part for i in pairs for part in (vectors[:, i].real, vectors[:, i].imag)]
    columns += [vectors[:, i].real for i in real]
    return np.array(columns).T


def _dense(modal: Modal, step: float) -> tuple[dict[str, Any], Array]:
    """Fields of a `DenseString`, whose states are the modal ones."""
    free, push = _held(modal.a, modal.b, step)
    s = modal.signals
    fields = {
        "free": free,
        "push": push,
        "top_angle": s[0].copy(),
        "bit_speed": s[1].copy(),
        "pipe": s[2].copy(),
        "top_speed": s[3].copy(),
        "bit_angle": s[4].copy(),
        **_by_ends(s[[0, 1, 3]] @ push),
    }
    return fields, np.eye(len(modal.a))
