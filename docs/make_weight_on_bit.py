"""Write the tables and the pictures of `weight-on-bit.md`.

python docs/make_weight_on_bit.py
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import drillctl
from drillctl import plots
from drillctl.ensemble.cases import Crossing
from drillctl.studies import WeightDelay, weight_delay
from drillctl.studies.delay.compute import DelayedBenefit

PAGE = Path(__file__).with_name("weight-on-bit.md")
DESIGN = "dynamic-wob-delay-140kn"


@dataclass(frozen=True)
class Case:
    """Gains of the drive, and the name of picture and table."""

    name: str
    kp: float
    ki: float


CASES = (Case("sticking", 200.0, 100.0), Case("smooth", 625.0, 125.0))
SHOWN = (0.0, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Delays of the table of differences (s)."""


def main() -> None:
    """Fill the page beside this file and draw its pictures."""
    text = PAGE.read_text(encoding="utf-8")
    for case in CASES:
        values = {"controller.kp": case.kp, "controller.ki": case.ki}
        design = drillctl.load(DESIGN, **values)
        title = f"{design.tables.title}, Kp {case.kp:g}, Ki {case.ki:g}"
        result = weight_delay(design.replace({"title": title}))
        picture = PAGE.with_name(f"weight-delay-{case.name}.png")
        plots.weight_delay(result).savefig(picture, dpi=110)
        text = filled(text, case.name, (*differences(result), "", *limits(result)))
    PAGE.write_text(text, encoding="utf-8")


def filled(text: str, name: str, lines: Sequence[str]) -> str:
    """The page with the tables of one case in their place."""
    begin = f"<!-- {name}: begin, made by make_weight_on_bit.py -->"
    end = f"<!-- {name}: end -->"
    before, rest = text.split(begin)
    return "\n".join([f"{before}{begin}", "", *lines, "", f"{end}{rest.split(end)[1]}"])


def differences(result: WeightDelay) -> list[str]:
    """J1 less that of the constant weight, by gain and delay."""
    delays = [k for k, delay in enumerate(result.delays) if float(delay) in SHOWN]
    head = [f"{result.delays[k]:g} s" for k in delays]
    rows = [
        [f"{gain / 1e3:g}", *(_difference(row[k]) for k in delays)]
        for gain, row in zip(result.gains, result.benefits, strict=True)
        if gain > 0.0
    ]
    return _table(["K_w (kN s/rad)", *head], rows)


def limits(result: WeightDelay) -> list[str]:
    """How much delay each gain bears."""
    rows = [
        [
            f"{found.gain / 1e3:g}",
            "at no delay" if found.ends_at is None else f"{found.ends_at.delay:g} s",
            _share(found.ends_at),
            _share(found.ends_before),
            *_harm(found.harmful_from, float(result.delays[-1])),
        ]
        for found in result.limits
        if found.gain > 0.0
    ]
    heads = ["K_w (kN s/rad)", "stick-slip ends up to", "share of draws there",
             "share at the next delay", "harmful from", "95 % interval"]  # fmt: skip
    return _table(heads, rows)


def _difference(one: DelayedBenefit) -> str:
    low, high = one.difference.ends
    return f"{one.difference.value:+.1f} ({low:.1f} to {high:.1f})"


def _share(one: DelayedBenefit | None) -> str:
    if one is None:
        return "-"
    low, high = (100.0 * end for end in one.ended.interval)
    return f"{100.0 * one.ended.value:.1f} % ({low:.1f} to {high:.1f}) at {one.delay:g} s"


def _harm(found: Crossing, longest: float) -> list[str]:
    low, high = found.interval
    if found.at is None:
        return [f"beyond {longest:g} s", "-"]
    ends = (f"beyond {longest:g}" if end is None else f"{end:.2f}" for end in (low, high))
    return [f"{found.at:.2f} s", " to ".join(ends)]


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [heads, ["---"] * len(heads), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


if __name__ == "__main__":
    main()
