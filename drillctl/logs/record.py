"""A log: time, torque and speed at the top and whatever else there is, and what is wrong with it.

Nothing is interpolated across a gap: a log is a number of stretches, each of regular samples.
Outliers of one or two samples are replaced by the line between their neighbours, and counted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drillctl.arrays import Array, Index, Mask, runs
from drillctl.errors import InputError
from drillctl.logs.files import ABSENT, Source, open_source
from drillctl.logs.quantities import NEEDED, QUANTITIES, Chosen, choose
from drillctl.progress import SILENT, Progress

GAP = 2.5  # spacing of two samples, over the usual one, that counts as a gap
IRREGULAR = 0.1  # standard deviation of the spacing over the usual one that is told
FEWEST_ROWS = 32
DAY = 86400.0  # (s)
LARGEST = 1e15  # SI: whatever exceeds it was not measured; its square is a number as well
CLIPPED = 0.002  # share of rotating time at the very largest value that counts as clipping
STUCK_TIME = 20.0  # time (s) of one and the same torque under rotation: a sensor that is stuck
SPIKE = 12.0  # deviation from the running median, over its usual one, of an outlier
TURNING = 1.0  # top speed (rad/s) from which a string counts as rotating
MOST_LISTED = 20  # intervals of a fault that are listed one by one


@dataclass(frozen=True)
class Fault:
    """Something that is wrong with a log."""

    what: str  # in plain words
    count: int  # samples or intervals
    # (s) of those listed; empty where it is everywhere
    intervals: tuple[tuple[float, float], ...] = ()

    @property
    def said(self) -> str:
        """In a sentence, with the first places."""
        places = ", ".join(f"{a:.6g}-{b:.6g} s" for a, b in self.intervals[:3])
        more = f" and {len(self.intervals) - 3} more" if len(self.intervals) > 3 else ""
        return f"{self.what}{f': {places}{more}' if places else ''}"


@dataclass(frozen=True, eq=False)
class Log:
    """A log in SI units."""

    file: str
    columns: tuple[Chosen, ...]
    time: Array  # (s) from the first row of the first file, increasing, shape (rows,)
    # by quantity, single precision: what sensors give has no more; NaN where there is no value
    signals: Mapping[str, Any]
    spacing: float  # usual time between samples (s)
    # first row of each stretch without a gap, and the end of the last, shape (stretches + 1,)
    bounds: Index
    faults: tuple[Fault, ...] = ()
    usable: Any = field(default=None)  # rows where the torque may be believed, shape (rows,)

    def signal(self, name: str, rows: slice | Mask) -> Array:
        """Some rows of a signal, in double precision."""
        return np.asarray(self.signals[name][rows], float)

    @property
    def rate(self) -> float:
        """Samples a second (Hz)."""
        return 1.0 / self.spacing

    @property
    def stretches(self) -> list[slice]:
        """Rows of each stretch without a gap."""
        return [slice(int(a), int(b)) for a, b in zip(self.bounds, self.bounds[1:], strict=False)]

    @property
    def gaps(self) -> list[tuple[float, float]]:
        """Begin and end (s) of each gap."""
        inner = self.bounds[1:-1]
        return [(float(self.time[k - 1]), float(self.time[k])) for k in inner]


def read_log(
    path: str | Path,
    given: Mapping[str, tuple[str, str]] | None = None,
    progress: Progress = SILENT,
) -> Log:
    """Read a log.

    Parameters
    ----------
    path : str or Path
        CSV (.csv, .txt, .tsv, .dat, .asc), Parquet, MAT or LAS.
    given : mapping, optional
        Column and unit by quantity, either may be empty; the others are found by their names.
    progress : Progress
        Receives what was read.

    Returns
    -------
    Log

    Raises
    ------
    InputError
        A file that cannot be read, a quantity without column or unit, no rows.
    """
    source = open_source(Path(path))
    chosen = choose(source.heads, given or {}, Path(path).name, source.dated)
    order = list(chosen.values())
    columns = _columns(source, order, progress)
    return _cleaned(Path(path).name, order, columns)


def _columns(source: Source, order: list[Chosen], progress: Progress) -> dict[str, Any]:
    """Columns in SI, time in double and signals in single precision."""
    parts: dict[str, list[Any]] = {one.quantity: [] for one in order}
    unread = dict.fromkeys(parts, 0)
    numbers = list(dict.fromkeys(one.number for one in order))
    for piece in source.pieces(numbers, progress):
        held = dict(zip(numbers, piece, strict=True))
        for one in order:
            values, lost = _si(held[one.number], one)
            parts[one.quantity].append(values)
            unread[one.quantity] += lost
    if not parts["time"]:
        raise InputError("holds no rows", str(source.path))
    results: dict[str, Any] = {}
    for name in list(parts):
        results[name] = np.concatenate(parts.pop(name))  # one copy at a time
    results["unread"] = {name: count for name, count in unread.items() if count}
    return results


def _si(values: Any, one: Chosen) -> tuple[Any, int]:
    """Values of a column in SI, and how many cells were no numbers."""
    if one.unit == "date":
        return _seconds(values), 0
    values = np.asarray(values)
    lost = 0
    if values.dtype.kind not in "fiub":
        import pandas as pd

        numbers = pd.to_numeric(pd.Series(values), errors="coerce").to_numpy(float)
        lost = int((np.isnan(numbers) & ~pd.isna(pd.Series(values)).to_numpy()).sum())
        values = numbers
    with np.errstate(over="ignore"):
        result = values.astype(np.float64 if one.quantity == "time" else np.float32)
    for absent in ABSENT:
        result[result == result.dtype.type(absent)] = np.nan
    with np.errstate(over="ignore"):
        result *= result.dtype.type(one.factor)
    result[np.abs(result) > LARGEST] = np.nan
    return result, lost


def _seconds(values: Any) -> Array:
    """Dates, or times of day, as seconds; NaN where they cannot be read."""
    import pandas as pd

    values = pd.Series(np.asarray(values))
    if values.dtype.kind != "M":
        # 01.03.2024 is the first of March, where dates have dots.
        dotted = bool(values.astype(str).str.match(r"\d{1,2}\.\d{1,2}\.\d{4}").any())
        times = pd.to_datetime(values, errors="coerce", format="mixed", dayfirst=dotted)
        if times.dt.tz is not None:
            times = times.dt.tz_convert(None)
    else:
        times = values
    held = times.to_numpy().astype("datetime64[ns]")
    result = held.astype(np.int64) * 1e-9
    result[np.isnat(held)] = np.nan
    return np.asarray(result)


def _cleaned(file: str, order: list[Chosen], columns: dict[str, Any]) -> Log:
    faults: list[Fault] = []
    for name, count in columns.pop("unread").items():
        faults.append(Fault(f"{count} cells of {QUANTITIES[name].label} are no numbers", count))
    time = columns.pop("time")
    time, columns = _in_order(time, columns, faults, file)
    columns = _with_values(columns, faults, file)
    spacing = float(np.median(np.diff(time[: min(len(time), 200_000)])))
    if not spacing > 0.0:
        raise InputError("its time does not advance", file)
    steps = np.diff(time)
    inside = steps[steps <= GAP * spacing]
    if len(inside) and float(np.std(inside)) > IRREGULAR * spacing:
        spread = np.std(inside) / spacing
        faults.append(Fault(f"irregular times: the spacing varies by {spread:.0%}", len(inside)))
    gaps = np.flatnonzero(steps > GAP * spacing) + 1
    if len(gaps):
        places = tuple((float(time[k - 1]), float(time[k])) for k in gaps[:MOST_LISTED])
        lost = float((steps[gaps - 1] - spacing).sum())
        faults.append(Fault(f"{len(gaps)} gaps, {lost:.4g} s in all", len(gaps), places))
    bounds = np.concatenate(([0], gaps, [len(time)]))
    usable = np.ones(len(time), bool)
    turning = np.abs(columns["top_speed"]) > TURNING
    for name, values in columns.items():
        _mend(name, values, time, turning, usable, spacing, faults)
    return Log(file, tuple(order), time, columns, spacing, bounds, tuple(faults), usable)


def _with_values(columns: dict[str, Any], faults: list[Fault], file: str) -> dict[str, Any]:
    """Columns in which there is anything; refused (`InputError`) if one of the others is needed."""
    for name in [name for name, values in columns.items() if np.isnan(values).all()]:
        problem = f"holds no values of {QUANTITIES[name].label}"
        if name in NEEDED:
            raise InputError(problem, file)
        faults.append(Fault(problem, len(columns.pop(name))))
    return columns


def _in_order(
    time: Array, columns: dict[str, Any], faults: list[Fault], file: str
) -> tuple[Array, dict[str, Any]]:
    """Rows whose time advances, from zero; coarse stamps are spread over the rows they share."""
    keep = np.isfinite(time)
    if not keep.all():
        count = int((~keep).sum())
        faults.append(Fault(f"{count} rows without a time were left out", count))
        time, columns = time[keep], {name: values[keep] for name, values in columns.items()}
    if len(time) < FEWEST_ROWS:
        raise InputError(f"holds {len(time)} rows; at least {FEWEST_ROWS} are needed", file)
    # A clock that shows the time of day begins again at midnight.
    steps = np.diff(time, prepend=time[0])
    time = time + DAY * np.cumsum((steps < -0.5 * DAY) & (steps >= -DAY))
    highest = np.maximum.accumulate(time)
    back = time < highest
    new = np.concatenate(([True], time[1:] > highest[:-1]))
    repeats = int((~new & ~back).sum())
    if repeats > 0.3 * len(time):  # stamps that are coarser than the sampling
        stamps = np.flatnonzero(new)
        time = np.interp(np.arange(len(time)), stamps, time[stamps])
        new = np.concatenate(([True], np.diff(time) > 0.0))
        faults.append(
            Fault(
                f"time stamps are coarser than the sampling ({repeats} repeats): rows were spread "
                "evenly between stamps",
                repeats,
            )
        )
    elif repeats:
        faults.append(Fault(f"{repeats} rows repeat a time stamp and were left out", repeats))
    if back.any():
        count = int(back.sum())
        faults.append(Fault(f"{count} rows go back in time and were left out", count))
    if not new.all():
        time, columns = time[new], {name: values[new] for name, values in columns.items()}
    if len(time) < FEWEST_ROWS:
        raise InputError(f"only {len(time)} rows advance in time", file)
    return time - time[0], columns


def _mend(
    name: str, values: Any, time: Array, turning: Any, usable: Any, spacing: float,
    faults: list[Fault],
) -> None:  # fmt: skip
    """Find what a sensor did wrong; replace single outliers in place."""
    label = QUANTITIES[name].label
    absent = np.isnan(values)
    if absent.any():
        faults.append(
            Fault(f"{int(absent.sum())} values of {label} are missing", int(absent.sum()),
                  _places(absent, time)))  # fmt: skip
        if name in NEEDED:
            usable &= ~absent
    if name == "hook_load":
        return
    spikes = _spikes(values)
    if len(spikes):
        good = np.ones(len(values), bool)
        good[spikes] = False
        good &= ~absent
        values[spikes] = np.interp(time[spikes], time[good], values[good])
        places = tuple((float(time[k]), float(time[k])) for k in spikes[:MOST_LISTED])
        faults.append(
            Fault(f"{len(spikes)} outliers of {label} were replaced", len(spikes), places)
        )
    if name == "weight_on_bit":
        return
    if name != "top_speed":
        held = _constant(values, time, turning, STUCK_TIME, spacing)
        if held.any():
            places = _places(held, time)
            faults.append(
                Fault(f"{label} stands still under rotation for {held.sum() * spacing:.4g} s: a "
                      "stuck sensor", len(places), places))  # fmt: skip
            if name in NEEDED:
                usable &= ~held
    level = _clipped(values, turning & ~absent)
    if level is not None:
        at = values == level
        # A level that noise reaches now and then is no stop.
        faults.append(
            Fault(f"{label} is clipped at {level:.6g} {QUANTITIES[name].si}, "
                  f"{at.sum() / max(turning.sum(), 1):.1%} of rotating time", int(at.sum()),
                  _places(at, time)))  # fmt: skip
        if name in NEEDED:
            usable &= ~at


def _places(where: Any, time: Array) -> tuple[tuple[float, float], ...]:
    """Begin and end (s) of the first runs of rows."""
    return tuple((float(time[a]), float(time[b - 1])) for a, b in runs(where)[:MOST_LISTED])


def _spikes(values: Any) -> Index:
    """Rows of outliers of one or two samples: far from both sides, beyond all usual steps."""
    a, b = values[:-1], values[1:]
    step = np.abs(b - a)
    finite = step[np.isfinite(step)]
    if not len(finite):
        return np.zeros(0, int)
    usual = float(np.quantile(finite[:: max(1, len(finite) // 100_000)], 0.99))
    spread = np.ptp(np.nanquantile(values[:: max(1, len(values) // 100_000)], (0.005, 0.995)))
    bound = max(SPIKE * usual, 0.5 * float(spread))
    if bound == 0.0:
        return np.zeros(0, int)
    jumps = np.flatnonzero(step > bound)
    found: list[int] = []
    for k in jumps[:100_000]:  # a jump and one back within two samples
        for length in (1, 2):
            after = k + length + 1
            if after < len(values) and abs(values[after] - values[k]) < 0.5 * bound:
                found.extend(range(k + 1, k + 1 + length))
                break
    return np.unique(np.array(found, int))


def _constant(values: Any, time: Array, turning: Any, least: float, spacing: float) -> Any:
    """Rows of runs of one and the same value, longer than `least` (s), while the string turns."""
    same = np.concatenate(([False], (np.diff(values) == 0.0) & turning[1:]))
    spells = runs(same)
    result = np.zeros(len(values), bool)
    for a, b in spells[np.ptp(spells, axis=1) * spacing > least]:
        result[a:b] = True
    return result


def _clipped(values: Any, turning: Any) -> float | None:
    """The largest value, if the signal stays there for several samples again and again."""
    inside = values[turning]
    if len(inside) < 100:
        return None
    top = inside.max()
    at = inside == top
    again = at[1:] & at[:-1]
    levels = len(np.unique(inside[:: max(1, len(inside) // 20_000)]))
    if levels < 50 or at.mean() < CLIPPED or again.sum() < 0.5 * at.sum():
        return None
    return float(top)
