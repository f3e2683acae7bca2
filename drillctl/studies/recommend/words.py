"""The recommendation in words, and numbers as a drive has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.design import Design, parameter
from drillctl.design.paths import SI_OF, USUAL_NAMES
from drillctl.store.tables import percent
from drillctl.studies.recommend.assess import FAILS, FRAGILE, Assessed
from drillctl.studies.recommend.candidates import NAMES, PRESENT
from drillctl.studies.recommend.criteria import Criterion, drive_of
from drillctl.studies.recommend.deeper import depth_of

if TYPE_CHECKING:
    from drillctl.studies.recommend.compute import Recommendation


def numbers_of(design: Design, gains: Mapping[str, float]) -> str:
    """The numbers of a drive, in full."""

    def unit(path: str) -> str:  # gains that a law has of the string are no keys of its design
        return SI_OF.get(path.rpartition(".")[2]) or parameter(design, path).si_unit

    return ", ".join(
        f"{USUAL_NAMES.get(path, path)} {units.full(value, unit(path), 5)}"
        for path, value in gains.items()
    )


def rated(design: Design) -> tuple[float | None, float | None]:
    """Rated torque (N m) and speed (rad/s) that per-unit numbers are of; None where unknown."""
    asked, drive = design.tables.recommend, drive_of(design)
    torque = asked.rated_torque or drive.continuous_torque or drive.torque_limit
    speed = asked.rated_speed or drive.maximum_speed or design.speed
    return torque, speed


def in_drive_units(one: Assessed) -> dict[str, Any]:
    """The controller's numbers in SI, in field units and per unit of rated torque and speed."""
    torque, speed = rated(one.design)
    results: dict[str, Any] = {"rated_torque": torque, "rated_speed": speed}
    for name, value in one.controller.items():
        shown, unit = units.displayed(value, SI_OF[name], "field")
        results[name] = {SI_OF[name]: value, unit.replace(" ", "*"): float(shown)}
        if torque and speed and name in ("kp", "ki"):
            results[name]["per unit" if name == "kp" else "per unit, 1/s"] = value * speed / torque
    kp, ki = one.controller["kp"], one.controller["ki"]
    results["integral_time"] = kp / ki if ki > 0.0 else None
    return results


def limits_of(one: Assessed) -> tuple[str, ...]:
    """What limits a setting: what it misses, else what it comes nearest to."""
    missed = tuple(criterion.said for criterion in one.missed)
    return missed or (min(one.criteria, key=lambda criterion: criterion.room).limiting,)


def sentence(result: Recommendation) -> str:
    """What to set, what limits it, what would help next."""
    best = result.recommended
    numbers = numbers_of(best.design, best.gains)
    kept = best.name == PRESENT
    level, share = best.design.tables.tune.level, percent(best.probability)
    kept_at = f"J1 is at or under {level:g} s with a probability of {share}"
    helps = "; ".join(result.helps)
    if best.verdict == FAILS:
        apart = _told_apart(best.missed)
        worst = max(apart, key=lambda one: one.miss)
        by = "far" if worst.miss >= 1.0 else f"{100 * worst.miss:.0f} %"
        missed = f"misses by {by}: {worst.said}"
        others = [one.said for one in apart if one is not worst]
        also = f"; also {'; '.join(others)}" if others else ""
        return (
            f"No setting passes; the least bad is {best.name} ({numbers}), which {missed}{also}. "
            f"{helps[:1].upper()}{helps[1:]}."
        )
    what = f"Keep what is in the drive: {numbers}" if kept else f"Set {numbers} ({best.name})"
    verdict = "It passes"
    if best.verdict == FRAGILE:
        verdict = f"It passes, but is fragile: {'; '.join(best.fragile)}"
    room = f" {helps[:1].upper()}{helps[1:]}." if helps else ""
    limit = "; ".join(limits_of(best))
    deeper = f" {_deeper(result)}" if result.until else ""
    return f"{what}. {verdict}. {kept_at}. What limits it is {limit}.{room}{deeper}"


def _told_apart(missed: Sequence[Criterion]) -> list[Criterion]:
    """What is missed, without what follows from a loop that is unstable."""
    follows = ("slope_reserve", "delay") if missed[0].name == "stable" else ()
    return [one for one in missed if one.name not in follows]


def _deeper(result: Recommendation) -> str:
    """Until which depth a setting that passes may stay."""
    assert result.until is not None
    last, fails = (None if x is None else units.full(x, "m", 5) for x in result.until)
    if fails is None:
        return f"With pipe added at the top it still passes at {last}, the deepest that was tried."
    if result.until[0] == depth_of(result.recommended.design):
        return f"With pipe added at the top it no longer passes at {fails}."
    return f"With pipe added at the top it passes down to {last}, and no longer at {fails}."


def others(result: Recommendation) -> list[str]:
    """Of every other setting what speaks against it, in a line."""
    best, texts = result.recommended, []
    for one in result.candidates:
        if one is best:
            continue
        name = f"{one.name} ({NAMES.get(one.law, one.law)})" if one.name == PRESENT else one.name
        if one.missed:
            first = one.missed[0]
            left = len(one.missed) - 1
            criteria = "criterion" if left == 1 else "criteria"
            more = f"; it misses {left} other {criteria}" if left else ""
            stable = "stable, but " if first.name != "stable" and best.verdict == FAILS else ""
            texts.append(f"{name}: {stable}{first.said}{more}")
        else:
            words = f", but fragile: {'; '.join(one.fragile)}" if one.fragile else ""
            objective = one.design.tables.tune.objective_said
            compared = f"{objective} {one.objective:.3g} s, {best.objective:.3g} s recommended"
            texts.append(f"{name}: passes too{words}; {compared}")
    return texts
