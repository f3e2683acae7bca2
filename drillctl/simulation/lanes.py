"""What a lane of the batch engine is: the numbers of one rig on a shared string."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.bit_rock import contact
from drillctl.design import Design
from drillctl.drillstring import Drillstring
from drillctl.simulation.start import Kind

Array = NDArray[np.float64]

SPEEDS = 161
"""Speeds at which a slope is looked for, from rest to eight times the set speed."""


@dataclass(frozen=True, eq=False)
class Lanes:
    """Any number of rigs that share a string, the types of their laws and the kind of start.

    Attributes
    ----------
    string : Drillstring
        Shared by all lanes.
    friction, drive, weight : NamedTuple
        Laws with an array, shape (lanes,), for each of their numbers.
    set_speed : ndarray, shape (lanes,)
        Final set speed (rad/s).
    turning_speed : ndarray, shape (lanes,)
        Speed of all nodes at time zero of a start that turns (rad/s).
    nominal_weight : ndarray, shape (lanes,)
        Nominal weight on bit (N).
    table_low, table_high : ndarray, shape (lanes,)
        Range of the friction table (N).
    start : {'rest', 'turning', 'wound_up'}
        Kind of start.
    """

    string: Drillstring
    friction: Any
    drive: Any
    weight: Any
    set_speed: Array
    turning_speed: Array
    nominal_weight: Array
    table_low: Array
    table_high: Array
    start: Kind

    def __len__(self) -> int:
        return len(self.set_speed)

    def __getitem__(self, chosen: slice | NDArray[np.int64]) -> Lanes:
        """Some of the lanes."""

        def some(law: Any) -> Any:
            return type(law)(*(numbers[chosen] for numbers in law))

        return Lanes(
            string=self.string,
            friction=some(self.friction),
            drive=some(self.drive),
            weight=some(self.weight),
            set_speed=self.set_speed[chosen],
            turning_speed=self.turning_speed[chosen],
            nominal_weight=self.nominal_weight[chosen],
            table_low=self.table_low[chosen],
            table_high=self.table_high[chosen],
            start=self.start,
        )

    @cached_property
    def steepest_fall(self) -> float:
        """Steepest falling slope of the rock in any lane (N m s/rad)."""
        if not self.weight.moves:
            return float(np.max(self.friction.steepest_fall(self.weight.weight(0.0))))
        # The weight moves with the speed: looked for, up to far beyond any stick-slip.
        speeds = self.set_speed * np.linspace(0.0, 8.0, SPEEDS)[:, None]
        _, slope = contact(self.friction, self.weight, speeds, np.exp)
        return float(max(0.0, np.max(-slope)))


def lane_numbers(design: Design) -> dict[str, float]:
    """Every number of a design that may differ from lane to lane, by name."""
    laws = {"friction": design.bit_rock, "drive": design.top_drive, "weight": design.weight_on_bit}
    numbers = {
        f"{part}.{field}": float(value)
        for part, law in laws.items()
        for field, value in law._asdict().items()  # type: ignore[attr-defined]
    }
    turning = design.tables.start.speed
    numbers["set_speed"] = design.speed
    numbers["turning_speed"] = design.speed if turning is None else turning
    numbers["nominal_weight"] = design.tables.operating_point.weight_on_bit
    numbers["table_low"], numbers["table_high"] = design.table_range
    return numbers


def lanes_of(design: Design, numbers: dict[str, Array]) -> Lanes:
    """Lanes on the string of `design`, with the types of its laws.

    Parameters
    ----------
    design : Design
        Gives string, laws' types and start.
    numbers : dict of ndarray, shape (lanes,)
        By the names of `lane_numbers`.
    """

    def law(part: str, like: Any) -> Any:
        return type(like)(*(np.ascontiguousarray(numbers[f"{part}.{f}"]) for f in like._fields))

    return Lanes(
        string=design.string,
        friction=law("friction", design.bit_rock),
        drive=law("drive", design.top_drive),
        weight=law("weight", design.weight_on_bit),
        set_speed=numbers["set_speed"],
        turning_speed=numbers["turning_speed"],
        nominal_weight=numbers["nominal_weight"],
        table_low=numbers["table_low"],
        table_high=numbers["table_high"],
        start=design.tables.start.kind,
    )


def single_lane(design: Design) -> Lanes:
    """One lane: the design as it stands."""
    return lanes_of(design, {k: np.array([v]) for k, v in lane_numbers(design).items()})
