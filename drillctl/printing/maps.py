"""Maps as tables: regions, minimum, audit, checks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl import units
from drillctl.console import line, sized, table
from drillctl.printing.words import place_of, span_of, title_of

if TYPE_CHECKING:
    from drillctl.studies import AdaptiveMap, Regularisation, Sweep, ThreeRegions
    from drillctl.studies.adaptive.checks import FullAudit, SelfCheck


def sweep(result: Sweep, system: units.System) -> None:
    """Regions, minimum, audit and time of a map."""
    regions_of_map(result, system)
    line(
        f"{result.j1.size} cells: {result.seconds:.3f} s in the lanes, "
        f"{result.total_seconds:.1f} s in all"
    )


def regions_of_map(result: Sweep | AdaptiveMap, system: units.System) -> None:
    """Regions, minimum and audit of a map."""
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


def adaptive_map(result: AdaptiveMap, system: units.System) -> None:
    """Regions, minimum and audit as of a map; the checks, and how much was simulated."""
    regions_of_map(result, system)
    _self_check(result.self_check)
    if result.full_audit is not None:
        _full_audit(result.full_audit)
    line(
        f"{result.trajectories} of {result.bands.size} cells simulated ({result.share:.2%}): "
        f"{result.seconds:.3f} s in the lanes, {result.total_seconds:.1f} s in all"
    )


def _self_check(check: SelfCheck) -> None:
    if check.interval is None:
        line("self-check: none")
        return
    low, high = check.interval
    mended = f"; {check.followed} more simulated to mend it" if len(check.mismatches) else ""
    line(
        f"self-check: {check.verdict}, {len(check.mismatches)} of {len(check.cells)} cells left "
        f"out are in another band (95 % interval {low:.1%} to {high:.1%}){mended}"
    )


def _full_audit(audit: FullAudit) -> None:
    rows = [
        [
            f"J1 <= {level:g} s",
            str(one.cells),
            f"{one.area_fraction:.2%}",
            sized(one.farthest, 3),
            sized(one.hausdorff, 3),
            "yes" if one.to_one_cell else "no",
        ]
        for level, one in audit.mismatches.items()
    ]
    heads = [
        "region", "cells that differ", "area", "farthest from the edge (cells)",
        "outlines apart (cells)", "same to one cell",
    ]  # fmt: skip
    table(f"beside the full grid, {audit.trajectories} more cells: {audit.verdict}", heads, rows)


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
