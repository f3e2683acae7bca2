"""Friction laws as they are fitted: torque at the mean weight, by numbers that are well behaved."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drillctl.arrays import Array
from drillctl.logs.inclusion import EXPONENTIAL, POINTS

LEAST_DECAY, MOST_DECAY = 1e-4, 30.0  # (s/rad)
USUAL_DECAY = 0.1  # (s/rad), where a log says nothing
SPEEDS = (0.0, 1.0, 2.5, 4.5, 7.0, 10.0, 14.0, 19.0, 26.0, 36.0, 48.0)
"""Of tabulated points (rad/s), those that a log reaches."""
SLOW = 6.0  # fastest speed (rad/s) of a rig whose points and decay are nearer to rest
LEAST = 1e-9  # torque (N m) that is none
NONE = np.zeros(2)


@dataclass(frozen=True, eq=False)
class Curve:
    """Torque over speed as the inclusion takes it."""

    kind: int
    static: float  # (N m)
    numbers: Array
    knots: Array  # speeds of the numbers (rad/s), if they are points

    def torque(self, speed: Array) -> Array:
        """Torque (N m) of a turning bit."""
        speed = np.asarray(speed, float)
        if self.kind == EXPONENTIAL:
            low, high, decay = self.numbers
            return np.asarray(low + (high - low) * np.exp(-decay * speed))
        return np.asarray(np.interp(speed, self.knots, self.numbers))


@dataclass(frozen=True)
class Family:
    """A law with free numbers; `x` holds them in N m and logarithms."""

    name: str  # of the law in a design
    knots: tuple[float, ...] = ()  # of tabulated points
    decay: float = USUAL_DECAY  # (s/rad)

    @property
    def names(self) -> tuple[str, ...]:
        """What the coefficients are called."""
        if self.name == "navarro-lopez-suarez":
            return ("a1", "a2", "beta")
        if self.name == "jansen-van-den-steen":
            return ("a1", "a2")
        return ("static", *(f"a at {w:g} rad/s" for w in self.knots))

    @property
    def least(self) -> Array:
        """Least value of each number."""
        if self.name == "navarro-lopez-suarez":
            return np.array([0.0, 0.0, np.log(LEAST_DECAY)])
        return np.zeros(2 if self.name == "jansen-van-den-steen" else len(self.knots) + 1)

    @property
    def most(self) -> Array:
        """Largest value of each number."""
        result = np.full(len(self.least), np.inf)
        if self.name == "navarro-lopez-suarez":
            result[2] = np.log(MOST_DECAY)
        return result

    def start(self, static: float, sliding: float, decay: float) -> Array:
        """Numbers to begin with: torques at rest and at high speed (N m)."""
        drop = max(static - sliding, 0.02 * static)
        if self.name == "navarro-lopez-suarez":
            return np.array([sliding, drop, np.log(decay)])
        if self.name == "jansen-van-den-steen":
            return np.array([sliding, drop])
        torque = sliding + drop * np.exp(-decay * np.array(self.knots))
        return np.array([0.01 * drop, *(torque[:-1] - torque[1:]), torque[-1]])

    def usual(self, x: Array) -> tuple[Array, Array]:
        """What numbers are where a log does not say, and how far from it they may be."""
        size = max(float(np.sum(np.abs(x[:2]))), LEAST)
        if self.name == "navarro-lopez-suarez":
            # Torque at rest 1.2 to 3 times that at high speed, lost over 3 to 30 rad/s.
            return np.array([0.0, 0.5 * size, np.log(self.decay)]), np.array([1e9, size, 1.0])
        if self.name == "jansen-van-den-steen":
            return np.array([0.0, 0.3 * size]), np.array([1e9, size])
        size = max(float(np.sum(np.abs(x))), LEAST)
        spread = np.full(len(x), 0.3 * size)
        spread[-1] = 1e9
        return np.zeros(len(x)), spread

    def scale(self, x: Array) -> Array:
        """Size of each number, for differences."""
        size = max(float(np.sum(np.abs(x[:2]))), LEAST)
        if self.name == "navarro-lopez-suarez":
            return np.array([size, size, 1.0])
        return np.full(len(x), max(float(np.sum(np.abs(x))), LEAST))

    def curve(self, x: Array) -> Curve:
        """The law with these numbers: sliding torque, drop and log decay; or drops and the last."""
        if self.name == "navarro-lopez-suarez":
            numbers = np.array([x[0], x[0] + x[1], np.exp(x[2])])
            return Curve(EXPONENTIAL, float(x[0] + x[1]), numbers, NONE)
        if self.name == "jansen-van-den-steen":
            return Curve(POINTS, float(x[0] + x[1]), np.array([x[0], x[0]]), np.array([0.0, 1.0]))
        torque = np.cumsum(x[:0:-1])[::-1]
        return Curve(POINTS, float(torque[0] + x[0]), torque, np.array(self.knots))

    def coefficients(self, x: Array, weight: float) -> Array:
        """Coefficients of a design at a weight (N): torques over it (m), and the decay (s/rad)."""
        curve = self.curve(x)
        if self.name == "navarro-lopez-suarez":
            return np.array([*curve.numbers[:2] / weight, curve.numbers[2]])
        if self.name == "jansen-van-den-steen":
            return np.array([curve.numbers[0], curve.static]) / weight
        return np.array([curve.static, *curve.numbers]) / weight


EXPONENTIAL_LAW = Family("navarro-lopez-suarez")


def exponential_law(speed: float) -> Family:
    """Of a mean top speed (rad/s): the slower, the sooner the torque falls."""
    return replace(EXPONENTIAL_LAW, decay=USUAL_DECAY * max(1.0, SLOW / max(speed, 1e-3)))


PEAK_LAW = Family("jansen-van-den-steen")


def points_law(fastest: float) -> Family:
    """Tabulated points up to the fastest speed (rad/s) of a log."""
    scale = 1.0 if fastest > SLOW else fastest / 20.0
    inside = [w * scale for w in SPEEDS if w * scale < 0.9 * fastest]
    return Family("tabulated", (*inside, float(f"{max(fastest, inside[-1] + scale):.3g}")))
