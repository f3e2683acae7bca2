"""J1 over the map: figure with values and responses, regions, audit.

Regions by probability with intervals, the setting at its own draws, sensitivity.

Time responses at the current, the best and a bad setting.
"""

from __future__ import annotations

from drillctl import plots
from drillctl.reporting import cells
from drillctl.reporting.blocks import Block, Figure, InteractiveMap, Table, Text, block, figure
from drillctl.reporting.gather import Gathered, NotThereError, Study
from drillctl.reporting.sections.summary import regions_table
from drillctl.reporting.words import NOTHING, Words, chance, number
from drillctl.simulation.measures import MEASURES, Measure
from drillctl.studies.map import STUDY as MAP
from drillctl.studies.uncertainty import STUDY, indices


def build_map(gathered: Gathered) -> tuple[Block, ...]:
    """The map, its regions and the status of its cells."""
    study = gathered.need("map")
    result, words = study.summary, gathered.words
    blocks: list[Block] = []
    pictures = [figure(one, "map", words.system) for one in MAP.pictures(study.result)][:1]
    place = gathered.have("cells")
    for one in pictures:
        if place is None:
            blocks.append(one)
        else:
            blocks.append(
                InteractiveMap(one, lambda: cells.shown(place.folder, study.result, words))
            )
    if not pictures:
        count = len(result["axes"])
        blocks.append(Text(f"The map has {count} parameters: see the tables."))
    if table := regions_table(gathered):
        blocks.append(table)
    total = sum(result["statuses"].values())
    rows = tuple(
        (name.replace("_", " "), str(cells_), f"{100.0 * cells_ / total:.1f} %")
        for name, cells_ in result["statuses"].items()
    )
    blocks.append(Table("statuses", "Status at the end of the runs", ("status", "cells", "share"),
                        rows))  # fmt: skip
    return tuple(blocks)


def build_uncertainty(gathered: Gathered) -> tuple[Block, ...]:
    """Areas, figures, distributions, failures."""
    result, system = gathered.need("uncertainty").result, gathered.words.system
    blocks: list[Block] = [Text(remark) for remark in STUDY.remarks(result, system)]
    if (own := gathered.have("setting")) is not None:
        held = own.summary
        blocks.append(
            Text(
                f"At the current setting, with {held['realizations']} draws: P(J1 ≤ "
                f"{number(held['level'])} s) = {chance(held['probability'], held['interval_95'])}."
            )
        )
    blocks += [
        block(table, system)
        for table in STUDY.tables(result)
        if table.shown and table.name != "sensitivity"
    ]
    blocks += [
        figure(picture, "uncertainty", system)
        for picture in STUDY.pictures(result)
        if picture.name != "sensitivity"
    ]
    return tuple(blocks)


def build_sensitivity(gathered: Gathered) -> tuple[Block, ...]:
    """Indices with their errors."""
    study, system = gathered.need("uncertainty"), gathered.words.system
    if "sensitivity" not in study.summary:
        if gathered.requested.tables.uncertainty.sensitivity is None:
            raise NotThereError("the design requests no indices ([uncertainty.sensitivity])")
        raise NotThereError("indices are computed with --profile standard or full")
    *_, picture = STUDY.pictures(study.result)
    return figure(picture, "uncertainty", system), block(indices(study.result), system)


NAMES = {"simulate": "current", "best": "best of the map", "bad": "a bad cell"}
SHOWN = (
    "j1", "stuck_time", "sticks", "stick_slip_index", "settling_time", "peak_bit_speed",
    "peak_pipe_torque", "peak_top_torque", "mean_weight_on_bit", "rop_proxy", "work_per_turn",
)  # fmt: skip


def build_responses(gathered: Gathered) -> tuple[Block, ...]:
    """Runs in one figure, and their measures."""
    runs = {name: study for name in NAMES if (study := gathered.have(name)) is not None}
    if not runs:
        raise NotThereError(gathered.studies["simulate"].why)
    paths = list(study.summary["axes"]) if (study := gathered.have("map")) is not None else []
    heads = ["measure", *(NAMES[name] for name in runs)]
    rows = [["engine", *(study.summary["engine"] for study in runs.values())]]
    rows.append(["status", *(s.summary["status"].replace("_", " ") for s in runs.values())])
    words = gathered.words
    for one in (MEASURES[name] for name in SHOWN):
        rows.append([words.measure(one), *(_value(study, one, words) for study in runs.values())])
    rows += _places(gathered, runs)
    table = Table("responses", "Measures of the runs", tuple(heads), tuple(map(tuple, rows)))
    figure = Figure(
        "responses",
        "Speeds of bit and top drive at the current, the best and a bad setting, in this order; "
        "grey: bit at rest.",
        _alt(runs),
        lambda: plots.time_response([one.result for one in runs.values()], paths=paths),
        tuple(runs),
    )
    return figure, table


def _value(study: Study, one: Measure, words: Words) -> str:
    value = study.summary["measures"][one.name]
    return NOTHING if value is None else number(words.scaled(value, one.unit))


def _places(gathered: Gathered, runs: dict[str, Study]) -> list[list[str]]:
    """Axis values of the runs."""
    study = gathered.have("cells")
    if study is None:
        return []
    from drillctl.design import parameter

    best = study.summary["best"] or study.summary["bad"] or {}
    rows = []
    for path in best:
        own = parameter(gathered.design, path)
        row = [gathered.words.head(gathered.design, path)]
        for name in runs:
            at = own.value if name == "simulate" else study.summary[name][path]
            row.append(
                NOTHING if at is None else number(gathered.words.scaled(at, own.si_unit))
            )  # fmt: skip
        rows.append(row)
    return rows


def _alt(runs: dict[str, Study]) -> str:
    text = [
        f"{NAMES[name]}: {study.summary['status'].replace('_', ' ')}, "
        f"J1 {number(study.summary['measures']['j1'])} s"
        for name, study in runs.items()
    ]
    return f"Time responses of bit and top speed. {'; '.join(text)}."
