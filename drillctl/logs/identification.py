"""From windows of a log to laws of friction with bands, and to what the log does not say."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtri, stdtrit

from drillctl.arrays import Array, runs
from drillctl.errors import InputError
from drillctl.logs.fit import Fit, Problem, Window, driven, fit, residual
from drillctl.logs.laws import LEAST_DECAY, MOST_DECAY, Family
from drillctl.logs.record import Log
from drillctl.logs.waves import Portrait, at_the_bit, below, swing, track
from drillctl.logs.windows import tonal_share
from drillctl.rig.drillstring import Parts

CYCLES = 3  # of a window at least
LEAST_SAMPLES = 30  # a period of the string
SHORTEST = 20.0  # of a window (s), or
SHORT_CYCLES = 8  # of a quick string
LONGEST = 90.0
MOVED = 0.2  # change of the weight from cycle to cycle, of its mean, that is no steady drilling
LIGHT = 0.2  # of the largest weight, below which the bit is off bottom
LEAST_SPEED = 0.5  # mean speed (rad/s) of a window: turning
STILL, MOMENT = 0.05, 3.0  # speed (rad/s) and time (s) of a top that stands still
POORLY = 0.7  # share of the returning wave that a model explains, below which it is none
PARTLY = 0.9  # and below which its coefficients are not those of the rock
OFF = 0.1  # relative difference of a number of the rig that is told
FLAT = 0.03  # fall of the torque over the speeds seen, of itself, that is none
TELLING = 30.0  # variance over that of noise from which the string can be checked
UNSEEN = 0.5  # spread of the logarithm of the decay, where no stick shows the torque at rest
LOOSE = 0.25  # relative standard deviation of a coefficient that is not identified
SLOW_FALL = 0.2  # decay times the range of speeds below which a fall is straight
POINTS_OF_CURVE = 41
FINE = 0.06  # time between samples (s), less of a quick string, from which
FINE_FLOOR = 0.6  # of the floor is enough


Place = tuple[float, float, float, slice]  # tonal share, begin, end, run


def tracks_of(
    log: Log,
    parts: Parts,
    period: float,
    length: float | None,
    most: int,
    lags: tuple[float, float] = (0.0, 0.0),
) -> list[Window]:
    """Windows to fit.

    Even tracks of the stretches that rotate under torque, cut into windows of three cycles; of
    more than `most` those that swing most at one frequency.
    """
    lag = below(parts).memory + 4.0 * log.spacing
    shortest = min(SHORTEST, SHORT_CYCLES * period)
    places = runs_of(log, 0.5 * shortest)
    cycle = _cycle(log, places, period)
    own = length or min(max(CYCLES * cycle, CYCLES * period, shortest), max(LONGEST, 3.2 * period))
    found: list[Place] = []
    for part in places:
        time = log.time[part]
        first, last = float(time[0]) + lag, float(time[-1]) - 3.0 * log.spacing
        count = int((last - first) // own)
        if count == 0 and last - first >= 0.6 * own and length is None:
            count, begin, end = 1, first, last
            found.append((0.0, begin, end, part))
            continue
        for k in range(count):
            # The whole stretch is used: what is left over is divided among its windows.
            wide = (last - first) / count
            begin, end = first + k * wide, first + (k + 1) * wide
            inside = slice(*np.searchsorted(log.time, (begin, end)).tolist())
            share, _ = tonal_share(
                log.time[inside], log.signal("top_torque", inside), (0.25 / period, 2.0 / period)
            )
            found.append((share, begin, end, part))
    chosen = sorted(_steady(log, found, period), key=lambda one: -one[0])[:most]
    chosen = sorted(chosen, key=lambda one: one[1])
    return [_window(log, begin, end, lag, lags, part, period) for _, begin, end, part in chosen]


def _steady(log: Log, found: list[Place], period: float) -> list[Place]:
    """Windows whose logged weight holds: a fit takes one weight a window. All if none does."""
    if "weight_on_bit" not in log.signals:
        return found
    results = []
    for one in found:
        rows = slice(*np.searchsorted(log.time, one[1:3]).tolist())
        count = max(CYCLES, round((one[2] - one[1]) / period))
        cycles = np.array_split(log.signal("weight_on_bit", rows), count)
        means = [float(cycle.mean()) for cycle in cycles]
        if np.ptp(means) < MOVED * np.mean(means):
            results.append(one)
    return results or found


def runs_of(log: Log, least: float) -> list[slice]:
    """Runs of rows, `least` (s) long, without gaps and faults where the string turns on bottom."""
    torque, speed = log.signals["top_torque"], log.signals["top_speed"]
    good = log.usable & np.isfinite(torque) & np.isfinite(speed)
    # A soft drive is stopped by the bit for a moment; what lasts is no drilling.
    still = np.abs(speed) < STILL
    if "weight_on_bit" in log.signals:
        weight = log.signals["weight_on_bit"]
        heavy = float(np.nanquantile(weight, 0.95))
        still = still | ((weight < LIGHT * heavy) & (heavy > 0.0))
    moments = runs(still)
    for first, last in moments[np.ptp(moments, axis=1) * log.spacing > MOMENT]:
        good[first:last] = False
    results = []
    for stretch in log.stretches:
        for a, b in runs(good[stretch]):
            rows = slice(stretch.start + int(a), stretch.start + int(b))
            if (b - a) * log.spacing > least and (
                np.mean(log.signals["top_speed"][rows]) > LEAST_SPEED
            ):
                results.append(rows)
    return results


def _cycle(log: Log, places: Sequence[slice], period: float) -> float:
    """Period (s) of the torque in the longest run: stick-slip is slower than the string."""
    if not places:
        return period
    longest = max(places, key=lambda part: part.stop - part.start)
    rows = slice(longest.start, min(longest.stop, longest.start + int(600.0 / log.spacing)))
    time = log.time[rows]
    low = max(0.2 / period, 3.0 / float(time[-1] - time[0]))
    _, cycle = tonal_share(time, log.signal("top_torque", rows), (low, 1.5 / period))
    return float(cycle) if np.isfinite(cycle) else period


def _window(
    log: Log, begin: float, end: float, lag: float, lags: tuple[float, float], part: slice,
    period: float,
) -> Window:  # fmt: skip
    """The track of a window with what goes before it."""
    first, last = np.searchsorted(log.time, (begin - lag, end + 3.0 * log.spacing))
    rows = slice(max(int(first) - 1, 0), int(last) + 1)
    rows = slice(max(rows.start, part.start), min(rows.stop, part.stop))
    names = ("weight_on_bit", "bit_speed")
    held = [log.signal(n, rows) if n in log.signals else None for n in names]
    held = [None if one is None or not np.isfinite(one).all() else one for one in held]
    # A signal that is late by a lag was true so much earlier.
    torque, speed = (
        np.interp(log.time[rows] + late, log.time[rows], log.signal(name, rows))
        if late
        else log.signal(name, rows)
        for name, late in zip(("top_torque", "top_speed"), lags, strict=True)
    )
    made = track(log.time[rows], torque, speed, period, *held)
    place = np.searchsorted(made.time, (begin, end))
    last_sample = min(int(place[1]), len(made.time) - 3)
    return Window(made, int(place[0]), last_sample, 1.0)


def refuse_slow(rate: float, period: float) -> None:
    """Refuse (`InputError`) a log with too few samples a period."""
    needed = LEAST_SAMPLES / period
    if rate < needed * 0.999:
        raise InputError(
            f"{rate:.3g} Hz is too slow for a period of {period:.3g} s: friction is seen at the "
            f"edges of stick and slip, and {LEAST_SAMPLES} samples a period, {needed:.3g} Hz, are "
            "the least; it is not identifiable from this log",
            "--log",
        )


def weighted(windows: Sequence[Window]) -> tuple[tuple[Window, ...], float | None]:
    """Windows with their weight over the mean one, and that mean (N); None if it is not logged."""
    held = [one.track.weight for one in windows]
    if any(one is None for one in held):
        return tuple(windows), None
    means = [float(w.track.weight[w.first : w.last].mean()) for w in windows]  # type: ignore[index]
    mean = float(np.mean(means))
    if not mean > 0.0 or min(means) < 0.2 * mean:
        return tuple(windows), None
    return tuple(replace(w, weight=m / mean) for w, m in zip(windows, means, strict=True)), mean


def portrait(problem: Problem) -> Portrait:
    """Bit speed and torque from the waves alone, in all windows."""
    string = below(problem.parts)
    found = [at_the_bit(problem.parts, string, window.track) for window in problem.windows]
    return Portrait(*(np.concatenate(x) for x in zip(*found, strict=True)))


def rough(problem: Problem) -> tuple[float, float]:
    """Torque at rest and sliding torque (N m) to begin a fit with."""
    mean = float(np.mean([np.mean(w.track.torque[w.first : w.last]) for w in problem.windows]))
    return 1.3 * mean, 0.8 * mean


def best_fit(problem: Problem, family: Family, like: Fit | None = None) -> Fit:
    """The best of fits from several beginnings, on a few windows first; or from another law."""
    extra = np.ones(len(problem.free))
    if like is not None:
        low, high = like.curve.torque(np.array([0.0, like.fastest]))[::-1]
        begin = family.start(float(high), float(low), 3.0 / max(like.fastest, 1.0))
        if family.knots:
            torque = like.curve.torque(np.array(family.knots))
            begin = np.array([0.001 * high, *np.maximum(-np.diff(torque), 0.0), torque[-1]])
        return fit(problem, family, np.concatenate((begin, like.x[like.numbers :])), like.begins)
    static, sliding = rough(problem)
    few = replace(problem, windows=problem.windows[:: max(1, len(problem.windows) // 3)][:3])
    begins = [
        np.concatenate((family.start(s * static, sliding, d * family.decay), extra))
        for d in ((0.5, 2.0) if family.name == "navarro-lopez-suarez" else (1.0,))
        for s in (1.0, 1.6)
    ]
    trials = [fit(few, family, begin, rounds=8) for begin in begins]
    return fit(problem, family, min(trials, key=lambda one: one.objective).x)


def interval(leave: Array, level: float) -> Array:
    """Half widths of a band from values with each piece left out."""
    n = len(leave)
    variance = (n - 1) / n * ((leave - leave.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(stdtrit(n - 1, 0.5 + 0.5 * level) * np.sqrt(variance))


def floor_at(floor: float, problem: Problem) -> float:
    """The floor of a log: less where it is sampled finely, as sampling is what is in common."""
    fine = FINE * min(1.0, 0.4 * swing(problem.parts))
    return floor if problem.windows[0].track.spacing > fine else FINE_FLOOR * floor


def half_widths(
    one: Fit, of: Callable[[Array], Array], level: float, floor: float
) -> tuple[Array, Array]:
    """Values that follow from the numbers of a law, and half widths of their band.

    To first order: scatter between pieces of the log, what usual numbers leave open where it says
    nothing, and a floor for what pieces have in common. One window's pieces are alike: ten floors.
    """
    n = one.numbers
    x, values = one.x[:n], of(one.x[:n])
    steps = 1e-5 * one.family.scale(x)
    slopes = np.array([
        (of(x + step * np.eye(n)[j]) - values) / step for j, step in enumerate(steps)
    ])  # fmt: skip
    left = np.einsum("jw,jk,kw->w", slopes, one.unsaid[:n, :n], slopes)
    half = interval((one.leave[:, :n] - x) @ slopes, level)
    half = np.hypot(half, normal(level) * np.sqrt(np.maximum(left, 0.0)))
    common = floor if len(one.sticks) > 1 else 10.0 * floor
    return values, np.hypot(half, common * np.abs(values))


def noise_bias(one: Fit) -> Array:
    """How far noise of the top's acceleration moves the free factors, to first order.

    It is in what the string is driven by, times the drive's inertia: the less of that, the less
    is left of it.
    """
    free, problem = one.problem.free, one.problem
    if "drive_inertia" not in free:
        return np.zeros(len(free))
    at, inertia = free.index("drive_inertia"), problem.parts.top_inertia
    pull = sum(
        2.0 * (w.last - w.first) * (inertia * w.track.rise_noise) ** 2 for w in problem.windows
    )
    # The curvature is of noisy slopes, and has the pull in it already.
    pulled = np.linalg.inv(one.normal)[:, at] * pull
    return np.asarray(np.abs(pulled) * one.factors.drive_inertia / (1.0 - min(pulled[at], 0.9)))


def normal(level: float) -> float:
    """Half width of a band of a normal distribution, over its standard deviation."""
    return float(ndtri(0.5 + 0.5 * level))


def band_of(one: Fit, level: float, floor: float) -> tuple[Array, Array, Array]:
    """Speeds that were seen (rad/s), the torque there and half widths of its band (N m).

    From scatter between pieces of windows and a floor.
    """
    low = max(one.slowest, 0.0) if not any(one.sticks) else 0.0
    speed = np.linspace(low, max(one.fastest, low + 0.1), POINTS_OF_CURVE)
    torque, half = half_widths(one, lambda x: one.family.curve(x).torque(speed), level, floor)
    return speed, torque, half


def draws_of(one: Fit, count: int, seed: int, level: float, floor: float) -> Array:
    """Joint draws of the numbers of a law: Student's t of the scatter between windows."""
    n, numbers = len(one.leave), one.numbers
    random = np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, numbers])))
    centred = (one.leave - one.leave.mean(axis=0))[:, :numbers]
    covariance = (n - 1) / n * centred.T @ centred
    x = one.x[:numbers]
    root, loose = _root(covariance), _root(one.unsaid[:numbers, :numbers])
    degrees = max(n - 1, 1)
    # Without a stick the value and the slope at the mean speed are seen, and no torque at rest.
    exponential = one.family.name == "navarro-lopez-suarez"
    spread = 0.0 if any(one.sticks) or not exponential else UNSEEN
    speed = 0.5 * (max(one.slowest, 0.0) + one.fastest)
    least, most = one.family.least, one.family.most
    result: list[Array] = []
    while len(result) < count:
        # Of few windows the tails are cut where the band ends by far.
        stretch = min(np.sqrt(degrees / random.chisquare(degrees)), 3.0)
        trial = x + stretch * root @ random.standard_normal(numbers)
        trial += loose @ random.standard_normal(numbers)
        common = 1.0 + floor / normal(level) * random.standard_normal()
        torques = slice(0, 2) if one.family.name == "navarro-lopez-suarez" else slice(0, numbers)
        trial[torques] *= common
        if spread:
            trial = _bent(trial, speed, spread * random.standard_normal())
        result.append(np.clip(trial, least, most))
    return np.array(result)


def _bent(x: Array, speed: float, change: float) -> Array:
    """The exponential law with another decay, and the same value and slope at a speed."""
    low, drop, decay = x[0], x[1], np.exp(x[2])
    fall = drop * np.exp(-decay * speed)
    other = np.clip(decay * np.exp(change), LEAST_DECAY, MOST_DECAY)
    left = fall * decay / other
    base = low + fall - left
    if base < 0.0:
        return x
    return np.array([base, left * np.exp(other * speed), np.log(other)])


def _root(covariance: Array) -> Array:
    values, shapes = np.linalg.eigh(covariance)
    return np.asarray(shapes * np.sqrt(np.maximum(values, 0.0)))


def held_out(problem: Problem, family: Family, x: Array, begins: Array, last: int = 3) -> float:
    """Root mean square of what fits to the windows before miss of the next ones, over its swing."""
    n = len(problem.windows)
    errors, swings = [], []
    for k in range(max(1, n - last), n):
        before = fit(replace(problem, windows=problem.windows[:k]), family, x, begins[:k], rounds=2)
        one = replace(problem, windows=problem.windows[k : k + 1])
        # Its own beginning is no part of the law: the torque is held, the beginning fitted.
        only = fit(one, family, before.x, begins[k : k + 1], rounds=0)
        made = driven(one, one.windows[0], before.factors)
        curve = family.curve(before.x[: before.numbers])
        misses = residual(one, one.windows[0], made, curve, float(only.begins[0]))
        errors.append(np.mean(misses**2))
        swings.append(np.var(made.up))
    return float(np.sqrt(np.mean(errors) / np.mean(swings))) if errors else float("nan")
