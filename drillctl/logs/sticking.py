"""When the bit stood still: from its own speed where that is logged, else from the waves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drillctl.arrays import Array, Mask, runs
from drillctl.logs.identification import runs_of
from drillctl.logs.record import Log
from drillctl.logs.waves import at_the_bit, below, swing, track
from drillctl.rig.drillstring import Parts

STILL = 0.05  # of the mean speed at the top: a bit that is slower is stuck
SHORTEST = 0.02  # of a period: what is shorter is noise
CHUNK = 600.0  # (s) inverted at a time

Spans = Array
"""Begin and end (s) of intervals, shape (intervals, 2)."""


def sticking(log: Log, line: Parts | None, finest: float) -> Spans | None:
    """Intervals in which the bit stands still; None where neither its speed nor a string is known.

    Those nearer than `finest` (s) are one.
    """
    if "bit_speed" in log.signals:
        parts = _logged(log)
    elif line is not None:
        parts = _by_waves(log, line)
    else:
        return None
    spans = np.concatenate([np.zeros((0, 2)), *parts])
    if not len(spans):
        return spans
    apart = np.flatnonzero(spans[1:, 0] - spans[:-1, 1] > finest)
    return np.column_stack((spans[[0, *(apart + 1)], 0], spans[[*apart, len(spans) - 1], 1]))


def _logged(log: Log) -> Iterator[Spans]:
    for part in log.stretches:
        speed, bit = log.signals["top_speed"][part], log.signals["bit_speed"][part]
        mean = np.nanmean(speed) if np.isfinite(speed).any() else np.nan
        with np.errstate(invalid="ignore"):
            yield _spans(np.abs(bit) < STILL * mean, log.time[part])


def _by_waves(log: Log, line: Parts) -> Iterator[Spans]:
    string, period = below(line), swing(line)
    lost = string.memory + 2.0 * string.delay
    count = int(max(CHUNK, 6.0 * lost) / log.spacing)
    for run in runs_of(log, 4.0 * lost):
        for first in range(run.start, run.stop, max(count - int(2.0 * lost / log.spacing), 1)):
            rows = slice(first, min(first + count, run.stop))
            if (rows.stop - rows.start) * log.spacing < 4.0 * lost:
                break
            time = log.time[rows]
            torque, speed = (log.signal(k, rows) for k in ("top_torque", "top_speed"))
            seen = at_the_bit(line, string, track(time, torque, speed, period))
            slow = seen.speed < STILL * speed.mean()
            found = _spans(slow, seen.time - string.delay)
            yield found[found[:, 1] - found[:, 0] > SHORTEST * period]


def _spans(where: Mask, time: Array) -> Spans:
    return time[runs(where) - (0, 1)]


def share(spans: Spans, begin: float, end: float) -> float:
    """Share of a window that lies in intervals."""
    inside = np.clip(spans[:, 1], begin, end) - np.clip(spans[:, 0], begin, end)
    return float(inside.sum() / (end - begin))
