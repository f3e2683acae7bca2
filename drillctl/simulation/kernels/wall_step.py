"""Dry friction of the wall at nodes of the string, beside the bit, in one step of a block of lanes.

The string moves exactly under torques held over the step. With the drive eliminated, the speeds of
the nodes at its end are linear in the torques of all nodes,

    v_k = free_k - sum_j G_kj T_j,        T_k in F_k sign(v_k), any |T_k| <= F_k where v_k = 0,

the bit among them with the torque of rock and wall. Projected Gauss-Seidel solves this set by set:
a node sticks if the torque that holds it is within its friction at rest, else it slides under the
friction of its speed. The sweeps begin with the torques of the last step; their number is fixed, so
that no lane depends on its neighbours. The bit's own inclusion is then solved as without a wall,
with the wall's torques as they were found.

Beyond the critical speed a part of the friction is lost. Where a node passes that speed within the
step, as its last two speeds lead on, its friction is the mean over the step.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.bit_rock.law import Exp
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import exp, fma, law_at, most, signed
from drillctl.simulation.kernels.drive_step import RealStep, SampledStep, asks_for_top, eliminate
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.string_step import Swing, WallString
from drillctl.simulation.kernels.vectors import Variable, at, each, loop, pick, put
from drillctl.simulation.kernels.weight_step import acting

SWEEPS = 6
"""Of Gauss-Seidel in a step; `tests/simulation/test_wall.py` holds what more would change."""

# Rows of a node in the room that the string leaves, after those of the bit.
TORQUE, SPEED, BEFORE, FRICTION, SLIDING, MOVED, CLOSED, STUCK, WORK = range(9)
NODE_ROWS = 9
BIT_FRICTION, BIT_LEVEL, WALL_WORK = range(3)
BIT_ROWS = 3


def room_rows(nodes: int) -> int:
    """Rows that the friction of this many nodes beside the bit takes."""
    return BIT_ROWS + NODE_ROWS * nodes


def _row(node: Any, row: int) -> Any:
    return (BIT_ROWS + NODE_ROWS * node + row) * WIDTH


def _nodes(string: Any) -> Any:
    return string.by_top.shape[0]


def has_wall(string: Any) -> bool:
    """Whether the wall rubs on a string."""
    return isinstance(string, WallString)


def load_wall(string: Any, speed: Any, room: Any, work: Any, first: Any) -> None:
    """Friction of the nodes of each lane, the bit last: rows of `speed` after the fifth."""
    if not has_wall(string):
        return
    count = _nodes(string)
    put(room, BIT_FRICTION * WIDTH, at(speed[5 + count], first))
    begin = at(work, r.TOP_SPEED) + at(work, r.SET_SPEED)
    # All nodes start at rest or at one speed, but for a string wound up, whose nodes lie between.
    bit = at(work, r.BIT_SPEED)
    with loop(count) as nodes:
        k = nodes.index
        put(room, _row(k, FRICTION), at(speed[5 + k], first))
        share = string.place[k]
        own = begin + (bit - begin) * share
        put(room, _row(k, SPEED), own)
        put(room, _row(k, BEFORE), own)


class WalledRock(NamedTuple):
    """A bit-rock law with the friction of the wall at the bit."""

    rock: Any
    at_rest: Any  # friction of the wall at rest (N m)
    sliding: Any  # and in this step, while it slides (N m)

    @property
    def set_valued(self) -> bool:
        """A bit can stand still."""
        return True

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m)."""
        if self.rock.set_valued:
            return self.rock.static_torque(weight) + self.at_rest
        return self.rock.torque_and_slope(weight, each(0.0), exp)[0] + self.at_rest

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m)."""
        if self.rock.set_valued:
            return self.rock.kinetic_torque_at_rest(weight) + self.at_rest
        return self.static_torque(weight)

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s)."""
        torque, slope = self.rock.torque_and_slope(weight, speed, exp)
        return torque + self.sliding, slope


def walled(string: Any, law: Any, room: Any) -> Any:
    """The law that the bit meets: that of the rock, with the wall if there is one."""
    if not has_wall(string):
        return law
    friction = at(room, BIT_FRICTION * WIDTH)
    return WalledRock(law, friction, friction * at(room, BIT_LEVEL * WIDTH))


def begin_wall(string: Any, room: Any, work: Any) -> None:
    """Torque of the wall on a bit that turns at time zero."""
    if has_wall(string):
        turning = at(work, r.DIRECTION) != 0.0
        level = _level_at(string, abs(at(work, r.BIT_SPEED)))
        own = pick(turning, at(room, BIT_FRICTION * WIDTH) * level, 0.0)
        put(work, r.KINETIC, at(work, r.KINETIC) + own)


def _level_at(string: Any, speed: Any) -> Any:
    return pick(speed <= string.critical, 1.0, string.ratio)


def _level(string: Any, speed: Any, before: Any) -> Any:
    """Mean over the step of the share of the friction that is left, its end by the last speeds."""
    now = abs(speed)
    ahead = most(signed(each(1.0), speed) * (2.0 * speed - before), 0.0)
    slow, slow_after = now < string.critical, ahead < string.critical
    passed = (string.critical - now) / (ahead - now)
    share = pick(slow, pick(slow_after, 1.0, passed), pick(slow_after, 1.0 - passed, 0.0))
    return string.ratio + (1.0 - string.ratio) * share


def _closure(drive: Any, reduced: Any, work: Any, rate: Any) -> tuple[Any, Any]:
    """Top torque per fall of the top angle and per fall of the top speed at the end of a step."""
    if isinstance(drive, SampledStep):
        return each(0.0), each(0.0)
    if not isinstance(drive, RealStep):
        return -at(work, r.LINE_FORTH), each(0.0)
    law = law_at(drive, work, r.DRIVE)
    free = pick(reduced.share == 0.0, 0.0, at(work, r.SHRINK))
    return law.of_error * rate * free, law.of_error * law.by_speed * free


def _under_wall(string: Any, swing: Any, room: Any) -> Any:
    """What the string does under the torques of the wall that are in the room."""
    angle, bit, top = (Variable(x) for x in (swing.top_angle, swing.bit_speed, swing.top_speed))
    with loop(_nodes(string)) as nodes:
        k = nodes.index
        torque = at(room, _row(k, TORQUE))
        angle.set(fma(-string.angle_by_wall[k], torque, angle.get()))
        bit.set(fma(-string.bit_by_wall[k], torque, bit.get()))
        top.set(fma(-string.top_by_wall[k], torque, top.get()))
    return Swing(angle.get(), bit.get(), top.get(), swing.pipe)


def rub(
    string: Any, drive: Any, program: Any, weight: Any, law: Any, swing: Any, room: Any, work: Any,
    rate: Any,
) -> Any:  # fmt: skip
    """Find the torques of the wall on all nodes: what the string does under them, and a guess.

    `law`: that of the rock alone, without the wall at the bit. The guess: of the torques at both
    ends, under which the nodes have the speeds in the room.
    """
    if not has_wall(string):
        return swing, None
    count = _nodes(string)
    bit_speed, bit_before = at(work, r.BIT_SPEED), at(work, r.SPEED_BEFORE)
    put(room, BIT_LEVEL * WIDTH, _level(string, bit_speed, bit_before))
    begin = _under_wall(string, swing, room)
    reduced = eliminate(drive, program, string, begin, work, rate)
    by_angle, by_speed = _closure(drive, reduced, work, rate)
    bit = Variable(at(work, r.BIT_TORQUE))
    top = Variable(fma(reduced.share, bit.get(), reduced.alone))
    # Speeds of all nodes at the end of the step under the torques of the last one.
    with loop(count) as nodes:
        k = nodes.index
        speed = at(room, _row(k, SPEED))
        level = _level(string, speed, at(room, _row(k, BEFORE)))
        put(room, _row(k, SLIDING), at(room, _row(k, FRICTION)) * level)
        closed = string.angle_by_wall[k] * by_angle - string.top_by_wall[k] * by_speed
        put(room, _row(k, CLOSED), closed)
        moved = Variable(at(room, _row(k, MOVED)) + at(work, r.SET_SPEED))
        moved.set(fma(string.by_top[k], top.get(), moved.get()))
        moved.set(fma(-string.by_bit[k], bit.get(), moved.get()))
        with loop(count) as others:
            j = others.index
            torque = at(room, _row(j, TORQUE))
            moved.set(fma(-string.by_wall[k, j], torque, moved.get()))
        put(room, _row(k, MOVED), moved.get())
    at_bit = Variable(fma(-reduced.gain, bit.get(), reduced.free))
    static, sliding = _rock_torques(string, law, weight, room, work)
    with loop(SWEEPS):
        with loop(count) as nodes:
            _slide(string, nodes.index, count, room, top, at_bit)
        _slide_bit(string, count, reduced, static, sliding, room, top, bit, at_bit)
    return _under_wall(string, swing, room), (top.get(), bit.get())


def _rock_torques(string: Any, law: Any, weight: Any, room: Any, work: Any) -> tuple[Any, Any]:
    """Torques of rock and wall on the bit: at rest at most, and while it turns in this step."""
    whole, load = walled(string, law, room), acting(weight, work)
    at_rest = at(work, r.REST_LOAD)
    direction, speed = at(work, r.DIRECTION), at(work, r.BIT_SPEED)
    ahead = most(direction * (2.0 * speed - at(work, r.SPEED_BEFORE)), 0.0)
    torque, _ = whole.torque_and_slope(load.weight(ahead), ahead, exp)
    sliding = pick(
        direction == 0.0, whole.kinetic_torque_at_rest(at_rest),
        0.5 * (torque + at(work, r.KINETIC)),
    )  # fmt: skip
    return whole.static_torque(at_rest), sliding


def _slide(string: Any, k: Any, count: Any, room: Any, top: Any, at_bit: Any) -> None:
    """One node: the torque that its set allows, and what it does to all others."""
    torque, closed = at(room, _row(k, TORQUE)), at(room, _row(k, CLOSED))
    gain = string.by_wall[k, k] - string.by_top[k] * closed
    free = fma(gain, torque, at(room, _row(k, MOVED)))
    sticks = abs(free) <= gain * at(room, _row(k, FRICTION))
    new = pick(sticks, free / gain, signed(at(room, _row(k, SLIDING)), free))
    change = new - torque
    by_drive = closed * change
    put(room, _row(k, TORQUE), new)
    put(room, _row(k, STUCK), pick(sticks, 1.0, 0.0))
    top.set(top.get() + by_drive)
    _move_all(string, count, room, string.by_wall[k], change, by_drive)
    moved = fma(string.speed_by_top, by_drive, at_bit.get())
    at_bit.set(fma(-string.bit_by_wall[k], change, moved))


def _slide_bit(
    string: Any, count: Any, reduced: Any, static: Any, sliding: Any, room: Any, top: Any,
    bit: Any, at_bit: Any,
) -> None:  # fmt: skip
    """The bit, as a node like the others."""
    free = fma(reduced.gain, bit.get(), at_bit.get())
    sticks = abs(free) <= reduced.gain * static
    new = pick(sticks, free * reduced.per_gain, signed(sliding, free))
    change = new - bit.get()
    by_drive = reduced.share * change
    bit.set(new)
    top.set(top.get() + by_drive)
    _move_all(string, count, room, string.by_bit, change, by_drive)
    at_bit.set(fma(-reduced.gain, change, at_bit.get()))


def _move_all(string: Any, count: Any, room: Any, by: Any, change: Any, by_drive: Any) -> None:
    """Speeds of all nodes after a change of one torque and of the drive's."""
    with loop(count) as nodes:
        j = nodes.index
        moved = fma(string.by_top[j], by_drive, at(room, _row(j, MOVED)))
        put(room, _row(j, MOVED), fma(-by[j], change, moved))


def follow_wall(string: Any, room: Any, work: Any, guess: Any, step: Any) -> None:
    """Speeds of the nodes at the end of a step whose torques at both ends are known; the work."""
    if not has_wall(string):
        return
    top, bit = at(work, r.TOP_TORQUE) - guess[0], at(work, r.BIT_TORQUE) - guess[1]
    total = Variable(at(room, WALL_WORK * WIDTH))
    with loop(_nodes(string)) as nodes:
        k = nodes.index
        moved = fma(string.by_top[k], top, at(room, _row(k, MOVED)))
        moved = fma(-string.by_bit[k], bit, moved)
        new = pick(at(room, _row(k, STUCK)) > 0.0, 0.0, moved)
        last = at(room, _row(k, SPEED))
        put(room, _row(k, BEFORE), last)
        put(room, _row(k, SPEED), new)
        total.set(fma((0.5 * step) * (last + new), at(room, _row(k, TORQUE)), total.get()))
    put(room, WALL_WORK * WIDTH, total.get())


def conclude_wall(string: Any, room: Any, work: Any) -> None:
    """What the run has measured."""
    if has_wall(string):
        put(work, r.WALL_WORK, at(room, WALL_WORK * WIDTH))


def sample_wall(string: Any, room: Any, signals: Any, after: int, first: Any) -> None:
    """Store which nodes stick."""
    if not has_wall(string):
        return
    with loop(_nodes(string)) as nodes:
        k = nodes.index
        still = pick(at(room, _row(k, SPEED)) == 0.0, 1.0, 0.0)
        put(signals[k + after], first, still)


def pass_with_wall(string: Any, drive: Any, observer: Any, room: Any, state: Any, work: Any) -> Any:
    """Add the held torques of the last step to the state, propagate it freely; a `Swing`.

    The speeds of the nodes, in the frame, go into the room.
    """
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    count, tracks_top = _nodes(string), asks_for_top(drive, observer)
    angle, speed, top_speed = (Variable(each(0.0)) for _ in range(3))
    pipe = Variable(fma(string.pipe_by_top, top, string.pipe_by_bit * bit))
    with loop(count) as nodes:
        k = nodes.index
        torque = at(room, _row(k, TORQUE))
        pipe.set(fma(string.pipe_by_wall[k], torque, pipe.get()))
    with loop(string.free.shape[0]) as blocks:
        i = blocks.index
        at_x = 2 * i * WIDTH
        at_y = at_x + WIDTH
        b11, b12, b21, b22 = (string.push[i, k] for k in range(4))
        x = Variable(fma(b12, bit, fma(b11, top, at(state, at_x))))
        y = Variable(fma(b22, bit, fma(b21, top, at(state, at_y))))
        with loop(count) as nodes:
            k = nodes.index
            torque = at(room, _row(k, TORQUE))
            x.set(fma(string.wall_push[i, 2 * k], torque, x.get()))
            y.set(fma(string.wall_push[i, 2 * k + 1], torque, y.get()))
        x_now, y_now = x.get(), y.get()
        read = string.read[i]
        pipe.set(fma(read[5], y_now, fma(read[4], x_now, pipe.get())))
        a11, a12, a21, a22 = (string.free[i, k] for k in range(4))
        x_free = fma(a12, y_now, a11 * x_now)
        y_free = fma(a22, y_now, a21 * x_now)
        put(state, at_x, x_free)
        put(state, at_y, y_free)
        angle.set(fma(read[1], y_free, fma(read[0], x_free, angle.get())))
        speed.set(fma(read[3], y_free, fma(read[2], x_free, speed.get())))
        if tracks_top:
            top_speed.set(fma(read[7], y_free, fma(read[6], x_free, top_speed.get())))
    with loop(count) as nodes:
        k = nodes.index
        moved = Variable(each(0.0))
        with loop(string.free.shape[0]) as blocks:
            i = blocks.index
            at_x = 2 * i * WIDTH
            moved.set(fma(string.wall_read[i, 2 * k], at(state, at_x), moved.get()))
            moved.set(fma(string.wall_read[i, 2 * k + 1], at(state, at_x + WIDTH), moved.get()))
        put(room, _row(k, MOVED), moved.get())
    return Swing(angle.get(), speed.get(), top_speed.get(), pipe.get())


def see_with_wall(string: Any, room: Any, state: Any, work: Any) -> tuple[Any, Any]:
    """Top-drive speed and bit angle in the frame, torques included."""
    speed, turned = Variable(each(0.0)), Variable(each(0.0))
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    with loop(string.free.shape[0]) as blocks:
        i = blocks.index
        b11, b12, b21, b22 = (string.push[i, k] for k in range(4))
        at_x = 2 * i * WIDTH
        x = Variable(at(state, at_x) + (b11 * top + b12 * bit))
        y = Variable(at(state, at_x + WIDTH) + (b21 * top + b22 * bit))
        with loop(_nodes(string)) as nodes:
            k = nodes.index
            torque = at(room, _row(k, TORQUE))
            x.set(fma(string.wall_push[i, 2 * k], torque, x.get()))
            y.set(fma(string.wall_push[i, 2 * k + 1], torque, y.get()))
        read = string.read[i]
        speed.set(speed.get() + (read[6] * x.get() + read[7] * y.get()))
        turned.set(turned.get() + (read[8] * x.get() + read[9] * y.get()))
    return speed.get(), turned.get()
