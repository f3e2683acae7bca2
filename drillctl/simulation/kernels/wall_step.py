"""Dry friction of the wall at nodes of the string, beside the bit, in one step of a block of lanes.

The string moves exactly under torques held over the step. With the drive eliminated, the speeds of
the nodes at its end are linear in the torques of all nodes,

    v_k = free_k - sum_j G_kj T_j,        T_k in F_k sign(v_k), any |T_k| <= F_k where v_k = 0,

the bit among them with the torque of rock and wall. Projected Gauss-Seidel solves this set by set:
a node sticks if the torque that holds it is within its friction at rest, else it slides under the
friction of its speed. The sweeps begin with the torques of the last step; their number is fixed, so
that no lane depends on its neighbours. The bit's own inclusion is then solved as without a wall,
with the wall's torques as they were found.

Of a string that drifts along the well no node sticks: its torque is F w / sqrt(w^2 + d^2), the mean
of begin and end. Each sweep makes one step of Newton's method, from the last sweep's
speed; the function is concave, so that no step goes too far once it is on the near side.

Beyond the critical speed a part of the friction is lost. Where a node passes that speed within the
step, as its last two speeds lead on, its friction is the mean over the step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from drillctl.rig.bit_rock.law import Exp
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import exp, fma, law_at, most, root, signed
from drillctl.simulation.kernels.drive_step import REAL, SAMPLED, asks_for_top, eliminate
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.string_step import DriftString, Swing, WallString
from drillctl.simulation.kernels.vectors import Variable, at, each, loop, pick, put
from drillctl.simulation.kernels.weight_step import acting

SWEEPS = 4
"""Of Gauss-Seidel in a step; `tests/simulation/test_wall.py` holds what more would change."""

# Rows of a node in the room that the string leaves, after those of the bit; of one that drifts the
# speed of its last sweep, without sign, in place of whether it is stuck.
TORQUE, SPEED, BEFORE, FRICTION, SLIDING, FREE, CLOSED, STUCK, GAIN, PER_GAIN, HELD = range(11)
NODE_ROWS = 11
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
    return isinstance(string, (WallString, DriftString))


def drifts(string: Any) -> bool:
    """Whether it moves along the well."""
    return isinstance(string, DriftString)


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
    if not has_wall(string) or drifts(string):
        return law
    return _walled(string, law, room)


def _walled(string: Any, law: Any, room: Any) -> WalledRock:
    friction = at(room, BIT_FRICTION * WIDTH)
    return WalledRock(law, friction, friction * at(room, BIT_LEVEL * WIDTH))


def begin_wall(string: Any, room: Any, work: Any) -> None:
    """Torque of the wall on a bit that turns at time zero."""
    if has_wall(string) and not drifts(string):
        turning = at(work, r.DIRECTION) != 0.0
        level = _level_at(string, abs(at(work, r.BIT_SPEED)))
        own = pick(turning, at(room, BIT_FRICTION * WIDTH) * level, 0.0)
        put(work, r.KINETIC, at(work, r.KINETIC) + own)


def _level_at(string: Any, speed: Any) -> Any:
    return pick(speed <= string.critical, 1.0, string.ratio)


def _level(string: Any, speed: Any, before: Any, drift: Any = None) -> Any:
    """Mean over the step of the share of the friction that is left, its end by the last speeds."""
    now = abs(speed)
    ahead = most(signed(each(1.0), speed) * (2.0 * speed - before), 0.0)
    if drift is not None:
        now, ahead = (root(fma(x, x, drift * drift)) for x in (now, ahead))
    slow, slow_after = now < string.critical, ahead < string.critical
    passed = (string.critical - now) / (ahead - now)
    share = pick(slow, pick(slow_after, 1.0, passed), pick(slow_after, 1.0 - passed, 0.0))
    return string.ratio + (1.0 - string.ratio) * share


def _closure(drive: Any, reduced: Any, work: Any, rate: Any) -> tuple[Any, Any]:
    """Top torque per fall of the top angle and per fall of the top speed at the end of a step."""
    if isinstance(drive, SAMPLED):
        return each(0.0), each(0.0)
    if not isinstance(drive, REAL):
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
    """Find the torques of the wall on all nodes; returns what the string does under them.

    `law`: that of the rock alone, without the wall at the bit.
    """
    if not has_wall(string):
        return swing
    count = _nodes(string)
    bit_speed, bit_before = at(work, r.BIT_SPEED), at(work, r.SPEED_BEFORE)
    put(room, BIT_LEVEL * WIDTH, _level(string, bit_speed, bit_before))
    begin = _under_wall(string, swing, room)
    reduced = eliminate(drive, program, string, begin, work, rate)
    by_angle, by_speed = _closure(drive, reduced, work, rate)
    bit = Variable(at(work, r.BIT_TORQUE))
    top = Variable(fma(reduced.share, bit.get(), reduced.alone))
    with loop(count) as nodes:
        k = nodes.index
        speed = at(room, _row(k, SPEED))
        drift = string.drift[k] if drifts(string) else None
        level = _level(string, speed, at(room, _row(k, BEFORE)), drift)
        put(room, _row(k, SLIDING), at(room, _row(k, FRICTION)) * level)
        closed = string.angle_by_wall[k] * by_angle - string.top_by_wall[k] * by_speed
        gain = string.by_wall[k, k] - string.by_top[k] * closed
        put(room, _row(k, CLOSED), closed)
        put(room, _row(k, GAIN), gain)
        put(room, _row(k, PER_GAIN), 1.0 / gain)
        if drifts(string):
            _begin_drift(room, k, speed, string.drift[k], gain)
        put(room, _row(k, FREE), at(room, _row(k, FREE)) + at(work, r.SET_SPEED))
    at_rest, sliding = _rock_torques(string, law, weight, room, work)
    free_bit = swing.bit_speed + at(work, r.SET_SPEED)
    slide = _drift if drifts(string) else _slide
    with loop(SWEEPS):
        with loop(count) as nodes:
            slide(string, nodes.index, room, top, bit)
        _slide_bit(string, free_bit, reduced, at_rest, sliding, room, top, bit)
    return _under_wall(string, swing, room)


def _rock_torques(string: Any, law: Any, weight: Any, room: Any, work: Any) -> tuple[Any, Any]:
    """Torques of rock and wall on the bit: at rest at most, and while it turns in this step."""
    whole, load = _walled(string, law, room), acting(weight, work)
    at_rest = at(work, r.REST_LOAD)
    direction, speed = at(work, r.DIRECTION), at(work, r.BIT_SPEED)
    ahead = most(direction * (2.0 * speed - at(work, r.SPEED_BEFORE)), 0.0)
    torque, _ = whole.torque_and_slope(load.weight(ahead), ahead, exp)
    sliding = pick(
        direction == 0.0, whole.kinetic_torque_at_rest(at_rest),
        0.5 * (torque + at(work, r.KINETIC)),
    )  # fmt: skip
    return whole.static_torque(at_rest), sliding


def _speed(string: Any, k: Any, room: Any, top: Any, bit: Any) -> Any:
    """Speed of a node at the end of the step under the torques of all."""
    begin = fma(string.by_top[k], top, at(room, _row(k, FREE)))
    by_wall = string.by_wall[k]

    def of(j: Any) -> tuple[Any, Any]:
        return -by_wall[j], at(room, _row(j, TORQUE))

    return _sum_of_products(fma(-string.by_bit[k], bit, begin), of, _nodes(string))


def _sum_of_products(begin: Any, of: Callable[[Any], tuple[Any, Any]], count: Any) -> Any:
    """A sum in four parts: no operation waits for the one before it."""
    parts = [Variable(begin), *(Variable(each(0.0)) for _ in range(3))]
    fours = count // 4
    with loop(fours) as groups:
        for place, part in enumerate(parts):
            factor, row = of(4 * groups.index + place)
            part.set(fma(factor, row, part.get()))
    with loop(count - 4 * fours) as rest:
        factor, row = of(4 * fours + rest.index)
        parts[0].set(fma(factor, row, parts[0].get()))
    a, b, c, d = (part.get() for part in parts)
    return (a + b) + (c + d)


def _slide(string: Any, k: Any, room: Any, top: Any, bit: Any) -> None:
    """One node: the torque that its set allows, and what the drive makes of it."""
    torque, gain = at(room, _row(k, TORQUE)), at(room, _row(k, GAIN))
    free = fma(gain, torque, _speed(string, k, room, top.get(), bit.get()))
    sticks = abs(free) <= gain * at(room, _row(k, FRICTION))
    sliding = signed(at(room, _row(k, SLIDING)), free)
    new = pick(sticks, free * at(room, _row(k, PER_GAIN)), sliding)
    put(room, _row(k, TORQUE), new)
    put(room, _row(k, STUCK), pick(sticks, 1.0, 0.0))
    top.set(fma(at(room, _row(k, CLOSED)), new - torque, top.get()))


def _begin_drift(room: Any, k: Any, speed: Any, drift: Any, gain: Any) -> None:
    """Shares of begin and end in a torque that is held: the trapezoid's, unless it is too steep.

    As of a creeping bit, see `rock_step.py`: what relaxes within half a step may not ring.
    """
    friction = at(room, _row(k, SLIDING))
    inverse = 1.0 / root(fma(speed, speed, drift * drift))
    turn = drift * inverse
    steep = gain * friction * (turn * turn) * inverse
    share = pick(steep > 2.0, 1.0 - 1.0 / steep, 0.5)
    put(room, _row(k, SLIDING), share * friction)
    put(room, _row(k, HELD), (1.0 - share) * friction * (speed * inverse))
    put(room, _row(k, STUCK), abs(speed))


def _drift(string: Any, k: Any, room: Any, top: Any, bit: Any) -> None:
    """One node that drifts, d = `drift`: a step towards u + gain F u / sqrt(u^2 + d^2) = |free|."""
    torque, gain = at(room, _row(k, TORQUE)), at(room, _row(k, GAIN))
    held = at(room, _row(k, HELD))
    free = fma(gain, torque - held, _speed(string, k, room, top.get(), bit.get()))
    ahead, drift = abs(free), string.drift[k]
    u, friction = at(room, _row(k, STUCK)), gain * at(room, _row(k, SLIDING))
    inverse = 1.0 / root(fma(u, u, drift * drift))
    share, turn = u * inverse, drift * inverse
    slope = 1.0 + friction * turn * turn * inverse
    step = (ahead - u - friction * share) / slope
    least = most(ahead - friction, ahead * drift / (drift + friction))
    new_speed = most(u + step, least)
    put(room, _row(k, STUCK), new_speed)
    new = signed(most(ahead - new_speed, 0.0) * at(room, _row(k, PER_GAIN)), free) + held
    put(room, _row(k, TORQUE), new)
    top.set(fma(at(room, _row(k, CLOSED)), new - torque, top.get()))


def _slide_bit(
    string: Any, free_bit: Any, reduced: Any, at_rest: Any, sliding: Any, room: Any, top: Any,
    bit: Any,
) -> None:  # fmt: skip
    """The bit, as a node like the others."""
    speed = Variable(fma(string.speed_by_top, top.get(), free_bit))
    with loop(_nodes(string)) as nodes:
        k = nodes.index
        speed.set(fma(-string.bit_by_wall[k], at(room, _row(k, TORQUE)), speed.get()))
    # Its own torque acts by itself and through the drive: without both.
    free = fma(reduced.gain - string.speed_by_bit, bit.get(), speed.get())
    sticks = abs(free) <= reduced.gain * at_rest
    new = pick(sticks, free * reduced.per_gain, signed(sliding, free))
    top.set(fma(reduced.share, new - bit.get(), top.get()))
    bit.set(new)


def follow_wall(string: Any, room: Any, work: Any, step: Any) -> None:
    """Speeds of the nodes at the end of a step whose torques are known; the work of the wall."""
    if not has_wall(string):
        return
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    total = Variable(at(room, WALL_WORK * WIDTH))
    with loop(_nodes(string)) as nodes:
        k = nodes.index
        moved = _speed(string, k, room, top, bit)
        new = moved if drifts(string) else pick(at(room, _row(k, STUCK)) > 0.0, 0.0, moved)
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
        still = each(0.0) if drifts(string) else pick(at(room, _row(k, SPEED)) == 0.0, 1.0, 0.0)
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
        x = fma(b12, bit, fma(b11, top, at(state, at_x)))
        y = fma(b22, bit, fma(b21, top, at(state, at_y)))
        push = string.wall_push[i]

        def of_state(which: int) -> Callable[[Any], tuple[Any, Any]]:
            return lambda k: (push[2 * k + which], at(room, _row(k, TORQUE)))

        x_now = _sum_of_products(x, of_state(0), count)
        y_now = _sum_of_products(y, of_state(1), count)
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

        def of_block(place: Any) -> tuple[Any, Any]:  # its states one after the other
            return string.wall_read[place, k], at(state, place * WIDTH)

        moved = _sum_of_products(each(0.0), of_block, 2 * string.free.shape[0])
        put(room, _row(k, FREE), moved)
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
