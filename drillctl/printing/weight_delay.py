"""A weight law over its delay as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl import units
from drillctl.cli.console import line, sized, table
from drillctl.printing.words import title_of

if TYPE_CHECKING:
    from drillctl.ensemble.cases import Crossing, Share
    from drillctl.studies import WeightDelay
    from drillctl.studies.delay.compute import DelayedBenefit, GainLimits


def weight_delay(result: WeightDelay, system: units.System) -> None:
    """J1 and the end of stick-slip by gain and delay, and how much delay each gain bears."""
    force, unit = units.displayed(1.0, "N", system)
    names = [f"{gain * force:g} {unit} s/rad" for gain in result.gains]
    moving = [i for i, gain in enumerate(result.gains) if gain > 0.0]
    rows = [
        [f"{delay:g} s", *(_less_j1(result.benefits[i][k]) for i in moving)]
        for k, delay in enumerate(result.delays)
    ]
    heads = ["delay", *(names[i] for i in moving)]
    table(
        f"{title_of(result)}: J1 less that of a constant weight, mean (95 % interval), s",
        heads,
        rows,
    )
    rows = [
        [f"{delay:g} s", *(_share(result.benefits[i][k].ended) for i in moving)]
        for k, delay in enumerate(result.delays)
    ]
    table("stick-slip has ended, share of the draws (95 % interval)", heads, rows)
    longest = float(result.delays[-1])
    rows = [
        [names[i], *_ends(found), *_harm(found.harmful_from, longest)]
        for i, found in ((i, result.limits[i]) for i in moving)
    ]
    heads = ["gain", "stick-slip ends up to", "share there", "share at the next delay",
             "harmful from", "95 % interval"]  # fmt: skip
    table("delay that each gain bears", heads, rows)
    constant = result.baseline
    line(
        f"constant weight: J1 {sized(constant.j1.value, 4)} s, stick-slip ended in "
        f"{_share(constant.ended)} of the draws"
    )
    for failure in result.failures:
        line(
            f"{failure.count} of {result.realizations} draws failed; {failure.reason}: "
            f"{failure.example}"
        )
    line(f"{result.realizations} draws: {', '.join(result.drawn)}; seed {result.seed}")


def _less_j1(one: DelayedBenefit) -> str:
    if one.difference.value is None:
        return "-"
    if one.difference.interval is None:
        return f"{one.difference.value:+.1f}"
    low, high = one.difference.interval
    return f"{one.difference.value:+.1f} ({low:.1f} to {high:.1f})"


def _ends(found: GainLimits) -> list[str]:
    at, after = found.ends_at, found.ends_before
    shares = ["-" if one is None else _share(one.ended) for one in (at, after)]
    return ["at no delay" if at is None else f"{at.delay:g} s", *shares]


def _share(one: Share) -> str:
    low, high = (f"{100.0 * end:.1f}" for end in one.interval)
    return f"{one.value:.1%} ({low} to {high})"


def _harm(found: Crossing, longest: float) -> list[str]:
    """Where it turns harmful, and the interval; nothing is known beyond the longest delay."""
    beyond = f"beyond {longest:g} s"
    low, high = (beyond if end is None else f"{end:.2f} s" for end in found.interval)
    if found.interval == (None, None):
        return [beyond, "-"]
    return [beyond if found.at is None else f"{found.at:.2f} s", f"{low} to {high}"]
