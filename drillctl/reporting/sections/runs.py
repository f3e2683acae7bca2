"""Time responses at the current, the best and a bad setting; accuracy of the numbers."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.design import parameter
from drillctl.provenance import provenance
from drillctl.reporting.blocks import Block, Checks, Figure, Table, Words
from drillctl.reporting.gather import Gathered, NotThereError, Study, opened
from drillctl.simulation.measures import AXIAL_MEASURES, MEASURES, Measure
from drillctl.store.tables import NOTHING, number, percent
from drillctl.studies.base import Check

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

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
    told = [study.summary["measures"] for study in runs.values()]
    axial = [name for name in AXIAL_MEASURES if any(one[name] is not None for one in told)]
    for one in (MEASURES[name] for name in (*SHOWN, *axial)):
        rows.append([words.measure(one), *(_value(study, one, words) for study in runs.values())])
    rows += _places(gathered, runs)
    table = Table("responses", "Measures of the runs", tuple(heads), tuple(map(tuple, rows)))
    figure = Figure(
        "runs",
        f"Speeds of bit and top drive: {_listed(runs)}; grey: bit at rest.",
        _alt(runs),
        partial(_drawn, [(one.folder, one.key) for one in runs.values()], paths, words.system),
        tuple(runs),
    )
    return figure, table


def _listed(runs: dict[str, Study]) -> str:
    """The runs that there are, in words."""
    *most, last = (NAMES[name] for name in runs)
    return f"{', '.join(most)} and {last}, in this order" if most else last


def _drawn(runs: list[tuple[Path, str]], paths: list[str], system: units.System) -> Drawn:
    return plots.time_response([opened(*one) for one in runs], paths=paths, system=system)


def _value(study: Study, one: Measure, words: Words) -> str:
    value = study.summary["measures"][one.name]
    return NOTHING if value is None else number(words.scaled(value, one.unit))


def _places(gathered: Gathered, runs: dict[str, Study]) -> list[list[str]]:
    """Axis values of the runs."""
    study = gathered.have("cells")
    if study is None:
        return []
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


CHECKED = (
    "simulate",
    "map",
    "uncertainty",
    "compare",
    "tune",
    "doctor",
)  # whose numbers are checked
DETAILS = ("energy", "scheme", "errors")  # their tables and pictures beside the checks


def build_audit(gathered: Gathered) -> tuple[Block, ...]:
    """Checks, convergence, errors, versions."""
    shown = [gathered.shown(name) for name in CHECKED]
    checks = (*(check for one in shown for check in one.checks), *mesh_check(gathered))
    details = [part for one in shown for name, part, _ in one.parts if name in DETAILS]
    return (
        Checks("audit", "Checks of the numbers of this report", checks),
        *_convergence(gathered), *details, _versions(gathered),
    )  # fmt: skip


def mesh_check(gathered: Gathered) -> Iterator[Check]:
    """Whether finer meshes leave J1 within the tolerance that an audit has for it."""
    done = [one for parts in (1, 2, 4) if (one := gathered.have(f"mesh-{parts}")) is not None]
    j1 = [one.summary["measures"]["j1"] for one in done]
    if len(j1) < 3 or not all(j1):
        return
    twice, four_times = (finer / j1[0] - 1.0 for finer in j1[1:])
    tolerance = MEASURES["j1"].tolerance
    answer = max(abs(twice), abs(four_times)) <= tolerance
    detail = (
        f"J1 moves by {percent(twice, 2)} with twice and by {percent(four_times, 2)} with four "
        f"times as many; allowed: {percent(tolerance)}"
    )
    if not answer:
        detail += "; give more elements, or the string its damping"
    yield Check("Do the elements suffice?", answer, detail)


def _convergence(gathered: Gathered) -> tuple[Table, ...]:
    base = gathered.have("mesh-1")
    if base is None:
        return ()
    rows = []
    reference = gathered.have("simulate")
    if reference is not None and reference.summary["engine"] == "reference":
        rows.append(_row("reference solver", reference.summary, base.summary))
    rows.append(_row("batch engine, as used", base.summary, base.summary))
    for name, text in (
        ("step-2", "half the step"), ("step-4", "a quarter of the step"),
        ("mesh-2", "twice the elements"), ("mesh-4", "four times the elements"),
    ):  # fmt: skip
        study = gathered.have(name)
        if study is not None:
            rows.append(_row(f"batch engine, {text}", study.summary, base.summary))
    caption = "Convergence of the run at the current setting with step and mesh"
    heads = ("run", "step (ms)", "modes", "J1 (s)", "difference from the run as used")
    return (Table("convergence-of-this-run", caption, heads, tuple(rows)),)


def _row(text: str, result: dict[str, Any], base: dict[str, Any]) -> tuple[str, ...]:
    j1, own = result["measures"]["j1"], base["measures"]["j1"]
    apart = NOTHING if not own or j1 is None or result is base else percent(j1 / own - 1.0, 2)
    step = NOTHING if result["step"] is None else number(1e3 * result["step"])
    modes = NOTHING if result["modes"] is None else str(result["modes"])
    return text, step, modes, number(j1, 7), apart


def _versions(gathered: Gathered) -> Table:
    table = gathered.design.tables.uncertainty
    rows = [*provenance().items(), ("seed of the draws", str(table.seed))]
    rows.append(("profile", f"{gathered.profile.name}: {gathered.profile.meaning}"))
    return Table("versions", "Versions, machine and seed", ("item", "value"),
                 tuple(rows))  # fmt: skip
