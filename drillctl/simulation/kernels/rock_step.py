"""What the rock does to the bit in a step, set-valued or smooth, by the type of its law."""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined, widest_vectors
from drillctl.simulation.kernels.held_rock import rock
from drillctl.simulation.kernels.lane_step import (
    decide,
    set_up,
    solve_inclusion,
    time_releases,
    time_stops,
)
from drillctl.simulation.kernels.laws import contact
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.weight_step import acting

BISECTIONS = 60
"""Most iterations of the safeguarded Newton method."""
CLOSE = 1e-13
"""It has converged when it moves less than this (rad/s, relative over 1 rad/s)."""


def meet_rock(friction: Any, weight: Any, work: Any) -> None:
    """Bit speed and bit torque of the step from what string and drive leave free."""
    raise NotImplementedError("compiled only")


@overload(meet_rock)
def _meet_rock(friction, weight, work):
    # A property of the class: it reads no number of the law.
    if friction.instance_class.set_valued.fget(None):
        return lambda friction, weight, work: _stick_or_slip(friction, weight, work)
    return lambda friction, weight, work: _creep(friction, weight, work)


@inlined
def _stick_or_slip(friction: Any, weight: Any, work: Any) -> None:
    # What takes divisions and happens rarely is done when some lane needs it; it leaves the
    # other lanes as they are.
    if set_up(friction, weight, work) > 0:
        time_releases(friction, weight, work)
    solve_inclusion(friction, weight, work)
    if decide(friction, weight, work) > 0:
        time_stops(friction, weight, work)


@inlined
def _creep(friction: Any, weight: Any, work: Any) -> None:
    """The step of a smooth law: w + theta gain T(w) = free - (1 - theta) gain T(before).

    The mean torque is the trapezoid's, theta = 1/2, while the bit's own time constant under the
    rock is longer than half a step. A law that is steep at rest makes it shorter; theta then
    grows to 1 - 1/z, z = gain x slope, so that a creeping bit relaxes and does not ring.
    """
    widest_vectors()
    for lane in range(WIDTH):
        free, gain = work[r.FREE + lane], work[r.GAIN + lane]
        steep = gain * work[r.SLOPE + lane]
        theta = 1.0 - 1.0 / steep if steep > 2.0 else 0.5
        right = free - (1.0 - theta) * gain * work[r.KINETIC + lane]
        sign = 1.0 if right >= 0.0 else -1.0
        work[r.SIGN + lane] = sign
        work[r.RIGHT + lane] = sign * right
        work[r.SHARE_NEW + lane] = theta * gain
        # The root lies between zero and the right-hand side: the torque only brakes.
        work[r.LOW_BOUND + lane] = 0.0
        work[r.HIGH_BOUND + lane] = sign * right
        last = sign * work[r.BIT_SPEED + lane]
        guess = last if last > 0.0 else 0.0
        work[r.SPEED + lane] = guess if guess < sign * right else sign * right
        work[r.OPEN + lane] = 1.0
    for _ in range(BISECTIONS):
        if _safeguarded_newton(friction, weight, work) == 0:
            break
    for lane in range(WIDTH):
        sign, u = work[r.SIGN + lane], work[r.SPEED + lane]
        law = rock(friction, weight, work, lane)
        torque, slope = contact(law, acting(weight, work, lane), u)
        work[r.NEW_SPEED + lane] = sign * u
        work[r.NEW_DIRECTION + lane] = sign
        work[r.NEW_KINETIC + lane] = sign * torque
        work[r.SLOPE + lane] = slope
        work[r.BIT_TORQUE + lane] = (work[r.FREE + lane] - sign * u) * work[r.PER_GAIN + lane]
        work[r.STUCK_SHARE + lane] = 0.0


@inlined
def _safeguarded_newton(friction: Any, weight: Any, work: Any) -> int:
    """One step of Newton's method, or a bisection where it would leave the bracket."""
    widest_vectors()
    still_open = 0
    for lane in range(WIDTH):
        law = rock(friction, weight, work, lane)
        u, share = work[r.SPEED + lane], work[r.SHARE_NEW + lane]
        torque, slope = contact(law, acting(weight, work, lane), u)
        excess = u + share * torque - work[r.RIGHT + lane]
        low = u if excess < 0.0 else work[r.LOW_BOUND + lane]
        high = u if excess >= 0.0 else work[r.HIGH_BOUND + lane]
        new = u - excess / (1.0 + share * slope)
        inside = new > low and new < high
        new = new if inside else 0.5 * (low + high)
        is_open = work[r.OPEN + lane] > 0.0
        far = abs(new - u) > CLOSE * (1.0 + u)
        work[r.LOW_BOUND + lane] = low
        work[r.HIGH_BOUND + lane] = high
        work[r.SPEED + lane] = new if is_open else u
        work[r.OPEN + lane] = 1.0 if is_open and far else 0.0
        still_open += 1 if is_open and far else 0
    return still_open
