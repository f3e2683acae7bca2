"""What a weight that follows the bit speed is worth, each at its own robust optimum."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from drillctl import plots
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered, Study
from drillctl.reporting.words import NOTHING, between, chance, name_of, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

    from drillctl import units

PICTURES = {
    "advantage_cases": (
        "J1 of each case at the fresh draws, and what it is less than at a constant weight.",
        "Distributions of J1 and paired differences of every case.",
    ),
    "advantage_front": (
        "Objective against the mean weight on bit.",
        "Curves of the objective over the mean weight for each policy.",
    ),
    "advantage_map": (
        "Advantage over weights and set speeds.",
        "Maps of the advantage over weight on bit and set speed.",
    ),
    "advantage_delay": (
        "Advantage against the delay of the path of the weight.",
        "Curves of the advantage against delay, with intervals, gains kept and tuned anew.",
    ),
}
"""Caption and text of the pictures of `drillctl advantage`."""
LINES = {"kept": "gains kept", "anew": "gains tuned anew at each delay"}


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Cases, shares, the delay that ends it, pictures."""
    study = gathered.need("advantage")
    found = study.summary
    blocks: list[Block] = [
        Text(
            f"PI with a constant weight on bit and with one that follows the bit speed, each tuned "
            f"to the same objective ({found['objective']} of J1) and measured at "
            f"{found['realizations']} fresh draws, seed {found['seed']}. A negative difference: "
            "less than with a constant weight."
        ),
        _cases(gathered, found["cases"]),
        _shares(found["cases"]),
        _delays(found["delay"]),
    ]
    for name, (caption, alt) in PICTURES.items():
        drawn = partial(_drawn, getattr(plots, name), study, gathered.words.system)
        paper = name == "advantage_map"
        blocks.append(Figure(name.replace("_", "-"), caption, alt, drawn, ("advantage",), paper))
    return tuple(blocks)


def _drawn(draw: Callable[..., Drawn], study: Study, system: units.System) -> Drawn:
    return draw(study.result, system=system)


def _cases(gathered: Gathered, cases: dict[str, Any]) -> Table:
    words, rows = gathered.words, []
    for name, case in cases.items():
        rows.append((
            name, *(_gain(gathered, path, value) for path, value in case["gains"].items()),
            _estimate(case["objective"]), _estimate(case["objective_difference"]),
            words.quantity(case["means"]["mean_weight_after_start"], "N"),
            number(case["means"]["rop_proxy"]),
        ))  # fmt: skip
    paths = next(iter(cases.values()))["gains"]
    heads = (
        "case", *("gain of the weight" if path.startswith("weight") else name_of(path)
                  for path in paths),
        "objective (s)", "difference (s)", "mean weight", "ROP proxy",
    )  # fmt: skip
    caption = "Cases at their own optimum (95 % interval)"
    return Table("advantage", caption, heads, tuple(rows))


def _gain(gathered: Gathered, path: str, value: float) -> str:
    if path.startswith("weight_on_bit."):  # per speed: a force by rad/s
        force = gathered.words.quantity(value, "N")
        return NOTHING if value == 0.0 else f"{force} s/rad"
    return gathered.words.named(gathered.design, path, value).partition(" ")[2]


def _estimate(found: dict[str, Any]) -> str:
    if found["value"] is None:
        return NOTHING
    if found["interval_95"] is None:
        return number(found["value"])
    return f"{number(found['value'])} ({between(*found['interval_95'])})"


def _shares(cases: dict[str, Any]) -> Table:
    levels = list(next(iter(cases.values()))["levels"])
    rows = tuple(
        (name, *(chance(case["levels"][x]["share"], case["levels"][x]["interval_95"])
                 for x in levels))
        for name, case in cases.items()
    )  # fmt: skip
    heads = ("case", *(f"P(J1 ≤ {level} s)" for level in levels))
    caption = "Share of the fresh draws at or under each level (95 % interval)"
    return Table("advantage-shares", caption, heads, rows)


def _delays(found: dict[str, Any]) -> Table:
    rows = tuple(
        (told, _crossing(found[key]["zero"]), _crossing(found[key]["material"]))
        for key, told in LINES.items()
    )
    heads = ("gains", "no advantage from (s)", "less than the stated share from (s)")
    caption = "Delay of the path at which the advantage ends (95 % interval)"
    return Table("advantage-delays", caption, heads, rows)


def _crossing(found: dict[str, Any]) -> str:
    if found["delay"] is None:
        return NOTHING
    low, high = found["interval_95"]
    return f"{number(found['delay'], 3)} ({between(low, high, 3)})"
