"""What the rock does to the bit in a step, set-valued or smooth, by the type of its law."""

from __future__ import annotations

from typing import Any

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import (
    any_of,
    at,
    by_type,
    each,
    everywhere,
    inlined,
    least,
    most,
    pick,
)
from drillctl.simulation.kernels.held_rock import rock
from drillctl.simulation.kernels.lane_step import Outcome, stick_or_slip
from drillctl.simulation.kernels.laws import contact
from drillctl.simulation.kernels.weight_step import acting

BISECTIONS = 60  # most iterations of the safeguarded Newton method
CLOSE = 1e-13  # it has converged when it moves less than this (rad/s, relative over 1 rad/s)


def meet_rock(friction: Any, weight: Any, reduced: Any, work: Any) -> Any:
    """The `Outcome` of a step from what string and drive leave free."""
    raise NotImplementedError("compiled only")


@by_type(meet_rock)
def _meet_rock(friction, weight, reduced, work):
    # A property of the class: it reads no number of the law.
    if friction.instance_class.set_valued.fget(None):
        return lambda friction, weight, reduced, work: stick_or_slip(
            friction, weight, reduced, work
        )
    return lambda friction, weight, reduced, work: _creep(friction, weight, reduced, work)


@inlined
def _creep(friction: Any, weight: Any, reduced: Any, work: Any) -> Any:
    """The step of a smooth law: w + theta gain T(w) = free - (1 - theta) gain T(before).

    The mean torque is the trapezoid's, theta = 1/2, while the bit's own time constant under the
    rock is longer than half a step. A law that is steep at rest makes it shorter; theta then
    grows to 1 - 1/z, z = gain x slope, so that a creeping bit relaxes and does not ring.
    """
    law, load = rock(friction, weight, work), acting(weight, work)
    free, gain = reduced.free, reduced.gain
    steep = gain * at(work, r.SLOPE)
    theta = pick(steep > 2.0, 1.0 - 1.0 / steep, 0.5)
    right = free - (1.0 - theta) * gain * at(work, r.KINETIC)
    sign = pick(right >= 0.0, 1.0, -1.0)
    u = _safeguarded_newton(law, load, theta * gain, sign * right, sign * at(work, r.BIT_SPEED))
    torque, slope = contact(law, load, u)
    return Outcome(
        sign * u,
        sign,
        sign * torque,
        slope,
        (free - sign * u) * reduced.per_gain,
        each(-1.0),
        each(0.0),
    )


@inlined
def _safeguarded_newton(law: Any, load: Any, share: Any, right: Any, last: Any) -> Any:
    """The root of u + share T(u) = right, by Newton's method or bisection.

    It lies between zero and the right-hand side, as the torque only brakes; a step that would
    leave the bracket halves it instead.
    """
    low, high, is_open = each(0.0), right, everywhere()
    u = least(most(last, 0.0), right)
    for _ in range(BISECTIONS):
        torque, slope = contact(law, load, u)
        excess = u + share * torque - right
        low, high = pick(excess < 0.0, u, low), pick(excess >= 0.0, u, high)
        new = u - excess / (1.0 + share * slope)
        new = pick((new > low) & (new < high), new, 0.5 * (low + high))
        far = abs(new - u) > CLOSE * (1.0 + u)
        u = pick(is_open, new, u)
        is_open = is_open & far
        if not any_of(is_open):
            break
    return u
