"""What changes by the clock in a run: set speed, weight on bit, rock.

A design describes the rig as it ends; a program says what was before. The set speed and the
nominal weight come to their values along straight lines and in steps, the set speed behind a lag if
the drive has one; the rock is another one until a moment.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np


class Ramp(NamedTuple):
    """A value that moves along a straight line to zero and stays there.

    Attributes
    ----------
    first : float
        Value up to `begin`.
    begin, end : float
        Times (s); a step where they are equal.
    """

    first: Any
    begin: Any
    end: Any

    def at(self, time: float) -> float:
        """Value at a time (s); of a step, the one after it."""
        if time >= self.end:
            return 0.0
        if time <= self.begin:
            return float(self.first)
        return float(self.first * (self.end - time) / (self.end - self.begin))

    def integral(self, time: float) -> float:
        """Integral from zero to a time (s)."""
        flat = min(time, self.begin)
        total = self.first * flat
        if time > self.begin and self.end > self.begin:
            passed = min(time, self.end) - self.begin
            total += self.first * passed * (1.0 - 0.5 * passed / (self.end - self.begin))
        return float(total)

    def late_at(self, lag: float, time: float) -> float:
        """Value at a time (s) behind a lag of first order (s) that rests at `first` to begin with.

        The answer to a ramp in closed form; that to a step where `end` is `begin`.
        """
        if time <= self.begin:
            return float(self.first)
        if time < self.end:
            passed = 1.0 - math.exp((self.begin - time) / lag)
            ahead = self.end - time + lag * passed
            return float(self.first * ahead / (self.end - self.begin))
        reached = float(self.first)
        if self.end > self.begin:
            passed = 1.0 - math.exp((self.begin - self.end) / lag)
            reached = float(self.first * lag / (self.end - self.begin) * passed)
        return reached * math.exp((self.end - time) / lag)

    def late_integral(self, lag: float, time: float) -> float:
        """Integral of that from zero: lag y' = u - y, integrated."""
        return self.integral(time) - lag * (self.late_at(lag, time) - float(self.first))

    @property
    def ramps(self) -> tuple[Ramp, ...]:
        """Itself: a path of one."""
        return (self,)


MOST_RAMPS = 8  # of a path: two connections, each down and up, and as many changes again
OF_A_PATH = (*(f"{name}_{k}" for k in range(MOST_RAMPS) for name in Ramp._fields), "lag")
_Numbers: Any = namedtuple("_Numbers", OF_A_PATH)  # type: ignore[misc]


class Path(_Numbers):
    """A value that goes through several ramps, zero in the end: their sum.

    A straight piece from one value to the next is a ramp from what it changes by to zero. The
    numbers are those of the ramps, one after the other, none that does not move before one that
    does; then `lag`, the time constant (s) of a lag behind them, or 0.
    """

    __slots__ = ()
    lag: Any

    @classmethod
    def of(cls, ramps: Sequence[Ramp], lag: float = 0.0) -> Path:
        """The path of at most `MOST_RAMPS` ramps that move."""
        moving = [ramp for ramp in ramps if ramp.first != 0.0]
        filled = [*moving, *[STILL] * (MOST_RAMPS - len(moving))]
        numbers: Any = (*(number for ramp in filled for number in ramp), lag)
        return cls._make(numbers)

    @property
    def ramps(self) -> tuple[Ramp, ...]:
        """What it is the sum of; some may stand still."""
        return tuple(Ramp(*self[k : k + 3]) for k in range(0, 3 * MOST_RAMPS, 3))

    def at(self, time: float) -> float:
        """Value at a time (s); of a step without a lag, the one after it."""
        if self.lag == 0.0:
            return sum(ramp.at(time) for ramp in self.ramps)
        return sum(ramp.late_at(self.lag, time) for ramp in self.ramps)

    def integral(self, time: float) -> float:
        """Integral from zero to a time (s)."""
        if self.lag == 0.0:
            return sum(ramp.integral(time) for ramp in self.ramps)
        return sum(ramp.late_integral(self.lag, time) for ramp in self.ramps)


STILL = Ramp(0.0, 0.0, 0.0)  # A value that does not move


class Program(NamedTuple):
    """What was before.

    Attributes
    ----------
    speed : Ramp or Path
        Set speed less its final value (rad/s).
    weight : Ramp or Path
        Nominal weight over its final value, less one; a path if the speed is one.
    rock_until : float
        Time (s) until which the rock is another one; 0 for never.
    """

    speed: Ramp | Path
    weight: Ramp | Path
    rock_until: Any

    @property
    def moves(self) -> bool:
        """Whether anything changes at all, in any lane where the numbers are arrays."""
        ramps = (*self.speed.ramps, *self.weight.ramps)
        return any(np.any(x != 0.0) for x in (self.rock_until, *(ramp.first for ramp in ramps)))

    def breaks(self) -> list[float]:
        """Times (s) at which something begins, ends or jumps."""
        times = {self.rock_until}
        for ramp in (*self.speed.ramps, *self.weight.ramps):
            if ramp.first != 0.0:
                times |= {ramp.begin, ramp.end}
        return sorted(float(t) for t in times if 0.0 < t < math.inf)

    @property
    def settled(self) -> float:
        """Time (s) from which on nothing changes, the lag down to rounding."""
        return max(self.breaks(), default=0.0) + SETTLED * float(getattr(self.speed, "lag", 0.0))


SETTLED = 37.0  # time constants after which a lag has fallen to rounding

NONE = Program(STILL, STILL, 0.0)  # nothing changes by the clock
