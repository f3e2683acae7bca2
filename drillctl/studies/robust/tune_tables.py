"""A tune as CSV, for spreadsheets."""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from drillctl.studies.robust.certificate import FreshRuns
from drillctl.studies.robust.tune_study import Tune


def write_tune_tables(result: Tune, folder: Path) -> None:
    """Write a tune as tables; SI units, empty where a figure is not known or infinite.

    `baselines.csv`, a row the found gains and each baseline; `tolerance.csv`, a row a parameter;
    `neighbourhood.csv`, a row a cell; `draws.csv`, a row a fresh realization.
    """
    paths = [t.path for t in result.tuning.tuned]
    quantiles = list(result.certificate.runs.quantiles)
    heads = ["name", *paths, "objective", "probability", "low_95", "high_95", *quantiles, "reason"]
    rows: list[list[Any]] = [
        ["tuned", *result.gains.values(), *_figures(result.certificate.runs), ""]
    ]
    for one in result.baselines:
        gains = [one.told.get(path) for path in paths]
        figures = [""] * (4 + len(quantiles)) if one.runs is None else _figures(one.runs)
        rows.append([one.name, *gains, *figures, one.reason])
    _write(folder / "baselines.csv", heads, rows)
    heads = ["parameter", "unit", "value", "low", "high", "low_at_bound", "high_at_bound"]
    _write(
        folder / "tolerance.csv",
        heads,
        [[getattr(one, h if h != "parameter" else "path") for h in heads]
         for one in result.certificate.tolerances],
    )  # fmt: skip
    about = result.certificate.neighbourhood
    cells = itertools.product(*(axis.values for axis in about.axes))
    rows = [[*at, p] for at, p in zip(cells, about.probability.ravel(), strict=True)]
    _write(folder / "neighbourhood.csv", [*(a.path for a in about.axes), "probability"], rows)
    drawn = result.certificate.drawn
    columns = [*drawn.values(), result.certificate.runs.j1]
    _write(folder / "draws.csv", [*drawn, "j1"], zip(*columns, strict=True))


def _figures(runs: FreshRuns) -> list[Any]:
    return [runs.value, runs.probability, *runs.interval, *runs.quantiles.values()]


def _write(path: Path, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(heads)
        writer.writerows([_field(value) for value in row] for row in rows)


def _field(value: Any) -> Any:
    """A number as it is, nothing where there is none."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return float(value) if isinstance(value, float) else value
