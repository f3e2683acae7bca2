"""Where a setting drills without sticking: the lowest speed and the highest weight."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.arrays import Array, Mask
from drillctl.design import Design
from drillctl.ensemble.grid import Axis
from drillctl.ensemble.sweeps import sweep
from drillctl.errors import InputError
from drillctl.simulation.lanes import lane_numbers
from drillctl.simulation.measures import STATUSES
from drillctl.store.codec import label
from drillctl.store.json_files import picked

SPEED, WEIGHT = "operating_point.speed", "operating_point.weight_on_bit"
AS_FAR = 2.0  # how far speed and weight are followed, over those of the design
FREE = tuple(STATUSES.index(name) for name in ("ok", "not_settled"))
"""Ends of a run without sticking in its last 20 s."""


@dataclass(frozen=True, eq=False)
class Line:
    """Runs along one axis, at nominal rock."""

    path: str = label(means="of the parameter")
    unit: str = label(means="of its values")
    own: float = label(means="value of the design (SI)")
    values: Array = label("{path}", unit="{unit}", name="{path}", means="values, increasing")
    j1: Array = label("{path}", unit="s", name="j1 {path}", means="J1 at each")
    status: NDArray[np.int8] = label(
        "{path}", name="status {path}", flags=STATUSES, means="how each run ended"
    )

    @property
    def free(self) -> Mask:
        """Values without sticking in the last 20 s."""
        return np.isin(self.status, FREE)

    @property
    def at(self) -> int:
        """Place of the design's own value."""
        return int(np.argmin(np.abs(self.values - self.own)))

    def ends(self) -> tuple[float | None, float | None]:
        """Ends of what is free around the design's own value; None where that is not free."""
        free, at = self.free, self.at
        if not free[at]:
            return None, None
        stuck = np.flatnonzero(~free)
        low = stuck[stuck < at].max(initial=-1) + 1
        high = stuck[stuck > at].min(initial=len(free)) - 1
        return float(self.values[low]), float(self.values[high])

    def nearest(self, step: int, good: Mask | None = None) -> float | None:
        """First value from the design's own in a direction behind which all are good, or None."""
        good = self.free if good is None else good
        beyond = good[self.at :] if step > 0 else good[self.at :: -1]
        bad = np.flatnonzero(~beyond)
        first = 0 if not len(bad) else int(bad[-1]) + 1
        if first == len(beyond):
            return None
        return float(self.values[self.at + step * first])

    def islands(self) -> bool:
        """Whether what is free has a gap: sticking is then no matter of one limit."""
        changes = np.count_nonzero(np.diff(self.free.astype(int)))
        return bool(changes > 1)


@dataclass(frozen=True, eq=False)
class Window:
    """Lowest speed at the design's weight, and highest weight at its speed."""

    speed: Line = label(flat=True)
    weight: Line = label(flat=True)

    @property
    def lowest_speed(self) -> float | None:
        """Lowest speed (rad/s) down to which the bit does not stick; above the own if that does."""
        low, _ = self.speed.ends()
        return self.speed.nearest(1) if low is None else low

    @property
    def highest_weight(self) -> float | None:
        """Highest weight (N) up to which the bit does not stick; under the own if that does."""
        _, high = self.weight.ends()
        return self.weight.nearest(-1) if high is None else high

    @property
    def weight_open(self) -> bool:
        """Whether nothing sticks up to the largest weight that was run."""
        return self.highest_weight == float(self.weight.values[-1])

    @property
    def speed_open(self) -> bool:
        """Whether nothing sticks down to the least speed that was run."""
        return self.lowest_speed == float(self.speed.values[0])

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        return {
            "lowest_speed": self.lowest_speed,
            "highest_weight_on_bit": self.highest_weight,
            **picked(self, "speed_open", "weight_open"),
            "speed_islands": self.speed.islands(),
            "weight_islands": self.weight.islands(),
        }


def window(design: Design) -> Window:
    """Run a design at every speed and at every weight of two grids.

    Whole grids and no bracketing: lanes are cheap, and what sticks need not do so monotonically. An
    interval is reported only as far as nothing sticks in between.
    """
    asked, point = design.tables.recommend, design.tables.operating_point
    speed = _line(design, SPEED, "rad/s", point.speed, asked.speed_step)
    return Window(speed, _line(design, WEIGHT, "N", point.weight_on_bit, asked.weight_step))


def _line(design: Design, path: str, unit: str, own: float, step: float) -> Line:
    steps = np.arange(1.0, max(2, math.ceil(AS_FAR * own / step)) + 1.0) * step
    if path == WEIGHT:
        low, high = design.table_range
        steps = steps[(steps >= low) & (steps <= high)]
    values = np.unique(np.round(np.append(steps, own), 12))
    values = values[np.append(np.diff(values) > 1e-6 * step, True)]
    values = values[: _possible(design, path, values)]
    result = sweep(design, (Axis(path, unit, values),), audit_cells=0, measures=("j1",))
    return Line(path, unit, own, values, result.j1, result.status)


def _possible(design: Design, path: str, values: Array) -> int:
    """How many of rising values a design may have: a drive ends at a speed, and at a torque."""

    def refused(value: float) -> bool:
        try:
            lane_numbers(design.replace({path: units.SI(value)}))
        except InputError:
            return True
        return False

    return bisect.bisect_left(range(len(values)), True, key=lambda k: refused(float(values[k])))
