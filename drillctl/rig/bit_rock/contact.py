"""Rock and weight on bit together: what a bit feels that turns at a speed."""

from __future__ import annotations

from typing import Any

from drillctl.rig.bit_rock.protocol import Exp


def contact(friction: Any, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
    """Torque of the rock and its slope over speed, the weight moving with the speed.

    Parameters
    ----------
    friction : BitRockLaw
        Torque over speed and weight.
    weight : WeightLaw
        Weight over speed.
    speed : float, array or symbol
        Of the bit in its own direction, not negative (rad/s).
    exp : callable
        Exponential that fits `speed`.

    Returns
    -------
    torque, slope
        T(W(w), w) (N m) and dT/dw + dT/dW dW/dw (N m s/rad).
    """
    load = weight.weight(speed)
    torque, slope = friction.torque_and_slope(load, speed, exp)
    if not weight.moves:
        return torque, slope
    return torque, slope + by_weight(friction, load, speed, exp) * weight.slope(speed)


def by_weight(friction: Any, load: Any, speed: Any, exp: Exp) -> Any:
    """Torque per weight at constant speed, dT/dW (m).

    Most laws are proportional to the weight; one that is not has a method of its own.
    """
    if hasattr(friction, "torque_by_weight"):
        return friction.torque_by_weight(load, speed, exp)
    return friction.torque_and_slope(1.0, speed, exp)[0]
