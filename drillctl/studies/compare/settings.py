"""Keys of `[compare]`: cases made of a design by changing values of it."""

from __future__ import annotations

from typing import Any

from pydantic import Field, field_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table

KEY = "compare"


class CaseTable(Table):
    """A case: its name, and values by dotted path that replace those of the design."""

    name: q.Name
    values: dict[str, Any] = Field(default_factory=dict, alias="set")


class Settings(Table):
    """What is compared: the first case is the baseline; without cases, the design alone.

    `equal_mean_weight` shifts the nominal weight of a case whose weight on bit moves until its
    mean over the draws, after the start, is that of a constant weight. `maps` asks for the map of
    every case over the axes of `[map]`, at its own values.
    """

    cases: tuple[CaseTable, ...] = ()
    equal_mean_weight: bool = False
    maps: bool = True

    @field_validator("cases")
    @classmethod
    def _named_once(cls, cases: tuple[CaseTable, ...]) -> tuple[CaseTable, ...]:
        names = [case.name for case in cases]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"two cases are called {name!r}; names must differ")
        return cases
