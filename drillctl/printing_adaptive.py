"""Adaptive maps as tables for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl import printing, units
from drillctl.console import line, sized, table

if TYPE_CHECKING:
    from drillctl.studies import AdaptiveMap
    from drillctl.studies.adaptive_checks import FullAudit, SelfCheck


def adaptive_map(result: AdaptiveMap, system: units.System) -> None:
    """Regions, minimum and audit as of a map; the checks, and how much was simulated."""
    printing.regions_of_map(result, system)
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
