"""What changes by the clock in a run: set speed, weight on bit, rock.

A design describes the rig as it ends; a program says what was before. The set speed and the
nominal weight come up (or down) to their values along a straight line, or in a step; the rock is
another one until a moment.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple


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


STILL = Ramp(0.0, 0.0, 0.0)  # A value that does not move


class Program(NamedTuple):
    """What was before.

    Attributes
    ----------
    speed : Ramp
        Set speed less its final value (rad/s).
    weight : Ramp
        Nominal weight over its final value, less one.
    rock_until : float
        Time (s) until which the rock is another one; 0 for never.
    """

    speed: Ramp
    weight: Ramp
    rock_until: Any

    @property
    def moves(self) -> bool:
        """Whether anything changes at all."""
        return self != NONE

    def breaks(self) -> list[float]:
        """Times (s) at which something begins, ends or jumps."""
        times = {self.rock_until}
        for ramp in (self.speed, self.weight):
            if ramp.first != 0.0:
                times |= {ramp.begin, ramp.end}
        return sorted(float(t) for t in times if 0.0 < t < math.inf)


NONE = Program(STILL, STILL, 0.0)  # nothing changes by the clock
