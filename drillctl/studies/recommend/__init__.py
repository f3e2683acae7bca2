"""What to set in the drive: candidates judged by all criteria at common draws, one recommended.

`candidates.py`: laws by rules, by the linear loop, by search; `criteria.py`: what must be kept;
`window.py`: speeds and weights without sticking; `assess.py`: a setting with all that is said of
it; `deeper.py`: pipe added at the top; `help.py`: what would help next, and until which depth a
setting passes; `words.py`: the sentence, and units of drives; `compute.py`: `recommend`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.store.tables import Column, Estimate, Quantity, Table, Told, Unit
from drillctl.studies.base import (
    Check,
    Option,
    Picture,
    Recipe,
    Requested,
    Section,
    Study,
    in_batch,
    levels_any_run_keeps,
)

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.recommend.compute import Recommendation


def tables(result: Recommendation) -> Iterator[Table]:
    """Every setting with its verdict, what limits it, and numbers for the drive."""
    yield _settings(result)
    yield _limits(result)
    yield _numbers(result)
    yield _criteria(result)


def _named(result: Recommendation, name: str) -> str:
    return f"{name} *" if name == result.recommended.name else name


def _settings(result: Recommendation) -> Table:
    """Numbers, verdict, J1 and its probability."""
    from drillctl.studies.recommend.words import numbers_of

    rows = [
        [
            _named(result, one.name), one.law, Told(numbers_of(one.design, one.gains)), one.verdict,
            one.nominal["j1"], round(one.nominal["stick_slip_index"], 4),
            Estimate(one.probability, one.interval), one.objective,
            None if one is result.present else result.less(one),
        ]
        for one in result.candidates
    ]  # fmt: skip
    columns = (
        Column("setting"), Column("law", hidden=True), Column("numbers"), Column("verdict"),
        Column("j1", "J1", "s", 3), Column("stick_slip_index", "stick-slip index", digits=2),
        Column("probability", "probability of the level", percent=True, digits=3, interval=True),
        Column("objective", unit="s", hidden=True),
        Column("less", "mean J1 less that now", "s", 3, signed=True, interval=True),
    )  # fmt: skip
    draws = len(result.present.j1)
    title = f"at the same {draws} fresh draws (* {_chosen(result)})"
    return Table("settings", title, columns, rows)


def _chosen(result: Recommendation) -> str:
    """What the setting is that is put first."""
    return "the least bad: none passes" if result.verdict == "none" else "recommended"


def _limits(result: Recommendation) -> Table:
    """Window, torque, and figures of the linear loop of each."""
    rows = []
    for one in result.candidates:
        loop, whole, part = one.loop, one.loop.whole, one.loop.part
        ratio = loop.slope_margin / loop.slope if loop.slope > 0.0 else None
        rows.append([
            _named(result, one.name), one.window.lowest_speed, one.window.highest_weight,
            one.nominal["peak_top_torque"], one.limited, loop.stable, loop.slope_margin,
            loop.slope, ratio, loop.deciding_hz,
            *((None,) * 4 if whole is None else (
                whole.gain_db, whole.phase_deg, whole.delay, whole.peak_sensitivity)),
            None if part is None else part.peak_sensitivity,
        ])  # fmt: skip
    share = result.design.tables.recommend.slope_share
    columns = (
        Column("setting"), Column("lowest_speed", "no sticking from", "rad/s", 3),
        Column("highest_weight_on_bit", "up to WOB", "N", 3),
        Column("peak_top_torque", "peak torque", "N*m", 3),
        Column("time_at_limit", "time at limit", percent=True, digits=2), Column("stable"),
        Column("slope_margin", unit="N*m*s/rad", hidden=True),
        Column("slope", unit="N*m*s/rad", hidden=True),
        Column("slope_ratio", "slope margin over slope", digits=3),
        Column("deciding_frequency", "decided at", "Hz", 2),
        Column("disk_gain", "disk margin", "dB", 2),
        Column("disk_phase", unit="degrees", hidden=True),
        Column("delay_margin", "delay margin", "s", 2),
        Column("peak_sensitivity", "peak sensitivity", digits=3),
        Column("peak_sensitivity_part", f"at {share:g} of the slope", digits=3),
    )  # fmt: skip
    return Table("limits", "where each works, and its loop about steady drilling", columns, rows)


def _numbers(result: Recommendation) -> Table:
    """What stands in the drive, in its units, with how far each number may be off."""
    from drillctl.design.paths import SI_OF, USUAL_NAMES
    from drillctl.studies.recommend.words import in_drive_units

    best = result.recommended
    told = in_drive_units(best)
    drifts = {drift.path: drift for drift in best.tolerance}
    rows: list[list[Any]] = []
    for name, value in best.controller.items():
        si = SI_OF[name]
        each = told[name]
        written = float(f"{value:.5g}")  # the same in all units, and in the sentence
        both = [
            f"{v:.5g} {unit}"
            for v, unit in (units.displayed(written, si, of) for of in ("si", "field"))
        ]
        per = next((v for k, v in each.items() if k.startswith("per unit")), None)
        drift = drifts.get(f"controller.{name}")
        ends = (None, None) if drift is None else (drift.low, drift.high)
        label = USUAL_NAMES.get(f"controller.{name}", name.replace("_", " "))
        cells = [Quantity(one, si) for one in (value, *ends)]
        rows.append([label, name, Unit(si), cells[0], *both, per, *cells[1:]])
    columns = (
        Column("number"), Column("key", hidden=True), Column("unit", hidden=True),
        Column("value", hidden=True), Column("si", "SI"), Column("field", "field units"),
        Column("per_unit", "per unit", hidden=told["rated_torque"] is None),
        Column("low", "may be off down to"), Column("high", "up to"),
    )  # fmt: skip
    missed = ", which does not pass" if result.verdict == "none" else ""
    return Table("numbers", f"numbers for the drive: {best.name}{missed}", columns, rows)


def _criteria(result: Recommendation) -> Table:
    """Every criterion of every setting."""
    rows = [
        [one.name, each.name, each.kept, each.value, each.limit, each.miss, Told(each.said)]
        for one in result.candidates
        for each in one.criteria
    ]
    columns = (
        Column("setting"),
        Column("criterion"),
        Column("kept"),
        Column("value"),
        Column("limit"),
        Column("miss", digits=2),
        Column("said"),
    )
    return Table("criteria", "what each keeps", columns, rows, shown=False)


def pictures(result: Recommendation) -> Iterator[Picture]:
    """All settings side by side."""
    yield Picture(
        "recommended", "Settings side by side: J1, probability, window, loop.",
        f"J1, probability of the level, speeds and weights without sticking and slope margin of "
        f"{len(result.candidates)} settings; {_chosen(result)}: {result.recommended.name}.",
        lambda system: plots.recommended(result, system=system),
    )  # fmt: skip


def remarks(result: Recommendation, system: units.System) -> Iterator[str]:
    """The sentence, the other settings, grids, what does not apply."""
    from drillctl.studies.recommend.words import others

    yield units.told(result.sentence, system)
    yield from (units.told(text, system) for text in others(result))
    yield from (one.sentence for one in result.confirmed)
    names: dict[str, list[str]] = {}
    for name, why in result.left_out.items():
        names.setdefault(why, []).append(name)
    yield from (f"left out: {', '.join(some)}: {why}" for why, some in names.items())


def checks(result: Recommendation) -> Iterator[Check]:
    """What the recommended setting keeps."""
    for one in result.recommended.criteria:
        yield Check(one.question, one.kept, one.detail)


def notes(result: Recommendation) -> Iterator[str]:
    """A level that says nothing; where sticking is no matter of one limit."""
    yield from levels_any_run_keeps(result.design, [result.design.tables.tune.level])
    for one in result.candidates:
        for line, what in ((one.window.speed, "speeds"), (one.window.weight, "weights")):
            if line.islands() and not one.missed:
                yield f"{one.name}: {what} without sticking have gaps; the window ends at the first"


def files(result: Recommendation, folder: Path, system: units.System) -> None:
    """The design with the recommended setting, ready to run."""
    from drillctl.design import to_toml
    from drillctl.store.json_files import write_text

    head = f"# Setting recommended for {result.design.name!r} by drillctl.\n# {result.sentence}\n"
    write_text(folder / "recommended.toml", head + to_toml(result.recommended.design))


def check(design: Design) -> None:
    """Refuse numbers in the drive that no design has."""
    if design.tables.recommend.present:
        from drillctl.studies.recommend.candidates import present

        _ = present(design).top_drive


QUICK = {
    "tune.realizations": 300, "tune.starts": 1, "tune.certificate.realizations": 500,
}  # fmt: skip
"""Most draws and starts of a report that tunes nothing else."""


def for_report(request: Requested) -> Design:
    """The design with fewer draws, unless the report takes its time."""
    if request.profile.tuned:
        return request.design
    table = request.design.tables.tune
    given = (table.realizations, table.starts, table.certificate.realizations)
    most = zip(QUICK, given, QUICK.values(), strict=True)
    return request.design.replace({path: min(one, least) for path, one, least in most})


STUDY = Study(
    module=__name__,
    name="recommend",
    help="Recommend what to set in the drive, and what limits it",
    group="Decide",
    options=(
        Option("realizations", int, "Search at this many draws", sets="tune.realizations"),
        Option("seed", int, "Search with this seed", sets="tune.seed"),
        Option(
            "fresh", int, "Assess at this many fresh draws", sets="tune.certificate.realizations"
        ),
    ),
    python="recommend",
    recipes=(Recipe("recommend", "the recommendation", in_batch, for_report, order=5),),
    sections=(Section("recommend", "What to set", ("recommend",), order=-10),),
)
