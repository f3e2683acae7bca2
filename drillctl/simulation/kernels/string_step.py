"""One exact step of the string for a block of lanes.

The string is linear. Between samples its torques are held, so that a step is

    z(t + h) = A z(t) + B [T_top, T_bit],

exactly. A is block-diagonal with 2 x 2 blocks (one or two modes each), shared by all lanes.
The two states of a block are chosen as its contributions to the two signals the laws need:
the top-drive angle and the bit speed. Reading those signals is then a plain sum. Without damping
other coordinates take fewer operations (`simulation/undamped_step.py`): 9 a mode instead of 12.

A pass does two things at once: it adds the torques found by the last step, which completes
z(t), and propagates z(t) freely, which gives what the laws need to know of t + h.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import fma
from drillctl.simulation.kernels.drive_step import asks_for_top
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.vectors import Variable, at, each, loop, put


class UndampedString(NamedTuple):
    """A string without damping, mode by mode."""

    kappa: Any  # shape (modes,): 4 sin(w h / 2)^2 of a mode with frequency w
    ratio: Any  # shape (modes,): Its amplitude at the bit over that at the top
    push: Any  # shape (modes, 2): Change of x and y per torque on the top
    bit_speed: Any  # shape (modes, 2): Bit speed per x and y (1/s)
    pipe: Any  # shape (modes,): Pipe torque per x (N m/rad)
    top_speed: Any  # shape (modes, 2): Top-drive speed in the frame per x and y (1/s)
    angle_by_top: Any
    angle_by_bit: Any
    speed_by_top: Any
    speed_by_bit: Any
    top_speed_by_top: Any
    top_speed_by_bit: Any
    drag: Any
    pipe_offset: Any
    twist_offset: Any
    pipe_by_top: Any
    pipe_by_bit: Any


class BlockString(NamedTuple):
    """A string in 2 x 2 blocks."""

    free: Any  # shape (blocks, 4): A of each block by rows
    # shape (blocks, 4): B of each block: first state by top and bit torque, second state by the
    # same
    push: Any
    pipe: Any  # shape (blocks, 2): Pipe torque per state (N m)
    # shape (blocks, 2): Top-drive speed (rad/s) and bit angle (rad) in the frame per state; for
    # traces
    top_speed: Any
    bit_angle: Any
    # top angle after one step per held torque on the top and on the bit (rad per N m); a braking
    # torque on the bit counts positive
    angle_by_top: Any
    angle_by_bit: Any
    # bit speed after one step per the same (rad/s per N m)
    speed_by_top: Any
    speed_by_bit: Any
    # top speed after one step per the same
    top_speed_by_top: Any
    top_speed_by_bit: Any
    drag: Any  # torque of all damping to ground per set speed (N m s/rad)
    # pipe torque (N m s/rad) and twist (s) that this drag causes, per set speed
    pipe_offset: Any
    twist_offset: Any
    # pipe torque per held torque on the top and on the bit (braking) that the modes left out
    # carry: faster than a step, they follow at once
    pipe_by_top: Any
    pipe_by_bit: Any


class DenseString(NamedTuple):
    """A string as one dense matrix, for the few that do not fall into 2 x 2 blocks.

    The fields mean what they mean in `BlockString`, with `free` of shape (states, states),
    `push` (states, 2) and the signals' rows, `top_angle` and `bit_speed` too, (states,).
    """

    free: Any
    push: Any
    top_angle: Any
    bit_speed: Any
    pipe: Any
    top_speed: Any
    bit_angle: Any
    angle_by_top: Any
    angle_by_bit: Any
    speed_by_top: Any
    speed_by_bit: Any
    top_speed_by_top: Any
    top_speed_by_bit: Any
    drag: Any
    pipe_offset: Any
    twist_offset: Any
    pipe_by_top: Any
    pipe_by_bit: Any


class WallString(NamedTuple):
    """A string in 2 x 2 blocks, with nodes at which the wall rubs; stepped in `wall_step.py`.

    The other fields mean what they mean in `BlockString`; torques of the wall brake when positive.
    """

    free: Any
    push: Any
    wall_push: Any  # shape (blocks, 2 nodes): change of both states per torque on each node
    # shape (blocks, 10): top angle, bit speed, pipe torque, top speed and bit angle, per state
    read: Any
    wall_read: Any  # shape (2 blocks, nodes): speed of each node per state
    # shape (nodes,): fall of top angle, bit speed and top speed after a step per torque on each
    angle_by_wall: Any
    bit_by_wall: Any
    top_by_wall: Any
    pipe_by_wall: Any  # shape (nodes,)
    # shape (nodes,): rise of the speed of each node per torque on the top, its fall per that on
    # the bit; shape (nodes, nodes): its fall per that on each node
    by_top: Any
    by_bit: Any
    by_wall: Any
    place: Any  # shape (nodes,): compliance of the string above each over that of all of it
    ratio: Any  # of the friction that is left beyond the critical speed
    critical: Any  # rad/s
    angle_by_top: Any
    angle_by_bit: Any
    speed_by_top: Any
    speed_by_bit: Any
    top_speed_by_top: Any
    top_speed_by_bit: Any
    drag: Any
    pipe_offset: Any
    twist_offset: Any
    pipe_by_top: Any
    pipe_by_bit: Any


_DRIFTS = [*((name, Any) for name in WallString._fields), ("drift", Any)]
DriftString: Any = NamedTuple("DriftString", _DRIFTS)  # type: ignore[misc]
"""The same of a string that moves along the well.

`drift`, shape (nodes,): that speed over the radius of each node (rad/s).
"""


class Swing(NamedTuple):
    """What a pass over the string tells."""

    # in the frame at the end of the step, were there no torque in it (rad, rad/s, rad/s); the top
    # speed where something asks for it, else zero
    top_angle: Any
    bit_speed: Any
    top_speed: Any
    pipe: Any  # pipe torque at its beginning (N m)


_READ = {
    UndampedString: {
        "kappa": 1, "ratio": 1, "push": 2, "pipe": 1, "bit_speed": 2, "top_speed": 2,
    },
    BlockString: {"free": 4, "push": 4, "pipe": 2, "top_speed": 2},
}  # fmt: skip
"""What a pass reads of each mode or block, in this order, and how many numbers that is."""
MOST_READ = 12  # numbers of a mode or a block, at most


def load_string(string: Any, room: Any) -> None:
    """Put what a pass reads into a flat array, side by side: one address leads to all of it."""
    if type(string) not in _READ:
        return
    with loop(string.push.shape[0]) as parts:
        i, place = parts.index, parts.index * MOST_READ
        for name, count in _READ[type(string)].items():
            numbers = getattr(string, name)
            for k in range(count):
                room[place] = numbers[i] if count == 1 else numbers[i, k]
                place = place + 1


def _by_modes(string: Any, room: Any, state: Any, work: Any, tracks_top: bool) -> Swing:
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    # Two sums of the bit speed: neither waits for the other.
    top_angle, bit_speed, bit_speed_too, top_speed = (Variable(each(0.0)) for _ in range(4))
    pipe = Variable(fma(string.pipe_by_top, top, string.pipe_by_bit * bit))
    with loop(string.kappa.shape[0]) as modes:
        read = room[modes.index * MOST_READ :]
        kappa, ratio, push_x, push_y, pipe_x, bit_x, bit_y, top_x, top_y = (
            read[k] for k in range(9)
        )
        at_x = 2 * modes.index * WIDTH
        at_y = at_x + WIDTH
        force = top - ratio * bit
        x = fma(push_x, force, at(state, at_x))
        y = fma(push_y, force, at(state, at_y))
        pipe.set(fma(pipe_x, x, pipe.get()))
        y = y - kappa * x
        x = x + y
        put(state, at_x, x)
        put(state, at_y, y)
        top_angle.set(top_angle.get() + x)
        bit_speed.set(fma(bit_x, x, bit_speed.get()))
        bit_speed_too.set(fma(bit_y, y, bit_speed_too.get()))
        if tracks_top:
            top_speed.set(fma(top_y, y, fma(top_x, x, top_speed.get())))
    speed = bit_speed.get() + bit_speed_too.get()
    return Swing(top_angle.get(), speed, top_speed.get(), pipe.get())


def move_block(free: Any, x: Any, y: Any, state: Any, place: Any) -> tuple[Any, Any]:
    """Move a block of two states freely over a step, keep them at a place."""
    a11, a12, a21, a22 = free
    x_free = fma(a12, y, a11 * x)
    y_free = fma(a22, y, a21 * x)
    put(state, place, x_free)
    put(state, place + WIDTH, y_free)
    return x_free, y_free


def _by_blocks(string: Any, room: Any, state: Any, work: Any, tracks_top: bool) -> Swing:
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    top_angle, bit_speed, top_speed = (Variable(each(0.0)) for _ in range(3))
    pipe = Variable(fma(string.pipe_by_top, top, string.pipe_by_bit * bit))
    with loop(string.free.shape[0]) as blocks:
        read = room[blocks.index * MOST_READ :]
        a11, a12, a21, a22, b11, b12, b21, b22, pipe_x, pipe_y, top_x, top_y = (
            read[k] for k in range(12)
        )
        at_x = 2 * blocks.index * WIDTH
        x = fma(b12, bit, fma(b11, top, at(state, at_x)))
        y = fma(b22, bit, fma(b21, top, at(state, at_x + WIDTH)))
        pipe.set(fma(pipe_y, y, fma(pipe_x, x, pipe.get())))
        x_free, y_free = move_block((a11, a12, a21, a22), x, y, state, at_x)
        top_angle.set(top_angle.get() + x_free)
        bit_speed.set(bit_speed.get() + y_free)
        if tracks_top:
            top_speed.set(fma(top_y, y_free, fma(top_x, x_free, top_speed.get())))
    return Swing(top_angle.get(), bit_speed.get(), top_speed.get(), pipe.get())


def _by_matrix(string: Any, room: Any, state: Any, work: Any, tracks_top: bool) -> Swing:
    states = string.free.shape[0]
    complete = states * WIDTH
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    top_angle, bit_speed, top_speed = (Variable(each(0.0)) for _ in range(3))
    pipe = Variable(fma(string.pipe_by_top, top, string.pipe_by_bit * bit))
    with loop(states) as rows:
        i = rows.index
        z = fma(string.push[i, 0], top, at(state, i * WIDTH))
        z = fma(string.push[i, 1], bit, z)
        put(state, complete + i * WIDTH, z)
        pipe.set(fma(string.pipe[i], z, pipe.get()))
    with loop(states) as rows:
        i, total = rows.index, Variable(each(0.0))
        with loop(states) as columns:
            j = columns.index
            total.set(fma(string.free[i, j], at(state, complete + j * WIDTH), total.get()))
        z = total.get()
        put(state, i * WIDTH, z)
        top_angle.set(fma(string.top_angle[i], z, top_angle.get()))
        bit_speed.set(fma(string.bit_speed[i], z, bit_speed.get()))
        top_speed.set(fma(string.top_speed[i], z, top_speed.get()))
    return Swing(top_angle.get(), bit_speed.get(), top_speed.get(), pipe.get())


def complete_and_propagate(
    string: Any, drive: Any, observer: Any, room: Any, state: Any, work: Any
) -> Swing:
    """Add the held torques to `state`, read the pipe torque, propagate freely; a `Swing`.

    `state` comes as the free part of z and leaves as the free part of the next z: flat, state
    after state, `WIDTH` lanes each; its second half is scratch of the dense form. `room`: what
    `load_string` has left.
    """
    step = _PASSES[type(string)]
    return step(string, room, state, work, asks_for_top(drive, observer))


_PASSES = {UndampedString: _by_modes, BlockString: _by_blocks, DenseString: _by_matrix}


def look(string: Any, state: Any, work: Any) -> tuple[Any, Any]:
    """Top-drive speed and bit angle in the frame, torques included."""
    speed, angle = Variable(each(0.0)), Variable(each(0.0))
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    see = {UndampedString: _see_mode, BlockString: _see_block}.get(type(string), _see_state)
    with loop(string.push.shape[0]) as parts:
        moves, turned = see(string, state, parts.index, top, bit)
        speed.set(speed.get() + moves)
        angle.set(angle.get() + turned)
    return speed.get(), angle.get()


def _see_mode(string: Any, state: Any, mode: Any, top: Any, bit: Any) -> tuple[Any, Any]:
    force = top - string.ratio[mode] * bit
    x = at(state, 2 * mode * WIDTH) + string.push[mode, 0] * force
    y = at(state, (2 * mode + 1) * WIDTH) + string.push[mode, 1] * force
    speed = string.top_speed[mode, 0] * x + string.top_speed[mode, 1] * y
    return speed, string.ratio[mode] * x


def _see_block(string: Any, state: Any, block: Any, top: Any, bit: Any) -> tuple[Any, Any]:
    b11, b12, b21, b22 = (string.push[block, k] for k in range(4))
    x = at(state, 2 * block * WIDTH) + (b11 * top + b12 * bit)
    y = at(state, (2 * block + 1) * WIDTH) + (b21 * top + b22 * bit)
    speed = string.top_speed[block, 0] * x + string.top_speed[block, 1] * y
    return speed, string.bit_angle[block, 0] * x + string.bit_angle[block, 1] * y


def _see_state(string: Any, state: Any, i: Any, top: Any, bit: Any) -> tuple[Any, Any]:
    z = at(state, i * WIDTH) + string.push[i, 0] * top + string.push[i, 1] * bit
    return string.top_speed[i] * z, string.bit_angle[i] * z
