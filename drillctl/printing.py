"""Results as tables for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.console import line, sized, table

if TYPE_CHECKING:
    from collections.abc import Callable

    from drillctl.linear import LoopAnalysis
    from drillctl.simulation import Simulation
    from drillctl.simulation.limit_cycle import LimitCycle
    from drillctl.studies import (
        AdaptiveMap,
        Axis,
        Comparison,
        Region,
        Regularisation,
        Sweep,
        ThreeRegions,
        WeightDelay,
    )
    from drillctl.studies.comparison import ComparedCase, Difference
    from drillctl.studies.delay_limits import EndedShare, EndsUpTo, HarmfulFrom
    from drillctl.studies.weight_delay import DelayedBenefit

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
    title = result.design.tables.title or result.design.name
    table(f"{title}: loop at the top torque, slope of the rock included",
          ["figure", "value", "unit"], rows)  # fmt: skip
    modes = [
        [str(number), f"{frequency:.6f}", sized(ratio)]
        for number, (frequency, ratio) in enumerate(result.oscillations[:8], start=1)
    ]
    table("oscillating poles", ["number", "frequency (Hz)", "damping ratio"], modes)


def cycle(result: LimitCycle, system: units.System) -> None:
    """What each method says of the limit cycle, side by side."""
    orbit, predicted, run = result.orbit, result.predicted, result.simulated.summary()

    def speed(value: float | None) -> str:
        return "-" if value is None else f"{units.displayed(value, 'rad/s', system)[0]:.2f}"

    def spread(values: list[float] | None, shown: Callable[[float], str]) -> str:
        return "-" if values is None else " to ".join(dict.fromkeys(map(shown, values)))

    rows = [
        [
            "period (s)",
            "-" if predicted is None else f"{predicted.period:.3f}",
            "-" if orbit is None else f"{orbit.period:.6f}",
            spread(run["period_spread"], lambda x: f"{x:.4f}"),
        ],
        [
            "peak bit speed (rpm)",
            speed(None if predicted is None else predicted.peak_speed),
            speed(None if orbit is None else orbit.peak_bit_speed),
            spread(run["peak_spread"], speed),
        ],
        [
            "stuck in a period (s)",
            "-",
            "-" if orbit is None else f"{orbit.stuck_time:.4f}",
            spread(run["stuck_time_spread"], lambda x: f"{x:.4f}"),
        ],
        [
            "largest multiplier",
            "-",
            "-" if orbit is None else f"{abs(orbit.multipliers[0]):.4f}",
            "-",
        ],
    ]
    heads = ["figure", "one harmonic", "exact (shooting)", "last ten returns of a long run"]
    title = result.design.tables.title or result.design.name
    table(f"{title}: {result.status}", heads, rows)
    for unstable in (x for x in result.harmonic if not x.stable):
        line(
            f"unstable cycle by one harmonic: {unstable.period:.3f} s, "
            f"{speed(unstable.least_speed)} to {speed(unstable.peak_speed)} rpm"
        )
    line(f"status: {result.status} (wound up, {result.simulated.duration:.0f} s)")


def regions(result: ThreeRegions) -> None:
    """Cells of the three regions and of where they differ."""
    summary = result.summary()
    total = summary["cells"]
    rows = [
        [name.replace("_", " "), str(count), f"{count / total:.2%}"]
        for name, count in summary["counts"].items()
    ]
    title = result.design.tables.title or result.design.name
    table(f"{title}: three regions of {total} cells", ["region", "cells", "share"], rows)
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
    title = result.design.tables.title or result.design.name
    heads = ["friction", "median change of J1", "worst", *(f"J1 <= {x} s" for x in levels)]
    table(f"{title}: friction smoothed by tanh, {result.j1.size} cells", heads, rows)


def weight_delay(result: WeightDelay, system: units.System) -> None:
    """J1 and the end of stick-slip by gain and delay, and how much delay each gain bears."""
    force, unit = units.displayed(1.0, "N", system)
    names = [f"{gain * force:g} {unit} s/rad" for gain in result.gains]
    moving = [i for i, gain in enumerate(result.gains) if gain > 0.0]
    title = result.design.tables.title or result.design.name
    rows = [
        [f"{delay:g} s", *(_less_j1(result.benefits[i][k]) for i in moving)]
        for k, delay in enumerate(result.delays)
    ]
    heads = ["delay", *(names[i] for i in moving)]
    table(f"{title}: J1 less that of a constant weight, mean (95 % interval), s", heads, rows)
    rows = [
        [f"{delay:g} s", *(_ended(result.benefits[i][k]) for i in moving)]
        for k, delay in enumerate(result.delays)
    ]
    table("stick-slip has ended, share of the draws (95 % interval)", heads, rows)
    longest = float(result.delays[-1])
    rows = [
        [names[i], *_ends(found.ends_up_to), *_harm(found.harmful_from, longest)]
        for i, found in ((i, result.limits[i]) for i in moving)
    ]
    heads = ["gain", "stick-slip ends up to", "share there", "share at the next delay",
             "harmful from", "95 % interval"]  # fmt: skip
    table("delay that each gain bears", heads, rows)
    constant = result.baseline
    line(
        f"constant weight: J1 {sized(constant.j1, 4)} s, stick-slip ended in {_ended(constant)} "
        f"of the draws"
    )
    for failure in result.failures:
        line(
            f"{failure.count} of {result.realizations} draws failed; {failure.reason}: "
            f"{failure.example}"
        )
    line(f"{result.realizations} draws: {', '.join(result.drawn)}; seed {result.seed}")


def _less_j1(one: DelayedBenefit) -> str:
    if one.difference is None:
        return "-"
    if one.difference_interval is None:
        return f"{one.difference:+.1f}"
    low, high = one.difference_interval
    return f"{one.difference:+.1f} ({low:.1f} to {high:.1f})"


def _ended(one: DelayedBenefit) -> str:
    return _share_told(one.ended_share)


def _ends(found: EndsUpTo) -> list[str]:
    shares = ["-" if one is None else _share_told(one) for one in (found.at, found.next)]
    return ["at no delay" if found.at is None else f"{found.at.delay:g} s", *shares]


def _share_told(one: EndedShare) -> str:
    low, high = (f"{100.0 * end:.1f}" for end in one.interval_95)
    return f"{one.share:.1%} ({low} to {high})"


def _harm(found: HarmfulFrom, longest: float) -> list[str]:
    """Where it turns harmful, and the interval; nothing is known beyond the longest delay."""
    beyond = f"beyond {longest:g} s"
    low, high = (beyond if end is None else f"{end:.2f} s" for end in found.interval_95)
    if found.interval_95 == (None, None):
        return [beyond, "-"]
    return [beyond if found.delay is None else f"{found.delay:.2f} s", f"{low} to {high}"]


def comparison(result: Comparison, system: units.System) -> None:
    """Distributions of the cases, differences from the first, shares and areas under each level."""
    from drillctl.studies.comparison import MEASURES

    names = [case.name for case in result.cases]
    title = result.design.tables.title or result.design.name
    rows = []
    for name, unit in MEASURES.items():
        factor, label = units.displayed(1.0, unit, system)
        found = [case.distribution(name) for case in result.cases]
        rows.append([_head(name, label), *(_spread(one, factor) for one in found)])
    table(
        f"{title}: mean over {result.realizations} draws (5 % to 95 %)", ["measure", *names], rows
    )
    if len(names) > 1:
        rows = []
        for name, unit in MEASURES.items():
            factor, label = units.displayed(1.0, unit, system)
            apart = [result.paired[case][name] for case in names[1:]]
            rows.append([_head(name, label), *(_apart(one, factor) for one in apart)])
        heads = ["measure", *names[1:]]
        table(f"difference from {names[0]!r} draw by draw, mean (95 % interval)", heads, rows)
    rows = []
    for level in result.levels:
        shares = [case.share(level) for case in result.cases]
        cells = [f"{share:.1%} ({low:.1%} to {high:.1%})" for _, share, (low, high) in shares]
        rows.append([f"J1 <= {level:g} s", *cells])
    table("share of the draws (95 % interval)", ["level", *names], rows)
    if any(case.nominal.map is not None for case in result.cases):
        rows = [
            [f"J1 <= {level:g} s", *(_area(case.region(level)) for case in result.cases)]
            for level in result.levels
        ]
        axes = ", ".join(table.path for table in result.design.tables.map.axes)
        table(f"share of the map over {axes}, without draws (cells)", ["level", *names], rows)
    for case in result.cases:
        _case_notes(case, system)
        if case.nominal.no_map and result.design.tables.compare.maps:
            line(f"{case.name}: no map: {case.nominal.no_map}")
    line(f"drawn: {', '.join(result.baseline.drawn)}; seed {result.seed}")


def _case_notes(case: ComparedCase, system: units.System) -> None:
    if case.weight_shift:
        shift, unit = units.displayed(case.weight_shift, "N", system)
        line(f"{case.name}: nominal weight shifted by {shift:+.3f} {unit} for equal means")
    for failure in case.failures:
        reason = f"{failure.reason}: {failure.example}"
        line(f"{case.name}: {failure.count} of {len(case.status)} draws failed; {reason}")


def _area(found: Region | None) -> str:
    return "-" if found is None else f"{found.area_fraction:.1%} ({found.cells})"


def _head(name: str, label: str) -> str:
    return f"{name} ({label})" if label not in ("", "1") else name


def _spread(found: dict[str, Any], factor: float) -> str:
    if found["mean"] is None:
        return "-"
    mean, low, high = (f"{found[key] * factor:.4g}" for key in ("mean", "p05", "p95"))
    return f"{mean} ({low} to {high})"


def _apart(found: Difference, factor: float) -> str:
    if found.difference is None:
        return "-"
    if found.interval is None:
        return f"{found.difference * factor:+.4g}"
    low, high = (f"{end * factor:.4g}" for end in found.interval)
    return f"{found.difference * factor:+.4g} ({low} to {high})"


def _span(bounds: tuple[float, float] | None, factor: float) -> str:
    return "-" if bounds is None else f"{bounds[0] * factor:g} to {bounds[1] * factor:g}"


def _place(at: dict[str, float], axes: tuple[Axis, ...], system: units.System) -> str:
    words = []
    for axis in axes:
        value, unit = units.displayed(at[axis.path], axis.unit, system)
        words.append(f"{axis.path} = {value:g} {unit}".rstrip())
    return ", ".join(words)
