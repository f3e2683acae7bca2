"""The table of one axis of a map."""

from __future__ import annotations

from pydantic import field_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table, number_or_quantity


class AxisTable(Table):
    """One axis of a map; `min` and `max` as they would be written at `path`."""

    path: str
    min: float | str
    max: float | str
    points: q.Count

    @field_validator("min", "max", mode="before")
    @classmethod
    def _number_or_quantity(cls, value: object) -> object:
        return number_or_quantity(value)

    @field_validator("points")
    @classmethod
    def _two_or_more(cls, value: int) -> int:
        if value < 2:
            raise InputError(f"an axis needs 2 points or more, got {value}")
        return value
