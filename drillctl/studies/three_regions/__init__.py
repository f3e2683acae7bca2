"""Locally stable, J1 under a level, attracted: three regions that are easily confused."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from drillctl import plots, units
from drillctl.errors import InputError
from drillctl.store.tables import Column, Table
from drillctl.studies.base import (
    Picture,
    Recipe,
    Requested,
    Run,
    Section,
    Study,
    in_batch,
    over_two_axes,
)

if TYPE_CHECKING:
    from drillctl.design import Design
    from drillctl.studies.three_regions.compute import ThreeRegions

MEANINGS = {
    "locally_stable": "locally stable: small disturbances of steady drilling die out",
    "inside_level": "J1 of the run at or under the level",
    "attracted": "attracted: drills steadily after a start from rest and after one wound up",
    "from_rest": "drills steadily after a start from rest",
    "from_wound_up": "drills steadily after a start wound up",
    "sticking_from_rest": "still sticks long after a start from rest",
    "sticking_from_wound_up": "still sticks long after a start wound up",
    "bistable": "locally stable, yet sticking long after a start",
    "undecided": "locally stable and not sticking, yet not settled at the end of the long run",
    "lingering": "not locally stable, yet within the band: it grows too slowly to show",
    "no_operating_point": "without steady drilling",
    "failed": "without a finite answer",
}
"""Regions by name, in the order in which they are reported."""


def computed(design: Design, run: Run) -> ThreeRegions:
    """The regions over the two axes of the map."""
    from drillctl.design import axis_tables
    from drillctl.studies.three_regions.compute import three_regions

    count = len(axis_tables(design))
    if count != 2:
        raise InputError(f"regions are shown over 2 parameters, got {count}", "map.axes")
    return three_regions(design, progress=run.progress)


def tables(result: ThreeRegions) -> Iterator[Table]:
    """Cells of each region."""
    counts, total = result.counts, result.j1.size
    columns = (
        Column("region"), Column("cells"), Column("share", percent=True, digits=3),
    )  # fmt: skip
    rows = [[MEANINGS[name], counts[name], counts[name] / total] for name in MEANINGS]
    yield Table("three-regions", f"regions of {total} cells", columns, rows)


def pictures(result: ThreeRegions) -> Iterator[Picture]:
    """The regions over each other."""
    counts = result.counts
    cells = ", ".join(f"{name.replace('_', ' ')} {counts[name]}" for name in list(MEANINGS)[:3])
    yield Picture(
        "three-regions",
        f"Locally stable, J1 at or under {result.level:g} s, attracted: three regions of one map.",
        f"Three regions over the map, of {result.j1.size} cells: {cells}.",
        lambda system: plots.three_regions(result, system=system),
        paper=True,
    )


def remarks(result: ThreeRegions, system: units.System) -> Iterator[str]:
    """What attraction means here."""
    yield (
        f"Attracted: within {100 * result.band:g} % of the operating speed throughout the last "
        f"{result.window:g} s of {result.horizon:g} s. Local stability is of the linear loop, J1 "
        "of one run over a finite time, attraction of long runs from far away: none of them "
        "implies another."
    )


def not_applicable(request: Requested) -> str:
    """Why a report has no regions."""
    return in_batch(request) or over_two_axes(request)


STUDY = Study(
    module=__name__,
    name="regions",
    help="Map local stability, J1 under a level and attraction",
    group="Analyse the loop",
    axes=True,
    python="three_regions",
    recipes=(Recipe("regions", "the three regions", not_applicable, order=85),),
    sections=(Section("regions", "Three regions", ("regions",), order=65),),
)
