"""Keys of `[schedule]`: depths, law, and when gains of an earlier depth will no longer do."""

from __future__ import annotations

from typing import Literal

from pydantic import field_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.table import Table

KEY = "schedule"
DEPTH = "depth"


class Settings(Table):
    """Gains over the depth, or over anything else that changes the string.

    `values`: "500 m:5000 m:10", first, last and how many; by default ten depths from the string
    with half its topmost section to the whole of it. `along`: what they are values of: `depth`,
    the length of the whole string, to which pipe is added at the top, or a dotted path. `law`:
    `tuned` searches the PI of the least objective of `[tune]` at each depth, and from the gains of
    the one before; others follow from the string by their rule.

    Gains of an earlier depth are compared: those of `kept_from` times each depth, a quarter deeper.
    They must be changed where a drive that keeps them reflects `reflection` more of a wave at the
    stick-slip frequency than one in tune (0.1: of what a soft torque takes, 64 %, it then takes
    51 %), or where it keeps the level of J1 with less than the required probability though one in
    tune keeps it. Where the quarter costs less than `material` in reflection, almost no schedule is
    needed. `realizations` at each depth; `stand`: length of a stand of pipe, a row of the table for
    the drive.
    """

    values: str | None = None
    along: str = DEPTH
    law: Literal["tuned", "soft-torque", "stiff-speed", "z-torque", "active-damping"] = "tuned"
    kept_from: q.PartialShare = 0.8
    reflection: q.Share = 0.1
    material: q.Share = 0.05
    realizations: q.Count = 400
    stand: q.Length = 28.35

    @field_validator("values")
    @classmethod
    def _spelt(cls, text: str | None) -> str | None:
        if text is not None:
            first, last, count = _three(text)
            if not count.isdigit() or int(count) < 2:
                raise InputError(f"needs 2 values or more, got {count!r} in {text!r}")
            if first == last:
                raise InputError(f"begins where it ends: {text!r}")
        return text

    @property
    def ends(self) -> tuple[str, str, int]:
        """First, last and how many of `values`."""
        first, last, count = _three(self.values or "")
        return first, last, int(count)


def _three(text: str) -> tuple[str, str, str]:
    parts = tuple(part.strip() for part in text.split(":"))
    if len(parts) != 3 or not all(parts):
        raise InputError(f'must be first:last:points, as in "500 m:5000 m:10", got {text!r}')
    return parts[0], parts[1], parts[2]
