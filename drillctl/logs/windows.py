"""Windows of a log, ranked by how much of the torque's variance swings at one frequency.

A window is of rotating time alone, within a stretch without gaps. Its torque, less a quadratic
trend, under a Hann window, has a spectrum: the tonal share is the power within two lines of the
largest one of the string's band, over the power above `SLOW`. A swing alone, as large steps of
set speed make, would rank others first.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from drillctl.arrays import Array
from drillctl.errors import InputError
from drillctl.logs.record import Log
from drillctl.progress import SILENT, Progress

LENGTH = 300.0  # of a window (s), less in short logs
PERIODS = (3.0, 15.0)  # of stick-slip (s) where no string is known
AROUND = (0.5, 1.5)  # of the first frequency of the string with the top held: its band
SLOW = 0.02  # (Hz) what is slower is no vibration
NEAR = 2  # lines on either side of the largest that belong to it
LEAST_SPEED = 30.0 * np.pi / 30.0  # (rad/s) at any time in a window: rotating, or
UNDER_TORQUE = 0.5  # of its mean torque
LEAST_TORQUE = 500.0  # mean of a window (N m): drilling
SMALL = 0.3, 0.05  # shares of the largest speed and torque that are least on smaller rigs
ROTATING = 0.98  # least share of a window that rotates
ENDS = (1.0, 99.0)  # percentiles that are the swing of surface torque, which carries noise
ALIKE = 0.15  # largest relative difference of period of neighbours that are merged


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of one or more logs, by time; every array of shape (windows,)."""

    log: Array  # number of the log
    begin: Array  # (s)
    end: Array  # (s)
    share: Array  # tonal share
    period: Array  # of the strongest line (s)
    index: Array  # stick-slip index
    torque: Array  # mean (N m)
    swing: Array  # of the torque, from the lower to the upper percentile (N m)
    speed: Array  # mean of the top speed (rad/s)
    weight: Array  # mean weight on bit (N); NaN where it is not logged
    stuck: Array  # share of time at which the bit stands still; NaN where that is not known
    from_bit: bool  # whether the index is of a downhole speed

    def __len__(self) -> int:
        return len(self.begin)


NUMBERS = tuple(one.name for one in fields(Windows))[:-1]


class Event(NamedTuple):
    """Neighbouring windows with one oscillation, merged."""

    log: int
    begin: float  # (s)
    end: float  # (s)
    best: int  # number of its strongest window


def band_of(frequency: float | None) -> tuple[float, float]:
    """Frequencies (Hz) of stick-slip: about the string's first one, or of usual periods."""
    if frequency is None:
        return 1.0 / PERIODS[1], 1.0 / PERIODS[0]
    return AROUND[0] * frequency, AROUND[1] * frequency


def windows_of(
    logs: tuple[Log, ...],
    band: tuple[float, float],
    length: float | None = None,
    progress: Progress = SILENT,
) -> Windows:
    """Every window of some logs, each half over the next."""
    if length is not None and length * band[1] < 2.0:
        raise InputError(
            f"{length:g} s is less than two of the shortest period looked for, {1 / band[1]:.3g} s",
            "log.window",
        )
    from_bit = all("bit_speed" in log.signals for log in logs)
    rows: list[tuple[float, ...]] = []
    for number, log in enumerate(logs):
        span = float(log.time[-1])
        own = length or min(LENGTH, max(span / 4.0, 6.0 / band[0]))
        count = max(int(own / log.spacing), 16)
        places, least = _places(log, count), _least(log)
        progress.begin(f"windows of {log.file}", max(len(places), 1))
        for first in places:
            row = _measured(log, slice(first, first + count), band, from_bit, least)
            if row is not None:
                rows.append((number, *row))
            progress.advance(1)
    table = np.array(rows, dtype=float).reshape(-1, len(NUMBERS)).T
    return Windows(**dict(zip(NUMBERS, table, strict=True)), from_bit=from_bit)


def _places(log: Log, count: int) -> list[int]:
    """First rows of windows of so many rows."""
    usable = log.usable
    results: list[int] = []
    for part in log.stretches:
        last = part.stop - count
        results += list(range(part.start, last + 1, max(count // 2, 1)))
    summed = np.concatenate(([0], np.cumsum(~usable)))
    return [k for k in results if summed[k + count] - summed[k] <= 0.02 * count]


def _least(log: Log) -> tuple[float, float]:
    """Least speed and torque of drilling: of rigs, or on a smaller one shares of its largest."""
    every = slice(None, None, max(1, len(log.time) // 100_000))
    speed, torque = (
        float(np.nanquantile(log.signals[name][every], 0.99))
        for name in ("top_speed", "top_torque")
    )
    return (
        LEAST_SPEED if speed > LEAST_SPEED else SMALL[0] * speed,
        LEAST_TORQUE if torque > LEAST_TORQUE else SMALL[1] * torque,
    )


def _measured(
    log: Log, rows: slice, band: tuple[float, float], from_bit: bool, least: tuple[float, float]
) -> tuple[float, ...] | None:
    """Numbers of a window; None where the string does not rotate and drill."""
    time = log.time[rows]
    speed = log.signal("top_speed", rows)
    torque = log.signal("top_torque", rows)
    good = np.isfinite(speed) & np.isfinite(torque)
    if good.mean() < ROTATING:
        return None
    if not good.all():  # a few values, within a stretch
        speed, torque = (np.interp(time, time[good], x[good]) for x in (speed, torque))
    # A soft drive is stopped for moments by a bit that sticks, under torque.
    turning = (speed >= least[0]) | (torque >= UNDER_TORQUE * torque.mean())
    drilling = speed.mean() >= least[0] > 0.0 and torque.mean() >= least[1] > 0.0
    if turning.mean() < ROTATING or not drilling:
        return None
    share, period = tonal_share(time, torque, band)
    low, high = np.percentile(torque, ENDS)
    index = float((high - low) / (2.0 * torque.mean()))
    if from_bit:
        bit = _known(log, "bit_speed", rows)
        mean = bit.mean() if len(bit) else 0.0
        index = float(np.ptp(bit) / (2.0 * mean)) if mean > 0.0 else np.nan
    weight = _known(log, "weight_on_bit", rows)
    return (
        float(time[0]), float(time[-1]), share, period, index, float(torque.mean()),
        float(high - low), float(speed.mean()), float(weight.mean()) if len(weight) else np.nan,
        np.nan,
    )  # fmt: skip


def _known(log: Log, name: str, rows: slice) -> Array:
    """Values of a signal that are there, if any."""
    values = np.asarray(log.signals.get(name, ())[rows], float)
    return values[np.isfinite(values)]


def tonal_share(time: Array, torque: Array, band: tuple[float, float]) -> tuple[float, float]:
    """Share of the torque's variance in the strongest line of a band, and its period (s)."""
    frequency, power = spectrum(time, torque)
    inside = np.flatnonzero((frequency >= band[0]) & (frequency <= band[1]))
    total = power[frequency > SLOW].sum()
    if not len(inside) or not total > 0.0:
        return 0.0, np.nan
    peak = int(inside[np.argmax(power[inside])])
    # Inside the band: what swells towards slow frequencies is no line of it.
    near = power[max(peak - NEAR, inside[0]) : min(peak + NEAR, inside[-1]) + 1].sum()
    return float(near / total), 1.0 / _refined(frequency, power, peak)


def _refined(frequency: Array, power: Array, peak: int) -> float:
    """Frequency of a peak between the lines: a parabola through three logarithms."""
    if not 0 < peak < len(power) - 1 or not (power[peak - 1 : peak + 2] > 0.0).all():
        return float(frequency[peak])
    a, b, c = np.log(power[peak - 1 : peak + 2])
    bend = a - 2.0 * b + c
    shift = 0.5 * (a - c) / bend if bend < 0.0 else 0.0
    return float(frequency[peak] + shift * (frequency[1] - frequency[0]))


def spectrum(time: Array, torque: Array) -> tuple[Array, Array]:
    """Frequencies (Hz) and power of a signal less its quadratic trend, on even times."""
    even = np.linspace(time[0], time[-1], len(time))
    values = np.interp(even, time, torque)
    x = np.linspace(-1.0, 1.0, len(even))
    values = values - np.polynomial.polynomial.polyval(
        x, np.polynomial.polynomial.polyfit(x, values, 2)
    )
    power = np.abs(np.fft.rfft(values * np.hanning(len(values)))) ** 2
    return np.fft.rfftfreq(len(values), even[1] - even[0]), power


def events_of(windows: Windows) -> list[Event]:
    """Oscillations, the strongest tonal share first; overlapping windows of one are merged."""
    taken = np.zeros(len(windows), bool)
    results = []
    for best in np.argsort(-windows.share, kind="stable").tolist():
        if taken[best]:
            continue
        low = high = best
        for step in (-1, 1):
            near = best + step
            while 0 <= near < len(windows) and _joined(windows, best, near, near - step):
                if taken[near]:
                    break
                low, high = min(low, near), max(high, near)
                near += step
        taken[low : high + 1] = True
        # What overlaps the strongest window is no event of its own.
        overlap = (
            (windows.log == windows.log[best])
            & (windows.begin < windows.end[high])
            & (windows.end > windows.begin[low])
        )
        taken |= overlap
        results.append(
            Event(int(windows.log[best]), float(windows.begin[low]), float(windows.end[high]), best)
        )
    return results


def _joined(windows: Windows, best: int, near: int, last: int) -> bool:
    """Whether a window belongs to the oscillation of a stronger one."""
    same = windows.log[near] == windows.log[best]
    touches = windows.begin[near] <= windows.end[last] and windows.end[near] >= windows.begin[last]
    alike = abs(windows.period[near] / windows.period[best] - 1.0) < ALIKE
    return bool(same and touches and alike and windows.share[near] > 0.5 * windows.share[best])
