"""Stability regions under uncertainty as CSV, for spreadsheets."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drillctl.studies.uncertainty import Uncertainty
from drillctl.studies.uncertainty.labels import known
from drillctl.studies.uncertainty.probability import INNER, MEDIAN, OUTER


def write_uncertainty_tables(result: Uncertainty, folder: Path) -> None:
    """Write a study under uncertainty as tables; SI units, empty where a figure is not known.

    `cells.csv`, a row a cell; `areas.csv`, a row a level; `convergence.csv`, a row a level and
    number of realizations; `draws.csv`, a row a realization; `sensitivity.csv` and
    `contours.csv` where they were asked for.

    Parameters
    ----------
    result : Uncertainty
        What was computed.
    folder : Path
        Where to.
    """
    _write(folder / "cells.csv", *_cells(result))
    _write(folder / "areas.csv", *_areas(result))
    rows: list[list[Any]] = [
        [level, count, area.value, *area.interval]
        for level, areas in result.convergence.areas.items()
        for count, area in zip(result.convergence.counts, areas, strict=True)
    ]
    heads = ["level", "realizations", "area_p95", "area_p95_low", "area_p95_high"]
    _write(folder / "convergence.csv", heads, rows)
    _write(folder / "draws.csv", list(result.drawn), zip(*result.drawn.values(), strict=True))
    if result.sensitivity is not None:
        rows = [
            [one.of, path, one.first[k], one.first_error[k], one.total[k], one.total_error[k]]
            for one in result.sensitivity.indices
            for k, path in enumerate(result.sensitivity.parameters)
        ]
        heads = ["of", "parameter", "first", "first_error_95", "total", "total_error_95"]
        _write(folder / "sensitivity.csv", heads, rows)
    if result.design.tables.uncertainty.contours:
        paths = [a.path for a in result.axes]
        heads = ["level", "realization", "polygon", "ring", *paths]
        _write(folder / "contours.csv", heads, _contours(result))


def _cells(result: Uncertainty) -> tuple[list[str], Iterable[Sequence[Any]]]:
    maps = result.maps
    columns: dict[str, Any] = {}
    for level, one in maps.items():
        name = f"probability_{level:g}"
        columns[name] = one.probability
        columns[f"{name}_low"], columns[f"{name}_high"] = one.interval
    columns |= {f"j1_{name}": values for name, values in known(result).items()}
    columns["nominal_j1"] = result.nominal
    points = itertools.product(*(a.values for a in result.axes))
    flat = [values.ravel() for values in columns.values()]
    rows = ([*point, *values] for point, *values in zip(points, *flat, strict=True))
    return [*(a.path for a in result.axes), *columns], rows


def _areas(result: Uncertainty) -> tuple[list[str], Iterable[Sequence[Any]]]:
    names = {INNER: "p95", MEDIAN: "p50", OUTER: "p05"}
    heads = ["level", "nominal"]
    for name in names.values():
        heads += [f"area_{name}", f"area_{name}_low", f"area_{name}_high"]
    rows = []
    for level in result.levels:
        row = [level, result.nominal_regions[level].area_fraction]
        for probability in names:
            area = result.areas[level][probability]
            row += [area.value, *area.interval]
        rows.append(row)
    return heads, rows


def _contours(result: Uncertainty) -> Iterable[Sequence[Any]]:
    for level in result.levels:
        for number in range(result.realizations):
            outline = result.contours(level, number)
            for k, polygon in enumerate(outline.geoms):
                for ring, line in enumerate((polygon.exterior, *polygon.interiors)):
                    for x, y in line.coords:
                        yield level, number, k, ring, x, y


def _write(path: Path, heads: list[str], rows: Iterable[Sequence[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(heads)
        for row in rows:
            writer.writerow([_plain(value) for value in row])


def _plain(value: Any) -> Any:
    """A number in full; nothing for one that is not known."""
    if isinstance(value, (float, np.floating)):
        return "" if value != value else repr(float(value))
    return value
