"""Stability regions under uncertainty: a map at thousands of realizations.

- `compute.py`: from design to result, and what is drawn on the way; `result.py`: `Uncertainty`, and
  how many realizations are enough.
- `best.py`: best cells by several objectives, and those that are no worse beyond doubt;
  `sensitivity.py`: Sobol indices.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from drillctl import plots, units
from drillctl.errors import InputError
from drillctl.store.tables import (
    Column,
    Estimate,
    Table,
    Told,
    chance,
    number,
    open_estimate,
    percent,
    place,
)
from drillctl.studies.base import (
    SEED,
    Check,
    Option,
    Picture,
    Recipe,
    Requested,
    Run,
    Section,
    Study,
    audit_tables,
    audited,
    doubted,
    in_batch,
    levels_any_run_keeps,
    mapped_in_batch,
)

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.store.folder import Growing
    from drillctl.studies.uncertainty.result import Uncertainty


def computed(design: Design, run: Run) -> Uncertainty:
    """The regions, from the blocks that the folder may hold, here or on a cluster."""
    from drillctl.ensemble.running import Cluster, connect
    from drillctl.ensemble.storing import Folder
    from drillctl.studies.uncertainty.compute import Interim, uncertainty

    given: dict[str, Any] = {"progress": run.progress}
    interim = None
    if run.folder is not None:
        interim = run.folder / "interim.png"
        given["store"] = Folder(run.folder)
        if run.options["interim"] is not None:
            given["interim"] = Interim(run.options["interim"], interim, run.system)
    if run.options["scheduler"] is None:
        result = uncertainty(design, **given)
    else:
        with connect(run.options["scheduler"]) as client:
            workers = Cluster(client, run.options["allow_other_machine"])
            result = uncertainty(design, workers=workers, **given)
            result = replace(result, provenance=workers.origin)
    if interim is not None:
        interim.unlink(missing_ok=True)
    return result


def growing(design: Design) -> Growing | None:
    """The number of realizations, to which more can be added."""
    from drillctl.store.folder import growing_realizations

    return growing_realizations(design)


def tables(result: Uncertainty) -> Iterator[Table]:
    """Areas of the regions, best cells, Sobol indices, and how areas settle."""
    yield _areas("areas", "share of the map by probability (95 % interval)", result)
    for k, (value, one) in enumerate(result.slices().items(), start=1):
        last = result.axes[2]
        named = Told(f"the same at {last.path} = {units.full(value, last.unit)}")
        yield _areas(f"areas-{k}", named, one)
    yield _best(result)
    if result.sensitivity is not None:
        yield indices(result)
    columns = (
        Column("level", "J1 at or under", "s"), Column("realizations"),
        Column("area_p95", "P >= 95 %", percent=True, interval=True),
    )  # fmt: skip
    rows = [
        [level, count, Estimate(*area)]
        for level, areas in result.convergence.areas.items()
        for count, area in zip(result.convergence.counts, areas, strict=True)
    ]
    title = "areas of the inner regions against the number of draws"
    yield Table("convergence", title, columns, rows, shown=False)
    cells, unit_of = result.nominal.size, {axis.path: axis.unit for axis in result.axes}
    yield from audit_tables(
        result.audit,
        lambda lane: f"draw {lane // cells}, {place(result.at(lane % cells), unit_of)}",
    )


def _areas(name: str, title: str, result: Uncertainty) -> Table:
    columns = (
        Column("level", "J1 at or under", "s"),
        Column("nominal", "nominal design", percent=True, digits=3),
        *(
            Column(f"area_{key}", f"P ≥ {share} %", percent=True, digits=3, interval=True)
            for key, share in (("p95", 95), ("p50", 50), ("p05", 5))
        ),
    )
    rows = [
        [
            level, result.nominal_regions[level].area_fraction,
            *(Estimate(*area) for area in result.areas[level].values()),
        ]
        for level in result.levels
    ]  # fmt: skip
    return Table(name, title, columns, rows)


def _best(result: Uncertainty) -> Table:
    from drillctl.ensemble.probability import called

    columns = (
        Column("objective", hidden=True), Column("said", "best by"), Column("value", interval=True),
        *(Column(axis.path, unit=axis.unit) for axis in result.axes),
        Column("alike_cells", "cells not significantly worse"),
    )  # fmt: skip
    rows: list[list[Any]] = []
    for name in result.objectives:
        try:
            best = result.best(name)
        except InputError as error:
            said = f"{called(name)}: {error.problem}"
            rows.append([name, said, *[None] * (len(columns) - 2)])
            continue
        alike = None if best.alike is None else int(best.alike.sum())
        at = result.at(best.cell).values()
        rows.append([name, called(name), open_estimate(best.value, best.interval), *at, alike])
    return Table("best", "best cells over the draws (J1 in s, 95 % interval)", columns, rows)


def indices(result: Uncertainty) -> Table:
    """Sobol indices of each uncertain parameter."""
    sensitivity = result.sensitivity
    assert sensitivity is not None
    columns = (
        Column("of"), Column("parameter"),
        Column("first", "first index", digits=3), Column("first_error_95", "±", digits=2),
        Column("total", "total index", digits=3), Column("total_error_95", "±", digits=2),
    )  # fmt: skip
    rows = [
        [
            Told(one.of), path,
            *(float(x[k]) for x in (one.first, one.first_error, one.total, one.total_error)),
        ]
        for one in sensitivity.indices
        for k, path in enumerate(sensitivity.parameters)
    ]  # fmt: skip
    title = f"Sobol indices from {sensitivity.samples} points (95 % interval)"
    return Table("sensitivity", title, columns, rows)


def pictures(result: Uncertainty) -> Iterator[Picture]:
    """Regions by probability, their sampling error, convergence, distributions, responses."""
    flat = {"": result} if len(result.axes) == 2 else {}
    flat |= {f"-{k}": one for k, one in enumerate(result.slices().values(), start=1)}
    for ending, one in flat.items():
        yield from _maps(one, ending)
    yield Picture(
        "convergence", "Areas of the inner regions against the number of draws.",
        "Curves of the area against the number of draws, with their intervals narrowing.",
        lambda system: plots.area_convergence(result),
    )  # fmt: skip
    yield Picture(
        "distributions", "J1 over the draws at the best cells.",
        "Distribution functions of J1 at the cells that are best by mean and by quantile.",
        lambda system: plots.cell_distributions(result, system=system),
    )  # fmt: skip
    if result.envelope is not None:
        yield Picture(
            "responses", "Responses at the design's own setting: 5 to 95 % of the draws.",
            "Bands of bit speed and pipe torque over time, with the median.",
            lambda system: plots.response_envelope(result, system=system),
        )  # fmt: skip
    if result.sensitivity is not None:
        yield Picture(
            "sensitivity", "First and total Sobol indices with their intervals.",
            "Bars of first and total index for each uncertain parameter.",
            lambda system: plots.sensitivity_bars(result, system=system),
        )  # fmt: skip


def _maps(result: Uncertainty, ending: str) -> Iterator[Picture]:
    areas = "; ".join(f"under {x:g} s {percent(next(iter(a.values())).value, 2)}"
                      for x, a in result.areas.items())  # fmt: skip
    yield Picture(
        f"regions{ending}", "Regions by probability: kept in 95 %, 50 % and 5 % of the draws.",
        f"Bands of the regions over the map. Share kept with 95 %: {areas}.",
        lambda system: plots.uncertain_regions(result, system=system), paper=True,
    )  # fmt: skip
    yield Picture(
        f"probability{ending}", "Probability that J1 keeps to each level.",
        "Maps of the probability at each level, with contours.",
        lambda system: plots.probability_map(result, system=system), paper=True,
    )  # fmt: skip
    yield Picture(
        f"sampling-error{ending}", "Inner regions with their sampling error.",
        "Cells that are in the inner region, and those that may be, with all intervals at once.",
        lambda system: plots.region_error(result, system=system), paper=True,
    )  # fmt: skip


def remarks(result: Uncertainty, system: units.System) -> Iterator[str]:
    """Looks, failures, stopped lanes, audit, draws and time."""
    for seen in result.looks:
        low, high = seen.interval
        yield (
            f"look at {seen.realizations} realizations: area {percent(seen.area)} "
            f"({percent(low)} to {percent(high)}, {percent(seen.confidence, 4)} interval)"
        )
    for failure in result.failures:
        yield failure.sentence(result.realizations)
    if result.censored.any():
        yield (
            f"{percent(result.censored.mean())} of the lanes were stopped once J1 had passed "
            f"{result.levels[-1]:g} s: they are outside every region, their J1 is a lower bound"
        )
    if len(result.audit.cells):
        yield result.audit.sentence("lanes")
    method = result.design.tables.uncertainty.sampling
    yield f"{result.realizations} draws ({method}, seed {result.seed}): {', '.join(result.drawn)}"
    yield (
        f"{result.trajectories:,} lanes: {result.seconds:.1f} s in blocks, "
        f"{result.total_seconds:.1f} s in all"
    )


def checks(result: Uncertainty) -> Iterator[Check]:
    """Whether the reference solver agrees."""
    yield from audited(result.audit, "the draws", "lanes")


def notes(result: Uncertainty) -> Iterator[str]:
    """What deserves attention."""
    yield from levels_any_run_keeps(result.design, result.levels)
    yield from doubted(result.audit)


def files(result: Uncertainty, folder: Path, system: units.System) -> None:
    """Cells, draws and contours."""
    from drillctl.studies.uncertainty.compute import write_columns_of

    write_columns_of(result, folder, system)


def audited_as_profile(request: Requested) -> Design:
    """The design with as many audited lanes as the profile of a report spends."""
    count = request.profile.drawn_audit
    return request.design if count is None else request.design.replace({"map.audit_cells": count})


def check(design: Design) -> None:
    """Refuse (`InputError`) what a run would refuse."""
    if design.tables.uncertain:
        from drillctl.ensemble.parameters import uncertain_parameters

        uncertain_parameters(design)
    if "uncertainty" in design.tree:
        from drillctl.studies.uncertainty.compute import refuse_impossible
        from drillctl.studies.uncertainty.result import map_axes

        refuse_impossible(design, map_axes(design))


def at_setting(request: Requested) -> Design:
    """The design with more draws at its own gains, and its level among those that are counted."""
    design, level = request.design, request.design.tables.tune.level
    # Nothing that a map under uncertainty has beyond its draws.
    values: dict[str, Any] = {
        "map.levels": sorted({*design.tables.map.levels, level}),
        "uncertainty.sampling": "monte-carlo",
        "uncertainty.realizations": request.profile.setting, "uncertainty.sensitivity": None,
        "uncertainty.until": None, "uncertainty.axes": [], "uncertainty.contours": False,
        "uncertainty.keep": [],
    }  # fmt: skip
    return design.replace(values)


def setting(design: Design, run: Run) -> Uncertainty:
    """Draws at the design's own values."""
    from drillctl.studies.uncertainty.compute import uncertainty

    return uncertainty(design, axes=(), audit_cells=0, progress=run.progress)


def setting_summary(result: Uncertainty) -> dict[str, Any]:
    """The probability of keeping the level, with its interval."""
    level = result.design.tables.tune.level
    share = result.probability(level)
    low, high = share.interval
    return {
        "level": level,
        "realizations": result.realizations,
        "seed": result.seed,
        "uncertain": list(result.drawn),
        "probability": float(share.probability),
        "interval_95": [float(low), float(high)],
        "failures": [{"reason": one.reason, "count": one.count} for one in result.failures],
    }


def setting_remark(summary: dict[str, Any]) -> Iterator[str]:
    """The probability of keeping the level in a sentence."""
    yield (
        f"At the current setting, with {summary['realizations']} draws: P(J1 ≤ "
        f"{number(summary['level'])} s) = {chance(summary['probability'], summary['interval_95'])}."
    )


def no_indices(design: Design) -> str:
    """Why a report has no Sobol indices."""
    if design.tables.uncertainty.sensitivity is None:
        return "the design requests no indices ([uncertainty.sensitivity])"
    return "indices are computed with --profile standard or full"


STUDY = Study(
    module=__name__,
    name="uncertainty",
    help="Map J1 over draws: regions by probability, best cells",
    group="Decide",
    options=(
        Option("realizations", int, "Use this many draws; more than before extend a run",
               sets="uncertainty.realizations"),
        SEED,
        Option("sampling", Literal["monte-carlo", "sobol", "latin-hypercube"],
               "Draw by this method", sets="uncertainty.sampling"),
        Option("full", bool, "Run every lane to its end, for means and quantiles",
               sets="uncertainty.full"),
        Option("sensitivity", int, "Compute Sobol indices from this many points",
               sets="uncertainty.sensitivity.samples"),
        Option("audit", int, "Audit this many lanes with the reference solver",
               sets="map.audit_cells"),
        Option("resume", bool, "Resume the run in --out; fail if there is none", False, how=True),
        Option("scheduler", str, "Use the dask.distributed scheduler at this address", how=True),
        Option("interim", float, "Draw interim pictures this many seconds apart", how=True,
               least=0.0),
    ),
    axes=True,
    python="uncertainty",
    resumes=True,
    recipes=(
        Recipe("setting", "the draws at the current setting", in_batch, at_setting,
               compute=setting, summary=setting_summary, says=setting_remark, order=30),
        Recipe("uncertainty", "the map under uncertainty", mapped_in_batch, audited_as_profile,
               order=90),
    ),
    sections=(
        Section("uncertainty", "Uncertainty", ("uncertainty", "setting"), order=70),
        Section("sensitivity", "Sensitivity", ("uncertainty",), order=80, shows=("sensitivity",),
                absent=no_indices),
    ),
)  # fmt: skip
