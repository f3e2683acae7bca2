"""Reading logs and ranking their windows: the computation and its result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from drillctl.arrays import Array, finite
from drillctl.design import Design
from drillctl.design.parts import parts_of
from drillctl.errors import InputError
from drillctl.linear import modes
from drillctl.logs.quantities import Chosen
from drillctl.logs.record import Fault, Log, read_log
from drillctl.logs.sticking import share, sticking
from drillctl.logs.windows import Event, Windows, band_of, events_of, spectrum, windows_of
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.store.result import Result

PIECE, PIECES = 32, 16  # rows of a piece of a log by which it is known again, and how many
BINS = 1500  # of the outline of a signal over time
DRAWN = ("top_torque", "top_speed", "weight_on_bit", "bit_speed")


@dataclass(frozen=True, eq=False)
class Outline:
    """Least and largest values of a signal over a log, for pictures."""

    begin: Array = label("bin", unit="s", means="beginning of each bin")
    # by quantity, in SI
    least: dict[str, Array] = label("bin", means="least value in each")
    most: dict[str, Array] = label("bin", means="largest value in each")


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Spectrum of the torque in one window."""

    name: str  # of the window
    frequency: Array = label("{name}_line", unit="Hz", means="frequency")
    power: Array = label("{name}_line", means="power over that of all lines")


@dataclass(frozen=True, eq=False)
class LogOverview(Result, kind="log"):
    """What is in a log: signals, faults, and windows by their oscillations."""

    design: Design = label(means="the rig, or a stand-in where none was given")
    known: bool = label(means="whether a rig was given")
    files: tuple[str, ...] = label(means="names of the logs")
    rows: int = label(means="rows of all logs")
    rate: float = label(unit="Hz", means="usual samples a second")
    duration: float = label(unit="s", means="time of all logs")
    offsets: Array = label("log", unit="s", means="beginning of each log in the pictures")
    gaps: tuple[tuple[float, float], ...] = label(unit="s", means="begin and end of each gap")
    columns: tuple[Chosen, ...] = label(means="what was read as what")
    faults: tuple[Fault, ...] = label(means="what is wrong with the logs")
    band: tuple[float, float] = label(unit="Hz", means="where stick-slip was looked for")
    frequencies: Array = label("mode", unit="Hz", means="of the string with the top held")
    windows: Windows = label(means="all windows of rotating time", flat=True)
    events: tuple[Event, ...] = label(means="oscillations, the strongest first")
    sticking: Array = label(
        "interval", "end", unit="s",
        means="when the bit stood still, in the time of the pictures: those nearer than a pixel "
        "are one",
    )  # fmt: skip
    sticking_from: str = label(means="what tells it: the downhole speed, the waves, or nothing")
    outlines: tuple[Outline, ...] = label(means="signals over time", over="log")
    spectra: tuple[Spectrum, ...] = label(means="of the strongest and of a typical window")

    @property
    def worst(self) -> int | None:
        """Number of the window with the largest tonal share."""
        return self.events[0].best if self.events else None

    @property
    def typical(self) -> int | None:
        """Number of the window whose tonal share is the median of all."""
        if not len(self.windows):
            return None
        return int(np.argsort(self.windows.share, kind="stable")[(len(self.windows) - 1) // 2])

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI; windows ranked."""
        w = self.windows
        return {
            "files": list(self.files),
            **picked(self, "rows", "rate", "duration"),
            "gaps": [list(gap) for gap in self.gaps],
            "columns": {
                one.quantity: {"column": one.column, "unit": one.unit} for one in self.columns
            },
            "faults": [one.said for one in self.faults],
            "band": list(self.band),
            "index_from": "downhole speed" if w.from_bit else "surface torque",
            "sticking_from": self.sticking_from or None,
            "sticking": self.sticking.tolist(),
            "windows": [
                {
                    "begin": one.begin, "end": one.end, "log": one.log,
                    "stick_slip_index": finite(w.index[one.best]),
                    "period": finite(w.period[one.best]),
                    "tonal_share": float(w.share[one.best]),
                }
                for one in self.events
            ],
        }  # fmt: skip


def log_overview(
    design: Design | None, files: Sequence[str | Path], known: bool = True,
    progress: Progress = SILENT,
) -> LogOverview:  # fmt: skip
    """Read logs and rank their windows by how much of the torque swings at one frequency.

    Parameters
    ----------
    design : Design or None
        The rig: its string's frequencies, and the columns of `[log]`.
    files : sequence of str or Path
        One or more logs of one well.
    known : bool
        Whether the string of the design is that of the log.
    progress : Progress
        Receives rows and windows.

    Returns
    -------
    LogOverview

    Raises
    ------
    InputError
        A file that cannot be read, or without the needed columns and their units.
    """
    known = known and design is not None
    design = stand_in() if design is None else design
    settings = design.tables.log
    logs = read_logs(design, files, progress)
    held = (
        np.array([mode.frequency_hz for mode in modes(design, 6).fixed_top])
        if known
        else np.zeros(0)
    )
    band = band_of(float(held[0]) if known else None)
    windows = windows_of(logs, band, settings.window, progress)
    events = tuple(events_of(windows))
    spans = np.array([float(log.time[-1]) for log in logs])
    offsets = np.concatenate(([0.0], np.cumsum(1.02 * spans)[:-1]))
    line = parts_of(design.tables) if known else None
    still = [sticking(log, line, float(spans.sum()) / BINS) for log in logs]
    for k, number in enumerate(windows.log.astype(int)):
        spells = still[number]
        if spells is not None:
            windows.stuck[k] = share(spells, windows.begin[k], windows.end[k])
    return LogOverview(
        design=design, known=known, files=tuple(log.file for log in logs),
        rows=sum(len(log.time) for log in logs), rate=logs[0].rate, duration=float(spans.sum()),
        offsets=offsets, gaps=tuple(gap for log in logs for gap in log.gaps),
        columns=logs[0].columns, faults=tuple(fault for log in logs for fault in log.faults),
        band=band, frequencies=held, windows=windows, events=events,
        sticking=np.concatenate([
            np.zeros((0, 2)),
            *(one + first for one, first in zip(still, offsets, strict=True) if one is not None),
        ]),
        sticking_from="" if all(one is None for one in still) else (
            "downhole speed" if windows.from_bit else "waves"
        ),
        outlines=tuple(map(_outline, logs)), spectra=tuple(_spectra(logs, windows, events)),
    )  # fmt: skip


def read_logs(
    design: Design, files: Sequence[str | Path], progress: Progress = SILENT
) -> tuple[Log, ...]:
    """The logs of one well, with the columns that a design names."""
    if not files:
        raise InputError("there is no log: name one, or [log] files in the design", "--log")
    logs = tuple(read_log(file, design.tables.log.given, progress) for file in files)
    for number, log in enumerate(logs):
        for other in logs[:number]:
            if _holds_some(other, log) or _holds_some(log, other):
                # Rows that count twice leave a fit surer than it is, and are no test of it.
                raise InputError(f"holds rows of {other.file}: give each row once", log.file)
    return logs


def _holds_some(log: Log, other: Log) -> bool:
    """Whether a log holds one of a few pieces of another, whose torques tell it from any other."""
    all_of_it, torque = log.signals["top_torque"].tobytes(), other.signals["top_torque"]
    begins = np.linspace(0, max(len(torque) - PIECE, 0), PIECES).astype(int)
    pieces = (torque[begin : begin + PIECE] for begin in begins)
    return any(len(np.unique(p)) > PIECE // 2 and p.tobytes() in all_of_it for p in pieces)


def named_files(design: Design) -> list[Path]:
    """Logs that a design names, relative to its own place."""
    return [Path(design.origin).parent / file for file in design.tables.log.files]


def stand_in(name: str = "log", values: Mapping[str, Any] = MappingProxyType({})) -> Design:
    """A design for a log of a rig that was not described: only its `[log]` counts."""
    from drillctl.design.merging import with_values
    from drillctl.design.validation import validated

    tree = {
        "title": "log of a rig that was not described",
        "status": "a stand-in: only [log] counts, no number of this rig enters",
        "drillstring": {
            "sections": [{"name": "pipe", "pipe": "5 in 19.5 lb/ft", "length": "3000 m"}]
        },
        "top_drive": {"inertia": "2000 kg*m^2"},
        "bha": {"inertia": "400 kg*m^2"},
        "bit_rock": {"law": "coulomb", "a": 0.04},
    }
    tree = with_values(tree, dict(values))
    return Design(name, validated(tree, ""), tree, "")


def _outline(log: Log) -> Outline:
    """Least and largest values in bins of rows."""
    starts = np.unique(
        np.linspace(0, len(log.time), min(BINS, len(log.time)), endpoint=False).astype(int)
    )
    least, most = {}, {}
    for name in DRAWN:
        if name in log.signals:
            values = log.signals[name]
            least[name] = np.fmin.reduceat(values, starts).astype(float)
            most[name] = np.fmax.reduceat(values, starts).astype(float)
    return Outline(log.time[starts], least, most)


def _spectra(logs: tuple[Log, ...], windows: Windows, events: tuple[Event, ...]) -> list[Spectrum]:
    if not events:
        return []
    order = np.argsort(windows.share, kind="stable")
    results = []
    for name, number in (("strongest", events[0].best), ("typical", order[(len(order) - 1) // 2])):
        log = logs[int(windows.log[number])]
        inside = (log.time >= windows.begin[number]) & (log.time <= windows.end[number])
        torque = log.signal("top_torque", inside)
        good = np.isfinite(torque)
        frequency, power = spectrum(log.time[inside][good], torque[good])
        total = power[1:].sum() or 1.0  # of a constant torque nothing is to be shared
        results.append(Spectrum(name, frequency[1:], power[1:] / total))
    return results
