"""Tuned gains as tables for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.cli.console import line, sized, table
from drillctl.printing.words import title_of

if TYPE_CHECKING:
    from drillctl.studies.robust import Tune
    from drillctl.studies.robust.baselines import Baseline
    from drillctl.studies.robust.certificate import FreshRuns


def tune(result: Tune, system: units.System) -> None:
    """Gains with their tolerance, the certificate, and what they are set beside."""
    _gains(result, system)
    _beside(result, system)
    _certificate(result)
    found = result.tuning
    line(
        f"search: {found.trajectories:,} trajectories at {found.realizations} realizations, "
        f"{found.seconds:.1f} s"
    )
    line(
        f"certificate: {result.certificate.trajectories:,} trajectories, "
        f"{result.certificate.seconds:.1f} s; {result.total_seconds:.1f} s in all"
    )
    line(result.message)


def _gains(result: Tune, system: units.System) -> None:
    rows = []
    for one, tuned in zip(result.certificate.tolerances, result.tuning.tuned, strict=True):
        factor, label = units.displayed(1.0, one.unit, system)
        low, high = (sized(end * factor, 6) for end in (one.low, one.high))
        if result.certificate.runs.probability < result.certificate.required:
            low = high = "-"  # it is below already
        rows.append([
            f"{one.path} ({label})" if label else one.path,
            sized(one.value * factor, 6),
            low + (" (bound)" if one.low_at_bound else ""),
            high + (" (bound)" if one.high_at_bound else ""),
            f"{tuned.low * factor:g} to {tuned.high * factor:g}",
        ])  # fmt: skip
    required, level = result.certificate.required, result.certificate.runs.level
    table(
        f"{title_of(result)}: tuned; each alone may drift while P(J1 <= {level:g} s) >= "
        f"{required:g}",
        ["parameter", "value", "down to", "up to", "searched"],
        rows,
    )


def _beside(result: Tune, system: units.System) -> None:
    rows = [["tuned", _told(result, result.gains, system), *_figures(result.certificate.runs)]]
    left_out = []
    for one in result.baselines:
        if one.runs is None:
            left_out.append(one)
        else:
            rows.append([one.name, _told(result, one.told, system), *_figures(one.runs)])
    count, level = len(result.certificate.runs.j1), result.certificate.runs.level
    heads = ["", "gains", "objective (s)", f"P(J1 <= {level:g} s)", "95 % interval", "median",
             "95 %", "99 %"]  # fmt: skip
    table(f"at the same {count} fresh realizations; J1 in s", heads, rows)
    for one in left_out:
        line(f"{one.name}: left out: {one.reason}")
    for one in result.baselines:
        if one.name == "exhaustive grid" and one.runs is not None:
            _grid(result, one)


def _grid(result: Tune, one: Baseline) -> None:
    share = result.tuning.trajectories / one.found["trajectories"]
    line(
        f"exhaustive grid: {one.found['trajectories']:,.0f} trajectories, "
        f"{one.found['seconds']:.1f} s, objective {one.found['value']:.4g} s at the realizations "
        f"of the search, which has {result.tuning.value:.4g} s from {share:.1%} of them"
    )


def _told(result: Tune, told: dict[str, Any], system: units.System) -> str:
    """Gains in the units people read, or the name of a law."""
    if "law" in told:
        return f"{told['law']}, default tuning"
    words = []
    for path, value in told.items():
        unit = next((t.unit for t in result.tuning.tuned if t.path == path), "")
        if value is None:
            words.append("by its own rule")
        else:
            words.append(f"{units.displayed(value, unit, system)[0]:.5g}")
    return ", ".join(words)


def _figures(runs: FreshRuns) -> list[str]:
    low, high = runs.interval
    found = runs.quantiles
    return [
        sized(runs.value, 4), f"{runs.probability:.4f}", f"{low:.4f} to {high:.4f}",
        *(sized(found[name], 4) for name in ("q50", "q95", "q99")),
    ]  # fmt: skip


def _certificate(result: Tune) -> None:
    certificate = result.certificate
    number = certificate.worst
    if number is not None:
        drawn = ", ".join(
            f"{path} = {column[number]:.4g}" for path, column in certificate.drawn.items()
        )
        line(f"worst realization (SI): J1 {certificate.runs.j1[number]:.4g} s at {drawn}")
    for failure in certificate.failures:
        line(
            f"{failure.count} draws that no rig has count as over the level; {failure.reason}: "
            f"{failure.example}"
        )
    for name, missed in certificate.violations.items():
        line(f"at the fresh realizations {name} is missed by {missed:.2%} of its limit")
    _margins(result)
    audit = certificate.audit
    line(
        f"audit: {certificate.audit_verdict}, {len(audit.cells)} realizations by the reference "
        f"solver, worst relative difference in J1 {sized(audit.worst, 2)}, "
        f"{certificate.other_side} on the other side of the level"
    )


def _margins(result: Tune) -> None:
    found = result.certificate.margins
    if not found:
        line(f"no margins: {result.certificate.no_margins}")
        return
    disk = found["disk_margin"] or {"gain_db": None, "phase_deg": None}
    line(
        f"loop: slope margin {sized(found['slope_margin'], 4)} N m s/rad (the rock has "
        f"{sized(found['slope'], 4)}), disk margins {sized(disk['gain_db'], 3)} dB and "
        f"{sized(disk['phase_deg'], 3)} deg, peak sensitivity "
        f"{sized(found['peak_sensitivity'], 3)}"
    )
