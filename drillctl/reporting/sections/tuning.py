"""Tuned gains with their certificate."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from drillctl import plots
from drillctl.design import parameter
from drillctl.reporting.blocks import Block, Check, Checks, Figure, Table, Text
from drillctl.reporting.gather import Gathered, Study
from drillctl.reporting.words import NOTHING, chance, number, percent

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

PICTURES = {
    "tune_baselines": ("Tuned gains and other gains at the same fresh draws.",
                       "J1 over the fresh draws at the tuned gains and at other gains."),
    "tune_neighbourhood": ("Probability around the tuned gains: their tolerance.",
                           "Map of P(J1 ≤ level) around the tuned gains."),
}  # fmt: skip
"""Caption and text alternative of the figures of `drillctl tune`."""


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Gains, objective, certificate, baselines, as far as saved."""
    study = gathered.need("tune")
    found = study.summary
    certificate = found.get("certificate") or {}
    blocks: list[Block] = []
    if found.get("message"):
        blocks.append(Text(str(found["message"]), "note" if certificate.get("passed") else "open"))
    blocks.append(_gains(gathered, found, certificate.get("tolerance") or {}))
    if certificate:
        blocks.append(_certificate(certificate))
    if found.get("baselines"):
        blocks.append(_baselines(gathered, found["baselines"]))
    blocks.append(_search(found))
    for name, (caption, alt) in PICTURES.items():
        draw = getattr(plots, name, None)
        if draw is not None:
            drawn = partial(_drawn, draw, study)
            blocks.append(
                Figure(name.replace("_", "-"), caption, alt, drawn, ("tune",), paper=True)
            )
    return tuple(blocks)


def _drawn(draw: Callable[[Any], Drawn], study: Study) -> Drawn:
    return draw(study.result)


def _gains(gathered: Gathered, found: dict[str, Any], tolerance: dict[str, Any]) -> Table:
    """Tuned values, and the tolerance of each."""
    words, rows = gathered.words, []
    for path, value in (found.get("gains") or {}).items():
        unit = parameter(gathered.design, path).si_unit
        span = NOTHING
        ends_of = tolerance.get(path)
        if isinstance(ends_of, dict) and {"low", "high"} <= set(ends_of):
            ends = (NOTHING if ends_of[end] is None else words.quantity(ends_of[end], unit)
                    for end in ("low", "high"))  # fmt: skip
            span = " to ".join(ends)
        rows.append((words.head(gathered.design, path), number(words.scaled(value, unit)), span))
    heads = ("parameter", "tuned", "tolerance, one at a time")
    return Table("tuned", "Tuned gains", heads, tuple(rows))


def _certificate(found: dict[str, Any]) -> Checks:
    required = found["required_probability"]
    detail = chance(found["probability"], found["interval_95"])
    question = (
        f"Is P(J1 ≤ {number(found['level'])} s) at least {percent(required)}, at fresh draws?"
    )
    check = Check(question, bool(found["passed"]), f"{detail}, {found['realizations']} draws")
    return Checks("certificate", "Certificate", (check,))


def _baselines(gathered: Gathered, found: dict[str, Any]) -> Table:
    rows = []
    for name, one in found.items():
        gains = one.get("gains")
        at = NOTHING
        if isinstance(gains, dict) and gains:
            at = ", ".join(_gain(gathered, path, value) for path, value in gains.items())
        if one.get("probability") is None:
            rows.append((name, at, str(one.get("reason") or NOTHING), NOTHING))
            continue
        share = chance(one["probability"], one["interval_95"])
        rows.append((name, at, share, number(one.get("value"))))
    heads = ("gains", "at", "P(J1 ≤ level), 95 % interval", "objective")
    return Table("baselines", "Other gains at the same fresh draws", heads, tuple(rows))


def _gain(gathered: Gathered, path: str, value: Any) -> str:
    if not isinstance(value, (int, float)):
        return f"{path} {value}"
    try:
        return gathered.words.named(gathered.design, path, value)
    except ValueError:  # of another law
        return f"{path} {number(value)}"


def _search(found: dict[str, Any]) -> Table:
    rows = []
    for name, key in (
        ("objective", "objective"), ("value over the draws of the search", "value"),
        ("draws", "realizations"), ("runs", "trajectories"), ("time (s)", "seconds"),
    ):  # fmt: skip
        if found.get(key) is not None:
            value = found[key]
            rows.append((name, value if isinstance(value, str) else number(value, 6)))
    return Table("search", "The search", ("quantity", "value"), tuple(rows))
