"""Accuracy of the numbers of this report; the design in full."""

from __future__ import annotations

from typing import Any

from drillctl import plots
from drillctl.design import to_toml
from drillctl.provenance import provenance
from drillctl.reporting.blocks import Block, Check, Checks, Code, Figure, Table
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import NOTHING, number, percent

BALANCED = 1e-6  # largest relative residual of a balanced run


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Checks, convergence, errors, versions, design."""
    blocks: list[Block] = [
        Checks("audit", "Checks of the numbers of this report", tuple(_checks(gathered)))
    ]
    for table in (_energy(gathered), _convergence(gathered), _engine(gathered)):
        if table is not None:
            blocks.append(table)
    study = gathered.have("doctor")
    if study is not None and study.summary["estimate"]["lanes"]:
        blocks.append(
            Figure(
                "errors", "Estimated relative error of J1 over a sample of the map.",
                "Estimated errors of a sample of cells against their J1.",
                lambda: plots.error_estimate(study.result), ("doctor",),
            )
        )  # fmt: skip
    blocks += [_versions(gathered), Code("The design in full", to_toml(gathered.requested))]
    return tuple(blocks)


def _checks(gathered: Gathered) -> list[Check]:
    checks = []
    run = gathered.have("simulate")
    if run is not None and run.summary["energy"] is not None:
        residual = run.summary["energy"]["relative_residual"]
        text = f"relative residual {number(residual, 2)}"
        checks.append(Check("Does the energy of the run balance?", residual < BALANCED, text))
    for name, what, cells in (("map", "the map", "cells"), ("uncertainty", "the draws", "lanes")):
        study = gathered.have(name)
        if study is not None and study.summary["audit"]["cells"]:
            audit = study.summary["audit"]
            worst = audit["worst_relative_difference"]
            text = f"{audit['cells']} {cells}, worst relative difference in J1 {number(worst, 2)}"
            question = f"Does the reference solver agree with {what}?"
            checks.append(Check(question, audit["verdict"] == "ok", text))
    doctor = gathered.have("doctor")
    if doctor is not None and doctor.summary["refused"] is None:
        result = doctor.summary
        text = f"median {number(result['estimate']['median'], 2)}, "
        text += f"99th percentile {number(result['estimate']['p99'], 2)} over "
        text += f"{result['estimate']['lanes']} cells"
        if result["advice"]:
            text += f"; better: {result['advice']}"
        accuracy = gathered.design.tables.simulation.accuracy
        question = f"Is the accuracy {accuracy!r} reached?"
        checks.append(Check(question, result["verdict"] in ("ok", "check"), text))
    return checks


def _energy(gathered: Gathered) -> Table | None:
    study = gathered.have("simulate")
    if study is None or study.summary["energy"] is None:
        return None
    energy = study.summary["energy"]
    rows = tuple(
        (name, number(energy[key] / 1e3, 6))
        for name, key in (("work of the drive", "drive"), ("work on the rock", "bit"),
                          ("dissipated by damping", "damping"),
                          ("change of stored energy", "stored"))
    )  # fmt: skip
    return Table("energy", "Energy of the reference run at the current setting",
                 ("term", "energy (kJ)"), rows)  # fmt: skip


def _convergence(gathered: Gathered) -> Table | None:
    base = gathered.have("mesh-1")
    if base is None:
        return None
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
    return Table("convergence-of-this-run", caption, heads, tuple(rows))


def _row(text: str, result: dict[str, Any], base: dict[str, Any]) -> tuple[str, ...]:
    j1, own = result["measures"]["j1"], base["measures"]["j1"]
    apart = NOTHING if not own or j1 is None or result is base else percent(j1 / own - 1.0, 2)
    step = NOTHING if result["step"] is None else number(1e3 * result["step"])
    modes = NOTHING if result["modes"] is None else str(result["modes"])
    return text, step, modes, number(j1, 7), apart


def _engine(gathered: Gathered) -> Table | None:
    study = gathered.have("doctor")
    if study is None or study.summary["scheme"] is None:
        return None
    result = study.summary
    rows = [
        ("step", f"{number(1e3 * result['scheme']['step'])} ms"),
        ("modes", str(result["scheme"]["modes"])),
        ("median of the estimated errors", number(result["estimate"]["median"], 2)),
        ("99th percentile", number(result["estimate"]["p99"], 2)),
        ("observed order", number(result["estimate"]["order"], 2)),
    ]
    return Table("engine", "The batch engine over the map (errors of J1, relative)",
                 ("quantity", "value"), tuple(rows))  # fmt: skip


def _versions(gathered: Gathered) -> Table:
    table = gathered.design.tables.uncertainty
    rows = [*provenance().items(), ("seed of the draws", str(table.seed))]
    rows.append(("profile", f"{gathered.profile.name}: {gathered.profile.meaning}"))
    return Table("versions", "Versions, machine and seed", ("item", "value"),
                 tuple(rows))  # fmt: skip
