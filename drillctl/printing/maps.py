"""Maps as tables: regions, minimum, audit, checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl import units
from drillctl.cli.console import line, sized, table
from drillctl.printing.words import place_of, span_of, title_of

if TYPE_CHECKING:
    from drillctl.studies import Regularisation, Sweep, ThreeRegions


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


def regions(result: ThreeRegions) -> None:
    """Cells of the three regions and of where they differ."""
    summary = result.summary()
    total = summary["cells"]
    rows = [
        [name.replace("_", " "), str(count), f"{count / total:.2%}"]
        for name, count in summary["counts"].items()
    ]
    table(f"{title_of(result)}: three regions of {total} cells", ["region", "cells", "share"], rows)
    line(
        f"J1 level {result.level:g} s; attracted: within {result.band:.0%} of the operating speed "
        f"throughout the last {result.window:g} s of {result.horizon:g} s"
    )


def regularisation(result: Regularisation) -> None:
    """What each width of the smoothing does to J1 and to the regions."""
    summary = result.summary()
    exact = summary["set_valued_cells"]
    levels = list(exact)
    rows = [["set-valued", "-", "-", *(str(exact[level]) for level in levels)]]
    for row in summary["widths"]:
        cells = [f"{row['cells'][x]} ({row['changed_side'][x]} changed)" for x in levels]
        shifts = [f"{row[name]:.2%}" for name in ("median_shift", "worst_shift")]
        rows.append([f"{row['width']:g} rad/s", *shifts, *cells])
    heads = ["friction", "median change of J1", "worst", *(f"J1 <= {x} s" for x in levels)]
    table(f"{title_of(result)}: friction smoothed by tanh, {result.j1.size} cells", heads, rows)
