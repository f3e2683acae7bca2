"""Regions under uncertainty as tables for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl import units
from drillctl.cli.console import line, sized, table
from drillctl.errors import InputError
from drillctl.printing.words import place_of, title_of

if TYPE_CHECKING:
    from drillctl.studies import Uncertainty
    from drillctl.studies.uncertainty.areas import Area


def uncertainty(result: Uncertainty, system: units.System) -> None:
    """Areas, best cells, indices, failures and audit."""
    _areas(result)
    for one in result.slices().values():
        _areas(one)
    _best(result, system)
    if result.sensitivity is not None:
        _indices(result)
    for seen in result.looks:
        low, high = seen.interval
        line(
            f"look at {seen.realizations} realizations: area {seen.area:.2%} ({low:.2%} to "
            f"{high:.2%}, {seen.confidence:.2%} interval)"
        )
    for failure in result.failures:
        line(
            f"{failure.count} of {result.realizations} draws failed; {failure.reason}: "
            f"{failure.example}"
        )
    if result.censored.any():
        share = result.censored.mean()
        line(f"{share:.1%} of the lanes were stopped once J1 had passed {result.levels[-1]:g} s")
    audit = result.audit
    worst = f", worst relative difference in J1 {sized(audit.worst, 2)}" if len(audit.cells) else ""
    line(f"audit: {audit.verdict}, {len(audit.cells)} lanes{worst}")
    method = result.design.tables.uncertainty.sampling
    line(f"{result.realizations} draws ({method}, seed {result.seed}): {', '.join(result.drawn)}")
    line(
        f"{result.trajectories:,} lanes: {result.seconds:.1f} s in blocks, "
        f"{result.total_seconds:.1f} s in all"
    )


def _areas(result: Uncertainty) -> None:
    rows = []
    for level in result.levels:
        areas = result.areas[level]
        nominal = result.nominal_regions[level].area_fraction
        rows.append(
            [f"J1 <= {level:g} s", f"{nominal:.2%}", *(_area(one) for one in areas.values())]
        )
    title = title_of(result)
    heads = ["region", "nominal", "P >= 95 %", "P >= 50 %", "P >= 5 %"]
    table(f"{title}: share of the map by probability (95 % interval)", heads, rows)


def _area(one: Area) -> str:
    low, high = (f"{100.0 * end:.2f}" for end in one.interval)
    return f"{one.value:.2%} ({low} to {high})"


def _best(result: Uncertainty, system: units.System) -> None:
    rows = []
    for name in result.objectives:
        try:
            found = result.best(name)
        except InputError as error:
            rows.append([name, "-", "-", error.problem, "-"])
            continue
        place = place_of(result.at(found.cell), result.axes, system)
        low, high = (sized(end, 4) for end in found.interval)
        alike = "-" if found.alike is None else str(int(found.alike.sum()))
        rows.append([name, f"{found.value:.4g}", f"{low} to {high}", place, alike])
    heads = ["best by", "value", "95 % interval", "at", "cells alike"]
    table("best cells over the draws (J1 in s)", heads, rows)


def _indices(result: Uncertainty) -> None:
    found = result.sensitivity
    assert found is not None
    rows = []
    for one in found.indices:
        for k, path in enumerate(found.parameters):
            rows.append([
                one.of if k == 0 else "", path,
                _index(one.first[k], one.first_error[k]), _index(one.total[k], one.total_error[k]),
            ])  # fmt: skip
    heads = ["of", "parameter", "first index", "total index"]
    table(f"Sobol indices, {found.samples} points (95 % interval)", heads, rows)


def _index(value: float, error: float) -> str:
    if value != value:
        return "-"
    return f"{value:.3f} (error not known)" if error != error else f"{value:.3f} +- {error:.3f}"
