"""Maps as tables: regions, minimum, audit, checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl import units
from drillctl.cli.console import line, sized, table
from drillctl.printing.words import place_of, span_of, title_of

if TYPE_CHECKING:
    from drillctl.studies import Sweep


def sweep(result: Sweep, system: units.System) -> None:
    """Regions, minimum, audit and time of a map."""
    scales = [units.displayed(1.0, axis.unit, system) for axis in result.axes]
    rows = [
        [
            f"J1 <= {level:g} s",
            str(region.cells),
            f"{region.area_fraction:.2%}",
            *(
                span_of(region.bounds.get(axis.path), factor)
                for axis, (factor, _) in zip(result.axes, scales, strict=True)
            ),
        ]
        for level, region in result.regions.items()
    ]
    heads = [
        f"{a.path} ({unit})" if unit else a.path
        for a, (_, unit) in zip(result.axes, scales, strict=True)
    ]
    table(title_of(result), ["region", "cells", "area", *heads], rows)
    if result.minimum is not None:
        value, at = result.minimum
        line(f"minimum J1 {value:.3f} s at {place_of(at, result.axes, system)}")
    audit = result.audit
    worst = f", worst relative difference in J1 {sized(audit.worst, 2)}" if len(audit.cells) else ""
    line(f"audit: {audit.verdict}, {len(audit.cells)} cells{worst}")
    line(
        f"{result.j1.size} cells: {result.seconds:.3f} s in the lanes, "
        f"{result.total_seconds:.1f} s in all"
    )
