"""What the rock does to the bit in a step, in CasADi's symbols: `kernels/lane_step.py` once more.

Every choice of the kernel is an `if_else` on both of whose sides there are numbers, so that a
derivative is that of the side taken: right almost everywhere, and of no meaning where an event
appears or goes. Newton's method stops by the kernel's rule, which is part of the scheme: what it
leaves is below the scheme's error but not below the tolerance that both engines are compared at.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.bit_rock.law import contact
from drillctl.simulation.kernels.lane_step import NEWTON_STEP

NEWTON = 4
"""Newton steps that are written out. Each squares the error of the one before; the first guess is
right to the curvature of the law over a step, and a lane that breaks loose needs the most."""


class Bit(NamedTuple):
    """State of bit and rock between steps; see `kernels.lane_step.Outcome`."""

    speed: Any
    direction: Any
    kinetic: Any
    slope: Any
    holding: Any


class Met(NamedTuple):
    """A step of the bit: its state at the end, and the mean torque on it (N m)."""

    bit: Bit
    torque: Any


def meet_rock(friction: Any, weight: Any, free: Any, gain: Any, bit: Bit) -> Met:
    """The step of a bit under a set-valued law."""
    import casadi as ca

    at_rest = weight.weight(0.0 * free)
    static, kinetic = friction.static_torque(at_rest), friction.kinetic_torque_at_rest(at_rest)
    half = 0.5 * gain
    was_stuck = bit.direction == 0
    own = bit.direction * (free - half * bit.kinetic) > half * kinetic
    sign = ca.if_else(own, bit.direction, ca.if_else(free > 0, 1.0, -1.0))
    previous = ca.if_else(own, sign * bit.kinetic, kinetic)
    holding = ca.fabs(free) / gain
    loose = ca.logic_and(was_stuck, holding > static)
    right = sign * free - half * previous
    right += ca.if_else(loose, _early(static, kinetic, holding, gain, bit.holding), 0.0)
    fall = ca.if_else(own, -half * bit.slope, 0.0)
    last, flat = ca.fabs(bit.speed), right - half * previous
    guess = ca.fmax(flat + fall * (flat + fall * (flat - last) - last), 0.0)
    u, slope = _newton(friction, weight, half, right, guess, bit.slope)
    sticks = ca.logic_and(holding <= static, ca.logic_not(own))
    speed = ca.if_else(sticks, 0.0, sign * u)
    after = Bit(
        speed,
        ca.if_else(sticks, 0.0, sign),
        ca.if_else(sticks, 0.0, sign * 2.0 * (right - u) / gain),
        slope,
        ca.if_else(ca.logic_and(was_stuck, sticks), holding, -1.0),
    )
    return Met(after, (free - speed) / gain)


def _early(static: Any, kinetic: Any, holding: Any, gain: Any, last: Any) -> Any:
    """Impulse of the time before a bit breaks loose; `kernels.lane_step.time_release`."""
    import casadi as ca

    known = last >= 0
    rise = ca.if_else(known, holding - last, 1.0)
    held = 0.5 + (static - holding) / rise
    early = gain * (0.5 * rise * held * held - held * (static - kinetic))
    return ca.if_else(known, early, 0.0)


def _newton(
    friction: Any, weight: Any, half: Any, right: Any, guess: Any, before: Any
) -> tuple[Any, Any]:
    """The root u >= 0 of u + half T(u) = right, and the law's slope, by the kernel's rule."""
    import casadi as ca

    u, slope, is_open = guess, before, ca.SX(1)
    for _ in range(NEWTON):
        torque, falls = contact(friction, weight, u, ca.exp)
        new = ca.fmax(u + (right - u - half * torque) / (1.0 + half * falls), 0.0)
        far = ca.fabs(new - u) > NEWTON_STEP * (1.0 + u)
        u, slope = ca.if_else(is_open, new, u), ca.if_else(is_open, falls, slope)
        is_open = ca.logic_and(is_open, far)
    return u, slope
