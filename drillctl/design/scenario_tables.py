"""Tables of what changes by the clock: each tells what was before the design's own values."""

from __future__ import annotations

from pydantic import model_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table


def _refuse_backwards(begin: float, end: float) -> None:
    if end < begin:
        raise InputError(f"end {end:g} s must not come before begin {begin:g} s")


class SpeedProgramTable(Table):
    """Set speed: `start` up to `begin`, the operating speed from `end` on, straight between."""

    start: q.Speed | None = None
    begin: q.TimeOrZero = 0.0
    end: q.TimeOrZero = 0.0

    @model_validator(mode="after")
    def _in_order(self) -> SpeedProgramTable:
        _refuse_backwards(self.begin, self.end)
        return self


class WeightProgramTable(Table):
    """Nominal weight: `start` up to `begin`, that of the operating point from `end` on."""

    start: q.Weight | None = None
    begin: q.TimeOrZero = 0.0
    end: q.TimeOrZero = 0.0

    @model_validator(mode="after")
    def _in_order(self) -> WeightProgramTable:
        _refuse_backwards(self.begin, self.end)
        return self


class RockProgramTable(Table):
    """Rock: torques and decay times these factors before the time `until`."""

    until: q.TimeOrZero = 0.0
    static_factor: q.PositiveNumber = 1.0
    sliding_factor: q.PositiveNumber = 1.0
    decay_factor: q.PositiveNumber = 1.0


class ScenarioTable(Table):
    """What was before: the design's own values are those that a run ends with."""

    speed: SpeedProgramTable = SpeedProgramTable()
    weight_on_bit: WeightProgramTable = WeightProgramTable()
    bit_rock: RockProgramTable = RockProgramTable()
