"""Compared cases as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.cli.console import line, table
from drillctl.printing.words import head_of, title_of

if TYPE_CHECKING:
    from drillctl.ensemble.cases import Estimate, Share
    from drillctl.studies import Comparison, Region
    from drillctl.studies.compare.compute import ComparedCase


def comparison(result: Comparison, system: units.System) -> None:
    """Distributions of the cases, differences from the first, shares and areas under each level."""
    from drillctl.studies.compare.compute import MEASURES

    names = [case.name for case in result.cases]
    rows = []
    for name, unit in MEASURES.items():
        factor, label = units.displayed(1.0, unit, system)
        found = [case.distribution(name) for case in result.cases]
        rows.append([head_of(name, label), *(_spread(one, factor) for one in found)])
    table(
        f"{title_of(result)}: mean over {result.realizations} draws (5 % to 95 %)",
        ["measure", *names],
        rows,
    )
    if len(names) > 1:
        rows = []
        for name, unit in MEASURES.items():
            factor, label = units.displayed(1.0, unit, system)
            apart = [result.paired[case][name] for case in names[1:]]
            rows.append([head_of(name, label), *(_apart(one, factor) for one in apart)])
        heads = ["measure", *names[1:]]
        table(f"difference from {names[0]!r} draw by draw, mean (95 % interval)", heads, rows)
    rows = []
    for level in result.levels:
        rows.append([f"J1 <= {level:g} s", *(_share(case.share(level)) for case in result.cases)])
    table("share of the draws (95 % interval)", ["level", *names], rows)
    if any(case.nominal.map is not None for case in result.cases):
        rows = [
            [f"J1 <= {level:g} s", *(_area(case.region(level)) for case in result.cases)]
            for level in result.levels
        ]
        axes = ", ".join(table.path for table in result.design.tables.map.axes)
        table(f"share of the map over {axes}, without draws (cells)", ["level", *names], rows)
    for case in result.cases:
        _case_notes(case, system)
        if case.nominal.no_map and result.design.tables.compare.maps:
            line(f"{case.name}: no map: {case.nominal.no_map}")
    line(f"drawn: {', '.join(result.baseline.drawn)}; seed {result.seed}")


def _case_notes(case: ComparedCase, system: units.System) -> None:
    if case.weight_shift:
        shift, unit = units.displayed(case.weight_shift, "N", system)
        line(f"{case.name}: nominal weight shifted by {shift:+.3f} {unit} for equal means")
    for failure in case.failures:
        reason = f"{failure.reason}: {failure.example}"
        line(f"{case.name}: {failure.count} of {len(case.status)} draws failed; {reason}")


def _share(found: Share) -> str:
    low, high = found.interval
    return f"{found.value:.1%} ({low:.1%} to {high:.1%})"


def _area(found: Region | None) -> str:
    return "-" if found is None else f"{found.area_fraction:.1%} ({found.cells})"


def _spread(found: dict[str, Any], factor: float) -> str:
    if found["mean"] is None:
        return "-"
    mean, low, high = (f"{found[key] * factor:.4g}" for key in ("mean", "p05", "p95"))
    return f"{mean} ({low} to {high})"


def _apart(found: Estimate, factor: float) -> str:
    if found.value is None:
        return "-"
    if found.interval is None:
        return f"{found.value * factor:+.4g}"
    low, high = (f"{end * factor:.4g}" for end in found.interval)
    return f"{found.value * factor:+.4g} ({low} to {high})"
