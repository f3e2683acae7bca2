"""Steady drilling: the speeds at which drive, drag and rock balance, and the slope there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.errors import InputError

Array = NDArray[np.float64]

FASTEST = 1e4
"""Highest speed that is looked at, over the set speed."""
SCAN = 4000
"""Speeds at which the balance is looked at before its zeros are located."""


@dataclass(frozen=True)
class OperatingPoint:
    """One steady state of a rig.

    Attributes
    ----------
    speed : float
        Of top and bit (rad/s).
    bit_torque : float
        Torque of the rock (N m).
    slope : float
        Its falling slope D = -dT/dw (N m s/rad), negative where the torque rises with speed.
    """

    speed: float
    bit_torque: float
    slope: float


def operating_point(design: Design) -> OperatingPoint:
    """The steady state nearest to the set speed.

    Parameters
    ----------
    design : Design
        With integral action that is the set speed itself.

    Raises
    ------
    InputError
        There is none: the drive cannot turn the bit, or nothing limits its speed.
    """
    found = equilibria(design)
    if not found:
        raise InputError(
            "no speed at which the torque of the drive equals that of rock and drag", "controller"
        )
    return min(found, key=lambda point: abs(point.speed - design.speed))


def equilibria(design: Design) -> tuple[OperatingPoint, ...]:
    """All steady states of a turning bit, by rising speed.

    Parameters
    ----------
    design : Design
        Rig and control. With integral action the set speed alone is steady, however much
        torque that takes.
    """
    _, ki = design.top_drive.gains()
    if ki != 0.0:
        return (at_speed(design, design.speed),)
    speeds = design.speed * np.concatenate(
        [np.geomspace(1e-6, 0.01, SCAN // 4), np.linspace(0.01, 10.0, SCAN)[1:],
         np.geomspace(10.0, FASTEST, SCAN // 4)[1:]]
    )  # fmt: skip
    signs = _surplus(design, speeds) > 0.0
    return tuple(
        at_speed(design, _zero(design, float(speeds[i]), float(speeds[i + 1])))
        for i in np.flatnonzero(signs[1:] != signs[:-1])
    )


def at_speed(design: Design, speed: float) -> OperatingPoint:
    """Torque and slope of the rock at a speed (rad/s), be it steady or not."""
    torque, slope = _rock(design, speed)
    return OperatingPoint(speed, float(torque), -float(slope))


def _rock(design: Design, speed: float | Array) -> tuple[Any, Any]:
    weight = design.weight_on_bit.weight(speed)
    return design.bit_rock.torque_and_slope(weight, speed, np.exp)


def _surplus(design: Design, speed: float | Array) -> Any:
    """Torque (N m) that drive gives beyond what rock and drag take at a steady speed."""
    drag = float(design.string.ground_damping.sum()) * speed
    return design.top_drive.torque(0.0, speed - design.speed) - drag - _rock(design, speed)[0]


def _zero(design: Design, low: float, high: float) -> float:
    from scipy.optimize import brentq

    def balance(speed: float) -> float:
        return float(_surplus(design, speed))

    return float(brentq(balance, low, high, xtol=1e-15, rtol=1e-14))
