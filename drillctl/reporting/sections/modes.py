"""Modes of the string and their shapes."""

from __future__ import annotations

from typing import Any

from drillctl import plots
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import NOTHING, number, percent

SUPPORTS = {"free_free": "top free", "fixed_top": "top held"}


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Frequencies with either end condition, and shapes."""
    study = gathered.need("modes")
    found = study.summary
    most = max(len(found[key]) for key in SUPPORTS)
    rows = []
    for order in range(most):
        row = [str(order + 1)]
        for key in SUPPORTS:
            row += _mode(found[key], order)
        rows.append(tuple(row))
    heads = ["mode"]
    for told in SUPPORTS.values():
        heads += [f"{told}: frequency (Hz)", f"{told}: damping"]
    first = next((m["frequency_hz"] for m in found["fixed_top"]), None)
    return (
        Table("modes", "Natural frequencies of the string", tuple(heads), tuple(rows)),
        Figure(
            "modes", "Angle and torque of the lowest modes along the string.",
            f"Shapes of the lowest modes with the top free and held; the first with the top held "
            f"is at {number(first)} Hz, its angle largest at the bit.",
            lambda: plots.mode_shapes(study.result, system=gathered.words.system), ("modes",),
        ),
        Text(
            "Stick-slip has the period of the lowest mode with the top held, or longer: a stiff "
            "drive makes the top a fixed end."
        ),
    )  # fmt: skip


def _mode(found: list[dict[str, Any]], order: int) -> list[str]:
    if order >= len(found):
        return [NOTHING, NOTHING]
    mode = found[order]
    ratio = mode["damping_ratio"]
    if mode.get("overdamped"):
        return [number(mode["frequency_hz"]), "overdamped"]
    if mode["frequency_hz"] == 0.0:
        return ["0 (rigid body)", NOTHING]
    return [number(mode["frequency_hz"]), percent(ratio)]
