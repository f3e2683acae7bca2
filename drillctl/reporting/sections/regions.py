"""Three regions that are easily taken for each other."""

from __future__ import annotations

from drillctl import plots
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import number, percent

MEANINGS = {
    "locally_stable": "locally stable: small disturbances of steady drilling die out",
    "inside_level": "J1 of the run at or under the level",
    "attracted": "attracted: drills steadily after a start from rest and after one wound up",
    "from_rest": "drills steadily after a start from rest",
    "from_wound_up": "drills steadily after a start wound up",
    "bistable": "locally stable, yet sticking long after a start",
    "undecided": "locally stable and not sticking, yet not settled at the end of the long run",
    "lingering": "not locally stable, yet within the band: it grows too slowly to show",
    "no_operating_point": "without steady drilling",
    "failed": "without a finite answer",
}


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Picture and cells of each region."""
    study = gathered.need("regions")
    found = study.summary
    total = found["cells"]
    rows = tuple(
        (meaning, str(found["counts"][name]), percent(found["counts"][name] / total))
        for name, meaning in MEANINGS.items()
    )
    told = ", ".join(f"{MEANINGS[name].partition(':')[0]} {found['counts'][name]}" for name in
                     ("locally_stable", "inside_level", "attracted"))  # fmt: skip
    return (
        Figure(
            "three-regions",
            f"Locally stable, J1 at or under {number(found['level'])} s, attracted: three regions "
            "of the same map.",
            f"Three regions over the map, of {total} cells: {told}.",
            lambda: plots.three_regions(study.result, system=gathered.words.system),
            ("regions",), True,
        ),
        Table("three-regions", "Cells of the regions", ("region", "cells", "share"), rows),
        Text(
            f"Attracted: within {percent(found['band'])} of the operating speed throughout the "
            f"last {number(found['window'])} s of {number(found['horizon'])} s. Local stability "
            "is of the linear loop, J1 of one run over a finite time, attraction of long runs "
            "from far away: none of them implies another."
        ),
    )  # fmt: skip
