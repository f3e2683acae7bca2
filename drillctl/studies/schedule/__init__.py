"""Gains over the depth of the well, for the drive stand by stand.

`strings.py`: the design at other depths; `compute.py`: `schedule`; `settings.py`: `[schedule]`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from drillctl import plots, units
from drillctl.store.tables import Column, Estimate, Table, Told, percent
from drillctl.studies.base import (
    Check,
    Option,
    Picture,
    Recipe,
    Requested,
    Section,
    Study,
    in_batch,
)

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.schedule.compute import Schedule


def tables(result: Schedule) -> Iterator[Table]:
    """Depths, changes, stands."""
    from drillctl.design import parameter

    where = Column("depth" if result.path == "depth" else result.path, unit=result.unit)
    paths = list(result.rows[0].gains)
    unit_of = {path: parameter(_like(result), path).si_unit for path in paths}
    gains = [Column(path, path.removeprefix("controller."), unit_of[path]) for path in paths]
    share = result.design.tables.schedule.kept_from
    rows = [
        [
            one.depth, one.period, *one.gains.values(), one.reflection, one.stale_reflection,
            one.j1, Estimate(one.probability, one.interval), one.stale_probability,
            one.lowest_speed, one.highest_weight, *one.stale_gains.values(),
        ]
        for one in result.rows
    ]  # fmt: skip
    columns = (
        where, Column("period", unit="s"), *gains, Column("reflection", digits=3),
        Column("stale_reflection", f"reflection, gains of {share:g} of it", digits=3),
        Column("j1", "median J1", "s", 3),
        Column("probability", "probability of the level", percent=True, digits=3, interval=True),
        Column(
            "stale_probability", f"probability, gains of {share:g} of it", percent=True, digits=3
        ),
        Column("lowest_speed", "no sticking from", "rad/s", 3),
        Column("highest_weight_on_bit", "up to WOB", "N", 3),
        *(Column(f"stale {path}", unit=unit_of[path], hidden=True) for path in paths),
    )  # fmt: skip
    yield Table(
        "schedule",
        f"in tune, and with gains of {share:g} of the {where.name} ({result.law})",
        columns,
        rows,
    )
    changes = [[one.depth, one.before, Told(one.reason)] for one in result.changes]
    heads = (
        Column("at", f"change at {where.name}", result.unit),
        Column("before", "gains until there of", result.unit), Column("reason"),
    )  # fmt: skip
    yield Table("changes", "where gains must be changed", heads, changes, shown=bool(changes))
    values = [result.stands.tolist(), *(one.tolist() for one in result.stand_gains.values())]
    yield Table(
        "stands", "gains stand by stand", (where, *gains), list(zip(*values, strict=True)),
        shown=False,
    )  # fmt: skip


def _like(result: Schedule) -> Design:
    """A design that has the gains of the schedule."""
    from drillctl.studies.schedule.strings import Along

    return Along(result.design).by_rule(result.rows[-1].depth)


def pictures(result: Schedule) -> Iterator[Picture]:
    """Gains, reflection, probability and window over the depth."""
    yield Picture(
        "schedule", "Gains over the depth, in tune and kept from an earlier one.",
        f"Gains, reflection, probability of the level and window over the {result.path}.",
        lambda system: plots.schedule(result, system=system),
    )  # fmt: skip


def remarks(result: Schedule, system: units.System) -> Iterator[str]:
    """Whether a schedule is needed, and where gains must change."""
    yield units.told(result.sentence, system)
    if result.short:
        level, required = result.design.tables.tune.level, result.design.tables.tune.probability
        said = (
            f"P(J1 <= {level:g} s) is under {percent(required)} even in tune at "
            f"{_places(result)}: there a schedule is not enough"
        )
        yield units.told(said, system)


def _places(result: Schedule) -> str:
    return ", ".join(units.full(one.depth, result.unit, 5) for one in result.short)


def checks(result: Schedule) -> Iterator[Check]:
    """Whether the level is kept at every depth."""
    detail = f"not at {_places(result)}" if result.short else "at all"
    question = "Is J1 kept with the required probability at each depth?"
    yield Check(question, not result.short, detail)


def check(design: Design) -> None:
    """Refuse depths that the string cannot have; defaults need not fit every string."""
    table = design.tables.schedule
    if table != type(table)():
        from drillctl.studies.schedule.strings import Along

        along = Along(design)
        for value in along.values()[[0, -1]]:
            along.at(float(value))


def not_applicable(request: Requested) -> str:
    """Why a report has no schedule."""
    if not request.profile.tuned and "schedule" not in request.design.tree:
        return "gains are scheduled with --profile full, or where the design has [schedule]"
    return in_batch(request)


STUDY = Study(
    module=__name__,
    name="schedule",
    help="Schedule the gains of the drive over depth",
    group="Decide",
    options=(
        Option(
            "depth", str, "Schedule over these lengths of the string", sets="schedule.values",
            metavar="FIRST:LAST:POINTS",
        ),
        Option("along", str, "Schedule over this path instead", sets="schedule.along"),
        Option("law", str, "Schedule the gains of this law", sets="schedule.law"),
    ),
    python="schedule",
    recipes=(Recipe("schedule", "the schedule over depth", not_applicable, order=112),),
    sections=(Section("schedule", "Gains over depth", ("schedule",), order=95),),
)  # fmt: skip
