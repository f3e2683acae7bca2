"""A bit that cuts its own wake in one step of a block of lanes, and the axial string with it.

Both strings move exactly under torque and force held over a step; with the drive eliminated the bit
speed at its end is free - gain T. What is left are two scalar inclusions in closed form, the axial
one first: the wear flat bears in full where the bit sinks, not at all where it rises, else as much
as holds it. Then the torsional one, under the torque of the cutters, that of both ends of the step
on the mean, and of the wear flat. A bit that comes to rest loses its axial motion at the share of
the step that it still turns.

The surface behind the bit lies in a ring of angles and depths, a lane after the other, straight
between two points. Two of them are at hand, on both sides of the place that the blade before has
left; a lane moves on along the ring where its bit has passed the second.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import (
    any_of,
    fma,
    gather,
    lane_number,
    law_at,
    least,
    most,
    scatter,
)
from drillctl.simulation.kernels.drive_step import REAL, SAMPLED
from drillctl.simulation.kernels.rock_step import Outcome
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.string_step import move_block
from drillctl.simulation.kernels.variation_step import varies
from drillctl.simulation.kernels.vectors import Variable, at, each, loop, pick, put, when
from drillctl.simulation.kernels.weight_step import acting, stays


class Bit(NamedTuple):
    """Bit and rock of every lane."""

    per_depth: Any  # force of all cutters per depth of one blade (N/m)
    arm: Any  # their torque per force (m)
    flat: Any  # force on the whole wear flat (N)
    flat_torque: Any  # N m
    between: Any  # angle from blade to blade (rad)
    slope: Any  # of the surface at time zero (m/rad)
    rate: Any  # of steady drilling at time zero (m/s)
    torque: Any  # of the drive then (N m); 0 where the start is none of steady drilling
    steady: Any  # rate of penetration at which dampers take no force (m/s)
    closest: Any  # distance of the points of the surface (rad)


class CuttingStep(NamedTuple):
    """The bit; the axial string in 2 x 2 blocks, whose states are parts of the bit's motion."""

    bit: Bit
    free: Any  # shape (blocks, 4): part of the depth (m) and of its rate (m/s)
    push: Any  # shape (blocks, 4): each of both by force, and by `Bit.steady`
    by_force: Any  # shape (2,): depth and sinking of the bit after a step per force held over it
    start: Any  # shape (2 blocks, lanes): at the steady rate of time zero


(FORCE, CUT, TOUCHING, GAP, OLDER, NEWEST, BASE, BEFORE_ANGLE, NEWEST_ANGLE, LEFT_ANGLE,
 LEFT_DEPTH, RIGHT_ANGLE, RIGHT_DEPTH, PUSH, SHIFT) = (WIDTH * k for k in range(15))  # fmt: skip
"""Rows of a block: mean force of the rock (N), depth of cut of a blade (m), 1 in contact, by how
much the bit is off bottom (m); slots of the second point at hand and of the newest, where a lane's
ring begins; angles (rad) and depths (m) of points; force of the step just taken (N), and what is
to be added to the depth (m)."""
OWN = 15
FARTHEST = 3.0  # angles between two blades that the surface goes back at time zero
TINY = 1e-300


def cuts(friction: Any) -> bool:
    """Whether the bit cuts its own wake."""
    return isinstance(friction, CuttingStep)


def numbers_of(friction: Any) -> Any:
    """What is to be loaded of a law, a number a lane."""
    return friction.bit if cuts(friction) else friction


def cutting_rows(friction: Any) -> int:
    """Rows of memory that a law takes."""
    return OWN + len(friction.start) if cuts(friction) else 0


def begin_cutting(
    friction: Any, drive: Any, weight: Any, variation: Any, work: Any, memory: Any, first: Any
) -> None:
    """Steady drilling at time zero, but for the bit itself."""
    law, rows, speed = law_at(friction.bit, work, r.FRICTION), memory.cutting, at(work, r.BIT_SPEED)
    still = speed == 0.0
    with loop(friction.start.shape[0]) as states:
        begin = at(friction.start[states.index], first)
        put(rows, (OWN + states.index) * WIDTH, pick(still, 0.0, begin))
    put(work, r.SINKING, pick(still, 0.0, law.rate))
    cut = law.slope * law.between
    factor = at(work, r.FACTOR) if varies(variation) else each(1.0)
    cutters = law.per_depth * factor * cut
    for row in (r.SPEED_BEFORE, r.SPEED_BEFORE_THAT):
        put(work, row, speed)
    load = acting(weight, work).weight(speed)
    put(work, r.LOAD, load)
    put(work, r.REST_END, load)
    put(work, r.DIRECTION, pick(still, 0.0, 1.0))
    put(work, r.KINETIC, pick(still, 0.0, law.arm * cutters + law.flat_torque))
    put(rows, FORCE, load)
    put(rows, CUT, cut)
    put(rows, TOUCHING, 1.0)
    base = lane_number() * (2 * (memory.surface.shape[0] // (2 * WIDTH)))
    put(rows, BASE, base)
    begin = -FARTHEST * law.between
    scatter(memory.surface, base, begin)
    scatter(memory.surface, base + 1.0, begin * law.slope)
    for row in (BEFORE_ANGLE, LEFT_ANGLE):
        put(rows, row, begin)
    put(rows, LEFT_DEPTH, begin * law.slope)
    for row in (OLDER, NEWEST):
        put(rows, row, 1.0)
    _begin_drive(drive, law, work)


def _begin_drive(drive: Any, bit: Any, work: Any) -> None:
    """The drive gives what steady drilling takes: its integral, or its angle, holds that."""
    law = law_at(drive, work, r.DRIVE)
    ki = law.ki if isinstance(drive, REAL + SAMPLED) else each(law.gains()[1])
    steady = (bit.torque != 0.0) & (ki != 0.0)
    if isinstance(drive, REAL + SAMPLED):
        put(work, r.INTEGRAL, pick(steady, (bit.torque - law.feedforward) / ki, 0.0))
        for row in (r.MOTOR, r.FELT, r.SLOW, r.COMMAND, r.PENDING):
            put(work, row, pick(steady, bit.torque, at(work, row)))
    else:
        put(work, r.ANGLE, pick(steady, -bit.torque / ki, 0.0))


def cut_rock(
    friction: Any, weight: Any, program: Any, variation: Any, reduced: Any, work: Any,
    memory: Any, step: Any,
) -> Outcome:  # fmt: skip
    """The `Outcome` of a step, with the axial motion."""
    law, rows = law_at(friction.bit, work, r.FRICTION), memory.cutting
    depth_free, sinking_free = _sink(friction, law, rows)
    last, turned, depth, sinking = (
        at(work, row) for row in (r.BIT_SPEED, r.TURNED, r.SUNK, r.SINKING)
    )
    still, cut = at(work, r.DIRECTION) == 0.0, at(rows, CUT)
    touching = at(rows, TOUCHING) > 0.0
    speed = pick(still, 0.0, most(reduced.free - reduced.gain * at(work, r.KINETIC), 0.0))
    hook = at(work, r.LOAD)
    if not stays(weight, program):
        hook = 0.5 * (hook + acting(weight, work).weight(speed))
    place = turned + 0.5 * step * (last + speed) - law.between
    behind = _behind(place, rows, memory.surface)
    begin_hard = end_hard = each(1.0)
    if varies(variation):
        end_hard = at(work, r.FACTOR)
        begin_hard = 2.0 * at(work, r.FACTOR_MEAN) - end_hard
    stiffness = 0.5 * law.per_depth * end_hard
    was = 0.5 * law.per_depth * begin_hard * cut
    by_depth, by_speed = (each(friction.by_force[k]) for k in range(2))
    shrink = 1.0 / (1.0 + stiffness * by_depth)

    def under(base: Any) -> tuple[Any, ...]:
        """Push, depth, sinking and contact at the end under a force beside the new cut's."""
        inside = shrink * (depth_free + by_depth * (base + stiffness * behind))
        touches = inside >= behind
        push = pick(touches, base - stiffness * (inside - behind), base)
        return push, depth_free + by_depth * push, sinking_free + by_speed * push, touches

    push_up, depth_up, sinking_up, touches_up = under(hook - was)
    # A bit that comes down from above meets the rock with its wear flat for a share of the step.
    lands = touches_up & ~touching
    under_way = most(depth_up - behind, 0.0)
    bearing = pick(lands, under_way / most(under_way + at(rows, GAP), TINY), 1.0)
    push_down, depth_down, sinking_down, _ = under(hook - was - law.flat * bearing)
    sinks = (sinking_down > 0.0) & (touching | lands)
    leaves = (sinking_up < 0.0) | ~(touching | lands)
    rests = (still & (touching | lands)) | ~(sinks | leaves)
    push_held = -sinking_free / by_speed
    depth_held = depth_free + by_depth * push_held
    push = pick(rests, push_held, pick(sinks, push_down, push_up))
    new_depth = pick(rests, depth_held, pick(sinks, depth_down, depth_up))
    new_sinking = pick(rests, 0.0, pick(sinks, sinking_down, sinking_up))
    touches = (new_depth >= behind) | (rests & still)
    bears = touches | touching | lands
    cutters = was + stiffness * most(new_depth - behind, 0.0)
    share = _within_one((hook - push - cutters) / most(law.flat, TINY))
    share = pick(bears, pick(rests, share, pick(sinks, bearing, 0.0)), 0.0)
    # The torsional one.
    torque = law.arm * cutters + law.flat_torque * share
    moved = reduced.free - reduced.gain * torque
    stops = moved <= 0.0
    arrives = stops & ~still
    turning = pick(stops, 0.0, 1.0)
    with_it = arrives & bears
    part = pick(arrives, last / most(last - moved, TINY), turning)
    # It loses its axial motion as it comes to rest, after that share of the step.
    shift = pick(with_it, step * sinking * (part - 0.5), 0.0)
    push = pick(with_it, push_held, push)
    new_depth = pick(with_it, depth_held + shift, new_depth)
    new_sinking = pick(with_it, 0.0, new_sinking)
    torque = pick(stops, reduced.free * reduced.per_gain, torque)
    new_speed = pick(stops, 0.0, moved)
    put(work, r.STICKS, at(work, r.STICKS) + arrives)
    way = 0.5 * step * (last + new_speed) * pick(arrives, part, 1.0)
    new_cut = most(new_depth - behind, 0.0)
    _leave(turned + way, pick(touches, new_depth, behind), law, rows, memory.surface)
    force = hook - push
    for row, amount in (
        (r.WEIGHT_SUM, step * force),
        (r.ROP_SUM, force * way),
        (r.AXIAL_WORK, force * (new_depth - depth)),
        (r.CUT_SUM, 0.5 * step * (cut + new_cut)),
        (r.AXIAL_STUCK, pick((new_sinking == 0.0) & (sinking == 0.0) & touches, step, 0.0)),
        (r.OFF_BOTTOM, pick(touches, 0.0, step)),
    ):
        put(work, row, at(work, row) + amount)
    for row, value in (
        (FORCE, force), (CUT, new_cut), (TOUCHING, pick(touches, 1.0, 0.0)),
        (GAP, most(behind - new_depth, 0.0)), (PUSH, push), (SHIFT, shift),
    ):  # fmt: skip
        put(rows, row, value)
    put(work, r.TURNED, turned + way)
    put(work, r.SUNK, new_depth)
    put(work, r.SINKING, new_sinking)
    kinetic = law.arm * law.per_depth * end_hard * new_cut + law.flat_torque * share
    stuck = pick(stops, 1.0 - pick(arrives, part, 0.0), 0.0)
    return Outcome(
        new_speed, turning, pick(stops, 0.0, kinetic), each(0.0), torque, stuck
    )  # fmt: skip


def _within_one(share: Any) -> Any:
    return least(most(share, 0.0), 1.0)


def _sink(friction: Any, law: Any, rows: Any) -> tuple[Any, Any]:
    """Add what the last step has pushed; depth and sinking of the bit after one without a push."""
    push, steady = at(rows, PUSH), law.steady
    # A displacement at once is what a pair of opposite blows leaves: in proportion to their answer.
    blow = at(rows, SHIFT) / friction.by_force[1]
    depth, sinking = Variable(each(0.0)), Variable(each(0.0))
    with loop(friction.free.shape[0]) as blocks:
        i = blocks.index
        at_x = (OWN + 2 * i) * WIDTH
        free = [friction.free[i, k] for k in range(4)]
        b11, b12, b21, b22 = (friction.push[i, k] for k in range(4))
        x = fma(b21, blow, fma(b12, steady, fma(b11, push, at(rows, at_x))))
        y = fma(b22, steady, fma(b21, push, at(rows, at_x + WIDTH)))
        x_free, y_free = move_block(free, x, y, rows, at_x)
        depth.set(depth.get() + x_free)
        sinking.set(sinking.get() + y_free)
    return depth.get(), sinking.get()


def _after(slot: Any, surface: Any) -> Any:
    """The slot after another one of a ring."""
    return pick(slot + 1.0 < surface.shape[0] // (2 * WIDTH), slot + 1.0, 0.0)


def _behind(place: Any, rows: Any, surface: Any) -> Any:
    """Depth of the rock at an angle, as the blade before has left it."""
    kept = (LEFT_ANGLE, LEFT_DEPTH, RIGHT_ANGLE, RIGHT_DEPTH, OLDER)
    left, left_depth, right, right_depth, slot = found = [Variable(at(rows, row)) for row in kept]
    newest, base = at(rows, NEWEST), at(rows, BASE)

    def passed() -> Any:
        return (right.get() < place) & (slot.get() != newest)

    with when(any_of(passed())):
        is_open = Variable(passed())
        with loop(surface.shape[0]) as points:
            goes = is_open.get()
            slot.set(pick(goes, _after(slot.get(), surface), slot.get()))
            spot = base + 2.0 * slot.get()
            left.set(pick(goes, right.get(), left.get()))
            left_depth.set(pick(goes, right_depth.get(), left_depth.get()))
            right.set(pick(goes, gather(surface, spot), right.get()))
            right_depth.set(pick(goes, gather(surface, spot + 1.0), right_depth.get()))
            is_open.set(goes & passed())
            with when(~any_of(is_open.get())):
                points.leave()
    for row, value in zip(kept, found, strict=True):
        put(rows, row, value.get())
    rise = (right_depth.get() - left_depth.get()) / most(right.get() - left.get(), TINY)
    return left_depth.get() + rise * (place - left.get())


def _leave(angle: Any, depth: Any, law: Any, rows: Any, surface: Any) -> None:
    """Put the newest point of the surface down, a new one where the last two lie well apart."""
    before, newest = at(rows, BEFORE_ANGLE), at(rows, NEWEST_ANGLE)
    apart = (newest - before >= law.closest) & (angle > newest)
    slot = at(rows, NEWEST)
    slot = pick(apart, _after(slot, surface), slot)
    put(rows, NEWEST, slot)
    put(rows, BEFORE_ANGLE, pick(apart, newest, before))
    put(rows, NEWEST_ANGLE, angle)
    spot = at(rows, BASE) + 2.0 * slot
    scatter(surface, spot, angle)
    scatter(surface, spot + 1.0, depth)


def sample_cutting(work: Any, signals: Any, after: int, first: Any) -> None:
    """Store depth and rate of penetration."""
    put(signals[after], first, at(work, r.SUNK))
    put(signals[after + 1], first, at(work, r.SINKING))


def conclude_cutting(work: Any) -> None:
    """Work of the rock in both directions."""
    put(work, r.WORK, at(work, r.WORK) + at(work, r.AXIAL_WORK))
    put(work, r.DRILLED, at(work, r.SUNK))
