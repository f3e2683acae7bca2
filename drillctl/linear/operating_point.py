"""Steady drilling: the speeds at which drive, drag and rock balance, and the slope there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.rig.bit_rock import contact
from drillctl.rig.bit_rock.law import by_weight
from drillctl.rig.weight_on_bit import PATHS, AlarmWeight
from drillctl.store.codec import documented, label

FASTEST = 1e4  # highest speed of the scan (rad/s)
SCAN = 4000  # speeds at which the balance is evaluated before its zeros are located


@dataclass(frozen=True)
@documented
class OperatingPoint:
    """One steady state of a rig."""

    speed: float = label(unit="rad/s", means="of top and bit")
    bit_torque: float = label(unit="N*m", means="torque of the rock")
    slope: float = label(
        unit="N*m*s/rad", means="its falling slope D = -dT/dw, negative where the torque rises"
    )


def operating_point(design: Design) -> OperatingPoint:
    """The steady state that a rig drills at.

    Parameters
    ----------
    design : Design
        With integral action that is the set speed itself; with proportional action alone the
        steady state nearest to it; at constant torque the fastest.

    Raises
    ------
    InputError
        There is none: the drive cannot turn the bit, or nothing limits its speed.
    """
    result = equilibria(design)
    if not result:
        raise InputError(
            "no speed at which the torque of the drive equals that of rock and drag", "controller"
        )
    if not any(design.linear_drive.gains()):  # no set speed to be near to
        return result[-1]
    return min(result, key=lambda point: abs(point.speed - design.speed))


def equilibria(design: Design) -> tuple[OperatingPoint, ...]:
    """All steady states of a turning bit, by rising speed.

    Parameters
    ----------
    design : Design
        Rig and control. With integral action the set speed alone is steady, however much
        torque that takes.
    """
    _, ki = design.linear_drive.gains()
    if ki != 0.0:
        return (at_speed(design, design.speed),)
    speeds = _speeds(design)
    surplus = _surplus(design, speeds)
    signs = surplus > 0.0
    changes = np.flatnonzero(signs[1:] != signs[:-1])
    brackets = [(float(speeds[i]), float(speeds[i + 1])) for i in changes]
    brackets += _folds(design, speeds, surplus)
    found = sorted(_zero(design, *b) for b in brackets)
    if design.wall is not None:  # at its critical speed the torque of the wall jumps over a balance
        found = [x for x in found if abs(_surplus(design, x)) < 1e-6 * design.wall.total]
    return tuple(at_speed(design, speed) for speed in found)


def _speeds(design: Design) -> Array:
    """Speeds of the scan (rad/s): decades from next to rest, and evenly about the set speed."""
    decades = np.geomspace(1e-6, FASTEST, SCAN)
    about = design.speed * np.linspace(0.0, 3.0, SCAN)[1:]
    return np.unique(np.concatenate([decades, about]))


def _folds(design: Design, speeds: Array, surplus: Array) -> list[tuple[float, float]]:
    """Brackets of pairs of steady states so close that no two of the speeds part them."""
    from scipy.optimize import minimize_scalar

    results = []
    low, middle, high = surplus[:-2], surplus[1:-1], surplus[2:]
    for sign in (1.0, -1.0):
        near = (sign * middle < 0.0) & (sign * middle > sign * low) & (sign * middle >= sign * high)
        for i in np.flatnonzero(near):
            begin, end = float(speeds[i]), float(speeds[i + 2])

            def depth(speed: float, sign: float = sign) -> float:
                return -sign * float(_surplus(design, speed))

            top = minimize_scalar(depth, bounds=(begin, end), method="bounded",
                                  options={"xatol": 1e-12 * end})  # fmt: skip
            if top.fun < 0.0:
                results += [(begin, float(top.x)), (float(top.x), end)]
    return results


def at_speed(design: Design, speed: float) -> OperatingPoint:
    """Torque and slope of the rock at a speed (rad/s), be it steady or not."""
    torque, slope = rock_at(design.bit_rock, design.weight_on_bit, speed)
    return OperatingPoint(speed, float(torque), -float(slope))


def cancelling_weight_gain(design: Design) -> float:
    """Gain K_w of weight on bit over bit speed that cancels the falling slope of the rock.

    Parameters
    ----------
    design : Design
        Its own weight law does not matter: only torque, speed and weight of the operating point.

    Returns
    -------
    float
        K_w* = (-dT/dw) / (dT/dW) (N s/rad) at constant weight; at a row of a friction table
        dT/dW is the mean of both sides.
    """
    point = operating_point(design)
    weight = design.tables.operating_point.weight_on_bit
    moving = design.replace(
        {"weight_on_bit": {"law": "navarro-lopez-suarez", "gain": units.SI(1.0)}}
    )
    _, slope = moving.bit_rock.torque_and_slope(weight, point.speed, np.exp)
    return float(-slope / by_weight(moving.bit_rock, weight, point.speed, np.exp))


def rock_at(friction: Any, weight: Any, speed: Any) -> tuple[Any, Any]:
    """Torque of the rock and its slope in steady motion."""
    if not isinstance(weight, PATHS):
        return contact(friction, weight, speed, np.exp)
    steady = weight.nominal + 0.0 * speed
    if not isinstance(weight, AlarmWeight):
        steady = weight.command(speed, weight.nominal)
    return friction.torque_and_slope(steady, speed, np.exp)


def _surplus(design: Design, speed: float | Array) -> Any:
    """Torque (N m) that drive gives beyond what rock, drag and wall take at a steady speed."""
    drag = float(design.string.ground_damping.sum()) * speed
    rock, _ = rock_at(design.bit_rock, design.weight_on_bit, speed)
    if design.wall is not None:
        drag = drag + design.wall.at_speed(speed)
    return design.linear_drive.torque(0.0, speed - design.speed) - drag - rock


def _zero(design: Design, low: float, high: float) -> float:
    from scipy.optimize import brentq

    def balance(speed: float) -> float:
        return float(_surplus(design, speed))

    return float(brentq(balance, low, high, xtol=1e-15, rtol=1e-14))
