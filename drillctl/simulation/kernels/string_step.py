"""One exact step of the string for a block of lanes.

The string is linear. Between samples its torques are held, so that a step is

    z(t + h) = A z(t) + B [T_top, T_bit],

exactly. A is block-diagonal with 2 x 2 blocks (one or two modes each), shared by all lanes.
The two states of a block are chosen as its contributions to the two signals the laws need:
the top-drive angle and the bit speed. Reading those signals is then a plain sum.

A pass does two things at once: it adds the torques found by the last step, which completes
z(t), and propagates z(t) freely, which gives what the laws need to know of t + h.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import fma
from drillctl.simulation.kernels.compiling import inlined, widest_vectors
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.top_motion import asks_for_top


class BlockString(NamedTuple):
    """A string in 2 x 2 blocks.

    Attributes
    ----------
    free : ndarray, shape (blocks, 4)
        A of each block by rows.
    push : ndarray, shape (blocks, 4)
        B of each block: first state by top and bit torque, second state by the same.
    pipe : ndarray, shape (blocks, 2)
        Pipe torque per state (N m).
    top_speed, bit_angle : ndarray, shape (blocks, 2)
        Top-drive speed (rad/s) and bit angle (rad) in the frame per state; for traces.
    angle_by_top, angle_by_bit : float
        Top angle after one step per held torque on the top and on the bit (rad per N m);
        a braking torque on the bit counts positive.
    speed_by_top, speed_by_bit : float
        Bit speed after one step per the same (rad/s per N m).
    top_speed_by_top, top_speed_by_bit : float
        Top speed after one step per the same.
    drag : float
        Torque of all damping to ground per set speed (N m s/rad).
    pipe_offset, twist_offset : float
        Pipe torque (N m s/rad) and twist (s) that this drag causes, per set speed.
    """

    free: Any
    push: Any
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


def complete_and_propagate(string: Any, drive: Any, observer: Any, state: Any, work: Any) -> None:
    """Add the held torques to `state`, read the pipe torque, propagate freely, sum up.

    `state` comes as the free part of z and leaves as the free part of the next z: flat, state
    after state, `WIDTH` lanes each; its second half is scratch of the dense form. The top speed
    is summed up where `drive` or `observer` asks for it.
    """
    raise NotImplementedError("compiled only")


@inlined
def _clear_sums(work: Any) -> None:
    widest_vectors()
    for lane in range(WIDTH):
        work[r.TOP_FREE + lane] = 0.0
        work[r.BIT_FREE + lane] = 0.0
        work[r.TOP_SPEED_FREE + lane] = 0.0
        work[r.PIPE + lane] = 0.0


def _by_blocks(tracks_top: bool) -> Any:
    # The closed-over constant prunes a branch of the compiled loop: a sum of its own would be
    # taken lane by lane.
    @inlined
    def step(string: Any, state: Any, work: Any) -> None:
        widest_vectors()
        _clear_sums(work)
        for block in range(string.free.shape[0]):
            a11, a12 = string.free[block, 0], string.free[block, 1]
            a21, a22 = string.free[block, 2], string.free[block, 3]
            b11, b12 = string.push[block, 0], string.push[block, 1]
            b21, b22 = string.push[block, 2], string.push[block, 3]
            p1, p2 = string.pipe[block, 0], string.pipe[block, 1]
            c1, c2 = string.top_speed[block, 0], string.top_speed[block, 1]
            at_x = 2 * block * WIDTH
            at_y = at_x + WIDTH
            for lane in range(WIDTH):
                top, bit = work[r.TOP_TORQUE + lane], work[r.BIT_TORQUE + lane]
                x = fma(b12, bit, fma(b11, top, state[at_x + lane]))
                y = fma(b22, bit, fma(b21, top, state[at_y + lane]))
                work[r.PIPE + lane] = fma(p2, y, fma(p1, x, work[r.PIPE + lane]))
                x_free = fma(a12, y, a11 * x)
                y_free = fma(a22, y, a21 * x)
                state[at_x + lane] = x_free
                state[at_y + lane] = y_free
                work[r.TOP_FREE + lane] += x_free
                work[r.BIT_FREE + lane] += y_free
                if tracks_top:
                    sped = fma(c2, y_free, fma(c1, x_free, work[r.TOP_SPEED_FREE + lane]))
                    work[r.TOP_SPEED_FREE + lane] = sped

    return step


@inlined
def _by_matrix(string: Any, state: Any, work: Any) -> None:
    widest_vectors()
    _clear_sums(work)
    states = string.free.shape[0]
    complete = states * WIDTH
    for i in range(states):
        b1, b2, p = string.push[i, 0], string.push[i, 1], string.pipe[i]
        at = i * WIDTH
        for lane in range(WIDTH):
            z = fma(b1, work[r.TOP_TORQUE + lane], state[at + lane])
            z = fma(b2, work[r.BIT_TORQUE + lane], z)
            state[complete + at + lane] = z
            work[r.PIPE + lane] = fma(p, z, work[r.PIPE + lane])
    for i in range(states):
        at = i * WIDTH
        for lane in range(WIDTH):
            state[at + lane] = 0.0
        for j in range(states):
            a = string.free[i, j]
            other = complete + j * WIDTH
            for lane in range(WIDTH):
                state[at + lane] = fma(a, state[other + lane], state[at + lane])
        c_top, c_bit, c_speed = string.top_angle[i], string.bit_speed[i], string.top_speed[i]
        for lane in range(WIDTH):
            z = state[at + lane]
            work[r.TOP_FREE + lane] = fma(c_top, z, work[r.TOP_FREE + lane])
            work[r.BIT_FREE + lane] = fma(c_bit, z, work[r.BIT_FREE + lane])
            work[r.TOP_SPEED_FREE + lane] = fma(c_speed, z, work[r.TOP_SPEED_FREE + lane])


@overload(complete_and_propagate)
def _complete_and_propagate(string, drive, observer, state, work):
    if string.instance_class is DenseString:
        return lambda string, drive, observer, state, work: _by_matrix(string, state, work)
    step = _by_blocks(asks_for_top(drive, observer))
    return lambda string, drive, observer, state, work: step(string, state, work)


def look(string: Any, state: Any, work: Any, lane: int) -> tuple[float, float]:
    """Top-drive speed and bit angle in the frame of one lane, its torques included."""
    raise NotImplementedError("compiled only")


@inlined
def _look_at_blocks(string: Any, state: Any, work: Any, lane: int) -> tuple[float, float]:
    widest_vectors()
    speed, angle = 0.0, 0.0
    top, bit = work[r.TOP_TORQUE + lane], work[r.BIT_TORQUE + lane]
    for block in range(string.free.shape[0]):
        at = 2 * block * WIDTH + lane
        x = state[at] + string.push[block, 0] * top + string.push[block, 1] * bit
        y = state[at + WIDTH] + string.push[block, 2] * top + string.push[block, 3] * bit
        speed += string.top_speed[block, 0] * x + string.top_speed[block, 1] * y
        angle += string.bit_angle[block, 0] * x + string.bit_angle[block, 1] * y
    return speed, angle


@inlined
def _look_at_matrix(string: Any, state: Any, work: Any, lane: int) -> tuple[float, float]:
    widest_vectors()
    speed, angle = 0.0, 0.0
    top, bit = work[r.TOP_TORQUE + lane], work[r.BIT_TORQUE + lane]
    for i in range(string.free.shape[0]):
        z = state[i * WIDTH + lane] + string.push[i, 0] * top + string.push[i, 1] * bit
        speed += string.top_speed[i] * z
        angle += string.bit_angle[i] * z
    return speed, angle


@overload(look)
def _look(string, state, work, lane):
    if string.instance_class is BlockString:
        return lambda string, state, work, lane: _look_at_blocks(string, state, work, lane)
    return lambda string, state, work, lane: _look_at_matrix(string, state, work, lane)
