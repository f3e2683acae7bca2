"""How much delay a benefit survives: where a share falls, where a difference changes its sign.

Both are read off a grid of delays, beginning with the shortest. What a longer delay may bring
back, as one near the period of the motion does, is not a limit anyone would drill by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.intervals import Interval

Array = NDArray[np.float64]

ENOUGH = 0.95
"""Share of the draws in which stick-slip must have ended."""


@dataclass(frozen=True)
class EndedShare:
    """Share of the draws in which stick-slip has ended, at one delay."""

    delay: float  # total delay of the path (s)
    share: float  # of all draws, failed ones included
    interval_95: Interval  # Clopper-Pearson interval of the probability that the share estimates

    def summary(self) -> dict[str, Any]:
        """As strict JSON values."""
        return {"delay": self.delay, "share": self.share, "interval_95": list(self.interval_95)}


@dataclass(frozen=True)
class EndsUpTo:
    """Longest delay at which stick-slip ends, it and all shorter ones."""

    at: EndedShare | None  # the longest such delay of the grid; None if there is none
    next: EndedShare | None  # the delay of the grid after it; None after the last

    def summary(self) -> dict[str, Any]:
        """As strict JSON values; `delay` is null if there is no such delay."""
        return {
            "delay": None if self.at is None else self.at.delay,
            "at": None if self.at is None else self.at.summary(),
            "next": None if self.next is None else self.next.summary(),
        }


@dataclass(frozen=True)
class HarmfulFrom:
    """Delay from which a case is no longer better than the baseline."""

    # where the mean difference first stops being negative (s); None if it never does
    delay: float | None
    # where the upper and the lower end of the difference's interval do; None where never
    interval_95: tuple[float | None, float | None]

    def summary(self) -> dict[str, Any]:
        """As strict JSON values."""
        return {"delay": self.delay, "interval_95": list(self.interval_95)}


def ends_up_to(shares: Sequence[EndedShare], enough: float = ENOUGH) -> EndsUpTo:
    """Longest delay at which a share, there and at all shorter delays, is at least `enough`."""
    count = next((k for k, one in enumerate(shares) if one.share < enough), len(shares))
    return EndsUpTo(
        shares[count - 1] if count else None, shares[count] if count < len(shares) else None
    )


def harmful_from(delays: Array, difference: Array, low: Array, high: Array) -> HarmfulFrom:
    """Where a difference, and the ends of its interval, first stop being negative."""
    return HarmfulFrom(
        first_not_negative(delays, difference),
        (first_not_negative(delays, high), first_not_negative(delays, low)),
    )


def first_not_negative(delays: Array, values: Array) -> float | None:
    """First delay (s) at which values are not negative, straight lines between the points."""
    known = ~np.isnan(values)
    delays, values = delays[known], values[known]
    over = np.flatnonzero(values >= 0.0)
    if not over.size:
        return None
    k = int(over[0])
    if k == 0:
        return float(delays[0])
    rise = values[k] - values[k - 1]
    return float(delays[k - 1] - values[k - 1] * (delays[k] - delays[k - 1]) / rise)
