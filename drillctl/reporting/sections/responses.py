"""Time responses at the current, the best and a bad setting."""

from __future__ import annotations

from drillctl import plots
from drillctl.reporting.blocks import Block, Figure, Table
from drillctl.reporting.gather import Gathered, NotThereError, Study
from drillctl.reporting.words import NOTHING, Words, number
from drillctl.simulation.measures import MEASURES, Measure

NAMES = {"simulate": "current", "best": "best of the map", "bad": "a bad cell"}
SHOWN = (
    "j1", "stuck_time", "sticks", "stick_slip_index", "settling_time", "peak_bit_speed",
    "peak_pipe_torque", "peak_top_torque", "mean_weight_on_bit", "rop_proxy", "work_per_turn",
)  # fmt: skip


def build(gathered: Gathered) -> tuple[Block, ...]:
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
