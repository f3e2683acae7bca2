"""Maps, regions and comparisons as CSV, for spreadsheets."""

from __future__ import annotations

import csv
from pathlib import Path

from drillctl.ensemble.cases import QUANTILES
from drillctl.simulation.measures import STATUSES
from drillctl.studies.compare.compute import MEASURES, Comparison
from drillctl.studies.delay.compute import WeightDelay


def write_comparison(result: Comparison, folder: Path) -> None:
    """Write `comparison.csv`, a row a case and measure, `shares.csv`, a row a case and level.

    And `draws.csv`, a row a case and realization. SI units, empty where a figure is undefined.

    Parameters
    ----------
    result : Comparison
        What was computed.
    folder : Path
        Where to.
    """
    figures = ("mean", "std", *QUANTILES, "defined")
    apart = ("difference", "difference_low", "difference_high", "pairs")
    rows: list[list[object]] = []
    for case in result.cases:
        for name, unit in MEASURES.items():
            found = case.distribution(name)
            row = [case.name, name, unit, *(found[figure] for figure in figures)]
            if case is result.baseline:
                rows.append([*row, *(None for _ in apart)])
            else:
                paired = result.paired[case.name][name]
                rows.append([*row, paired.value, *paired.ends, paired.draws])
    _write(folder / "comparison.csv", ["case", "measure", "unit", *figures, *apart], rows)
    rows = []
    for case in result.cases:
        for level in result.levels:
            share = case.share(level)
            inside = case.region(level)
            area = (None, None) if inside is None else (inside.cells, inside.area_fraction)
            rows.append([case.name, level, share.hits, share.value, *share.interval, *area])
    heads = ["case", "level", "draws", "share", "low", "high", "cells", "area_fraction"]
    _write(folder / "shares.csv", heads, rows)
    rows = []
    for case in result.cases:
        columns = [*case.drawn.values(), *case.measures.values()]
        for number, (status, *values) in enumerate(zip(case.status, *columns, strict=True)):
            rows.append([case.name, number, *map(float, values), STATUSES[status]])
    heads = ["case", "realization", *result.baseline.drawn, *MEASURES, "status"]
    _write(folder / "draws.csv", heads, rows)


def write_weight_delay(result: WeightDelay, folder: Path) -> None:
    """Write `weight-delay.csv`, a row a gain and delay; SI, empty where a figure is undefined.

    Parameters
    ----------
    result : WeightDelay
        What was computed.
    folder : Path
        Where to.
    """
    rows: list[list[object]] = []
    for gain, benefits in zip(result.gains, result.benefits, strict=True):
        for one in benefits:
            j1, apart, ended = one.j1, one.difference, one.ended
            rows.append([
                float(gain), one.delay, j1.value, *j1.ends, apart.value, *apart.ends, apart.draws,
                ended.hits, ended.value, *ended.interval, one.peak_bit_speed,
                one.peak_pipe_torque, one.mean_weight,
            ])  # fmt: skip
    heads = [
        "gain", "delay", "j1", "j1_low", "j1_high", "difference", "difference_low",
        "difference_high", "pairs", "ended", "ended_share", "ended_low", "ended_high",
        "peak_bit_speed", "peak_pipe_torque", "mean_weight",
    ]  # fmt: skip
    _write(folder / "weight-delay.csv", heads, rows)


def _write(path: Path, heads: list[str], rows: list[list[object]]) -> None:
    """Write rows; what is None or NaN is an empty field."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(heads)
        for row in rows:
            writer.writerow(["" if value is None or value != value else value for value in row])
