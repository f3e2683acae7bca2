"""From a log to a friction curve with a band, to what the log does not say, and to draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array, finite
from drillctl.design import Design, parts
from drillctl.errors import InputError
from drillctl.linear import modes
from drillctl.logs import identification as ident
from drillctl.logs.fit import FACTORS, Fit, Problem, driven, fit, run
from drillctl.logs.laws import PEAK_LAW, exponential_law, points_law
from drillctl.logs.waves import below, impedance, is_uniform, stiffness, travel_time
from drillctl.progress import SILENT, Progress
from drillctl.rig.drillstring import Parts
from drillctl.store.codec import label
from drillctl.store.result import Result
from drillctl.studies.log.compute import read_logs

CLEARLY = 8.0  # difference of misfits that tells two laws apart
BEYOND = 1.3  # of how far another law is away: a band that holds it, and what lies behind it
FOREIGN = 0.005  # unexplained share of the returning wave from which units are doubted
NEARLY = 1.1  # error of a prediction over the least one that counts as equal
USUAL_TWIST = (0.002, 20.0)  # of a string, over what the top turns in a period
USUAL_LEVER = (1e-4, 2.0)  # top torque over the weight on bit (m), of bits of any size
DRAWN_POINTS = 4000  # of a portrait
NUMBERS = {
    "travel_time": ("travel time", "s"), "impedance": ("pipe impedance", "N*m*s/rad"),
    "bit_inertia": ("inertia at the bit", "kg*m^2"),
    "drive_inertia": ("drive inertia at the pipe", "kg*m^2"),
}  # fmt: skip
FOOT_POUND = units.factor("lbf*ft", units.TORQUE)
WRONG_UNITS = (
    (FOOT_POUND, "the torque is in N m, read as ft lbf"),
    (1.0 / FOOT_POUND, "the torque is in ft lbf, read as N m"),
    (1e3, "the torque is in N m, read as kN m"), (1e-3, "the torque is in kN m, read as N m"),
    (1e3 * FOOT_POUND, "the torque is in N m, read as klbf ft"),
    (1e-3 / FOOT_POUND, "the torque is in klbf ft, read as N m"),
    (10.0, "the torque is in N m, read as daN m"), (0.1, "the torque is in daN m, read as N m"),
    (9.80665, "the torque is in N m, read as kgf m"),
    (1.0 / 9.80665, "the torque is in kgf m, read as N m"),
    (1.0 / units.RPM, "the speed is in rad/s, read as rpm"),
    (units.RPM, "the speed is in rpm, read as rad/s"),
)  # fmt: skip
"""Torque over speed as it was read, over what it is."""


@dataclass(frozen=True, eq=False)
class FittedLaw:
    """A law fitted to all windows."""

    name: str
    names: tuple[str, ...]  # of its coefficients
    values: Array = label("{name}_coefficient", means="coefficients of a design: m, and s/rad")
    half: Array = label("{name}_coefficient", means="half width of the interval of each")
    hold_out: float = label(means="error of predicting the next window, over its swing")
    explained: float = label(means="share of the variance of the returning wave")
    size: float = label(unit="N*m", means="usual residual")
    speed: Array = label("{name}_speed", unit="rad/s", means="speeds that were seen")
    torque: Array = label("{name}_speed", unit="N*m", means="torque at the mean weight")
    low: Array = label("{name}_speed", unit="N*m", means="lower end of its band")
    high: Array = label("{name}_speed", unit="N*m", means="upper end")
    static: float = label(unit="N*m", means="static torque")


@dataclass(frozen=True)
class StringNumber:
    """A number of the rig, as the design has it and as the log does."""

    name: str
    label: str
    unit: str
    design: float
    log: float  # NaN where it was not fitted
    half: float  # half width of its interval
    fitted: bool  # whether the friction was fitted with it free
    off: bool  # whether they differ by more than the interval and a tenth


@dataclass(frozen=True, eq=False)
class Trace:
    """A window of the log beside the simulation."""

    time: Array = label("time", unit="s", means="time")
    measured: Array = label("time", unit="N*m", means="wave that comes up, measured")
    predicted: Array = label("time", unit="N*m", means="the same from the fit")
    bit_speed: Array = label("time", unit="rad/s", means="of the fit")
    bit_torque: Array = label("time", unit="N*m", means="of the fit")
    downhole: Array | None = label("time", unit="rad/s", means="measured bit speed, if any")


@dataclass(frozen=True, eq=False)
class Identification(Result, kind="identify"):
    """Friction with a band from a log, and what the log does not say."""

    design: Design = label(means="the rig as it was given")
    files: tuple[str, ...] = label(means="names of the logs")
    law: str = label(means="the law that is written")
    fits: tuple[FittedLaw, ...] = label(means="every law")
    weight: float = label(unit="N", means="mean weight on bit that the curve is at")
    weight_known: bool = label(means="whether the log holds it")
    rate: float = label(unit="Hz", means="samples a second of the log")
    used_rate: float = label(unit="Hz", means="of what was fitted")
    period: float = label(unit="s", means="lowest of the string, top held")
    begin: Array = label("window", unit="s", means="beginning of each window")
    end: Array = label("window", unit="s", means="its end")
    sticks: Array = label("window", means="whether the bit stands still in it")
    numbers: tuple[StringNumber, ...] = label(means="of the rig, checked against the log")
    identifiable: dict[str, bool] = label(means="whether the log says each")
    findings: tuple[str, ...] = label(means="what the log says and does not say, in words")
    draws: Array = label("draw", "drawn", means="joint samples of the coefficients")
    trace: Trace = label(means="a window")
    profile: dict[str, Array] = label(
        "point", means="objective over its least, by coefficient: values, then increases"
    )
    portrait_speed: Array = label("sample", unit="rad/s", means="bit speed without a law")
    portrait_torque: Array = label("sample", unit="N*m", means="bit torque without a law")
    downhole_difference: float | None = label(
        means="largest difference of the curve by downhole speed from that by the surface, relative"
    )

    @property
    def fitted(self) -> FittedLaw:
        """The law that is written."""
        return next(one for one in self.fits if one.name == self.law)

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        one = self.fitted
        return {
            "law": self.law,
            "values": dict(zip(one.names, one.values.tolist(), strict=True)),
            "half_widths": dict(zip(one.names, map(finite, one.half), strict=True)),
            "weight": self.weight,
            "weight_known": self.weight_known,
            "curve": {
                "speed": one.speed.tolist(), "torque": one.torque.tolist(),
                "low": one.low.tolist(), "high": one.high.tolist(),
            },
            "static_torque": one.static if self.identifiable["static_friction"] else None,
            "string": {
                n.name: n.log if n.fitted else n.design for n in self.numbers
            },
            "checked": {
                n.name: {"design": n.design, "log": finite(n.log), "half_width": finite(n.half)}
                for n in self.numbers
            },
            "identifiable": dict(self.identifiable),
            "hold_out": {fit.name: finite(fit.hold_out) for fit in self.fits},
            "findings": list(self.findings),
            "windows": [
                {"begin": float(a), "end": float(b), "sticks": bool(s)}
                for a, b, s in zip(self.begin, self.end, self.sticks, strict=True)
            ],
        }  # fmt: skip


def identify(
    design: Design, log: Sequence[str | Path], progress: Progress = SILENT
) -> Identification:
    """Fit the friction of a rig to its logs.

    Parameters
    ----------
    design : Design
        String, drive inertia and the columns of the log; its controller and rock are not used.
    log : sequence of str or Path
        One or more logs of this rig.
    progress : Progress
        Receives files and fits.

    Returns
    -------
    Identification

    Raises
    ------
    InputError
        A log that cannot be read, that is too slow, that never turns, or that has nothing to do
        with this string.
    """
    settings = design.tables.identify
    logs = read_logs(design, log, progress)
    line = parts.parts_of(design.tables)
    period = 1.0 / modes(design, 1).fixed_top[0].frequency_hz
    windows = []
    for held_log in logs:
        ident.refuse_slow(held_log.rate, period)
        lags = settings.torque_lag, settings.speed_lag
        windows += ident.tracks_of(held_log, line, period, settings.window, settings.windows, lags)
    if not windows:
        raise InputError(
            f"no stretch of the log turns under torque for as long as a window: {ident.CYCLES} "
            f"cycles of {period:.3g} s",
            "--log",
        )
    held, weight = ident.weighted(windows)
    _refuse_implausible(windows, weight, line, period)
    if "travel_time" in settings.free and not travel_time(line):
        raise InputError("a lumped string has no travel time to be fitted", "identify.free")
    problem = Problem(line, held, settings.free)
    progress.begin("fitting laws", 7)
    turning = float(np.mean([w.track.speed.mean() for w in held]))
    fits = [ident.best_fit(problem, exponential_law(turning))]
    progress.advance(1)
    fits.append(ident.best_fit(problem, PEAK_LAW))
    progress.advance(1)
    main = _leading(fits)
    _refuse_foreign(problem, main)
    fits.append(ident.best_fit(problem, points_law(main.fastest), main))
    progress.advance(1)
    main = _leading(fits)
    checked = _checked(problem, main)
    progress.advance(1)
    numbers = _numbers(problem, main, checked, settings.confidence)
    known = weight is not None
    at = weight if weight is not None else design.tables.operating_point.weight_on_bit
    if not at > 0.0:
        raise InputError(
            "must be > 0: the coefficients are torque over weight", "operating_point.weight_on_bit"
        )
    described, floor = [], ident.floor_at(settings.floor, problem)
    for one in fits:
        score = ident.held_out(one.problem, one.family, one.x, one.begins)
        described.append(_described(one, at, score, settings.confidence, floor))
        progress.advance(1)
    described = _not_told_apart(described, fits)
    if any(n.off for n in numbers) and checked is not None:
        described = [_widened(d, f, checked) for d, f in zip(described, fits, strict=True)]
    law = settings.law or _best(described, fits)
    chosen, own = next(both for both in zip(fits, described, strict=True) if both[1].name == law)
    findings, identifiable = _findings(chosen, own, numbers, known, at)
    below_surface = _downhole(problem, main)
    if below_surface is not None:
        findings.append(
            f"driven by the downhole speed the curve differs from that by the surface alone by at "
            f"most {below_surface:.1%}"
        )
    x = ident.draws_of(chosen, settings.draws, settings.seed, settings.confidence, floor)
    draws = np.array([chosen.family.coefficients(row, at) for row in x])
    seen = ident.portrait(problem)
    every = slice(None, None, max(1, len(seen.speed) // DRAWN_POINTS))
    track = windows[0].track
    return Identification(
        design=design, files=tuple(one.file for one in logs), law=law, fits=tuple(described),
        weight=at, weight_known=known, rate=logs[0].rate, used_rate=1.0 / track.spacing,
        period=period,
        begin=np.array([w.track.time[w.first] for w in windows]),
        end=np.array([w.track.time[w.last - 1] for w in windows]),
        sticks=np.array(main.sticks), numbers=tuple(numbers), identifiable=identifiable,
        findings=tuple(findings), draws=draws, trace=_trace(chosen), profile=_profile(chosen, at),
        portrait_speed=seen.speed[every], portrait_torque=seen.torque[every],
        downhole_difference=below_surface,
    )  # fmt: skip


def _refuse_implausible(
    windows: Sequence[Any], weight: float | None, line: Parts, period: float
) -> None:
    """Refuse a speed, a torque or a weight that no rig has: another column, or another unit."""
    speed = float(np.median([np.median(w.track.speed) for w in windows]))
    torque = float(np.median([np.median(w.track.torque) for w in windows]))
    text = ""
    if not 0.0 <= speed <= units.SPEED.usual[1]:
        text = f"top speed of this log is {speed / units.RPM:.4g} rpm"
    # Of turns while the bit stands still for a period: rigs of any size have some.
    turns = torque / stiffness(line) / max(speed * period, 1e-9)
    if not text and not USUAL_TWIST[0] <= turns <= USUAL_TWIST[1]:
        twist = torque / stiffness(line) / (2.0 * np.pi)
        text = f"top torque of this log is {torque:.4g} N m, {twist:.3g} turns of the string,"
    lever = None if weight is None else torque / weight
    if not text and lever is not None and not USUAL_LEVER[0] <= lever <= USUAL_LEVER[1]:
        text = f"weight on bit of this log is {weight:.4g} N at a top torque of {torque:.4g} N m"
    if text:
        raise InputError(
            f"the {text} on the median, which no rig drills with: another column, or its unit is "
            "not the one it was read in (drillctl log prints both)",
            "--log",
        )


def _refuse_foreign(problem: Problem, main: Fit) -> None:
    """Refuse a log that the string cannot have made; name a unit that would explain it."""
    few = replace(problem, windows=problem.windows[:2], free=())
    own = fit(few, main.family, main.x[: main.numbers], main.begins[:2], rounds=4)
    if own.quiet:
        return
    noise = 1.0 - own.explained
    if noise > FOREIGN and own.signal > ident.TELLING:
        left = {}
        for factor, said in WRONG_UNITS:
            tracks = [replace(w.track, torque=w.track.torque / factor) for w in few.windows]
            scaled = replace(few, windows=tuple(
                replace(w, track=one) for w, one in zip(few.windows, tracks, strict=True)
            ))  # fmt: skip
            left[said] = max(1.0 - ident.best_fit(scaled, main.family).explained, 0.0)
        best = min(left.values())
        if best < min(0.25 * noise, 0.1):
            words = " or ".join(said for said, x in left.items() if x < 2.0 * best + FOREIGN)
            raise InputError(
                f"torque and speed of this log are not those of this string: {noise:.1%} of the "
                f"returning wave is unexplained, but {best:.1%} if {words}; name units in [log]",
                "--log",
            )
    if own.explained < ident.POORLY:
        raise InputError(
            f"the string of this design explains {max(own.explained, 0.0):.0%} of what returns to "
            "the top in this log: wrong columns, another rig, or a torque without the drive's "
            "inertia; friction is not identifiable",
            "--log",
        )


def _checked(problem: Problem, main: Fit) -> Fit | None:
    """The fit with all numbers of the rig free; None where too few windows tell their scatter."""
    if len(problem.windows) < 2 or main.signal < ident.TELLING:
        return None
    free = replace(problem, free=_of_string(problem.parts))
    extra = [getattr(main.factors, name) for name in free.free]
    return fit(
        free, main.family, np.concatenate((main.x[: main.numbers], extra)), main.begins, rounds=8
    )


def _of_string(line: Parts) -> tuple[str, ...]:
    """Numbers of the rig that a log can tell; a lumped string has no travel time."""
    return tuple(name for name in FACTORS if travel_time(line) or name != "travel_time")


def _numbers(problem: Problem, main: Fit, checked: Fit | None, level: float) -> list[StringNumber]:
    line = problem.parts
    body = line.bit_inertia + (line.sections[0].end_inertia if is_uniform(line) else 0.0)
    design = {
        "travel_time": travel_time(line), "impedance": impedance(line), "bit_inertia": body,
        "drive_inertia": line.top_inertia,
    }  # fmt: skip
    words = NUMBERS
    if not travel_time(line):
        design["impedance"] = stiffness(line)
        words = NUMBERS | {"impedance": ("stiffness of the string", "N*m/rad")}
    results = []
    for name in _of_string(line):
        fitted = name in problem.free
        source = main if fitted else checked
        factor = half = bias = np.nan
        if source is not None:
            k = source.numbers + source.problem.free.index(name)
            factor = float(source.x[k])
            half = float(ident.interval(source.leave[:, k], level))
            bias = float(ident.noise_bias(source)[source.problem.free.index(name)])
            half += bias
        apart = abs(factor - 1.0)
        # What noise may have moved so far says nothing of the rig.
        off = bool(apart > max(ident.OFF, 2.0 * half, 4.0 * bias)) and not fitted
        value = design[name]
        results.append(
            StringNumber(name, *words[name], value, factor * value, half * value, fitted, off)
        )
    return results


def _described(one: Fit, weight: float, score: float, level: float, floor: float) -> FittedLaw:
    speed, torque, wide = ident.band_of(one, level, floor)
    values, half = ident.half_widths(
        one, lambda x: one.family.coefficients(x, weight), level, floor
    )
    return FittedLaw(
        one.family.name, one.family.names, values, half, score, one.explained, one.size,
        speed, torque, torque - wide, torque + wide, one.curve.static,
    )  # fmt: skip


def _widened(law: FittedLaw, one: Fit, checked: Fit) -> FittedLaw:
    """A band that holds the curve with the rig's numbers free as well: they are in doubt."""
    other = checked.family.curve(checked.x[: checked.numbers]).torque(law.speed)
    margin = law.torque - law.low
    return replace(
        law, low=np.minimum(law.low, other - margin), high=np.maximum(law.high, other + margin)
    )


def _leading(fits: list[Fit]) -> Fit:
    """The fit that explains most; the first if it is as good."""
    missed = [1.0 - one.explained for one in fits]
    best = int(np.argmin(missed))
    return fits[0 if missed[0] <= 1.2 * missed[best] + 0.002 else best]


def _misfits(fits: list[Fit]) -> Array:
    """Misfits in units of the usual residual, neighbouring ones alike."""
    size = min(one.size for one in fits)
    return np.array([2.0 * one.objective / size**2 / one.problem.alike for one in fits])


def _not_told_apart(described: list[FittedLaw], fits: list[Fit]) -> list[FittedLaw]:
    """Bands that hold the curves of other laws, too, where the log does not tell them apart."""
    misfits, results = _misfits(fits), []
    for law, own in zip(described, misfits, strict=True):
        apart = np.zeros(len(law.speed))
        for other, misfit in zip(fits, misfits, strict=True):
            if misfit <= own + CLEARLY:
                apart = np.maximum(apart, np.abs(other.curve.torque(law.speed) - law.torque))
        half = np.maximum(law.high - law.torque, BEYOND * apart)
        results.append(replace(law, low=law.torque - half, high=law.torque + half))
    return results


def _best(described: list[FittedLaw], fits: list[Fit]) -> str:
    """Of the laws that predict the next windows nearly as well as the best, the one to write.

    Where the bit sticks the likeliest, at Schwarz's price of a number; where it does not, laws of
    one slope at the mean speed are all alike, and the first of them leaves its decay open.
    """
    count = sum(w.last - w.first for w in fits[0].problem.windows) / fits[0].problem.alike
    price = np.log(max(count, 2.0)) * np.array([one.numbers for one in fits])
    misfit = _misfits(fits) + price
    scores = np.array([one.hold_out for one in described])
    near = misfit <= misfit.min() + CLEARLY
    if np.isfinite(scores).all() and (near & (scores <= NEARLY * scores.min())).any():
        near &= scores <= NEARLY * scores.min()
    best = np.argmin(np.where(near, misfit, np.inf)) if any(fits[0].sticks) else np.argmax(near)
    return described[int(best)].name


def _findings(
    main: Fit, law: FittedLaw, numbers: list[StringNumber], known: bool, at: float
) -> tuple[list[str], dict[str, bool]]:
    """What the log says and does not say, by the law that is written."""
    findings: list[str] = []
    sticks = any(main.sticks)
    said = dict.fromkeys((*law.names, "static_friction"), True)
    if main.quiet:
        said |= dict.fromkeys(law.names, False)
        findings.append(
            "the log holds hardly more than its noise: what is seen is the mean torque at the mean "
            "speed, and no string, slope or decay"
        )
    elif law.explained < ident.PARTLY:
        said |= dict.fromkeys(said, False)
        findings.append(
            f"rig and law explain {law.explained:.0%} of what returns to the top beyond the noise: "
            "something in this log is not in the design, such as a sensor that stood still, drag "
            "at the wall or another string; no coefficient is identified"
        )
    rpm = units.RPM
    slow, fast = max(main.slowest, 0.0), main.fastest
    if not sticks:
        said["static_friction"] = said["a2"] = said["beta"] = False
        findings.append(
            f"no break-away in this log: the bit never stands still, so static friction is not "
            f"seen; the curve is known from {slow / rpm:.0f} to {fast / rpm:.0f} rpm alone"
        )
    ends = main.curve.torque(np.array([slow if not sticks else 0.0, fast]))
    fall = float(ends[0] - ends[1]) / float(ends[0])
    if main.quiet:
        pass  # it says nothing of a slope
    elif fall < ident.FLAT:
        said["beta"] = said["a2"] = False
        findings.append(
            f"the torque falls by {fall:.1%} from {slow / rpm:.0f} to {fast / rpm:.0f} rpm: it is "
            "flat, and how it decays (beta) is not identified; Coulomb's law or tabulated points "
            "say all there is"
        )
    elif main.family.name == "navarro-lopez-suarez" and (
        main.curve.numbers[2] * (fast - slow) < ident.SLOW_FALL or main.x[0] <= 0.0
    ):
        said["beta"] = said["a1"] = False
        findings.append(
            "the torque falls along a straight line over the speeds seen: beta is not identified, "
            "use the tabulated law"
        )
    for name, value, half in zip(law.names, law.values, law.half, strict=True):
        if said[name] and half > ident.LOOSE * abs(value) * 1.645:
            said[name] = False
            findings.append(
                f"{name} is not identified: {value:.3g} within {half:.2g}; the curve is what the "
                "log says"
            )
    if len(main.sticks) < 2:
        findings.append("one window alone: its scatter is hardly known, the band is a guess")
    if not known:
        logged = all(w.track.weight is not None for w in main.problem.windows)
        absent = "missing or next to nothing somewhere" if logged else "not in the log"
        findings.append(
            f"the weight on bit is {absent}: the curve is torque at its mean weight, and the "
            f"coefficients take it for the design's {units.full(at, 'N', 4)}"
        )
    for one in numbers:
        said[one.name] = bool(np.isfinite(one.half) and one.half < ident.LOOSE * one.design)
        if one.off:
            own, log, half = (
                units.full(value, one.unit, digits)
                for value, digits in ((one.design, 4), (one.log, 4), (one.half, 2))
            )
            findings.append(
                f"{one.label}: the design has {own}, the log {log} within {half} "
                f"({one.log / one.design - 1.0:+.0%}); correct it, or fit it "
                f'with [identify] free = ["{one.name}"]. The band was widened to hold both'
            )
    return findings, said


def _downhole(problem: Problem, main: Fit) -> float | None:
    """Largest relative difference of the curve by the downhole speed from that by the surface."""
    if any(w.track.bit is None for w in problem.windows):
        return None
    other = fit(replace(problem, downhole=True), main.family, main.x, main.begins, rounds=8)
    speed = np.linspace(max(main.slowest, 0.0), main.fastest, 20)
    one, two = main.curve.torque(speed), other.curve.torque(speed)
    return float(np.max(np.abs(two / one - 1.0)))


def _trace(one: Fit) -> Trace:
    """The first window with sticks, or the first."""
    k = next((k for k, sticks in enumerate(one.sticks) if sticks), 0)
    window = one.problem.windows[k]
    made = driven(one.problem, window, one.factors)
    motion = run(made, one.curve, window.weight, float(one.begins[k]))
    time = window.track.time[window.first : window.last]
    lag = below(one.problem.parts, one.factors).delay
    hole = (
        None
        if window.track.bit is None
        else np.interp(time - lag, window.track.time, window.track.bit)
    )
    return Trace(time, made.up, motion.up, motion.bit, motion.torque, hole)


def _profile(one: Fit, weight: float) -> dict[str, Array]:
    """Objective with a number held at values around the best, in units of a standard deviation."""
    if one.family.name == "tabulated":
        return {}
    n, results = one.numbers, {}
    spread = np.sqrt(
        (len(one.leave) - 1) * one.leave.var(axis=0) + np.diag(one.unsaid)[: len(one.x)]
    )
    for j, name in enumerate(one.family.names):
        values, rises = [], []
        for step in (-3.0, -1.5, 1.5, 3.0):
            x = one.x.copy()
            x[j] = np.clip(x[j] + step * spread[j], one.family.least[j], one.family.most[j])
            other = fit(one.problem, one.family, x, one.begins, rounds=2, hold=j)
            values.append(float(one.family.coefficients(other.x[:n], weight)[j]))
            rises.append(2.0 * (other.objective - one.objective) / one.size**2)
        values.insert(2, float(one.family.coefficients(one.x[:n], weight)[j]))
        rises.insert(2, 0.0)
        results[name] = np.array([values, rises])
    return results
