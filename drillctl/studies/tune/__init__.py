"""Robust gains: a linear design with CasADi, and a search over many realizations at once.

`compute.py`: `tune`, all of it in one go; `tuned.py`: what is tuned, and which numbers of a drive
follow from it; `settings.py`: the keys of `[tune]`.

Linear design, for the largest friction-slope margin over a set of loops:

- `loops.py`: the loops that gains must hold for, a string as data, crossings; how far requirements
  are missed at given gains.
- `linear_design.py`: starts, the smooth program near given gains, and the search from each.

Nonlinear design, for the least statistic of J1 over realizations:

- `problem.py`: runs of many gains by the batch engine, objective and requirements.
- `search.py`: from a first look to the gains, for the study of the advantage too.

What follows for the gains:

- `certificate.py`: runs at draws that no search has seen, margins, audit, how far gains may drift.
- `compute.py`: other gains and laws at the same draws.

CasADi is imported where a function needs it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.store.tables import (
    Column,
    Estimate,
    Quantity,
    Table,
    Unit,
    chance,
    number,
    percent,
    place,
    quantity,
)
from drillctl.studies.base import (
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
    levels_any_run_keeps,
)

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.tune.certificate import FreshRuns
    from drillctl.studies.tune.compute import Tune


SLOPE = "N*m*s/rad"
SHOWN = ("q50", "q95", "q99")  # quantiles of J1 that people are shown


def tables(result: Tune) -> Iterator[Table]:
    """Gains with their tolerance, others beside them; cells and draws for files alone."""
    yield _tolerance(result)
    yield _baselines(result)
    yield from audit_tables(result.certificate.audit, "draw {}".format)
    about = result.certificate.neighbourhood
    cells = itertools.product(*(axis.values.tolist() for axis in about.axes))
    yield Table(
        "neighbourhood", "probability around the tuned gains",
        (*(Column(axis.path, unit=axis.unit) for axis in about.axes), Column("probability")),
        [[*at, p] for at, p in zip(cells, about.probability.ravel().tolist(), strict=True)],
        shown=False,
    )  # fmt: skip
    draws = result.certificate.draws
    columns = [one.values.tolist() for one in draws] + [result.certificate.runs.j1.tolist()]
    yield Table(
        "draws", "the fresh realizations",
        (*(Column(one.path, unit=one.unit) for one in draws), Column("j1", "J1", "s")),
        list(zip(*columns, strict=True)), shown=False,
    )  # fmt: skip


def _tolerance(result: Tune) -> Table:
    """Tuned values, and how far each alone may drift; nothing where the level is not kept."""
    certificate = result.certificate
    kept = certificate.runs.probability >= certificate.required
    rows = []
    for one, tuned in zip(certificate.tolerances, result.tuning.tuned, strict=True):
        ends = (one.low, one.high) if kept else (None, None)
        numbers = (one.value, *ends, tuned.low, tuned.high)
        cells = [Quantity(value, one.unit) for value in numbers]
        rows.append([one.path, Unit(one.unit), *cells, one.low_at_bound, one.high_at_bound])
    columns = (
        Column("parameter"), Column("unit", hidden=True), Column("value", digits=6),
        Column("low", "down to", digits=6), Column("high", "up to", digits=6),
        Column("searched_low", "searched from"), Column("searched_high", "to"),
        Column("low_at_bound", hidden=True), Column("high_at_bound", hidden=True),
    )  # fmt: skip
    level, required = certificate.runs.level, certificate.required
    title = f"tuned gains; tolerance of each alone: P(J1 <= {level:g} s) >= {required:g}"
    return Table("tolerance", title, columns, rows)


def _baselines(result: Tune) -> Table:
    """The tuned gains and each baseline at the same draws."""
    runs = result.certificate.runs
    tuned, quantiles = result.tuning.tuned, list(runs.quantiles)
    rows = [["tuned", *result.gains.values(), *_figures(runs), ""]]
    for one in result.baselines:
        figures = [None] * (2 + len(quantiles)) if one.runs is None else _figures(one.runs)
        gains = [one.gains.get(t.path) for t in tuned]
        rows.append([one.name, *gains, *figures, one.reason])
    columns = (
        Column("name", "gains"), *(Column(t.path, unit=t.unit, digits=5) for t in tuned),
        Column("objective", unit="s"),
        Column("probability", f"P(J1 <= {runs.level:g} s), 95 % interval", interval=True),
        *(
            Column(name, f"J1, {float(name[1:]):g} %", "s", hidden=name not in SHOWN)
            for name in quantiles
        ),
        Column("reason", hidden=True),
    )  # fmt: skip
    title = f"at the same {len(runs.j1)} fresh realizations"
    return Table("baselines", title, columns, rows)


def _figures(runs: FreshRuns) -> list[Any]:
    return [runs.value, Estimate(runs.probability, runs.interval), *runs.quantiles.values()]


def pictures(result: Tune) -> Iterator[Picture]:
    """J1 at the tuned and other gains; how far the tuned ones may drift."""
    yield Picture(
        "baselines", "Tuned gains and other gains at the same fresh draws.",
        "J1 over the fresh draws at the tuned gains and at other gains.",
        lambda system: plots.tune_baselines(result), paper=True,
    )  # fmt: skip
    yield Picture(
        "neighbourhood", "Probability around the tuned gains: their tolerance.",
        "Map of P(J1 ≤ level) around the tuned gains.",
        lambda system: plots.tune_neighbourhood(result, system=system), paper=True,
    )  # fmt: skip


def remarks(result: Tune, system: units.System) -> Iterator[str]:
    """What the certificate shows beside its tables, and what search and certificate took."""
    certificate, search = result.certificate, result.tuning
    for one in result.baselines:
        if one.runs is None:
            yield f"{one.name}: left out: {one.reason}"
        elif one.name == "exhaustive grid":
            share = search.trajectories / one.search["trajectories"]
            yield (
                f"exhaustive grid: {one.search['trajectories']:,.0f} trajectories, "
                f"{one.search['seconds']:.1f} s, objective {one.search['value']:.4g} s at the "
                f"realizations of the search, which has {search.value:.4g} s from {share:.1%} of "
                "them"
            )
    yield from _certified(result, system)
    yield (
        f"search: {search.trajectories:,} trajectories at {search.realizations} realizations, "
        f"{search.seconds:.1f} s; certificate: {certificate.trajectories:,} trajectories, "
        f"{certificate.seconds:.1f} s; {result.total_seconds:.1f} s in all"
    )
    yield units.told(result.message, system)


def _certified(result: Tune, system: units.System) -> Iterator[str]:
    """Worst draw, draws without a rig, requirements, margins, audit."""
    certificate = result.certificate
    if (worst := certificate.worst) is not None:
        unit_of = {one.path: one.unit for one in certificate.draws}
        drawn = place({path: v[worst] for path, v in certificate.drawn.items()}, unit_of)
        where = units.told(drawn, system)
        yield f"worst realization: J1 {certificate.runs.j1[worst]:.4g} s at {where}"
    for failure in certificate.failures:
        yield (
            f"{failure.count} draws that no rig has count as over the level; {failure.reason}: "
            f"{failure.example}"
        )
    for name, missed in certificate.violations.items():
        yield f"at the fresh realizations {name} is missed by {missed:.2%} of its limit"
    if margins := certificate.margins:
        disk = margins["disk_margin"] or {"gain_db": None, "phase_deg": None}
        margin, slope = (quantity(margins[x], SLOPE, system) for x in ("slope_margin", "slope"))
        yield (
            f"loop: slope margin {margin} (the rock has {slope}), "
            f"disk margins {number(disk['gain_db'], 3)} dB and "
            f"{number(disk['phase_deg'], 3)} deg, peak sensitivity "
            f"{number(margins['peak_sensitivity'], 3)}"
        )
    else:
        yield f"no margins: {certificate.no_margins}"
    other = f"{certificate.other_side} of them on the other side of the level"
    yield f"{certificate.audit.sentence('draws')}; {other}"


def checks(result: Tune) -> Iterator[Check]:
    """Whether the certificate is passed, and the reference solver agrees."""
    certificate, runs = result.certificate, result.certificate.runs
    required = percent(certificate.required)
    detail = f"{chance(runs.probability, runs.interval)}, {len(runs.j1)} draws"
    question = f"Is P(J1 ≤ {number(runs.level)} s) at least {required}, at fresh draws?"
    yield Check(question, certificate.passed, detail)
    yield from audited(certificate.audit, "the certificate", "draws")


def notes(result: Tune) -> Iterator[str]:
    """Gains at an end of their range; where the two engines disagree."""
    yield from result.on_bounds
    yield from levels_any_run_keeps(result.design, [result.design.tables.tune.level])
    yield from doubted(result.certificate.audit)


def files(result: Tune, folder: Path, system: units.System) -> None:
    """The design with its tuned gains, ready to run, the result on top as comments."""
    from drillctl.design import to_toml
    from drillctl.store.json_files import write_text

    lines = (f"Gains tuned from {result.design.name!r} by drillctl.", result.message + ".")
    head = "".join(f"# {line}\n" for line in lines)
    write_text(folder / "tuned.toml", head + to_toml(result.tuned_design))


def failure(result: Tune) -> str | None:
    """Gains that are not certified are an answer, and no success."""
    return None if result.passed else result.message


def check(design: Design) -> None:
    """Refuse bounds that no design has, and parameters that are drawn as well."""
    if "tune" in design.tree:
        from drillctl.studies.tune.tuned import tuned_parameters

        tuned_parameters(design)


def not_applicable(request: Requested) -> str:
    """Why a report has no tuned gains."""
    return in_batch(request) if request.profile.tuned else "gains are tuned with --profile full"


STUDY = Study(
    module=__name__,
    name="tune",
    help="Search robust gains and certify them at fresh draws",
    group="Decide",
    options=(
        Option("realizations", int, "Search at this many draws", sets="tune.realizations"),
        Option("seed", int, "Search with this seed", sets="tune.seed"),
        Option(
            "certificate", int, "Certify the gains at this many fresh draws",
            sets="tune.certificate.realizations",
        ),
        Option("exhaustive", bool, "Run a grid of 41 x 41 gains as well", default=False),
    ),
    python="tune",
    resumes=True,
    recipes=(Recipe("tune", "the tuning of the gains", not_applicable, order=110),),
    sections=(Section("tuning", "Tuned gains and their certificate", ("tune",), order=90),),
)  # fmt: skip
