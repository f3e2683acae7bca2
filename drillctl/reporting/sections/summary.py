"""The first section: the verdict on the current setting, best settings, regions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from drillctl import units
from drillctl.ensemble.probability import called
from drillctl.reporting.blocks import Block, Check, Checks, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.store.tables import NOTHING, between, chance, number, percent
from drillctl.studies.recommend.candidates import NAMES, gains_of
from drillctl.studies.recommend.words import numbers_of

STATUS = {
    "ok": "settles",
    "sticking": "still sticks and slips at the end",
    "stalled": "is at rest at the end",
    "not_settled": "turns without sticking, but has not settled at the end",
    "censored": "was stopped early",
    "failed": "gives no finite result",
}
"""The motion of the bit by status."""
MARGINS = ("slope_reserve", "peak_sensitivity", "delay", "time_at_limit")
"""Criteria of `[recommend]` that are asked beside stability, J1 and its probability."""
PASSES, FAILS, OPEN = "passes", "does not pass", "is undecided"


@dataclass(frozen=True)
class Verdict:
    """The verdict on the current setting."""

    word: str  # PASSES, FAILS or OPEN
    checks: tuple[Check, ...]  # from which it follows


def verdict(gathered: Gathered) -> Verdict:
    """Decide the verdict from the finished studies."""
    checks = (
        _stable(gathered), _keeps_level(gathered), _probable(gathered), _margins(gathered),
        _strong(gathered),
    )  # fmt: skip
    known = tuple(check for check in checks if check is not None)
    answers = [check.answer for check in known]
    if False in answers:
        word = FAILS
    elif None in answers or _keeps_level(gathered) is None:
        word = OPEN
    else:
        word = PASSES
    return Verdict(word, known)


def _stable(gathered: Gathered) -> Check | None:
    study = gathered.have("loop")
    if study is None:
        return None
    result, words = study.summary, gathered.words
    margin = result["slope_margin"]
    slope = words.quantity(result["slope"], "N*m*s/rad")
    if margin is None:
        tolerated = "any slope is tolerated" if result["stable"] else "unstable even without it"
    else:
        tolerated = f"tolerated {words.quantity(margin, 'N*m*s/rad')}"
    detail = f"falling slope {slope}, {tolerated}"
    return Check("Is steady drilling stable to small disturbances?", bool(result["stable"]), detail)


def _keeps_level(gathered: Gathered) -> Check | None:
    study = gathered.have("simulate")
    if study is None:
        return None
    level = gathered.design.tables.tune.level
    j1, status = study.summary["measures"]["j1"], study.summary["status"]
    if j1 is None:
        return Check(_level_question(level), False, "the run gives no finite result")
    keeps = j1 <= level and status not in ("sticking", "stalled", "failed")
    return Check(_level_question(level), keeps, f"J1 {number(j1)} s; the bit {STATUS[status]}")


def _level_question(level: float) -> str:
    return f"Does the run have J1 ≤ {number(level)} s, without sticking at the end?"


def _probable(gathered: Gathered) -> Check | None:
    study = gathered.have("setting")
    if study is None:
        return None
    result = study.summary
    required = gathered.design.tables.tune.probability
    low, high = result["interval_95"]
    answer = True if low >= required else False if high < required else None
    question = f"Is P(J1 ≤ {number(result['level'])} s) at least {percent(required)}?"
    detail = f"{chance(result['probability'], (low, high))}, {result['realizations']} draws"
    return Check(question, answer, detail)


def _margins(gathered: Gathered) -> Check | None:
    """Whether the loop of the current setting keeps what `[recommend]` asks of its margins."""
    study = gathered.have("recommend")
    if study is None or gathered.design.tables.recommend.present:
        return None
    criteria = next(iter(study.summary["candidates"].values()))["criteria"]
    asked = [one for one in criteria if one["name"] in MARGINS]
    missed = [one["said"] for one in asked if not one["kept"]]
    detail = units.told("; ".join(missed), gathered.words.system) or "it keeps all of them"
    return Check("Does the loop keep its margins?", not missed, detail)


def _strong(gathered: Gathered) -> Check | None:
    study = gathered.have("simulate")
    if study is None or not study.summary.get("yield"):
        return None
    name, worst = max(study.summary["yield"].items(), key=lambda one: one[1]["share"])
    peak, share = worst["peak_torque"], worst["share"]
    if not math.isfinite(peak):
        return None
    detail = f"peak {gathered.words.quantity(peak, 'N*m')}, {percent(share)} of yield, in {name}"
    return Check(
        "Is the peak torque below the torsional yield of each section?", share < 1.0, detail
    )


def summary(result: Verdict) -> dict[str, Any]:
    """A verdict as strict JSON values."""
    return {
        "current_setting": result.word,
        "checks": [
            {"question": one.question, "answer": one.answer, "detail": one.detail}
            for one in result.checks
        ],
    }


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Verdict, best settings and regions, as far as available."""
    result = verdict(gathered)
    blocks: list[Block] = [Text(_sentence(gathered, result.word), _kind(result.word))]
    if result.checks:
        caption = "Checks of the current setting: all must be yes to pass"
        blocks.append(Checks("verdict", caption, result.checks))
    blocks += [
        Text(f"Warning: {one.said(gathered.words.system)}.", "warning")
        for one in gathered.design.warnings
    ]
    if best := _best(gathered):
        blocks.append(best)
    blocks += [part for name, part, _ in gathered.shown("map").parts if name == "regions"]
    if gathered.design.tables.status:
        blocks.append(Text(f"Status of the rig: {gathered.design.tables.status}.", "note"))
    return tuple(blocks)


def _kind(word: str) -> Literal["note", "open", "warning"]:
    kinds: dict[str, Literal["note", "open", "warning"]] = {PASSES: "note", FAILS: "warning"}
    return kinds.get(word, "open")


def setting(gathered: Gathered) -> str:
    """The current setting as text: drive with its numbers, weight, speed."""
    design, words = gathered.design, gathered.words
    law, point = design.tables.controller.law, design.tables.operating_point
    numbers = units.told(numbers_of(design, gains_of(design)), words.system)
    drive = f"{NAMES.get(law, law)}, {numbers}"
    return (
        f"{drive}, {words.quantity(point.weight_on_bit, 'N')} on bit, "
        f"{words.quantity(point.speed, 'rad/s')}"
    )


def _sentence(gathered: Gathered, word: str) -> str:
    """The verdict as text."""
    held = f"the current setting ({setting(gathered)})"
    if word == OPEN:
        text = f"Whether {held} passes is undecided: see the open check below."
    else:
        text = f"{held[0].upper()}{held[1:]} {word}."
    study = gathered.have("simulate")
    if study is not None and study.summary["measures"]["j1"] is not None:
        measures = study.summary["measures"]
        text += f" The bit {STATUS[study.summary['status']]}; J1 is {number(measures['j1'])} s"
        text += f" over {number(gathered.design.tables.simulation.duration)} s."
    return text


def _best(gathered: Gathered) -> Table | None:
    """Best settings by several measures."""
    rows: list[tuple[str, ...]] = []
    study = gathered.have("map")
    if study is not None and study.summary["minimum"] is not None:
        minimum = study.summary["minimum"]
        place = gathered.words.place(gathered.design, minimum["at"])
        rows.append(("least nominal J1", place, f"{number(minimum['j1'])} s", NOTHING))
    study = gathered.have("uncertainty")
    if study is not None:
        for name, best in study.summary["best"].items():
            if best["at"] is not None:
                rows.append(_best_of_draws(gathered, name, best))
    study = gathered.have("tune")
    if study is not None and study.summary.get("gains"):
        result = study.summary
        place = gathered.words.place(gathered.design, result["gains"])
        rows.append(("tuned", place, f"{number(result.get('value'))} s", NOTHING))
    if not rows:
        return None
    heads = ("best by", "at", "value", "95 % interval")
    return Table("best", "Best settings", heads, tuple(rows))


def _best_of_draws(gathered: Gathered, name: str, best: dict[str, Any]) -> tuple[str, ...]:
    place = gathered.words.place(gathered.design, best["at"])
    value, (low, high) = best["value"], best["interval_95"]
    if name.startswith("probability_"):
        ends = f"{between(100.0 * low, 100.0 * high, 3)} %"
        return called(name), place, percent(value), ends
    # Runs stopped early leave the upper end of the interval open.
    ends = f"at least {number(low)} s" if high is None else f"{between(low, high)} s"
    return called(name), place, f"{number(value)} s", ends
