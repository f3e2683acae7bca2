"""Step and modes of the batch engine, its errors and its speed, for one design."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.store.tables import Column, Table, Told, number, place
from drillctl.studies.base import Check, Option, Picture, Recipe, Run, Study

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.doctor.compute import Doctor

MODES = {
    "turn": "higher modes turn too far in a step; their static share of the torque is kept",
    "all": "every mode of the string",
    "fewest": "never fewer",
    "given": "simulation.modes",
}
VERDICTS = {
    "ok": "ok: errors of this design are within what '{accuracy}' promises over the paper's map",
    "check": "check: the reference solver differs by more than the estimate",
    "not_reached": "accuracy not reached: errors of this design exceed what '{accuracy}' promises "
    "over the paper's map",
    "refused": "refused",
}


def computed(design: Design, run: Run) -> Doctor:
    """The examination with the requested audit."""
    from drillctl.studies.doctor.compute import doctor

    return doctor(design, run.options["audit"], progress=run.progress)


def tables(result: Doctor) -> Iterator[Table]:
    """Scheme and reasons, errors, audited lanes, speed."""
    summary = result.summary()
    if summary["scheme"] is None:
        return
    yield _scheme(summary["scheme"])
    yield _errors(result, summary["estimate"])
    if summary["audit"]["lanes"]:
        yield _audited(result, summary["audit"])
    speed = summary["speed"]
    rows = [
        ["lanes per second", f"{speed['lanes_per_second']:,.0f} on {speed['threads']} threads"],
        ["a step of a lane", f"{speed['lane_step_ns']:.2f} ns of a core"],
    ]
    columns = (Column("quantity"), Column("value"))
    yield Table("speed", "speed on this machine, kernel warm", columns, rows)


def _scheme(scheme: dict[str, Any]) -> Table:
    from drillctl.studies.doctor.compute import FORMS

    why = f"{scheme['decided_by'].replace('_', ' ')}, and whole steps to the run"
    if scheme["decided_by"] == "sampling":
        why = f"{scheme['sampling']} to a period of the sampled controller"
    if scheme["decided_by"] == "program":
        why = "whole steps to the changes of the program"
    rows = [["step", f"{1e3 * scheme['step']:.4g} ms", why]]
    for name, step in sorted(scheme["bounds"].items(), key=lambda bound: bound[1]):
        reason = Told(scheme["reasons"][name])
        rows.append([f"bound: {name.replace('_', ' ')}", f"{1e3 * step:.4g} ms", reason])
    left = f", {scheme['modes_left_out']} left out" if scheme["modes_left_out"] else ""
    rows.append(["modes", f"{scheme['modes']}{left}", MODES[scheme["modes_by"]]])
    turn = f"turns {math.degrees(scheme['turn']):.2g}° in a step"
    rows.append(["highest mode", f"{scheme['highest_frequency_hz']:.3g} Hz", turn])
    strings = scheme["strings"]
    several = "" if strings == 1 else f"the shortest step of {strings} strings"
    rows.append(["string", FORMS[scheme["string"]], several])
    columns = (Column("setting"), Column("chosen"), Column("reason"))
    return Table("scheme", f"batch engine at accuracy {scheme['accuracy']}", columns, rows)


def _errors(result: Doctor, estimate: dict[str, Any]) -> Table:
    promised = estimate["promised"]
    rows = [
        ["median", estimate["median"], promised["median"]],
        ["90th percentile", estimate["p90"], None],
        ["99th percentile", estimate["p99"], promised["p99"]],
        ["largest", estimate["worst"], None],
    ]
    failed = f", {estimate['failed']} failed" if estimate["failed"] else ""
    order = "" if estimate["order"] is None else f"; observed order {estimate['order']:.2f}"
    title = f"relative error of J1, estimated from {estimate['lanes']} lanes{failed}{order}"
    columns = (
        Column("percentile"), Column("estimated", digits=2),
        Column("promised", f"'{result.accuracy}' over the paper's map", digits=2),
    )  # fmt: skip
    return Table("errors", title, columns, rows)


def _audited(result: Doctor, audit: dict[str, Any]) -> Table:
    from drillctl.design import parameter

    paths = {path for lane in audit["lanes"] for path in lane["at"]}
    unit_of = {path: parameter(result.design, path).si_unit for path in paths}
    rows = [
        [
            place(lane["at"], unit_of), lane["j1"], lane["reference_j1"],
            lane["relative_difference"], lane["estimated_error"],
        ]
        for lane in audit["lanes"]
    ]  # fmt: skip
    columns = (
        Column("lane"), Column("j1", "J1", "s", 6),
        Column("reference_j1", "reference solver", "s", 6),
        Column("difference", digits=2), Column("estimated", digits=2),
    )  # fmt: skip
    late = "" if audit["cells"] == audit["asked"] else " (the others would have taken too long)"
    title = f"audit of {audit['cells']} of {audit['asked']} lanes{late}"
    return Table("audited", title, columns, rows)


def pictures(result: Doctor) -> Iterator[Picture]:
    """Estimated errors against J1."""
    if len(result.cells):
        yield Picture(
            "errors", "Estimated relative error of J1 over a sample of the map.",
            "Estimated errors of a sample of the map's cells against their J1.",
            lambda system: plots.error_estimate(result),
        )  # fmt: skip


def remarks(result: Doctor, system: units.System) -> Iterator[str]:
    """Verdict and advice."""
    if result.refused is not None:
        yield f"{result.refused}; use {result.advice}"
        return
    yield f"one run (drillctl simulate) uses the {result.engine} engine"
    yield VERDICTS[result.verdict].format(accuracy=result.accuracy)
    if result.advice is not None:
        yield f"advice: {result.advice}"


def checks(result: Doctor) -> Iterator[Check]:
    """Whether the accuracy is reached."""
    if result.refused is None:
        known = result.summary()["estimate"]
        detail = (
            f"median {number(known['median'], 2)}, 99th percentile {number(known['p99'], 2)} over "
            f"{known['lanes'] - known['failed']} cells"
        )
        better = f"; better: {result.advice}" if result.advice else ""
        reached = result.verdict in ("ok", "check")
        yield Check(f"Is the accuracy {result.accuracy!r} reached?", reached, detail + better)


STUDY = Study(
    module=__name__,
    name="doctor",
    help="Explain step, modes, errors and speed of the engine",
    group="Describe a rig",
    options=(
        Option("audit", int, "Audit this many lanes with the reference solver", default=4, least=0),
    ),
    axes=True,
    python="doctor",
    recipes=(Recipe("doctor", "the errors of the batch engine", options={"audit": 0}, order=130),),
)
