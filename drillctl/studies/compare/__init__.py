"""Cases at the same draws: distributions, paired differences, regions, responses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.simulation.measures import MEASURES, STATUSES
from drillctl.store.tables import Column, Quantity, Table, Unit, quantity
from drillctl.studies.base import (
    DRAWS,
    SEED,
    Check,
    Option,
    Picture,
    Recipe,
    Requested,
    Section,
    Study,
    audit_tables,
    audited,
    doubted,
    in_batch,
)

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.compare.compute import Comparison


def tables(result: Comparison) -> Iterator[Table]:
    """Measures and differences, shares and areas under each level, and all draws."""
    yield _measures(result)
    yield _shares(result)
    yield _draws(result)
    for number, case in enumerate(result.cases, start=1):
        yield from audit_tables(case.audit, "draw {}".format, f"-{number}", f"{case.name}: ")


def _measures(result: Comparison) -> Table:
    from drillctl.ensemble.cases import QUANTILES

    columns = (
        Column("measure", hidden=True), Column("label", "measure"), Column("case"),
        Column("unit", hidden=True), Column("mean"),
        Column("std", hidden=True), Column("p05", "5 %"), Column("p50", hidden=True),
        Column("p95", "95 %"), Column("defined", hidden=True),
        Column("difference", f"less {result.baseline.name!r}, draw by draw", digits=3,
               signed=True, interval=True),
        Column("pairs", hidden=True),
    )  # fmt: skip
    rows: list[list[Any]] = []
    for name in result.baseline.measures:
        measure = MEASURES[name]
        for case in result.cases:
            of = case.distribution(name)
            apart = None if case is result.baseline else result.paired[case.name][name]
            rows.append([
                name, measure.label, case.name, Unit(measure.unit),
                *(Quantity(of[key], measure.unit) for key in ("mean", "std", *QUANTILES)),
                of["defined"], Quantity(apart, measure.unit), apart and apart.draws,
            ])  # fmt: skip
    title = f"Measures over {result.realizations} draws, and mean differences (95 % interval)"
    return Table("comparison", title, columns, rows)


def _shares(result: Comparison) -> Table:
    from drillctl.design import axis_tables

    maps = any(case.nominal.map is not None for case in result.cases)
    columns = (
        Column("level", "J1 at or under", "s"), Column("case"), Column("draws", hidden=True),
        Column("share", "share of the draws", percent=True, digits=3, interval=True),
        Column("cells", "cells of the map without draws", hidden=not maps),
        Column("area_fraction", "share of the map", percent=True, digits=3, hidden=not maps),
    )  # fmt: skip
    rows: list[list[Any]] = []
    for level in result.levels:
        for case in result.cases:
            share, inside = case.share(level), case.region(level)
            area = (None, None) if inside is None else (inside.cells, inside.area_fraction)
            rows.append([level, case.name, share.hits, share.estimate, *area])
    over = ", ".join(table.path for table in axis_tables(result.design))
    title = "Draws at or under each level of J1 (95 % interval)" + (f"; map over {over}" * maps)
    return Table("shares", title, columns, rows)


def _draws(result: Comparison) -> Table:
    from drillctl.design import parameter

    drawn, measures = result.baseline.drawn, result.baseline.measures
    columns = (
        Column("case"), Column("realization"),
        *(Column(path, unit=parameter(result.design, path).si_unit) for path in drawn),
        *(Column(name, unit=MEASURES[name].unit) for name in measures), Column("status"),
    )  # fmt: skip
    rows = [
        [case.name, number, *map(float, values), STATUSES[status]]
        for case in result.cases
        for number, (status, *values) in enumerate(
            zip(case.status, *case.drawn.values(), *case.measures.values(), strict=True)
        )
    ]
    return Table("draws", "Every draw", columns, rows, shown=False)


def pictures(result: Comparison) -> Iterator[Picture]:
    """Distributions, differences, weight, regions and responses."""
    names, first = ", ".join(case.name for case in result.cases), result.baseline.name
    yield Picture(
        "distributions", "Distribution of J1 of each case over the draws.",
        f"Distribution functions of J1 of {names}.", lambda system: plots.j1_distributions(result),
    )  # fmt: skip
    if len(result.cases) > 1:
        yield Picture(
            "differences", f"Mean differences from {first} at the same draws, with intervals.",
            f"Differences from {first} in every measure, in percent.",
            lambda system: plots.paired_differences(result),
        )  # fmt: skip
    yield Picture(
        "weight", "J1 against the mean weight on bit.",
        f"J1 of {names} against the mean weight on bit.",
        lambda system: plots.j1_against_weight(result, system=system),
    )  # fmt: skip
    yield Picture(
        "responses", "Bit speed, weight on bit and top torque of each case, without draws.",
        f"Bit speed, weight on bit and top torque of {names} against time.",
        lambda system: plots.compared_responses(result, system=system),
    )  # fmt: skip
    if any(case.nominal.map is not None for case in result.cases):
        yield Picture(
            "regions", f"Region of J1 at or under {result.levels[0]:g} s of each case.",
            f"Outlines of the regions of {names} over the map.",
            lambda system: plots.compared_regions(result, system=system), paper=True,
        )  # fmt: skip


def remarks(result: Comparison, system: units.System) -> Iterator[str]:
    """Draws, shifted weights, failures, missing maps and audits."""
    yield (
        f"{result.realizations} draws of {', '.join(result.baseline.drawn)}, the same for every "
        f"case; seed {result.seed}."
    )
    for case in result.cases:
        if case.weight_shift:
            shift = quantity(case.weight_shift, "N", system)
            yield f"{case.name}: nominal weight shifted by {shift} for equal means."
        for failure in case.failures:
            yield f"{case.name}: {failure.sentence(result.realizations)}"
        if case.nominal.no_map and result.design.tables.compare.maps:
            yield f"{case.name}: no map: {case.nominal.no_map}"
        yield f"{case.name}: {case.audit.sentence('draws')}"


def checks(result: Comparison) -> Iterator[Check]:
    """Whether the reference solver agrees with every case."""
    for case in result.cases:
        yield from audited(case.audit, f"the draws of {case.name}", "draws")


def notes(result: Comparison) -> Iterator[str]:
    """That there is nothing to compare with; where the engines differ."""
    for case in result.cases:
        yield from (f"{case.name}: {note}" for note in doubted(case.audit))
    if len(result.cases) == 1:
        yield "one case only: name others in compare.cases to compare it with"


def check(design: Design) -> None:
    """Refuse cases that are not on equal terms."""
    if design.tables.compare.cases:
        from drillctl.studies.compare.compute import case_designs, refuse_unequal

        refuse_unequal(case_designs(design))


def not_applicable(request: Requested) -> str:
    """Why a report compares no cases."""
    if not request.design.tables.compare.cases:
        return "the design has no cases to compare ([compare])"
    if not request.profile.compared:
        return "cases are compared with --profile full"
    return in_batch(request)


STUDY = Study(
    module=__name__,
    name="compare",
    help="Compare cases at the same draws",
    group="Decide",
    options=(
        DRAWS,
        SEED,
        Option(
            "equal_mean_weight",
            bool,
            "Shift nominal weights until mean weights are equal",
            sets="compare.equal_mean_weight",
            opposite="nominal-weight",
        ),
    ),
    axes=True,
    python="compare",
    recipes=(Recipe("compare", "the comparison", not_applicable, order=100),),
    sections=(Section("comparison", "Comparison of cases", ("compare",), order=100),),
)
