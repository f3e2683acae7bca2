"""PI against PI with a weight that follows the bit speed as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drillctl import units
from drillctl.cli.console import line, table
from drillctl.ensemble.draws import EQUAL_TO
from drillctl.printing.words import title_of

if TYPE_CHECKING:
    from drillctl.ensemble.cases import Crossing, Estimate
    from drillctl.studies.advantage import Advantage
    from drillctl.studies.advantage.cases import Case
    from drillctl.studies.advantage.delays import DelayLine
    from drillctl.studies.advantage.sweeps import Chart


def advantage(result: Advantage, system: units.System) -> None:
    """Cases with paired differences, areas, front, map and crossing delays."""
    _, unit = units.displayed(1.0, "N", system)
    heads = ["case", "kp", "ki", f"K_w ({unit} s/rad)", "objective (s)", "less constant (s)",
             "mean J1 less constant (s)", f"mean weight ({unit})", "ROP proxy"]  # fmt: skip
    rows = [_case(result, case, system) for case in result.cases]
    summary = result.summary()
    table(f"{title_of(result)}: {summary['objective']} of J1 and 95 % intervals", heads, rows)
    heads = ["J1 at or under", *(f"{level:g} s" for level in result.levels)]
    rows = [[case.name, *(_share(case, level) for level in result.levels)] for case in result.cases]
    table("share of the fresh draws (95 % interval)", heads, rows)
    _areas(result)
    _front(result, system)
    _map(result.chart, system)
    _delay(result)
    _bounds(result)
    _unequal(result)
    line(
        f"{summary['realizations']} fresh draws, seed {result.seed}; tuned at "
        f"{result.design.tables.tune.realizations}, seed {result.design.tables.tune.seed}"
    )


def _case(result: Advantage, case: Case, system: units.System) -> list[str]:
    kp, ki, gain = case.gains.values()
    force, _ = units.displayed(1.0, "N", system)
    weight, rop = case.mean("mean_weight_after_start"), case.mean("rop_proxy")
    apart = ["", ""]
    if case is not result.baseline:
        mean = case.difference(result.baseline, "j1", result.seed)
        apart = [told(case.objective_less, "+.2f"), told(mean, "+.2f")]
    return [
        case.name, f"{kp:.1f}", f"{ki:.1f}", f"{gain * force:.2f}", told(case.objective, ".2f"),
        *apart, "-" if weight is None else f"{weight * force:.2f}",
        "-" if rop is None else f"{rop:.4f}",
    ]  # fmt: skip


def told(found: Estimate, form: str) -> str:
    """A number with its interval."""
    if found.value is None:
        return "-"
    if found.interval is None:
        return f"{found.value:{form}}"
    low, high = (f"{end:{form.lstrip('+')}}" for end in found.interval)
    return f"{found.value:{form}} ({low} to {high})"


def _share(case: Case, level: float) -> str:
    share = case.share(level)
    low, high = share.interval
    return f"{share.value:.1%} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def _areas(result: Advantage) -> None:
    rows = []
    for one in result.regions:
        for level, areas in one.areas.items():
            ends = [
                f"{area.value:.1%} ({100.0 * area.interval[0]:.1f} to "
                f"{100.0 * area.interval[1]:.1f})"
                for area in areas.values()
            ]
            rows.append([one.policy, f"{level:g} s", f"{one.nominal_area(level):.1%}", *ends])
    heads = ["policy", "J1 at or under", "without draws", "P >= 0.95", "P >= 0.05"]
    table("share of the window of kp and ki, K_w at its optimum", heads, rows)


def _front(result: Advantage, system: units.System) -> None:
    force, unit = units.displayed(1.0, "N", system)
    found = result.front
    rows = []
    for i, weight in enumerate(found.weights):
        row = [f"{weight * force:g} {unit}"]
        for k in range(len(found.policies)):
            value = found.figures["objective"][k, i, 0]
            mean = found.figures["mean_weight"][k, i, 0] * force
            row.append("-" if np.isnan(value) else f"{value:.2f} s at {mean:.1f} {unit}")
        rows.append(row)
    table("objective at the mean weight, by nominal weight", ["weight", *found.policies], rows)


def _map(found: Chart, system: units.System) -> None:
    force, unit = units.displayed(1.0, "N", system)
    turning, rpm = units.displayed(1.0, "rad/s", system)
    heads = ["weight", *(f"{speed * turning:g} {rpm}" for speed in found.speeds)]
    for k in range(1, len(found.policies)):
        sure = found.significant(k)
        rows = [
            [
                f"{weight * force:g} {unit}",
                *(
                    f"{value:.1f}" + ("" if sure[i, j] else " x")
                    for j, value in enumerate(found.figures["advantage"][k, i])
                ),
            ]
            for i, weight in enumerate(found.weights)
        ]
        words = "objective of the constant weight less its own (s); x: interval holds 0"
        table(f"{found.policies[k]}: {words}", heads, rows)


def _delay(result: Advantage) -> None:
    found = result.delay
    rows = []
    for delay in np.union1d(found.kept.delays, found.anew.delays):
        row = [f"{delay:g} s", *(_at(one, float(delay)) for one in (found.kept, found.anew))]
        if delay not in found.anew.delays:
            rows.append([*row, "-"])
            continue
        kp, ki, gain = found.anew.gains[np.searchsorted(found.anew.delays, delay)]
        rows.append([*row, f"{kp:.0f}, {ki:.0f}, {gain / 1e3:.2f}"])
    heads = ["delay", "gains of the ideal path (s)", "tuned anew (s)", "its kp, ki, K_w (kN s/rad)"]
    table("advantage of the real path against its delay", heads, rows)
    longest, share = float(found.delays[-1]), result.design.tables.advantage.material
    line(f"gains of the ideal path: no advantage from {_crossing(found.kept.zero, longest)}")
    line(
        f"gains tuned anew: under {share:.1%} of the constant weight's objective from "
        f"{_crossing(found.anew.material, longest)}"
    )
    first = found.anew.indistinct_from
    where = f"at no delay up to {longest:g} s" if first is None else f"from {first:g} s on the grid"
    line(f"gains tuned anew: interval not above zero {where}")


def _at(line: DelayLine, delay: float) -> str:
    """Advantage at a delay, with its interval, if that delay was looked at."""
    if delay not in line.delays:
        return "-"
    at = int(np.searchsorted(line.delays, delay))
    return f"{line.advantage[at]:+.2f} ({line.low[at]:.2f} to {line.high[at]:.2f})"


def _crossing(found: Crossing, longest: float) -> str:
    if found.at is None:
        return f"beyond {longest:g} s (in {found.within:.1%} of the resamples before)"
    low, high = (f"beyond {longest:g}" if end is None else f"{end:.3f}" for end in found.interval)
    return f"{found.at:.3f} s (95 % interval {low} to {high})"


def _unequal(result: Advantage) -> None:
    for case in result.cases:
        if abs(case.off) > EQUAL_TO:
            line(f"{case.name}: not equal, off by {case.off:.1%} at the nearest nominal weight")


def _bounds(result: Advantage) -> None:
    for case in result.cases:
        if case.at_bounds:
            line(f"{case.name}: {', '.join(case.at_bounds)} on a bound of the search")
