"""What a setting must keep to pass, one criterion each, and what makes it fragile."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import finite
from drillctl.design import Design, parts
from drillctl.ensemble.cases import Share
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
    """One thing that must be kept, with all that is said of it; quantities in full."""

    name: str  # key of the settings, or what is asked
    kept: bool
    value: float | None  # None where undefined
    limit: float
    miss: float  # by how much it is missed, over the limit; 0 if kept, 1 if there is no value
    said: str  # what is missed; empty if kept
    question: str  # what is asked
    detail: str  # what is missed, else the number beside its limit
    limiting: str  # the same, of what a setting that passes comes nearest to missing
    room: float  # how near that is, over the limit; infinite where no number says so

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        return dict(strict(picked(self, "name", "kept", "value", "limit", "miss", "said")))

    def but(self, miss: float, said: str) -> Criterion:
        """The same, missed for another reason than its number."""
        return replace(self, kept=False, miss=miss, said=said, detail=said)


def _criterion(
    name: str, value: float, limit: float, at_least: bool, question: str, missed: str, kept: str,
    limiting: str,
) -> Criterion:  # fmt: skip
    """`value` against `limit`, kept at the limit itself; NaN is missed altogether."""
    words = question, missed, limiting
    if math.isnan(value):
        return Criterion(name, False, None, limit, 1.0, missed, *words, math.inf)
    keeps = value >= limit if at_least else value <= limit
    away = limit - value if at_least else value - limit
    miss = 0.0 if keeps else min(1.0, away / limit if limit > 0.0 else 1.0)
    room = -away / limit if limit > 0.0 and math.isfinite(value) else math.inf
    if keeps:
        return Criterion(name, True, value, limit, miss, "", question, kept, limiting, room)
    return Criterion(name, False, value, limit, miss, missed, *words, room)


def loop_criteria(design: Design, one: LoopFigures, asked: Settings) -> list[Criterion]:
    """What the linear loop must keep."""
    mode = mode_at(design, one.deciding_hz)
    return [_stable(one, mode), _reserve(one, mode, asked), _peak(design, one, asked),
            _late(design, one, asked)]  # fmt: skip


def _slopes(*slopes: float) -> tuple[str, ...]:
    return tuple(units.full(slope, "N*m*s/rad", 4) for slope in slopes)


def _ratio(one: LoopFigures) -> float:
    """Slope margin over the slope of the rock; infinite where that does not fall."""
    if one.slope > 0.0 or (one.slope < 0.0 and one.slope_margin <= 0.0):
        return one.slope_margin / one.slope
    if math.isnan(one.slope_margin):
        return math.nan
    return math.copysign(math.inf, one.slope_margin or -1.0)


def _stable(one: LoopFigures, mode: str) -> Criterion:
    question = "Is steady drilling stable to small disturbances?"
    rest = question, "", "stable", math.inf
    stable = Criterion("stable", one.stable, finite(one.slope_margin), one.slope, 0.0, "", *rest)
    if math.isnan(one.slope_margin):
        return stable.but(1.0, one.problem or f"unstable even without falling friction, in {mode}")
    falls, bears = _slopes(one.slope, one.slope_margin)
    if one.stable:
        detail = f"the loop bears {bears}, the rock falls by {falls}"
        return replace(stable, value=one.slope_margin, detail=detail)
    said = f"unstable in {mode}: the rock falls by {falls}, the loop bears {bears}"
    return stable.but(min(1.0, 1.0 - _ratio(one)), said)


def _reserve(one: LoopFigures, mode: str, asked: Settings) -> Criterion:
    ratio, least, missed = _ratio(one), asked.slope_reserve, "no slope margin"
    if not math.isnan(one.slope_margin):
        margin, needed = _slopes(one.slope_margin, least * max(one.slope, 0.0))
        missed = (
            f"slope margin {ratio:.2f} times that of the rock, {least:.2f} asked "
            f"({mode} decides: {margin}, {needed} needed)"
        )
    return _criterion(
        "slope_reserve", ratio, least, True,
        f"Is the slope margin at least {least:g} times the rock's slope?", missed,
        f"{ratio:.3g} times" if math.isfinite(ratio) else "the rock does not fall",
        f"the slope margin, {ratio:.2f} times the slope of the rock, {least:.2f} asked; {mode} "
        "decides it",
    )  # fmt: skip


def _peak(design: Design, one: LoopFigures, asked: Settings) -> Criterion:
    part, share, most = one.part, asked.slope_share, asked.peak_sensitivity
    peak, missed = math.nan, f"no sensitivity: not stable with {share:g} of the slope"
    where = ""
    if part is not None:
        peak, hertz = part.peak_sensitivity, part.peak_sensitivity_hz
        at = mode_at(design, hertz or math.nan)
        where = "" if hertz is None else f", at {at}"
        missed = (
            f"peak sensitivity {peak:.3g} with {share:g} of the slope, {most:g} allowed, at {at}"
        )
    return _criterion(
        "peak_sensitivity", peak, most, False,
        f"Is the peak sensitivity at {share:g} of that slope at most {most:g}?", missed,
        f"{peak:.3g}", f"the peak sensitivity, {peak:.3g} of {most:g}{where}",
    )  # fmt: skip


def _late(design: Design, one: LoopFigures, asked: Settings) -> Criterion:
    own = own_delay(drive_of(design)) if asked.delay is None else asked.delay
    delay = math.nan if one.whole is None else one.whole.delay
    bears, drive = f"{1e3 * delay:.3g} ms", f"{1e3 * own:.3g} ms"
    missed = f"bears {bears} more delay, the drive has {drive}"
    later = _criterion(
        "delay", delay, own, True, "Does the loop bear the further delay that is asked of it?",
        "no delay margin: the loop is not stable" if one.whole is None else missed,
        f"it bears {bears}, {drive} asked",
        f"the delay that it bears, {bears}, with {drive} in the drive",
    )  # fmt: skip
    return later.but(1.0, missed) if own == delay == 0.0 else later


def run_criteria(
    j1: float, status: str, level: float, share: Share, required: float
) -> list[Criterion]:
    """What the runs must keep: J1 without sticking at the end, and its probability."""
    sticks = status in ("sticking", "stalled", "failed")
    end = " and the bit sticks at the end" if sticks else ""
    nominal = _criterion(
        "j1", j1, level, False,
        f"Is J1 ≤ {level:g} s at nominal rock, without sticking at the end?",
        f"J1 {j1:.3g} s, {level:g} s allowed{end}", f"J1 {units.full(j1, 's', 3)}",
        f"J1, {j1:.3g} s of {level:g} s",
    )  # fmt: skip
    if sticks and nominal.kept:
        nominal = nominal.but(0.1, f"the bit is {status} in the last 20 s, with J1 {j1:.3g} s")
    (low, high), told = share.interval, chance(share.value, share.interval)
    asked = f"{percent(required)} {'required' if high < required else 'is not shown'}"
    probable = _criterion(
        "probability", low, required, True,
        f"Is P(J1 ≤ {level:g} s) shown to be at least {percent(required)}?",
        f"P(J1 <= {level:g} s) is {told}, {asked}", f"it is {told} of {share.total} draws",
        f"the probability, shown to be {low:.3f} at least, {required:g} required",
    )  # fmt: skip
    return [nominal, replace(probable, room=(low - required) / max(1.0 - required, 1e-9))]


def limit_criterion(share: float, allowed: float) -> Criterion:
    """Share of the time at the drive's limits."""
    return _criterion(
        "time_at_limit", share, allowed, False,
        f"Is the drive at its limit less than {percent(allowed)} of the time?",
        f"at the limit of the drive for {100 * share:.2g} % of the time", percent(share),
        f"the limit of the drive, at which it is {100 * share:.2g} % of the time",
    )  # fmt: skip
