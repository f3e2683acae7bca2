"""What a set-valued law of the rock does to the bit in a step.

With string and drive eliminated (`drive_step`), the bit speed at the end of the step
is free - gain T_bit, and what is left is one scalar inclusion:

- A stuck bit stays while the torque that holds it, free / gain, is within the static one.
- A turning bit feels the mean of the torque before and after, so that its speed u >= 0 in its
  own direction solves u + (gain/2) T(u) = right. With (gain/2) (-T') < 1/4 the left side rises
  and Newton's method converges to the only root.
- It sticks only if there is no root of its own sign and the static torque can hold it; else it
  turns the other way.

Every lane takes its own decisions, and its Newton iteration freezes when that lane has converged:
no lane's bits depend on its neighbours. What takes divisions and happens rarely is done when some
lane needs it; it leaves the other lanes as they are.

Top speed at the ends of steps, for the drives and observers that ask for it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import (
    any_of,
    at,
    by_type,
    each,
    everywhere,
    inlined,
    most,
    pick,
    put,
)
from drillctl.simulation.kernels.drive_step import RealStep, SampledStep
from drillctl.simulation.kernels.held_rock import rock
from drillctl.simulation.kernels.laws import contact, kinetic_torque_at_rest, static_torque
from drillctl.simulation.kernels.observer_step import ObserverStep
from drillctl.simulation.kernels.weight_step import acting

NEWTON_STEP = 1e-3
"""A lane has converged when Newton moves it less than this (rad/s, relative over 1 rad/s). What
is left is the square of that move times gain/4 times the law's curvature: 1e-9 rad/s for the
rock of the paper's map at steps of 50 ms, where the scheme itself is off by 1e-4 of the speed."""
NEWTON_LIMIT = 30


class Outcome(NamedTuple):
    """What a step ends with."""

    speed: Any  # bit speed at its end (rad/s)
    direction: Any  # +1 or -1 turning, 0 stuck
    # friction torque at that speed, signed (N m), and the law's slope there (N m s/rad)
    kinetic: Any
    slope: Any
    torque: Any  # mean torque on the bit over the step (N m)
    holding: Any  # mean torque that held a bit which was stuck throughout (N m); -1 of any other
    stuck: Any  # share of the step spent stuck


@inlined
def stick_or_slip(friction: Any, weight: Any, reduced: Any, work: Any) -> Any:
    """The `Outcome` of a step under a set-valued law."""
    law, load, at_rest = rock(friction, weight, work), acting(weight, work), at(work, r.REST_LOAD)
    static, kinetic = static_torque(law, at_rest), kinetic_torque_at_rest(law, at_rest)
    free, half = reduced.free, 0.5 * reduced.gain
    direction, before = at(work, r.DIRECTION), at(work, r.KINETIC)
    was_stuck = direction == 0.0
    own = direction * (free - half * before) > half * kinetic
    # A stuck bit, and one that is turned round, starts from the torque at rest.
    sign = pick(own, direction, pick(free > 0.0, 1.0, -1.0))
    previous = pick(own, sign * before, kinetic)
    right = sign * free - half * previous
    holding = abs(free) * reduced.per_gain
    loose = was_stuck & (holding > static)
    stuck = each(0.0)
    if any_of(loose):
        stuck, early = time_release(static, kinetic, holding, reduced.gain, at(work, r.HOLDING))
        right = pick(loose, right + early, right)
    # The law as a straight line from its last torque and slope: Newton's first guess, off
    # by its curvature over one step. A bit set in motion has no last slope.
    fall = pick(own, -half * at(work, r.SLOPE), 0.0)
    last = abs(at(work, r.BIT_SPEED))
    flat = right - half * previous
    guess = most(flat + fall * (flat + fall * (flat - last) - last), 0.0)
    u, slope = solve_inclusion(law, load, half, right, guess, at(work, r.SLOPE))

    sticks = (holding <= static) & ~own
    speed = pick(sticks, 0.0, sign * u)
    # The slip torque at the new speed follows from the equation that u solves.
    slip = 2.0 * (right - u) * reduced.per_gain
    # A bit that breaks loose keeps the share that `time_release` found.
    stuck = pick(loose, stuck, pick(sticks, 1.0, 0.0))
    stops = sticks & ~was_stuck
    if any_of(stops):
        past_zero = direction * (free - half * before) - half * kinetic
        # The bit is followed in a straight line from its speed before through zero.
        stuck = pick(stops, past_zero / (past_zero - last), stuck)
        put(work, r.STICKS, at(work, r.STICKS) + stops)
    return Outcome(
        speed,
        pick(sticks, 0.0, sign),
        pick(sticks, 0.0, sign * slip),
        slope,
        (free - speed) * reduced.per_gain,
        pick(was_stuck & sticks, holding, -1.0),
        stuck,
    )


@inlined
def time_release(static: Any, kinetic: Any, holding: Any, gain: Any, last: Any) -> Any:
    """Date the moment a stuck bit breaks loose, and give it no friction torque before it.

    The torque that would hold it rises along the line through the holding torques of this step
    and the last, each in the middle of its step; it meets the static one after the share
    `held` of this step, or before its beginning if that is negative. Until then the bit bears
    the holding torque, which the slip equation has as the slip torque: the difference of the
    two impulses goes to the right-hand side. Returns the share and that difference.
    """
    rise = holding - last
    held = 0.5 + (static - holding) / rise
    early = gain * (0.5 * rise * held * held - held * (static - kinetic))
    # Without a step wholly at rest behind it, nothing is known of the rise.
    known = last >= 0.0
    return pick(known, held, 0.0), pick(known, early, 0.0)


@inlined
def solve_inclusion(
    law: Any, load: Any, half: Any, right: Any, guess: Any, slope_before: Any
) -> Any:
    """Newton's method on u + half T(u) = right, u >= 0; the root and the slope there."""
    u, slope, is_open = guess, slope_before, everywhere()
    for _ in range(NEWTON_LIMIT):
        torque, falls = contact(law, load, u)
        new = most(u + (right - u - half * torque) * one_over_one_plus(half * falls), 0.0)
        far = abs(new - u) > NEWTON_STEP * (1.0 + u)
        u = pick(is_open, new, u)
        slope = pick(is_open, falls, slope)
        is_open = is_open & far
        if not any_of(is_open):
            break
    return u, slope


@inlined
def one_over_one_plus(d: Any) -> Any:
    """1 / (1 + d) for |d| <= 1/4, to 2e-5 and far better for small d; a division takes longer.

    (1 - d) (1 + d^2) (1 + d^4) = (1 - d^8) / (1 + d). Newton's method corrects itself: its step is
    off by that share at most.
    """
    square = d * d
    product = 1.0 - d
    product = product + product * square
    return product + product * (square * square)


def asks_for_top(drive: Any, observer: Any) -> bool:
    """Whether drive or observer, as numba knows them, need the top speed."""
    return (
        drive.instance_class in (RealStep, SampledStep) or observer.instance_class is ObserverStep
    )


def move_top(drive: Any, observer: Any, string: Any, swing: Any, work: Any) -> None:
    """Top speed at the end of the step, where something asks for it."""
    raise NotImplementedError("compiled only")


@by_type(move_top)
def _move_top(drive, observer, string, swing, work):
    if not asks_for_top(drive, observer):
        return lambda drive, observer, string, swing, work: None
    return lambda drive, observer, string, swing, work: _move(string, swing, work)


@inlined
def _move(string: Any, swing: Any, work: Any) -> None:
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    speed = swing.top_speed + string.top_speed_by_top * top - string.top_speed_by_bit * bit
    put(work, r.TOP_SPEED, speed)
