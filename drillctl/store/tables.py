"""Tables of results: one object for the terminal, CSV files and reports.

Cells hold SI numbers, text or None. Terminal and report use the units of the reader. A CSV file has
plain SI, or field units where the reader has; its heads name them. Ends of an interval are columns.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from drillctl import units
from drillctl.store.json_files import replaced, write_text

if TYPE_CHECKING:
    from drillctl.arrays import Array

NOTHING = "–"  # shown in place of a missing number
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Estimate(NamedTuple):
    """A number with the ends of its 95 % interval."""

    value: float | None  # None where nothing defines it or it is not finite
    interval: tuple[float, float] | None  # None where it is unknown; an open end is NaN
    draws: int | None = None  # draws, or pairs of draws, that it is the mean of

    @property
    def ends(self) -> tuple[float | None, float | None]:
        """Lower and upper end of the interval."""
        return self.interval or (None, None)

    @property
    def excludes_zero(self) -> bool:
        """Whether the interval lies on one side of zero."""
        return self.interval is not None and self.interval[0] * self.interval[1] > 0.0

    def summary(self, name: str = "value", prefix: str = "") -> dict[str, Any]:
        """As strict JSON values: the value by a name, and its interval."""
        interval = None if self.interval is None else list(self.interval)
        return {name: self.value, f"{prefix}interval_95": interval}


def open_estimate(value: float | None, ends: tuple[float | None, float | None]) -> Estimate:
    """An estimate whose interval may have open ends, which are None."""
    low, high = (math.nan if end is None else end for end in ends)
    return Estimate(value, None if ends == (None, None) else (low, high))


class Quantity(NamedTuple):
    """A number or an estimate (SI) in a column of several units."""

    value: float | Estimate | None
    unit: str


class Told(str):
    """Text with quantities in full (SI), which is told in the units of the reader."""

    __slots__ = ()


class Unit(str):
    """An SI unit in a column of units, which a file has as its quantities."""

    __slots__ = ()


def place(at: Mapping[str, float], unit_of: Mapping[str, str]) -> Told:
    """Values (SI) by path as text; `design` without any."""
    named = (f"{path} = {units.full(value, unit_of[path], 4)}" for path, value in at.items())
    return Told(", ".join(named) or "design")


Cell = Any  # text, a number (SI), an `Estimate`, a `Quantity`, or None


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    name: str  # head in a CSV file
    label: str = ""  # head for a reader; default: the name
    unit: str = ""  # SI
    digits: int = 4  # significant, for a reader
    percent: bool = False  # whether a share is shown in percent
    signed: bool = False  # whether a plus is shown, as for differences
    interval: bool = False  # whether cells are estimates
    hidden: bool = False  # whether it is in the CSV file only

    def head(self, system: units.System) -> str:
        """The head for a reader, with its unit."""
        unit = "%" if self.percent else units.unit_name(self.unit, system)
        text = self.label or self.name
        return f"{text} ({unit})" if unit else text

    def text(self, cell: Cell, system: units.System) -> str:
        """The text of a cell for a reader."""
        if isinstance(cell, Estimate):
            return self._estimate(cell, system)
        if isinstance(cell, Quantity):
            text = replace(self, unit=cell.unit).text(cell.value, system)
            unit = "" if text == NOTHING else units.unit_name(cell.unit, system)
            return f"{text} {unit}".rstrip()
        if isinstance(cell, str):
            return units.told(cell, system) if isinstance(cell, Told) else cell
        if isinstance(cell, bool):
            return "yes" if cell else "no"
        if isinstance(cell, int) and not self.percent and not self.unit:
            return str(cell)
        return self._number(cell, system)

    def _number(self, value: float | None, system: units.System) -> str:
        if value is None or math.isnan(value):
            return NOTHING
        shown = 100.0 * value if self.percent else units.displayed(value, self.unit, system)[0]
        text = number(shown, self.digits)
        return f"+{text}" if self.signed and shown > 0.0 else text

    def _estimate(self, cell: Estimate, system: units.System) -> str:
        text = self._number(cell.value, system)
        if cell.interval is None or cell.value is None:
            return text
        low, high = (self._number(end, system) for end in cell.interval)
        if NOTHING in (low, high):  # an open end
            return f"{text} ({f'at most {high}' if low == NOTHING else f'at least {low}'})"
        return f"{text} ({low} to {high})"

    def heads(self, system: units.System) -> list[str]:
        """Heads in a CSV file."""
        ends = ("", "_low", "_high") if self.interval else ("",)
        return [headed(f"{self.name}{end}", self.unit, system) for end in ends]

    def fields(self, cell: Cell, system: units.System) -> list[Any]:
        """Fields of a cell in a CSV file; empty without a finite number."""
        if isinstance(cell, Quantity):
            return replace(self, unit=cell.unit).fields(cell.value, system)
        if not self.interval:
            return [_field(cell, self.unit, system)]
        if not isinstance(cell, Estimate):
            return [_field(cell, self.unit, system), "", ""]
        ends = cell.interval or (None, None)
        return [_field(one, self.unit, system) for one in (cell.value, *ends)]


@dataclass(frozen=True)
class Table:
    """Rows of cells under columns."""

    name: str  # of its CSV file
    title: str  # what it shows
    columns: tuple[Column, ...]
    rows: Iterable[Sequence[Cell]]
    shown: bool = True  # on terminal and in reports; else in the CSV file only

    def said(self, system: units.System) -> str:
        """The title for a reader."""
        return units.told(self.title, system) if isinstance(self.title, Told) else self.title

    def heads(self, system: units.System) -> list[str]:
        """Heads for a reader."""
        return [column.head(system) for column in self.columns if not column.hidden]

    def texts(self, system: units.System) -> list[list[str]]:
        """Rows for a reader."""
        return [
            [
                column.text(cell, system)
                for column, cell in zip(self.columns, row, strict=True)
                if not column.hidden
            ]
            for row in self.rows
        ]


def headed(name: str, si_unit: str, system: units.System) -> str:
    """The head of a column in a CSV file: its name, and its unit if it has one."""
    unit = units.filed(1.0, si_unit, system)[1]
    return f"{name} ({unit})" if unit else name


def write_csv(table: Table, folder: Path, system: units.System = "si") -> None:
    """Write a table as `NAME.csv`, in plain SI or field units, atomically."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([head for column in table.columns for head in column.heads(system)])
    for row in table.rows:
        cells = zip(table.columns, row, strict=True)
        writer.writerow([field for column, cell in cells for field in column.fields(cell, system)])
    write_text(folder / f"{table.name}.csv", text.getvalue())


def texts(values: Array) -> list[str]:
    """Numbers in full, as Python writes them; what is undefined is an empty field.

    Most of the time of a large table goes into these texts: each different number has one.
    """
    import numpy as np  # commands that list the studies do without

    ordered = np.sort(values, axis=None)
    if np.count_nonzero(np.diff(ordered)) < 0.7 * ordered.size:  # NaN differ from each other
        different, at = np.unique(values, return_inverse=True)
        made = np.array([*map(repr, different.tolist())], dtype=object)
        made[np.isnan(different)] = ""
        result: list[str] = made[at.ravel()].tolist()
        return result
    return ["" if v != v else repr(v) for v in values.ravel().tolist()]


def in_columns(
    figures: Iterable[tuple[str, Array, str]], system: units.System
) -> dict[str, list[str]]:
    """Columns by their heads, for `write_columns`, of names, numbers and SI units."""
    return {
        headed(name, unit, system): texts(units.filed(values, unit, system)[0])
        for name, values, unit in figures
    }


def write_columns(path: Path, columns: Mapping[str, Sequence[str]]) -> None:
    """Write columns of texts without commas, quotes or line breaks: fast for many rows."""
    with replaced(path) as part, part.open("x", newline="", encoding="utf-8") as stream:
        csv.writer(stream, lineterminator="\n").writerow(columns)
        stream.writelines(f"{','.join(row)}\n" for row in zip(*columns.values(), strict=True))


def _field(value: Cell, si_unit: str, system: units.System) -> Any:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    if isinstance(value, float):
        return float(units.filed(value, si_unit, system)[0])
    if isinstance(value, Unit):
        return units.filed(1.0, value, system)[1] or str(value)
    if isinstance(value, Told):
        return units.filed_text(value, system)
    return value


def number(value: float | None, digits: int = 4) -> str:
    """Format a number with significant digits, without trailing zeros."""
    if value is None or math.isnan(value):
        return NOTHING
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    if value == 0.0:
        return "0"
    power = math.floor(math.log10(abs(value)))
    if not -4 <= power < 6:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        text = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        return f"{text} × 10{str(int(exponent)).translate(_RAISED)}".replace("-", "−")
    text = f"{value:.{max(0, digits - 1 - power)}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return text.replace("-", "−")


def percent(share: float | None, digits: int = 3) -> str:
    """Format a share in percent."""
    return NOTHING if share is None else f"{number(100.0 * share, digits)} %"


def between(low: float | None, high: float | None, digits: int = 4) -> str:
    """Format a range of values."""
    return f"{number(low, digits)} to {number(high, digits)}"


def chance(share: float, interval: Iterable[float | None]) -> str:
    """Format a probability with its 95 % interval, in percent."""
    low, high = interval
    if low is None or high is None:
        return percent(share)
    return f"{percent(share)} ({between(100.0 * low, 100.0 * high, 3)} %)"


def quantity(value: float | None, si_unit: str, system: units.System, digits: int = 4) -> str:
    """Format an SI value with its displayed unit."""
    if value is None or math.isnan(value):
        return NOTHING
    shown, unit = units.displayed(value, si_unit, system)
    return f"{number(shown, digits)} {unit}".rstrip()
