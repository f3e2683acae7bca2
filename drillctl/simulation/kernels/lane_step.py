"""The step of the laws, lane by lane: everything that is not the string.

With the mean top torque of the step affine in the top's motion at its end (`drive_step`), both
control and string can be eliminated. The bit speed at the end of the step
is then free - gain T_bit, and what is left is one scalar inclusion:

- A stuck bit stays while the torque that holds it, free / gain, is within the static one.
- A turning bit feels the mean of the torque before and after, so that its speed u >= 0 in its
  own direction solves u + (gain/2) T(u) = right. With (gain/2) (-T') < 1/4 the left side rises
  and Newton's method converges to the only root.
- It sticks only if there is no root of its own sign and the static torque can hold it; else it
  turns the other way.

Every lane takes its own decisions by selects, never by branches, and its Newton iteration
freezes when that lane has converged: no lane's bits depend on its neighbours.
"""

from __future__ import annotations

from typing import Any

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined, widest_vectors
from drillctl.simulation.kernels.drive_step import drive_line
from drillctl.simulation.kernels.held_rock import rock
from drillctl.simulation.kernels.laws import (
    contact,
    kinetic_torque_at_rest,
    static_torque,
    weight_at,
)
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.top_motion import move_top
from drillctl.simulation.kernels.weight_step import acting

NEWTON_STEP = 3e-5
"""A lane has converged when Newton moves it less than this (rad/s, relative over 1 rad/s). What
is left is the square of that move times gain/4 times the law's curvature: 1e-12 rad/s for the
rock of the paper's map, and at most 1e-9 for a law as steep as the step allows."""
NEWTON_LIMIT = 30


@inlined
def eliminate(string: Any, drive: Any, work: Any, rate: float) -> None:
    """Reduce string and control to free and gain; `rate` is 1 / step."""
    widest_vectors()
    for lane in range(WIDTH):
        drag = work[r.DRAG + lane]
        offset, slope, by_speed = drive_line(drive, string, work, lane, rate)
        shrink = 1.0 / (1.0 + slope * string.angle_by_top + by_speed * string.top_speed_by_top)
        angle = work[r.TOP_FREE + lane] - string.angle_by_top * drag
        speed = work[r.TOP_SPEED_FREE + lane] - string.top_speed_by_top * drag
        alone = (offset - slope * angle - by_speed * speed) * shrink
        share = (slope * string.angle_by_bit + by_speed * string.top_speed_by_bit) * shrink
        free = (
            work[r.SET_SPEED + lane]
            + work[r.BIT_FREE + lane]
            + string.speed_by_top * (alone - drag)
        )
        gain = string.speed_by_bit - string.speed_by_top * share
        work[r.OFFSET + lane] = alone
        work[r.SHARE + lane] = share
        work[r.FREE + lane] = free
        work[r.GAIN + lane] = gain
        work[r.PER_GAIN + lane] = 1.0 / gain


@inlined
def set_up(friction: Any, weight: Any, work: Any) -> int:
    """Set the inclusion at the bit up; returns how many lanes break loose."""
    widest_vectors()
    releases = 0
    for lane in range(WIDTH):
        free, gain, load = work[r.FREE + lane], work[r.GAIN + lane], work[r.REST_LOAD + lane]
        law = rock(friction, weight, work, lane)
        kinetic = kinetic_torque_at_rest(law, load)
        direction = work[r.DIRECTION + lane]
        forward = 1.0 if free > 0.0 else -1.0
        own = direction * (free - 0.5 * gain * work[r.KINETIC + lane]) > 0.5 * gain * kinetic
        # A stuck bit, and one that is turned round, starts from the torque at rest.
        sign = direction if own else forward
        previous = sign * work[r.KINETIC + lane] if own else kinetic
        right = sign * free - 0.5 * gain * previous
        # The law as a straight line from its last torque and slope: Newton's first guess, off
        # by its curvature over one step. A bit set in motion has no last slope.
        fall = -0.5 * gain * work[r.SLOPE + lane] if own else 0.0
        last = abs(work[r.BIT_SPEED + lane])
        flat = right - 0.5 * gain * previous
        guess = flat + fall * (flat + fall * (flat - last) - last)
        work[r.SIGN + lane] = sign
        work[r.OWN + lane] = 1.0 if own else 0.0
        work[r.RIGHT + lane] = right
        work[r.SPEED + lane] = guess if guess > 0.0 else 0.0
        work[r.OPEN + lane] = 1.0

        holding = abs(free) * work[r.PER_GAIN + lane]
        work[r.NEW_HOLDING + lane] = holding
        releases += 1 if direction == 0.0 and holding > static_torque(law, load) else 0
    return releases


@inlined
def time_releases(friction: Any, weight: Any, work: Any) -> None:
    """Date the moment a stuck bit breaks loose, and give it no friction torque before it.

    The torque that would hold it rises along the line through the holding torques of this step
    and the last, each in the middle of its step; it meets the static one after the share
    `held` of this step, or before its beginning if that is negative. Until then the bit bears
    the holding torque, which the slip equation has as the slip torque: the difference of the
    two impulses goes to the right-hand side.
    """
    widest_vectors()
    for lane in range(WIDTH):
        law = rock(friction, weight, work, lane)
        load = work[r.REST_LOAD + lane]
        static, kinetic = static_torque(law, load), kinetic_torque_at_rest(law, load)
        holding, last = work[r.NEW_HOLDING + lane], work[r.HOLDING + lane]
        rise = holding - last
        held = 0.5 + (static - holding) / rise
        # Without a step wholly at rest behind it, nothing is known of the rise.
        known = last >= 0.0
        loose = work[r.DIRECTION + lane] == 0.0 and holding > static
        early = work[r.GAIN + lane] * (0.5 * rise * held * held - held * (static - kinetic))
        work[r.RIGHT + lane] += early if loose and known else 0.0
        work[r.STUCK_SHARE + lane] = held if known else 0.0


@inlined
def solve_inclusion(friction: Any, weight: Any, work: Any) -> None:
    """Newton's method on u + (gain/2) T(u) = right, u >= 0, in every lane that is open."""
    widest_vectors()
    for _ in range(NEWTON_LIMIT):
        still_open = 0  # an integer: the compiler may not reorder a sum of doubles
        for lane in range(WIDTH):
            law = rock(friction, weight, work, lane)
            u = work[r.SPEED + lane]
            half = 0.5 * work[r.GAIN + lane]
            torque, slope = contact(law, acting(weight, work, lane), u)
            move = (work[r.RIGHT + lane] - u - half * torque) / (1.0 + half * slope)
            new = u + move
            new = new if new > 0.0 else 0.0
            is_open = work[r.OPEN + lane] > 0.0
            far = abs(new - u) > NEWTON_STEP * (1.0 + u)
            work[r.SPEED + lane] = new if is_open else u
            work[r.SLOPE + lane] = slope if is_open else work[r.SLOPE + lane]
            work[r.OPEN + lane] = 1.0 if is_open and far else 0.0
            still_open += 1 if is_open and far else 0
        if still_open == 0:
            break


@inlined
def decide(friction: Any, weight: Any, work: Any) -> int:
    """Stick or slip, and the bit torque of the step; returns how many lanes come to rest."""
    widest_vectors()
    stops = 0
    for lane in range(WIDTH):
        law = rock(friction, weight, work, lane)
        static = static_torque(law, work[r.REST_LOAD + lane])
        free, per_gain = work[r.FREE + lane], work[r.PER_GAIN + lane]
        holding = work[r.NEW_HOLDING + lane]
        sticks = holding <= static and not work[r.OWN + lane] > 0.0
        was_stuck = work[r.DIRECTION + lane] == 0.0
        speed = 0.0 if sticks else work[r.SIGN + lane] * work[r.SPEED + lane]
        # The slip torque at the new speed follows from the equation that u solves.
        slip = 2.0 * (work[r.RIGHT + lane] - work[r.SPEED + lane]) * per_gain
        work[r.NEW_SPEED + lane] = speed
        work[r.NEW_DIRECTION + lane] = 0.0 if sticks else work[r.SIGN + lane]
        work[r.NEW_KINETIC + lane] = 0.0 if sticks else work[r.SIGN + lane] * slip
        work[r.BIT_TORQUE + lane] = (free - speed) * per_gain
        # A bit that breaks loose keeps the share that `time_releases` found.
        loose = was_stuck and not sticks
        work[r.STUCK_SHARE + lane] = work[r.STUCK_SHARE + lane] if loose else 1.0 * sticks
        stops += 1 if sticks and not was_stuck else 0
    return stops


@inlined
def time_stops(friction: Any, weight: Any, work: Any) -> None:
    """Share of the step spent stuck in lanes that come to rest.

    The bit is followed in a straight line from its speed before through zero.
    """
    widest_vectors()
    for lane in range(WIDTH):
        law = rock(friction, weight, work, lane)
        half = 0.5 * work[r.GAIN + lane]
        direction = work[r.DIRECTION + lane]
        past_zero = direction * (work[r.FREE + lane] - half * work[r.KINETIC + lane])
        past_zero -= half * kinetic_torque_at_rest(law, work[r.REST_LOAD + lane])
        stuck = past_zero / (past_zero - abs(work[r.BIT_SPEED + lane]))
        stops = direction != 0.0 and work[r.NEW_DIRECTION + lane] == 0.0
        work[r.STUCK_SHARE + lane] = stuck if stops else work[r.STUCK_SHARE + lane]
        work[r.STICKS + lane] += 1.0 if stops else 0.0


@inlined
def conclude(string: Any, drive: Any, weight: Any, observer: Any, work: Any) -> None:
    """Top torque of the step, and the state at its end."""
    widest_vectors()
    for lane in range(WIDTH):
        bit_torque = work[r.BIT_TORQUE + lane]
        top_torque = work[r.OFFSET + lane] + work[r.SHARE + lane] * bit_torque
        net_torque = top_torque - work[r.DRAG + lane]
        work[r.TOP_TORQUE + lane] = net_torque
        work[r.ANGLE + lane] = (
            work[r.TOP_FREE + lane]
            + string.angle_by_top * net_torque
            - string.angle_by_bit * bit_torque
        )
        move_top(drive, observer, string, work, lane)
        stayed = work[r.DIRECTION + lane] == 0.0 and work[r.NEW_DIRECTION + lane] == 0.0
        work[r.HOLDING + lane] = work[r.NEW_HOLDING + lane] if stayed else -1.0
        work[r.DIRECTION + lane] = work[r.NEW_DIRECTION + lane]
        work[r.KINETIC + lane] = work[r.NEW_KINETIC + lane]
        work[r.SPEED_BEFORE + lane] = work[r.BIT_SPEED + lane]
        speed = work[r.NEW_SPEED + lane]
        work[r.BIT_SPEED + lane] = speed
        work[r.LOAD_BEFORE + lane] = work[r.LOAD + lane]
        work[r.LOAD + lane] = weight_at(acting(weight, work, lane), abs(speed))
