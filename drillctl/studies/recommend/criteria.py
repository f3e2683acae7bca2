"""What a setting must keep to pass, one criterion each, and what makes it fragile."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import finite
from drillctl.design import Design, parts
from drillctl.ensemble.cases import Interval
from drillctl.errors import InputError
from drillctl.linear.ends import bit_side, ends_of
from drillctl.linear.loop_analysis import tolerated_slope
from drillctl.linear.loop_margins import Margins, margins, whole_crossings
from drillctl.linear.loop_model import model_poles, poles_of
from drillctl.linear.operating_point import operating_point
from drillctl.rig.drillstring.frequencies import followed, natural_frequencies
from drillctl.rig.top_drive.law import DriveTable
from drillctl.store.codec import label
from drillctl.store.json_files import picked, strict
from drillctl.store.tables import chance, percent
from drillctl.studies.recommend.settings import Settings

NAMED_MODES = 12  # modes with the top held that a frequency is named after
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth")


@dataclass(frozen=True, eq=False)
class LoopFigures:
    """The loop about steady drilling, as far as the mesh follows it."""

    slope: float = label(unit="N*m*s/rad", means="falling slope of the rock, D")
    slope_margin: float = label(
        unit="N*m*s/rad", means="slope that the loop tolerates; NaN if none at all"
    )
    deciding_hz: float = label(unit="Hz", means="of the poles that decide it")
    whole: Margins | None = label(means="margins at the top torque; None if it is not stable")
    part: Margins | None = label(means="the same with a share of the slope")
    problem: str = label(means="why there are no figures, if so")
    aside: bool = label(
        default=False, means="whether modes grow that the elements do not follow, not counted"
    )

    @property
    def stable(self) -> bool:
        """Whether the slope is under its margin."""
        return bool(self.slope < self.slope_margin)

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        one = self.whole
        disk = None if one is None else {"gain_db": one.gain_db, "phase_deg": one.phase_deg}
        return dict(strict({
            "slope": self.slope, "slope_margin": self.slope_margin,
            "deciding_frequency_hz": self.deciding_hz, "stable": self.stable,
            "disk_margin": disk,
            "delay_margin": None if one is None else one.delay,
            "peak_sensitivity": None if one is None else one.peak_sensitivity,
            "peak_sensitivity_part": None if self.part is None else self.part.peak_sensitivity,
        }))  # fmt: skip


def loop_figures(design: Design, share: float) -> LoopFigures:
    """Figures of the loop of a design, with all of the bit's slope and with a share of it.

    What crossings and peaks above the highest frequency that the elements follow would say is the
    mesh's own, and does not count.
    """
    try:
        point = operating_point(design)
        margin, omega, aside = slope_margin_of(design, point.speed)
    except InputError as error:
        return LoopFigures(math.nan, math.nan, math.nan, None, None, str(error))
    whole, part = (
        _margins(design, one * point.slope, point.speed) if one * point.slope < margin else None
        for one in (1.0, share)
    )
    return LoopFigures(point.slope, margin, omega / (2.0 * math.pi), whole, part, "", aside)


def slope_margin_of(design: Design, speed: float) -> tuple[float, float, bool]:
    """Slope margin (N m s/rad), its frequency (rad/s), and whether modes were left aside.

    Of a loop in which, without slope, only modes grow that the elements do not follow it is that
    of the others. Where others grow it is NaN, with the frequency of what grows.
    """
    margin, omega = tolerated_slope(design, speed)
    if not math.isnan(margin):
        return margin, omega, False
    bit, limit = bit_side(design, 0.0, speed), followed(design.string.parts)
    poles = model_poles(design, bit)
    seen = poles[(poles.real > 0.0) & (np.abs(poles.imag) <= limit)]
    if len(seen):
        return math.nan, float(abs(seen[np.argmax(seen.real)].imag)), False
    result = whole_crossings(ends_of(design.sliding_string), design.linear_drive, bit)
    over = np.flatnonzero((result.slope > 0.0) & (result.omega <= limit))
    if len(over) == 0:
        return math.inf, math.nan, True
    return float(result.slope[over[0]]), float(result.omega[over[0]]), True


def _margins(design: Design, slope: float, speed: float) -> Margins:
    bit, ends = bit_side(design, slope, speed), ends_of(design.sliding_string)
    limit = followed(design.string.parts)
    return margins(ends, design.linear_drive, bit, poles_of(design, bit), limit)


def drive_of(design: Design) -> DriveTable:
    """The drive of a design, with the limits of its motors."""
    drive: DriveTable = parts.drive_of(design.tables)
    return drive


def own_delay(drive: DriveTable) -> float:
    """Delay and lags (s) that a drive has: samples, motor, encoder, filter of the torque."""
    late = drive.sampling_period * (1.5 if drive.one_sample_delay else 0.5)
    return late + drive.motor_lag + drive.encoder_lag + drive.torque_lag


def mode_at(design: Design, hertz: float) -> str:
    """The mode of the string that a frequency is nearest to, in words."""
    if not math.isfinite(hertz) or hertz <= 0.0:
        return "a slow drift"
    held = natural_frequencies(design.string.parts, "finite-elements", NAMED_MODES, top_held=True)
    number = min(range(len(held)), key=lambda k: abs(math.log(held[k] / (2 * math.pi * hertz))))
    said = ORDINALS[number] if number < len(ORDINALS) else "a high"
    return f"{'' if said.startswith('a ') else 'the '}{said} mode ({hertz:.2g} Hz)"


@dataclass(frozen=True)
class Criterion:
    """One thing that must be kept."""

    name: str  # key of the settings, or what is asked
    kept: bool
    value: float | None  # None where undefined
    limit: float
    miss: float  # by how much it is missed, over the limit; 0 if kept, 1 if there is no value
    said: str  # what is missed, with numbers in full; empty if kept

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        return dict(strict(picked(self, "name", "kept", "value", "limit", "miss", "said")))


def _criterion(
    name: str, value: float | None, limit: float, at_least: bool, said: str
) -> Criterion:
    """`value` against `limit`, kept at the limit itself."""
    if value is None or math.isnan(value):
        return Criterion(name, False, None, limit, 1.0, said)
    kept = value >= limit if at_least else value <= limit
    away = limit - value if at_least else value - limit
    miss = 0.0 if kept else min(1.0, away / limit if limit > 0.0 else 1.0)
    return Criterion(name, kept, value, limit, miss, "" if kept else said)


def loop_criteria(design: Design, one: LoopFigures, asked: Settings) -> list[Criterion]:
    """What the linear loop must keep."""
    mode = mode_at(design, one.deciding_hz)
    needed = asked.slope_reserve * max(one.slope, 0.0)
    no_slope = math.isnan(one.slope_margin)
    ratio = math.nan if no_slope else math.copysign(math.inf, one.slope_margin or -1.0)
    if one.slope > 0.0 or (one.slope < 0.0 and one.slope_margin <= 0.0):
        ratio = one.slope_margin / one.slope
    without = one.problem or f"unstable even without falling friction, in {mode}"
    own = own_delay(drive_of(design)) if asked.delay is None else asked.delay
    delay = None if one.whole is None else one.whole.delay
    peak = None if one.part is None else one.part.peak_sensitivity
    peak_at = None if one.part is None else one.part.peak_sensitivity_hz
    unstable = without if no_slope else (
        f"unstable in {mode}: the rock falls by {units.full(one.slope, 'N*m*s/rad', 4)}, the loop "
        f"bears {units.full(one.slope_margin, 'N*m*s/rad', 4)}"
    )  # fmt: skip
    small = (
        "no slope margin"
        if no_slope
        else (
            f"slope margin {ratio:.2f} times that of the rock, {asked.slope_reserve:.2f} asked "
            f"({mode} decides: {units.full(one.slope_margin, 'N*m*s/rad', 4)}, "
            f"{units.full(needed, 'N*m*s/rad', 4)} needed)"
        )
    )
    late = (
        "no delay margin: the loop is not stable"
        if delay is None
        else f"bears {1e3 * delay:.3g} ms more delay, the drive has {1e3 * own:.3g} ms"
    )
    high = (
        f"no sensitivity: not stable with {asked.slope_share:g} of the slope"
        if peak is None
        else f"peak sensitivity {peak:.3g} with {asked.slope_share:g} of the slope, "
        f"{asked.peak_sensitivity:g} allowed, at {mode_at(design, peak_at or math.nan)}"
    )
    stable = Criterion("stable", one.stable, one.slope_margin, one.slope, 0.0, "")
    if not one.stable:
        miss = 1.0 if no_slope else min(1.0, 1.0 - ratio)
        stable = Criterion("stable", False, finite(one.slope_margin), one.slope, miss, unstable)
    later = _criterion("delay", delay, own, True, late)
    if own == 0.0 and delay == 0.0:
        later = Criterion("delay", False, 0.0, 0.0, 1.0, late)
    return [
        stable,
        _criterion("slope_reserve", ratio, asked.slope_reserve, True, small),
        _criterion("peak_sensitivity", peak, asked.peak_sensitivity, False, high),
        later,
    ]


def run_criteria(
    j1: float, status: str, level: float, share: float, interval: Interval, required: float
) -> list[Criterion]:
    """What the runs must keep: J1 without sticking at the end, and its probability."""
    sticks = status in ("sticking", "stalled", "failed")
    end = " and the bit sticks at the end" if sticks else ""
    nominal = _criterion("j1", j1, level, False, f"J1 {j1:.3g} s, {level:g} s allowed{end}")
    if sticks and nominal.kept:
        said = f"the bit is {status} in the last 20 s, with J1 {j1:.3g} s"
        nominal = Criterion("j1", False, j1, level, 0.1, said)
    low, high = interval
    asked = f"{percent(required)} {'required' if high < required else 'is not shown'}"
    shown = f"P(J1 <= {level:g} s) is {chance(share, interval)}, {asked}"
    probable = _criterion("probability", low, required, True, shown)
    return [nominal, probable]


def limit_criterion(share: float, allowed: float) -> Criterion:
    """Share of the time at the drive's limits."""
    said = f"at the limit of the drive for {100 * share:.2g} % of the time"
    return _criterion("time_at_limit", share, allowed, False, said)
