r"""What a moving weight on bit does to the linear loop.

Near steady drilling the torque of the rock changes by :math:`-D\,w_b + g\,W'`, with D the falling
slope at constant weight, g = dT/dW, and W' the change of the weight. A weight that follows the bit
speed through filter, delay and hoist is

.. math:: W' = K_w \frac{e^{-s \tau}}{(1 + s \tau_s)(1 + s \tau_h)}\, w_b,

one that follows an observer has the observer's answer to top speed and top torque in place of
w_b / (1 + s tau_s). A signal that is sampled counts as half a period late.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.bit_rock.contact import by_weight
from drillctl.design import Design
from drillctl.linear.ends import Ends
from drillctl.linear.observer import Observer
from drillctl.weight_on_bit import FollowingSpeed, ObservedWeight, RealWeight

ComplexArray = NDArray[np.complexfloating[Any, Any]]


class Feedback(NamedTuple):
    """Torque on the bit per motion: T_b' = bit w_b + top w_top + torque T_top."""

    # per bit speed and top speed (N m s/rad)
    bit: Any
    top: Any
    torque: Any  # per torque of the drive


@dataclass(frozen=True, eq=False)
class WeightPath:
    """From the bit speed, or what stands for it, to the torque of the rock."""

    gain: float  # g K_w, torque per bit speed at rest of all lags (N m s/rad)
    # total delay and the time constants of sensor and hoist (s)
    delay: float
    sensor: float
    hoist: float
    observer: Observer | None  # in place of a sensor

    def feedback(self, s: ComplexArray) -> Feedback:
        """Torque per motion at complex frequencies `s` (1/s)."""
        way = self.gain * np.exp(-s * self.delay) / (1.0 + s * self.hoist)
        if self.observer is None:
            return Feedback(way / (1.0 + s * self.sensor), 0.0, 0.0)
        by_torque, by_speed = self.observer.transfer(s)
        return Feedback(0.0, way * by_speed, way * by_torque)


def weight_path(design: Design, speed: float) -> WeightPath | None:
    """The path of a design's weight law about steady drilling at a speed (rad/s).

    None for a weight that is constant, at its limit, or changed by an alarm alone, which drilling
    steadily never sets off.
    """
    law = design.weight_on_bit
    if not isinstance(law, (FollowingSpeed, RealWeight, ObservedWeight)):
        return None
    slope = float(FollowingSpeed(*law[:5]).slope(speed))
    if slope == 0.0:
        return None
    weight = float(FollowingSpeed(*law[:5]).weight(speed))
    gain = slope * float(by_weight(design.bit_rock, weight, speed, np.exp))
    if isinstance(law, FollowingSpeed):
        return WeightPath(gain, 0.0, 0.0, 0.0, None)
    delay = law.delay + 0.5 * law.period
    return WeightPath(gain, delay, law.sensor, law.hoist, design.observer)


@dataclass(frozen=True, eq=False)
class BitSide:
    """What closes the loop at the bit: the slope of the rock, and the weight that moves."""

    slope: float  # falling slope D of the rock at constant weight (N m s/rad)
    path: WeightPath | None = None  # of a weight that moves

    def top_impedance(self, ends: Ends, s: ComplexArray) -> ComplexArray:
        """Torque per speed at the top (N m s/rad), drive inertia included, the bit closed."""
        if self.path is None:
            return ends.top_impedance(s, -self.slope)
        felt = self.path.feedback(s)
        if self.path.observer is None:
            return ends.top_impedance(s, felt.bit - self.slope)
        seen = ends.mobility(s, bit=-self.slope + 0.0 * s)
        # w_top = top T - transfer T_b', T_b' = felt.top w_top + felt.torque T.
        return np.asarray(
            (1.0 + seen.transfer * felt.top) / (seen.top - seen.transfer * felt.torque)
        )

    def bit_impedance(self, ends: Ends, s: ComplexArray, drive: ComplexArray) -> ComplexArray:
        """Torque per speed at the bit (N m s/rad), drive and weight closed, the slope apart.

        Poles lie where it equals the slope.
        """
        return ends.bit_impedance(s, drive) + self.by_weight(ends, s, drive)

    def by_weight(self, ends: Ends, s: ComplexArray, drive: ComplexArray) -> ComplexArray:
        """The part of the moving weight in it (N m s/rad)."""
        if self.path is None:
            return np.zeros_like(s)
        felt = self.path.feedback(s)
        if self.path.observer is None:
            return np.asarray(felt.bit + 0.0 * s)
        seen = ends.mobility(s, top=drive)
        return np.asarray((felt.top - felt.torque * drive) * seen.transfer / seen.bit)
