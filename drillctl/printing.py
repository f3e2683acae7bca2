"""Results as tables for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.console import line, sized, table

if TYPE_CHECKING:
    from drillctl.simulation import Simulation
    from drillctl.studies import Axis, Sweep

_MEASURES = {
    "j1": "s", "stuck_time": "s", "sticks": "", "stick_slip_index": "",
    "mean_bit_speed": "rad/s", "min_bit_speed": "rad/s", "peak_bit_speed": "rad/s",
    "peak_pipe_torque": "N*m", "peak_top_torque": "N*m", "settling_time": "s",
    "settling_time_wide": "s", "mean_weight_on_bit": "N", "rop_proxy": "",
    "work_per_turn": "J",
}  # fmt: skip


def modes(summary: dict[str, Any]) -> None:
    """Frequencies and damping ratios, one table a boundary condition."""
    for name, title in (("free_free", "both ends free"), ("fixed_top", "top held")):
        rows = [
            [
                str(number),
                f"{entry['frequency_hz']:.6f}",
                "overdamped" if entry.get("overdamped") else sized(entry["damping_ratio"]),
            ]
            for number, entry in enumerate(summary[name])
        ]
        table(title, ["mode", "frequency (Hz)", "damping ratio"], rows)


def simulation(result: Simulation, system: units.System) -> None:
    """Measures of one run."""
    rows = []
    for name, unit in _MEASURES.items():
        value = getattr(result.measures, name)
        if value is None:
            rows.append([name, sized(None), ""])
        else:
            shown, label = units.displayed(value, unit, system)
            rows.append([name, sized(shown), label])
    if result.share_of_yield is not None:
        rows.append(["share of torsional yield", f"{result.share_of_yield:.1%}", ""])
    if result.energy is not None:
        rows.append(["energy balance", f"{result.energy.relative_residual:.0e}", "of the work"])
    rows.append(["status", result.status, ""])
    engine = result.engine
    if result.step is not None:
        engine = f"{engine}, step {result.step * 1e3:g} ms, {result.modes} modes"
    title = result.design.tables.title or result.design.name
    table(f"{title} ({engine})", ["measure", "value", "unit"], rows)


def sweep(result: Sweep, system: units.System) -> None:
    """Regions, minimum, audit and time of a map."""
    scales = [units.displayed(1.0, axis.unit, system) for axis in result.axes]
    rows = [
        [
            f"J1 <= {level:g} s",
            str(region.cells),
            f"{region.area_fraction:.2%}",
            *(
                _span(region.bounds.get(axis.path), factor)
                for axis, (factor, _) in zip(result.axes, scales, strict=True)
            ),
        ]
        for level, region in result.regions.items()
    ]
    heads = [
        f"{a.path} ({unit})" if unit else a.path
        for a, (_, unit) in zip(result.axes, scales, strict=True)
    ]
    title = result.design.tables.title or result.design.name
    table(title, ["region", "cells", "area", *heads], rows)
    if result.minimum is not None:
        value, at = result.minimum
        line(f"minimum J1 {value:.3f} s at {_place(at, result.axes, system)}")
    audit = result.audit
    worst = f", worst relative difference in J1 {sized(audit.worst, 2)}" if len(audit.cells) else ""
    line(f"audit: {audit.verdict}, {len(audit.cells)} cells{worst}")
    line(
        f"{result.j1.size} cells: {result.seconds:.3f} s in the lanes, "
        f"{result.total_seconds:.1f} s in all"
    )


def _span(bounds: tuple[float, float] | None, factor: float) -> str:
    return "-" if bounds is None else f"{bounds[0] * factor:g} to {bounds[1] * factor:g}"


def _place(at: dict[str, float], axes: tuple[Axis, ...], system: units.System) -> str:
    words = []
    for axis in axes:
        value, unit = units.displayed(at[axis.path], axis.unit, system)
        words.append(f"{axis.path} = {value:g} {unit}".rstrip())
    return ", ".join(words)
