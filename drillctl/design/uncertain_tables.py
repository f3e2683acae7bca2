"""Tables of uncertain parameters and of the draws from them.

Samples of an uncertain parameter from a file, taken into the design when it is loaded.

A design then holds all that its numbers follow from: it can be sent, saved and run again
without the file.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import field_validator, model_validator

from drillctl import catalog
from drillctl.errors import InputError, nearest, shown
from drillctl.rig import table as q
from drillctl.rig.table import Table, number_or_quantity

_KEYS = {
    "lognormal": ("mean", "cov"),
    "normal": ("mean", "cov", "min", "max"),
    "uniform": ("mean", "cov", "min", "max"),
    "beta": ("mean", "cov", "min", "max"),
    "triangular": ("mean", "cov", "min", "max", "mode"),
    "samples": ("samples", "file", "column", "unit", "joint"),
}
"""Keys that go with each distribution."""
_NEEDED: dict[str, tuple[tuple[str, ...], ...]] = {
    "lognormal": (("cov",),),
    "normal": (("cov",),),
    "uniform": (("min", "max"), ("cov",)),
    "beta": (("cov", "min", "max"),),
    "triangular": (("min", "max"), ("cov",)),
    "samples": (("samples",),),
}
"""Those of them that have no default: one of these ways."""
FEWEST_REPLICATES = 8
"""Of randomised quasi-Monte Carlo: fewer make intervals from their scatter mean little."""


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


class DistributionTable(Table):
    """How an uncertain parameter is distributed; its values as they are written at its path.

    `lognormal` and `normal`: `cov`, the standard deviation over the mean, and `mean`, by default
    the design's own value. A normal distribution is truncated at `min` and `max`, by default at
    what its key allows (a weight is not negative); mean and deviation are those before.
    `uniform` and `triangular`: `min` and `max`, with `mode` of the latter, by default halfway; or
    `cov` and `mean`, symmetric about it. `beta`: `cov` and `mean` between `min` and `max`.
    `samples`: values as they were measured, each as likely; a list, or a `file` of text with one
    a line, or with columns and their names in the first line (`column`), in a `unit`. Samples of
    several parameters that are `joint` are drawn together, row by row: so correlations are kept.
    """

    distribution: Literal["lognormal", "normal", "uniform", "beta", "triangular", "samples"]
    mean: float | str | None = None
    cov: q.PositiveNumber | None = None
    min: float | str | None = None
    max: float | str | None = None
    mode: float | str | None = None
    samples: tuple[float | str, ...] | None = None
    file: str | None = None
    column: str | None = None
    unit: str | None = None
    joint: bool | None = None

    @field_validator("mean", "min", "max", "mode", mode="before")
    @classmethod
    def _number_or_quantity(cls, value: object) -> object:
        return None if value is None else number_or_quantity(value)

    @field_validator("samples", mode="before")
    @classmethod
    def _numbers_or_quantities(cls, values: object) -> object:
        if not isinstance(values, (list, tuple)):
            return values
        if not values:
            raise InputError("holds nothing to draw from")
        return tuple(number_or_quantity(value) for value in values)

    @model_validator(mode="after")
    def _its_own_keys(self) -> DistributionTable:
        keys = _KEYS[self.distribution]
        given = [
            key for key in type(self).model_fields
            if key != "distribution" and getattr(self, key) is not None
        ]  # fmt: skip
        for key in given:
            if key not in keys:
                raise InputError(
                    f"{key} is not allowed with {self.distribution}; allowed are {_list(keys)}"
                )
        if self.file is not None:
            raise InputError("file is read when a design is loaded; give samples here")
        ways = _NEEDED[self.distribution]
        if not any(all(key in given for key in way) for way in ways):
            nearest_way = min(ways, key=lambda way: sum(key not in given for key in way))
            missing = next(key for key in nearest_way if key not in given)
            raise InputError(f"{missing} is missing, {self.distribution} takes {_list(keys)}")
        if self.distribution in ("uniform", "triangular") and self.cov is not None:
            for key in ("min", "max", "mode"):
                if key in given:
                    raise InputError(f"{key} is not allowed with cov: give limits, or mean and cov")
        if self.distribution in ("uniform", "triangular") and self.cov is None and "mean" in given:
            raise InputError("mean is not allowed with min and max: give limits, or mean and cov")
        return self


def _list(keys: tuple[str, ...]) -> str:
    return f"{', '.join(keys[:-1])} and {keys[-1]}"


class CorrelationTable(Table):
    """Correlation of two uncertain parameters, of the normal scores of a Gaussian copula."""

    between: tuple[str, str]
    value: q.Number

    @model_validator(mode="after")
    def _two_of_them(self) -> CorrelationTable:
        first, second = self.between
        if first == second:
            raise InputError(f"{first!r} twice: a correlation is between two parameters")
        if not -1.0 < self.value < 1.0:
            raise InputError(f"value {self.value:g} must lie between -1 and 1")
        return self


class UntilTable(Table):
    """When to stop before all realizations are run.

    As soon as the share of the map where J1 <= `level` with at least `probability` is known to
    within `half_width`, of the whole map, on either side. Looked for at `first_look` realizations
    and at every doubling; the intervals are corrected for the number of looks.
    """

    level: q.PositiveNumber | None = None
    probability: q.Share = 0.95
    half_width: q.PositiveNumber = 0.01
    first_look: q.Count = 256


class SensitivityTable(Table):
    """Sobol indices of J1 at cells of the map, and of the areas of the regions.

    `samples` points of Saltelli's design, each of two realizations more than there are
    parameters; the cells nearest to `cells`, by default the design's own values.
    """

    samples: q.Count = 256
    cells: tuple[dict[str, float | str], ...] = ()

    @field_validator("samples")
    @classmethod
    def _power_of_two(cls, samples: int) -> int:
        if samples & (samples - 1):
            raise InputError(f"{samples} is not a power of two, as Sobol points need")
        return samples


class UncertaintyTable(Table):
    """How many draws of the uncertain parameters, and which.

    `monte-carlo`: a draw is a function of seed and number alone, so that more realizations begin
    with the same ones. So is one of `sobol`, scrambled in `replicates` independent ways that take
    turns. `latin-hypercube` draws are of a fixed number. `correlations`: of any two parameters,
    by a Gaussian copula; those left out are independent. `full`: lanes run to their end, else
    they may stop when J1 has passed the highest level. `keep`: measures kept of every lane
    beside J1. `contours`: outlines of every realization as a table. `axes`: more parameters that
    the map runs over under uncertainty, those of `[map]` first.
    """

    realizations: q.Count = 200
    seed: q.CountOrZero = 2012
    sampling: Literal["monte-carlo", "sobol", "latin-hypercube"] = "monte-carlo"
    replicates: q.Count = FEWEST_REPLICATES
    correlations: tuple[CorrelationTable, ...] = ()
    full: bool = False
    keep: tuple[str, ...] = ()
    contours: bool = False
    axes: tuple[AxisTable, ...] = ()
    until: UntilTable | None = None
    sensitivity: SensitivityTable | None = None

    @field_validator("replicates")
    @classmethod
    def _enough(cls, replicates: int) -> int:
        if replicates < FEWEST_REPLICATES:
            raise InputError(f"{replicates} is not allowed: at least {FEWEST_REPLICATES}")
        return replicates

    @model_validator(mode="after")
    def _whole_replicates(self) -> UncertaintyTable:
        if self.sampling != "monte-carlo" and self.realizations % self.replicates:
            more = -(-self.realizations // self.replicates) * self.replicates
            raise InputError(
                f"realizations {self.realizations} must be a multiple of the {self.replicates} "
                f"replicates of {self.sampling}, for instance {more}"
            )
        if self.until is not None and self.sampling == "latin-hypercube":
            raise InputError("until is not allowed with latin-hypercube, whose number is fixed")
        first = 0 if self.until is None else self.until.first_look
        if self.sampling == "sobol" and first % self.replicates:
            raise InputError(
                f"until.first_look {first} must be a multiple of the {self.replicates} replicates"
            )
        return self


def flattened(tree: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Distributions by dotted path, whether the paths were quoted in the file or not."""
    result: dict[str, Any] = {}
    for key, value in tree.items():
        path = f"{prefix}{key.strip(chr(34))}"
        inside = isinstance(value, Mapping) and value
        if inside and all(isinstance(v, Mapping) for v in value.values()):
            deeper = flattened(value, f"{path}.")
        else:
            deeper = {path: value}
        for leaf, table in deeper.items():
            both = isinstance(table, Mapping) and isinstance(result.get(leaf), Mapping)
            result[leaf] = {**result[leaf], **table} if both else table
    return result


_FILE_KEYS = ("file", "column", "unit")


def with_samples(tree: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A design's tree with every `uncertain.*.file` replaced by the samples it holds."""
    uncertain = tree.get("uncertain")
    if not isinstance(uncertain, Mapping):
        return tree
    tables = flattened(uncertain)
    if not any(isinstance(table, Mapping) and "file" in table for table in tables.values()):
        return tree
    return {**tree, "uncertain": {path: _inlined(path, t, folder) for path, t in tables.items()}}


def _inlined(path: str, table: Any, folder: Path) -> Any:
    if not isinstance(table, Mapping) or "file" not in table:
        return table
    where = f"uncertain.{path}.file"
    for key in _FILE_KEYS:
        if key in table and not isinstance(table[key], str):
            raise InputError(f"got {shown(table[key])}; it must be text in quotes", where)
    if "samples" in table:
        raise InputError("is not allowed with samples: the file holds them", where)
    numbers = _numbers(folder / table["file"], table.get("column"), where)
    unit = table.get("unit")
    samples = [f"{value!r} {unit}" for value in numbers] if unit else numbers
    return {key: value for key, value in table.items() if key not in _FILE_KEYS} | {
        "samples": samples
    }


def _numbers(path: Path, column: str | None, where: str) -> list[float]:
    text = catalog.read(path, f"{where}: {path}")
    try:
        rows = [row for row in csv.reader(io.StringIO(text)) if row and not row[0].startswith("#")]
    except csv.Error as error:
        raise InputError(f"{path}: {error}", where) from None
    index = 0
    if rows and not _is_number(rows[0][0]):
        heads = [head.strip() for head in rows[0]]
        if column is None and len(heads) > 1:
            raise InputError(
                f"{path} has {len(heads)} columns; column must be one of {', '.join(heads)}", where
            )
        if column is not None and column not in heads:
            raise InputError(f"{path} has no column {column!r}; {nearest(column, heads)}", where)
        index = 0 if column is None else heads.index(column)
        rows = rows[1:]
    elif column is not None:
        raise InputError(f"{path} has no line of column names to find {column!r} in", where)
    result = []
    for number, row in enumerate(rows, start=1):
        text = row[index].strip() if index < len(row) else ""
        if not _is_number(text):
            named = f" of column {column!r}" if column else ""
            raise InputError(f"{path}: {shown(text)} in row {number}{named} is not a number", where)
        result.append(float(text))
    return result


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
