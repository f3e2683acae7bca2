"""Modes and the linear loop as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.cli.console import sized, table
from drillctl.printing.words import title_of

if TYPE_CHECKING:
    from drillctl.linear import LoopAnalysis


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


def loop(result: LoopAnalysis, system: units.System) -> None:
    """Stability, margins, critical operating points and the first modes of a loop."""
    found = result.margins
    rows = [
        ["stable", "yes" if result.stable else "no", ""],
        ["spectral abscissa", f"{result.spectral_abscissa:.3g}", "1/s"],
        ["slope of the rock, -dT/dw", sized(result.operating_point.slope), "N m s/rad"],
        ["friction-slope margin D*", sized(result.slope_margin), "N m s/rad"],
        ["  decided at", sized(result.deciding_frequency_hz), "Hz"],
        ["  of the continuum", sized(result.continuum_slope_margin), "N m s/rad"],
    ]
    if found is not None:
        rows += [
            ["peak sensitivity", sized(found.peak_sensitivity), ""],
            ["  at", sized(found.peak_sensitivity_hz), "Hz"],
            ["disk margin, gain", sized(found.gain_db), "dB"],
            ["disk margin, phase", sized(found.phase_deg), "deg"],
            ["delay margin", sized(found.delay), "s"],
            ["  decided at", sized(found.delay_hz), "Hz"],
        ]
    for name, value, unit in (
        ("operating speed", result.operating_point.speed, "rad/s"),
        ("critical speed", result.critical_speed, "rad/s"),
        ("critical weight on bit", result.critical_weight_on_bit, "N"),
    ):
        shown, label = (None, "") if value is None else units.displayed(value, unit, system)
        rows.append([name, sized(shown), label])
    table(f"{title_of(result)}: loop at the top torque, slope of the rock included",
          ["figure", "value", "unit"], rows)  # fmt: skip
    modes = [
        [str(number), f"{frequency:.6f}", sized(ratio)]
        for number, (frequency, ratio) in enumerate(result.oscillations[:8], start=1)
    ]
    table("oscillating poles", ["number", "frequency (Hz)", "damping ratio"], modes)
