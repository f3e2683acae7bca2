"""Samples of an uncertain parameter from a file, taken into the design when it is loaded.

A design then holds all that its numbers follow from: it can be sent, saved and run again
without the file.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drillctl.design.uncertain_tables import flattened
from drillctl.errors import InputError, nearest, shown

_KEYS = ("file", "column", "unit")


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
    for key in _KEYS:
        if key in table and not isinstance(table[key], str):
            raise InputError(f"got {shown(table[key])}; it must be text in quotes", where)
    if "samples" in table:
        raise InputError("goes without samples: the file holds them", where)
    numbers = _numbers(folder / table["file"], table.get("column"), where)
    unit = table.get("unit")
    samples = [f"{value!r} {unit}" for value in numbers] if unit else numbers
    return {key: value for key, value in table.items() if key not in _KEYS} | {"samples": samples}


def _numbers(path: Path, column: str | None, where: str) -> list[float]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            rows = [row for row in csv.reader(stream) if row and not row[0].startswith("#")]
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path} cannot be read: {reason}", where) from None
    index = 0
    if rows and not _is_number(rows[0][0]):
        heads = [head.strip() for head in rows[0]]
        if column is None and len(heads) > 1:
            raise InputError(f"{path} has {len(heads)} columns: which? {', '.join(heads)}", where)
        if column is not None and column not in heads:
            raise InputError(f"{path} has no column {column!r}; {nearest(column, heads)}", where)
        index = 0 if column is None else heads.index(column)
        rows = rows[1:]
    elif column is not None:
        raise InputError(f"{path} has no line of column names to find {column!r} in", where)
    found = []
    for number, row in enumerate(rows, start=1):
        text = row[index].strip() if index < len(row) else ""
        if not _is_number(text):
            raise InputError(f"{path}: {shown(text)} in row {number} is not a number", where)
        found.append(float(text))
    return found


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
