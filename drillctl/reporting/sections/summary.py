"""The first page: what was found, and whether the current setting passes."""

from __future__ import annotations

from typing import Any, Literal

from drillctl.design import parameter
from drillctl.reporting.blocks import Block, Checks, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.verdict import FAILS, OPEN, PASSES, STATUS, verdict
from drillctl.reporting.words import NOTHING, between, number, percent


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Verdict, best settings and regions, as far as they are there."""
    found = verdict(gathered)
    blocks: list[Block] = [Text(_sentence(gathered, found.word), _kind(found.word))]
    if found.checks:
        caption = "Does the current setting pass? Every answer must be yes."
        blocks.append(Checks("verdict", caption, found.checks))
    if best := _best(gathered):
        blocks.append(best)
    if regions := regions_table(gathered):
        blocks.append(regions)
    if gathered.design.tables.status:
        blocks.append(Text(f"Status of the rig: {gathered.design.tables.status}.", "note"))
    return tuple(blocks)


def _kind(word: str) -> Literal["note", "open", "warning"]:
    kinds: dict[str, Literal["note", "open", "warning"]] = {PASSES: "note", FAILS: "warning"}
    return kinds.get(word, "open")


def setting(gathered: Gathered) -> str:
    """The current setting in words: drive with its numbers, weight, speed."""
    design, words = gathered.design, gathered.words
    table = design.tables.controller
    numbers = [
        words.named(design, path, getattr(table, name))
        for name, path in (("kp", "controller.kp"), ("ki", "controller.ki"))
        if getattr(table, name, None) is not None
    ]
    drive = ", ".join([table.law, *numbers])
    point = design.tables.operating_point
    return (
        f"{drive}, {words.quantity(point.weight_on_bit, 'N')} on bit, "
        f"{words.quantity(point.speed, 'rad/s')}"
    )


def _sentence(gathered: Gathered, word: str) -> str:
    """The verdict in a sentence or two."""
    held = f"the current setting ({setting(gathered)})"
    if word == OPEN:
        text = f"Whether {held} passes is not decided: see the open question below."
    else:
        text = f"{held[0].upper()}{held[1:]} {word}."
    study = gathered.have("simulate")
    if study is not None and study.summary["measures"]["j1"] is not None:
        measures = study.summary["measures"]
        text += f" Its bit {STATUS[study.summary['status']]}; J1 is {number(measures['j1'])} s"
        text += f" over {number(gathered.design.tables.simulation.duration)} s."
    return text


def _best(gathered: Gathered) -> Table | None:
    """Best settings by several measures."""
    rows: list[tuple[str, ...]] = []
    study = gathered.have("map")
    if study is not None and study.summary["minimum"] is not None:
        minimum = study.summary["minimum"]
        place = gathered.words.place(gathered.design, minimum["at"])
        rows.append(("least J1, nothing uncertain", place, f"{number(minimum['j1'])} s", NOTHING))
    study = gathered.have("uncertainty")
    if study is not None:
        for name, told in study.summary["best"].items():
            if told["at"] is not None:
                rows.append(_best_of_draws(gathered, name, told))
    study = gathered.have("tune")
    if study is not None and study.summary.get("gains"):
        found = study.summary
        place = gathered.words.place(gathered.design, found["gains"])
        rows.append(("tuned", place, f"{number(found.get('value'))} s", NOTHING))
    if not rows:
        return None
    heads = ("best by", "at", "value", "95 % interval")
    return Table("best", "Best settings", heads, tuple(rows))


MEANINGS = {
    "mean": "least mean of J1",
    "q95": "least 95 % quantile of J1",
    "cvar95": "least mean of the worst 5 % of J1",
}


def _best_of_draws(gathered: Gathered, name: str, told: dict[str, Any]) -> tuple[str, ...]:
    place = gathered.words.place(gathered.design, told["at"])
    value, (low, high) = told["value"], told["interval_95"]
    if name.startswith("probability_"):
        level = name.removeprefix("probability_")
        ends = f"{between(100.0 * low, 100.0 * high, 3)} %"
        return f"largest P(J1 ≤ {level} s)", place, percent(value), ends
    # Runs that were stopped early leave an interval open above.
    ends = f"at least {number(low)} s" if high is None else f"{between(low, high)} s"
    return MEANINGS.get(name, name), place, f"{number(value)} s", ends


def regions_table(gathered: Gathered) -> Table | None:
    """Bounds of the regions of the map."""
    study = gathered.have("map")
    if study is None:
        return None
    design, words = gathered.design, gathered.words
    paths = list(study.summary["axes"])
    rows = []
    for level, one in study.summary["regions"].items():
        spans = []
        for path in paths:
            bounds = one["bounds"].get(path)
            unit = parameter(design, path).si_unit
            if bounds is None:
                spans.append(NOTHING)
                continue
            low, high = (words.scaled(bound, unit) for bound in bounds)
            spans.append(between(low, high))
        rows.append(
            (f"J1 ≤ {level} s", str(one["cells"]), percent(one["area_fraction"]), *spans)
        )  # fmt: skip
    heads = ("region", "cells", "share of the map", *(words.head(design, path) for path in paths))
    caption = "Regions of the map: bounds between the centres of their outermost cells"
    return Table("regions", caption, heads, tuple(rows))
