"""Keys of `[log]`: which columns of a log are what, and how it is cut into windows."""

from __future__ import annotations

from drillctl.rig import table as q
from drillctl.rig.table import Table

KEY = "log"


class LogColumnTable(Table):
    """A column of a log by its name, where it is not found by itself, and its unit."""

    column: str = ""
    unit: str = ""


class Settings(Table):
    """Columns of a log, and its windows.

    Columns are found by the usual names (`drillctl log` prints what was taken for what) with the
    unit in the name, in brackets or in a row of units; a unit that is not named is refused.
    `window`: length of the windows that are ranked, by default 300 s, less in a short log. `files`:
    logs that `identify` and a report take where none is named, relative to the design.
    """

    time: LogColumnTable = LogColumnTable()
    top_speed: LogColumnTable = LogColumnTable()
    top_torque: LogColumnTable = LogColumnTable()
    weight_on_bit: LogColumnTable = LogColumnTable()
    hook_load: LogColumnTable = LogColumnTable()
    bit_speed: LogColumnTable = LogColumnTable()
    window: q.Duration | None = None
    files: tuple[str, ...] = ()

    @property
    def given(self) -> dict[str, tuple[str, str]]:
        """Column and unit by quantity, where either is named."""
        held = {name: one for name, one in self if isinstance(one, LogColumnTable)}
        return {name: (x.column, x.unit) for name, x in held.items() if x.column or x.unit}
