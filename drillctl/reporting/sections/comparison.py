"""Cases at the same draws: distributions, paired differences, regions, responses."""

from __future__ import annotations

from typing import Any

from drillctl import plots
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import NOTHING, between, chance, number
from drillctl.simulation.measures import MEASURES

SHOWN = [
    MEASURES[name]
    for name in (
        "j1", "stuck_time", "peak_top_torque", "peak_pipe_torque", "mean_weight_after_start",
        "rop_proxy",
    )
]  # fmt: skip


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Means, shares, differences and figures."""
    study = gathered.need("compare")
    found, system = study.summary, gathered.words.system
    cases = found["cases"]
    first = next(iter(cases))
    blocks: list[Block] = [
        Text(
            f"{found['realizations']} draws, seed {found['seed']}, the same for every case; "
            f"differences are to the first case, {first}."
        ),
        _means(gathered, cases),
        _shares(cases),
        _differences(gathered, found["paired"]),
    ]
    of = ("compare",)

    def added(name: str, caption: str, alt: str, draw: Any, paper: bool = False) -> None:
        blocks.append(Figure(name, caption, alt, lambda: draw(study.result), of, paper))

    names = ", ".join(cases)
    added("compared-distributions", "Distribution of J1 over the draws, by case.",
          f"Distribution functions of J1 of {names}.", plots.j1_distributions)  # fmt: skip
    if len(cases) > 1:
        added("paired-differences", "Paired differences to the first case, with intervals.",
              f"Differences to {first} of every measure, in percent.",
              plots.paired_differences)  # fmt: skip
    added("compared-weight", "J1 against the mean weight on bit.",
          "J1 of each case against its mean weight on bit.",
          lambda result: plots.j1_against_weight(result, system=system))  # fmt: skip
    added("compared-responses", "Time responses of the cases at their nominal values.",
          f"Speeds of bit and top of {names}.",
          lambda result: plots.compared_responses(result, system=system))  # fmt: skip
    if any(case["regions"] and any(r["cells"] is not None for r in case["regions"].values())
           for case in cases.values()):  # fmt: skip
        added("compared-regions", "Regions of the cases.", f"Outlines of the regions of {names}.",
              lambda result: plots.compared_regions(result, system=system), True)  # fmt: skip
    return tuple(blocks)


def _means(gathered: Gathered, cases: dict[str, Any]) -> Table:
    words = gathered.words
    heads = ["case"]
    heads += [words.measure(one) for one in SHOWN]
    rows = []
    for name, case in cases.items():
        row = [name]
        for one in SHOWN:
            mean = case["measures"][one.name]["mean"]
            row.append(number(None if mean is None else words.scaled(mean, one.unit)))
        rows.append(tuple(row))
    return Table("cases", "Means over the draws", tuple(heads), tuple(rows))


def _shares(cases: dict[str, Any]) -> Table:
    levels = list(next(iter(cases.values()))["regions"])
    rows = tuple(
        (name, *(chance(case["regions"][x]["share"], case["regions"][x]["interval_95"])
                 for x in levels))
        for name, case in cases.items()
    )  # fmt: skip
    heads = ("case", *(f"P(J1 ≤ {x} s)" for x in levels))
    return Table("shares", "Share of the draws at or below each level (95 % interval)", heads, rows)


def _differences(gathered: Gathered, paired: dict[str, Any]) -> Table:
    words = gathered.words
    heads = ["case"]
    heads += [words.measure(one) for one in SHOWN]
    rows = []
    for name, measures in paired.items():
        row = [name]
        for one in SHOWN:
            difference = measures[one.name]
            if difference["difference"] is None:
                row.append(NOTHING)
                continue
            value = words.scaled(difference["difference"], one.unit)
            ends = difference["interval_95"]
            text = number(value, 3)
            if ends is not None:
                low, high = (words.scaled(end, one.unit) for end in ends)
                text += f" ({between(low, high, 3)})"
            row.append(text)
        rows.append(tuple(row))
    return Table("differences", "Mean paired difference to the first case (95 % interval)",
                 tuple(heads), tuple(rows))  # fmt: skip
