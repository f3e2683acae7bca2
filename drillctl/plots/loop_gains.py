"""The top drive as the string feels it: impedance against that of the pipe, and reflection.

The boundary of the stable gains.

Poles of the loop in the complex plane as one parameter changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from drillctl import units
from drillctl.arrays import Array, ComplexArray
from drillctl.errors import InputError
from drillctl.linear.boundary import GainBoundary, RootLocus
from drillctl.linear.tuning import DriveImpedance
from drillctl.plots import style
from drillctl.plots.plant import hertz

GREY = "#777777"


@style.picture(
    results="From `drillctl.linear.drive_impedance`; each is named by its `label`.",
    ax="Two panels: impedance and reflection.",
    marks="Frequencies (Hz) to mark, such as that of stick-slip; by name, if they have one.",
    raises="Nothing to draw, or a mark that is not more than 0 Hz.",
)
def drive_impedance(
    results: DriveImpedance | Sequence[DriveImpedance],
    ax: Sequence[Axes] | None = None,
    marks: Mapping[str, float] | Sequence[float] = (),
    system: units.System = "si",
) -> Figure:
    """Draw impedance and reflection of one or several top drives over frequency.

    Above, the magnitude of the drive's impedance over that of the pipe: the drive takes most of a
    wave near 1, where the line is drawn. Below, the share of the amplitude of a wave that is sent
    back: 0 takes all, 1 takes nothing.
    """
    drives = style.listed(results)
    names = [units.told(drive.label, system) for drive in drives]
    figure, (above, below) = style.grid_or_new(ax, 2, 1, 7.5, 6.0, share_x=True)
    for number, (drive, name) in enumerate(zip(drives, names, strict=True)):
        look = style.look(number)
        frequency = drive.frequency_hz
        above.loglog(frequency, np.abs(drive.impedance) / drive.pipe, label=name, **look)
        below.semilogx(frequency, np.abs(drive.reflection), label=name, **look)
    above.axhline(1.0, color=GREY, linewidth=0.9)
    above.annotate(
        "as the pipe", (0.0, 1.0), xycoords=("axes fraction", "data"), xytext=(4, 3),
        textcoords="offset points", fontsize=style.SMALL, color=GREY,
    )  # fmt: skip
    style.dress(above, "", "drive / pipe impedance |Z|/ζ", "Impedance of the top drive")
    style.dress(below, "frequency (Hz)", "reflection |r|, 0 takes all")
    below.set_ylim(0.0, 1.05)
    _mark(above, below, marks)
    hertz(below)
    style.legend_above(above, [line for line in above.get_lines() if line.get_label() in names])
    return figure


def _mark(above: Axes, below: Axes, marks: Mapping[str, float] | Sequence[float]) -> None:
    named = marks.items() if isinstance(marks, Mapping) else [("", mark) for mark in marks]
    for name, frequency in named:
        if not (np.isfinite(frequency) and frequency > 0.0):
            raise InputError(f"must be more than 0 Hz, got {frequency:g}", f"marks {name}".strip())
        for panel in (above, below):
            panel.axvline(frequency, color=style.BLACK, linewidth=0.9, linestyle=":")
        below.annotate(
            f"{name}\n{frequency:.3g} Hz".strip(), (frequency, 0.0),
            xycoords=("data", "axes fraction"), xytext=(4, 4), textcoords="offset points",
            fontsize=style.SMALL, va="bottom",
        )  # fmt: skip


GAIN_UNITS = {"controller.kp": "N*m*s/rad", "controller.ki": "N*m/rad"}
GAINS = tuple(GAIN_UNITS)
STABLE = "#D5E8DF"
"""Stable gains."""
DIAMOND: dict[str, Any] = {
    "color": "white", "markeredgecolor": style.BLACK, "markersize": 8, "markeredgewidth": 1.4,
    "linestyle": "none", "zorder": 6,
}  # fmt: skip
"""Mark of the design's own values."""


@style.picture(
    result="From `drillctl.linear.gain_boundary`; others, as the continuum, after the first.",
    raises="Nothing to draw.",
)
def gain_boundary(
    result: GainBoundary | Sequence[GainBoundary],
    ax: Axes | None = None,
    system: units.System = "si",
) -> Figure:
    """Draw the curve of poles on the imaginary axis and the stable gains it bounds.

    The first result is coloured by frequency, its region filled; curves of others are dashed.
    Each mode adds a branch; those of high modes are thin.
    """
    boundaries = style.listed(result)
    first = boundaries[0]
    figure, ax = style.axes_or_new(ax, 7.8, 5.8)
    sides = [
        style.named_values(path, GAIN_UNITS[path], np.array(span), system)
        for path, span in zip(GAINS, first.window, strict=True)
    ]
    _fill(ax, first, system)
    _coloured(figure, ax, first, system)
    for number, other in enumerate(boundaries[1:]):
        _dashed(ax, other, number, system)
    own = first.design.linear_drive.gains()
    kp, ki = shown_gains(own[0], own[1], system)
    if kp > 0.0 or ki > 0.0:
        ax.plot(kp, ki, "D", **DIAMOND, label="gains of the design")
    style.dress(ax, sides[0][1], sides[1][1], style.heading(first, "Stable gains"))
    ax.set_xlim(*sides[0][0])
    ax.set_ylim(*sides[1][0])
    style.legend_under(ax, 2)
    slope, unit = units.displayed(first.slope, "N*m*s/rad", system)
    style.note(figure, f"falling slope of the rock {slope:.4g} {unit}")
    return figure


def _fill(ax: Axes, boundary: GainBoundary, system: units.System) -> None:
    rings = boundary.rings
    if not rings:
        ax.fill([], [], facecolor=STABLE, label="no stable gains within the picture")
        return
    paths = [
        Path(np.column_stack(shown_gains(r[:, 0], r[:, 1], system)), closed=True) for r in rings
    ]
    ax.add_patch(
        PathPatch(
            Path.make_compound_path(*paths), facecolor=STABLE, edgecolor="none", zorder=0.5,
            label="stable gains",
        )
    )  # fmt: skip


def _coloured(figure: Figure, ax: Axes, boundary: GainBoundary, system: units.System) -> None:
    """Branches coloured by frequency, the lower the heavier."""
    if not boundary.branches:
        return
    pieces, middle = [], []
    for branch in boundary.branches:
        points = np.column_stack(shown_gains(branch.kp, branch.ki, system))
        pieces.append(np.stack([points[:-1], points[1:]], axis=1))
        middle.append(np.sqrt(branch.omega[:-1] * branch.omega[1:]) / (2.0 * np.pi))
    frequency = np.concatenate(middle)
    # Towards Ki = 0 a branch goes to no frequency at all; modes must stay distinguishable.
    high = float(frequency.max())
    low = min(max(float(frequency.min()), 1e-3 * high), 0.99 * high)
    norm = LogNorm(low, high)
    share = np.log(np.maximum(frequency, low) / low) / np.log(high / low)
    lines = LineCollection(
        list(np.concatenate(pieces)), cmap=style.colours(0.0, 0.88),
        norm=norm, linewidths=4.0 - 3.3 * share,
        capstyle="round", zorder=3,
    )  # fmt: skip
    lines.set_array(frequency)
    ax.add_collection(lines)
    label = "frequency of the poles on the axis (Hz)"
    style.colour_bar(figure, lines, ax, label, style.beyond(frequency, norm))


def _dashed(ax: Axes, boundary: GainBoundary, number: int, system: units.System) -> None:
    dashes = style.DASHES[1 + number % (len(style.DASHES) - 1)]
    name = "continuum" if boundary.model == "wave" else boundary.model.replace("-", " ")
    for place, branch in enumerate(boundary.branches):
        ax.plot(
            *shown_gains(branch.kp, branch.ki, system), color=style.BLACK, linewidth=0.9,
            linestyle=dashes, zorder=4, label=name if place == 0 else "_",
        )  # fmt: skip


def shown_gains(kp: Any, ki: Any, system: units.System) -> tuple[Any, Any]:
    """Gains in the units of the axes."""
    kp_unit, ki_unit = GAIN_UNITS.values()
    return units.displayed(kp, kp_unit, system)[0], units.displayed(ki, ki_unit, system)[0]


LINE_APART = 0.035  # least distance between two lines of text, over the height of the window
LEAST_REACH = 0.02
"""A track is shown if it goes this far from the imaginary axis, over the farthest."""


@style.picture(result="From `drillctl.linear.root_locus`.", raises="No poles to draw.")
def root_locus(result: RootLocus, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """Draw the tracks of the poles, upper half of the plane.

    Real part in 1/s, frequency in Hz. Tracks that hug the imaginary axis, high modes of an
    undamped string, are left out of the window and counted below it. Poles right of the axis grow;
    numbers beside it are the parameter's values where a track crosses.
    """
    tracks = mirrored(result.poles)
    if not np.isfinite(tracks.real).any():
        raise InputError("no poles to draw")
    values, label = style.named_values(result.path, result.unit, result.values, system)
    figure, ax = style.axes_or_new(ax, 7.5, 6.0)
    norm = Normalize(float(np.min(values)), float(np.max(values)))
    lines = [_track(ax, column, values, norm) for column in tracks.T]
    _ends(ax, tracks)
    style.colour_bar(figure, lines[0], ax, label)
    left, right, top = _window(tracks)
    ax.axvspan(0.0, max(right, 0.0), color="#F2F2F2", zorder=0)
    ax.axvline(0.0, color=style.BLACK, linewidth=1.2)
    ax.set_xlim(left, right)
    ax.set_ylim(-0.02 * top, top)
    title = style.heading(result, "Root locus")
    style.dress(ax, "real part (1/s), unstable to the right", "frequency (Hz)", title)
    _crossings(ax, tracks, values, top)
    style.legend_under(ax, 3, drop=0.1)
    style.note(figure, _left_out(tracks, left, right, top))
    return figure


def mirrored(poles: ComplexArray) -> ComplexArray:
    """Tracks in the upper half plane, each pair once."""
    folded = poles.real + 1j * np.abs(poles.imag)
    kept: list[ComplexArray] = []
    for track in folded.T:
        if not any(np.allclose(track, k, rtol=1e-7, atol=1e-9, equal_nan=True) for k in kept):
            kept.append(track)
    return np.stack(kept, axis=1)


def _track(ax: Axes, poles: ComplexArray, values: Array, norm: Normalize) -> LineCollection:
    points = np.column_stack([poles.real, poles.imag / (2.0 * np.pi)])
    pieces = np.stack([points[:-1], points[1:]], axis=1)
    lines = LineCollection(
        list(pieces), cmap=style.colours(0.0, 0.88), norm=norm, linewidths=2.2, zorder=3
    )
    lines.set_array(0.5 * (values[:-1] + values[1:]))
    ax.add_collection(lines)
    return lines


def _ends(ax: Axes, tracks: ComplexArray) -> None:
    for row, marker, face, label in (
        (0, "o", "white", "first value"), (-1, "s", style.BLACK, "last value"),
    ):  # fmt: skip
        ax.plot(
            tracks[row].real, tracks[row].imag / (2.0 * np.pi), marker, markersize=6,
            markerfacecolor=face, markeredgecolor=style.BLACK, linestyle="none", label=label,
            zorder=4,
        )  # fmt: skip


def _crossings(ax: Axes, tracks: ComplexArray, values: Array, top: float) -> None:
    """The parameter's value where a track in the window crosses the imaginary axis."""
    written = -np.inf
    for frequency, value in sorted(_crossed(tracks, values)):
        if frequency > top:
            break
        written = max(frequency, written + LINE_APART * top)  # close ones are not overwritten
        ax.plot(0.0, frequency, "_", color=style.BLACK, markersize=10, zorder=5)
        ax.annotate(
            f"{value:.4g}", (0.0, written), xytext=(7, 3), textcoords="offset points",
            fontsize=style.SMALL, zorder=6,
        )  # fmt: skip


def _crossed(tracks: ComplexArray, values: Array) -> list[tuple[float, float]]:
    """Frequency (Hz) and value of the parameter of each crossing, linear between values."""
    results: dict[str, tuple[float, float]] = {}  # two tracks that part later cross as one
    for track in tracks.T:
        for i in np.flatnonzero(track.real[:-1] * track.real[1:] < 0.0):
            share = track.real[i] / (track.real[i] - track.real[i + 1])
            omega = track.imag[i] + share * (track.imag[i + 1] - track.imag[i])
            value = values[i] + share * (values[i + 1] - values[i])
            results[f"{omega:.6g} {value:.6g}"] = (float(omega) / (2.0 * np.pi), float(value))
    return list(results.values())


def _window(tracks: ComplexArray) -> tuple[float, float, float]:
    """Lowest and highest real part (1/s) and highest frequency (Hz) of the tracks in the window."""
    turning = np.where(tracks.imag > 0.0, tracks, np.nan)
    if not np.isfinite(turning).any():
        turning = tracks
    with np.errstate(invalid="ignore"):
        reach = np.nanmax(np.abs(np.nan_to_num(turning.real)), axis=0)
    drawn = turning[:, reach >= LEAST_REACH * reach.max()]
    left, right = float(np.nanmin(drawn.real)), max(float(np.nanmax(drawn.real)), 0.0)
    room = 0.08 * max(right - left, 1e-12)
    top = float(np.nanmax(drawn.imag)) / (2.0 * np.pi)
    return left - room, right + max(room, 0.05 * (right - left)), 1.08 * top or 1.0


def _left_out(tracks: ComplexArray, left: float, right: float, top: float) -> str:
    frequency = tracks.imag / (2.0 * np.pi)
    seen = (tracks.real >= left) & (tracks.real <= right) & (frequency <= top)
    hidden = np.isfinite(tracks.real).any(axis=0) & ~seen.any(axis=0)
    if not hidden.any():
        return ""
    noun = "track" if hidden.sum() == 1 else "tracks"
    far = float(np.nanmax(frequency[:, hidden]))
    return f"{int(hidden.sum())} more {noun} outside the window, up to {far:.3g} Hz"
