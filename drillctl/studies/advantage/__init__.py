"""PI against PI with a weight on bit that follows the bit speed, each at its robust optimum.

- `cases.py`: policies, what of them is tuned, and their optima on equal terms, at fresh draws.
- `compute.py`: areas over the gains of the drive, front and map over weights and speeds, delays of
  the path; all of it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.simulation.measures import MEASURES
from drillctl.store.tables import Column, Estimate, Table
from drillctl.studies.base import Picture, Recipe, Requested, Section, Study, in_batch

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.advantage.compute import Advantage, Chart


def tables(result: Advantage) -> Iterator[Table]:
    """Cases with paired differences, shares, areas, front, map and delays."""
    yield _cases(result)
    yield _shares(result)
    yield _areas(result)
    yield _chart("front", "objective and mean weight by nominal weight", result.front)
    yield _chart("map", "advantage over weights and speeds", result.chart, shown=False)
    yield _delays(result)


def _gains(hidden: bool = False) -> list[Column]:
    return [
        Column("kp", "Kp", "N*m*s/rad", hidden=hidden),
        Column("ki", "Ki", "N*m/rad", hidden=hidden),
        Column("gain", "K_w", "N*s/rad", hidden=hidden),
    ]  # fmt: skip


def _cases(result: Advantage) -> Table:
    columns = [
        Column("case"), *_gains(), Column("shift", "nominal weight shifted by", "N", 3),
        Column("objective", result.objective, "s", interval=True),
        Column("objective_difference", "less constant weight", "s", signed=True, interval=True),
    ]  # fmt: skip
    for name in result.baseline.measures:
        measure, hidden = MEASURES[name], name not in ("mean_weight_after_start", "rop_proxy")
        head = f"mean {measure.label} less constant weight"
        columns.append(Column(name, f"mean {measure.label}", measure.unit, hidden=hidden))
        columns.append(
            Column(f"{name}_difference", head, measure.unit, signed=True, interval=True,
                   hidden=name != "j1")
        )  # fmt: skip
    rows = []
    for case in result.cases:
        first = case is result.baseline
        row: list[Any] = [case.name, *case.gains.values(), case.shift, case.objective,
               None if first else case.objective_less]  # fmt: skip
        for name in case.measures:
            apart = None if first else case.difference(result.baseline, name, result.seed)
            row += [case.mean(name), apart]
        rows.append(row)
    title = f"{result.objective} of each policy at its robust optimum (95 % intervals)"
    return Table("cases", title, tuple(columns), rows)


def _shares(result: Advantage) -> Table:
    columns = (
        Column("case"), Column("level", "J1 at or under", "s"),
        Column("share", "share of the draws", percent=True, digits=3, interval=True),
        Column("difference", "less constant weight", percent=True, digits=3, signed=True,
               interval=True),
    )  # fmt: skip
    rows = [
        [case.name, level, case.share(level).estimate,
         case.share_difference(result.baseline, level, result.seed)]
        for case in result.cases
        for level in result.levels
    ]  # fmt: skip
    return Table("shares", "fresh draws at or under each level (95 % intervals)", columns, rows)


def _areas(result: Advantage) -> Table:
    columns = (
        Column("policy"), Column("gain", "K_w", "N*s/rad"), Column("level", "J1 at or under", "s"),
        Column("nominal", "without draws", percent=True, digits=3),
        Column("area_p95", "probability 95 % or more", percent=True, digits=3, interval=True),
        Column("area_p05", "probability 5 % or more", percent=True, digits=3, interval=True),
    )  # fmt: skip
    rows = [
        [one.policy, one.gain, level, one.nominal_area(level),
         *(Estimate(area.value, area.interval) for area in areas.values())]
        for one in result.regions
        for level, areas in one.areas.items()
    ]  # fmt: skip
    title = "share of the window of Kp and Ki, K_w at its optimum (95 % intervals)"
    return Table("areas", title, columns, rows)


def _chart(name: str, title: str, chart: Chart, shown: bool = True) -> Table:
    columns = (
        Column("policy"), Column("weight", "nominal WOB", "N"), Column("speed", "speed", "rad/s"),
        *_gains(hidden=True), Column("mean_weight", "mean WOB", "N"),
        Column("rop_proxy", hidden=True), Column("tuned_value", unit="s", hidden=True),
        Column("objective", "robust J1", "s", interval=True),
        Column("advantage", "advantage", "s", signed=True, interval=True),
    )  # fmt: skip
    plain = ("kp", "ki", "gain", "mean_weight", "rop_proxy", "tuned_value")
    rows: list[list[Any]] = []
    places = itertools.product(chart.policies, chart.weights.tolist(), chart.speeds.tolist())
    for place, *figures in zip(places, *(x.flat for x in chart.figures.values()), strict=True):
        at = dict(zip(chart.figures, map(float, figures), strict=True))
        ends = [
            Estimate(at[key], (at[f"{key}_low"], at[f"{key}_high"]))
            for key in ("objective", "advantage")
        ]
        rows.append([*place, *(at[x] for x in plain), *ends])
    return Table(name, title, columns, rows, shown)


def _delays(result: Advantage) -> Table:
    columns = (
        Column("gains"), Column("delay", "delay", "s"), *_gains(),
        Column("objective", "robust J1", "s"),
        Column("advantage", "advantage", "s", signed=True, interval=True),
    )  # fmt: skip
    rows = []
    for name, line in (("ideal path", result.delay.kept), ("tuned anew", result.delay.anew)):
        figures = zip(line.delays, line.gains, line.objective, line.advantage, line.low, line.high,
                      strict=True)  # fmt: skip
        for delay, gains, objective, advantage, *ends in figures:
            saved = Estimate(float(advantage), (float(ends[0]), float(ends[1])))
            rows.append([name, *map(float, (delay, *gains, objective)), saved])
    title = "advantage of the real path against its delay (95 % intervals)"
    return Table("delays", title, columns, rows)


def pictures(result: Advantage) -> Iterator[Picture]:
    """Cases, front, map and delays."""
    yield Picture(
        "cases", "J1 of each policy at its robust optimum, over the fresh draws.",
        "Spread of J1 of each policy on each of the terms.",
        lambda system: plots.advantage_cases(result),
    )  # fmt: skip
    yield Picture(
        "front", "Robust J1 against the mean weight on bit.",
        f"{result.objective} of each policy against its mean weight, over nominal weights.",
        lambda system: plots.advantage_front(result, system=system),
    )  # fmt: skip
    yield Picture(
        "map", "J1 that a weight which follows the bit speed saves, over weights and speeds.",
        "Maps of the robust J1 of the constant weight less that of the weight that follows.",
        lambda system: plots.advantage_map(result, system=system),
    )  # fmt: skip
    yield Picture(
        "delays", "J1 saved against the delay of the path.",
        "Advantage over the delay, with gains of the ideal path and gains tuned at each delay.",
        lambda system: plots.advantage_delay(result),
    )  # fmt: skip


def remarks(result: Advantage, system: units.System) -> Iterator[str]:
    """What was compared, where the advantage ends, and what limits the answer."""
    from drillctl.ensemble.draws import EQUAL_TO

    table, tune = result.design.tables.advantage, result.design.tables.tune
    yield (
        "Constant weight with PI, and PI with a weight that follows the bit speed, each tuned to "
        f"the {result.objective} at {tune.realizations} draws, seed {tune.seed}, and measured at "
        f"the same {table.realizations} fresh draws, seed {result.seed}."
    )
    for k, policy in enumerate(result.chart.policies[1:], start=1):
        values, sure = result.chart.figures["advantage"][k], result.chart.significant(k)
        yield (
            f"{policy}: advantage of {values.min():.1f} to {values.max():.1f} s over weights and "
            f"speeds; in {(~sure).sum()} of {sure.size} cells its interval includes zero."
        )
    curve, longest = result.delay, float(result.delay.delays[-1])
    kept, anew = (
        one.words(f"{longest:g} s") for one in (curve.kept.zero, curve.anew.material)
    )  # fmt: skip
    yield f"Gains of the ideal path: no advantage from {kept}."
    yield (
        f"Gains tuned anew: under {table.material:.1%} of the constant weight's objective from "
        f"{anew}."
    )
    first = curve.anew.indistinct_from
    where = f"at no delay up to {longest:g} s" if first is None else f"from {first:g} s on the grid"
    yield f"Gains tuned anew: interval not above zero {where}."
    for case in result.cases:
        if case.at_bounds:
            yield f"{case.name}: {', '.join(case.at_bounds)} on a bound of the search."
    for case in result.cases:
        if abs(case.off) > EQUAL_TO:
            yield f"{case.name}: not equal, off by {case.off:.1%} at the nearest nominal weight."


def notes(result: Advantage) -> Iterator[str]:
    """What of the design the study does not take."""
    from drillctl.studies.advantage.cases import SET

    law = result.design.tables.controller.law
    if law != "pi":
        yield f"the law of the drive is {law}: a PI is compared in its place"
    for path in SET:
        if path in result.design.tables.uncertain:
            yield f"{path} is set by the study, and not drawn"


def check(design: Design) -> None:
    """Refuse what the study would refuse in the midst of its work."""
    if "advantage" in design.tree:
        from drillctl.studies.advantage.cases import policies
        from drillctl.studies.advantage.compute import checked

        checked(policies(design))


def not_applicable(request: Requested) -> str:
    """Why a report has no such comparison."""
    if not request.profile.compared:
        return "dynamic weight on bit is compared with --profile full"
    if "advantage" not in request.design.tree:
        return "the design has no [advantage] table"
    return in_batch(request)


STUDY = Study(
    module=__name__,
    name="advantage",
    help="Tune PI with constant and with following weight; compare",
    group="Decide",
    python="advantage",
    resumes=True,
    recipes=(
        Recipe("advantage", "the advantage of dynamic weight on bit", not_applicable, order=120),
    ),
    sections=(
        Section("advantage", "Advantage of dynamic weight on bit", ("advantage",), order=110),
    ),
)
