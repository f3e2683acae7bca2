"""The study as CSV, for spreadsheets."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

from drillctl.ensemble.cases import Estimate
from drillctl.studies.advantage.cases import MEASURES
from drillctl.studies.advantage.compute import Advantage
from drillctl.studies.advantage.sweeps import FIGURES, Chart


def write_advantage(result: Advantage, folder: Path) -> None:
    """Write the study as tables; SI units, empty where a figure is not known.

    `cases.csv`, a row a case and figure; `shares.csv`, a row a case and level; `areas.csv`, a row
    a policy and level; `front.csv` and `map.csv`, a row a policy, weight and speed; `delays.csv`,
    a row a choice of gains and delay.
    """
    apart = ["difference", "difference_low", "difference_high"]
    ends = ["value", "low", "high"]
    _write(folder / "cases.csv", ["case", "figure", "unit", *ends, *apart], _cases(result))
    _write(folder / "shares.csv", ["case", "level", "share", *ends[1:], *apart], _shares(result))
    sizes = [f"area_{name}{end}" for name in ("p95", "p05") for end in ("", "_low", "_high")]
    _write(folder / "areas.csv", ["policy", "gain", "level", "nominal", *sizes], _areas(result))
    heads = ["policy", "weight", "speed", *FIGURES]
    _write(folder / "front.csv", heads, _chart(result.front))
    _write(folder / "map.csv", heads, _chart(result.chart))
    heads = ["gains", "delay", "kp", "ki", "gain", "objective", "advantage", "low", "high"]
    _write(folder / "delays.csv", heads, _delays(result))


def _cases(result: Advantage) -> Iterable[list[object]]:
    for case in result.cases:
        for path, value in case.gains.items():
            yield [case.name, path, "", value, *[None] * 5]
        yield [case.name, "shift", "N", case.shift, *[None] * 5]
        yield [case.name, "objective", "s", *_three(case.objective), *_three(case.objective_less)]
        for name, unit in MEASURES.items():
            apart = case.difference(result.baseline, name, result.seed)
            yield [case.name, name, unit, case.mean(name), None, None, *_three(apart)]


def _shares(result: Advantage) -> Iterable[list[object]]:
    for case in result.cases:
        for level in result.levels:
            share = case.share(level)
            apart = case.share_difference(result.baseline, level, result.seed)
            yield [case.name, level, share.value, *share.interval, *_three(apart)]


def _areas(result: Advantage) -> Iterable[list[object]]:
    for one in result.regions:
        for level, areas in one.areas.items():
            row: list[object] = [one.policy, one.gain, level, one.nominal_area(level)]
            for area in areas.values():
                row += [area.value, *area.interval]
            yield row


def _chart(found: Chart) -> Iterable[list[object]]:
    for k, policy in enumerate(found.policies):
        for i, weight in enumerate(found.weights):
            for j, speed in enumerate(found.speeds):
                figures = [float(values[k, i, j]) for values in found.figures.values()]
                yield [policy, float(weight), float(speed), *figures]


def _delays(result: Advantage) -> Iterable[list[object]]:
    for name, line in (("ideal path", result.delay.kept), ("tuned anew", result.delay.anew)):
        for i, delay in enumerate(line.delays):
            columns = (line.objective, line.advantage, line.low, line.high)
            numbers = [*line.gains[i], *(column[i] for column in columns)]
            yield [name, float(delay), *map(float, numbers)]


def _three(found: Estimate) -> list[object]:
    return [found.value, *found.ends]


def _write(path: Path, heads: list[str], rows: Iterable[list[object]]) -> None:
    """Write rows; what is None or NaN is an empty field."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(heads)
        for row in rows:
            writer.writerow(["" if value is None or value != value else value for value in row])
