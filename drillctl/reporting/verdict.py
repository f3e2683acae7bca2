"""Does the current setting pass? The questions that a report opens with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drillctl.reporting.blocks import Check
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import chance, number, percent

STATUS = {
    "ok": "settles",
    "sticking": "still sticks and slips at the end",
    "stalled": "stands still at the end",
    "not_settled": "turns without sticking, but has not settled at the end",
    "censored": "was stopped early",
    "failed": "gives no finite answer",
}
"""What a status says of the bit."""
PASSES, FAILS, OPEN = "passes", "does not pass", "is not decided"


@dataclass(frozen=True)
class Verdict:
    """What a report says of the current setting."""

    word: str  # `passes`, `does not pass` or `is not decided`
    checks: tuple[Check, ...]  # what it follows from


def verdict(gathered: Gathered) -> Verdict:
    """Judge the current setting from the studies that are there."""
    checks = (_stable(gathered), _keeps_level(gathered), _probable(gathered), _strong(gathered))
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
    found, words = study.summary, gathered.words
    margin = found["slope_margin"]
    told = "any slope" if margin is None and found["stable"] else words.quantity(
        margin, "N*m*s/rad"
    )  # fmt: skip
    detail = f"falling slope {words.quantity(found['slope'], 'N*m*s/rad')}, tolerated {told}"
    return Check("Is steady drilling stable to small disturbances?", bool(found["stable"]), detail)


def _keeps_level(gathered: Gathered) -> Check | None:
    study = gathered.have("simulate")
    if study is None:
        return None
    level = gathered.design.tables.tune.level
    j1, status = study.summary["measures"]["j1"], study.summary["status"]
    if j1 is None:
        return Check(_level_question(level), False, "the run gives no finite answer")
    keeps = j1 <= level and status not in ("sticking", "stalled", "failed")
    return Check(_level_question(level), keeps, f"J1 {number(j1)} s; the bit {STATUS[status]}")


def _level_question(level: float) -> str:
    return f"Does its run keep J1 at or under {number(level)} s, without sticking at the end?"


def _probable(gathered: Gathered) -> Check | None:
    study = gathered.have("setting")
    if study is None:
        return None
    found = study.summary
    asked = gathered.design.tables.tune.probability
    low, high = found["interval_95"]
    answer = True if low >= asked else False if high < asked else None
    question = f"Is P(J1 ≤ {number(found['level'])} s) at least {percent(asked)}?"
    detail = f"{chance(found['probability'], (low, high))}, {found['realizations']} draws"
    return Check(question, answer, detail)


def _strong(gathered: Gathered) -> Check | None:
    study = gathered.have("simulate")
    limit = gathered.design.string.yield_torque
    if study is None or limit == float("inf"):
        return None
    peak = study.summary["measures"]["peak_pipe_torque"]
    if peak is None:
        return None
    detail = f"peak {gathered.words.quantity(peak, 'N*m')}, {percent(peak / limit)} of yield"
    return Check("Does the pipe stay under its torsional yield?", peak < limit, detail)


def summary(found: Verdict) -> dict[str, Any]:
    """A verdict as strict JSON values."""
    return {
        "current_setting": found.word,
        "checks": [
            {"question": one.question, "answer": one.answer, "detail": one.detail}
            for one in found.checks
        ],
    }
