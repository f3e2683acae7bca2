r"""The loop broken at the top torque: Nyquist and Nichols curve, sensitivities.

Drawn is L = C/Z, the response of the top speed to the speed error with the loop open and the
slope of the rock closed around the bit:

    analysis = drillctl.linear.loop(design)
    slope = analysis.operating_point.slope
    omega = pole_grid(ends_of(design.sliding_string), analysis.poles)
    response = frequency_response(design, omega / (2 * np.pi), "open_loop", slope=slope)

The falling slope makes each mode of an undamped string grow without drive, and L circle at its
resonance, counter-clockwise: the loop is stable because L goes around -1 once per unstable pole.
The less the slope, the larger the circles; without slope they are infinite. Pictures show the
neighbourhood of -1 true to scale and say how far the curve goes beyond.

The disk of the disk margin :math:`\alpha` is :math:`|1 - L| / |1 + L| \ge 2/\alpha`: it spans
the real axis from :math:`-(2+\alpha)/(2-\alpha)` to :math:`-(2-\alpha)/(2+\alpha)`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from drillctl.arrays import Array, ComplexArray, Mask
from drillctl.errors import InputError
from drillctl.linear.loop_analysis import LoopAnalysis
from drillctl.linear.loop_margins import Margins
from drillctl.linear.loop_model import loop_poles
from drillctl.linear.response import FrequencyResponse, frequency_response
from drillctl.plots import style
from drillctl.plots.loop_gains import GREY
from drillctl.plots.plant import hertz

SHADE = "#F3C9A5"
"""Disk of the disk margin: what L may not enter."""
WINDOW = (-2.6, 0.8, 1.7)
"""Lowest and highest real part, and highest imaginary part, of the Nyquist picture."""
LEVELS_DB = (-30.0, 30.0)  # magnitudes of L (dB) within the Nichols picture
PEAKS = (1.4, 2.0, 4.0)  # magnitudes of the sensitivity drawn as curves on the Nichols picture
APART = 0.2  # least distance in the plane of L between two frequencies that are written beside it
LOW = 10.0  # the curve is heavy up to this many times the frequency at which it is nearest to -1
SHOWN_HZ = (0.01, 5.0)  # frequencies (Hz) within the picture of the sensitivities
OF_LOOP = {
    "result": "Of the open loop, slope of the rock included; see the head of this module.",
    "raises": "Not an open loop, one that does not react, or one that is not that of the analysis.",
}


@style.picture(
    **OF_LOOP,
    analysis="Of the same loop: gives the disk of its margin and the number of unstable poles.",
)
def nyquist(
    result: FrequencyResponse, ax: Axes | None = None, analysis: LoopAnalysis | None = None
) -> Figure:
    """Draw the Nyquist curve of the loop about -1, true to scale.

    Frequency rises along the arrows. A note below the picture says what lies outside, and how
    often L turns about -1 where curve and poles agree on it.
    """
    loop = _loop(result, analysis)
    figure, ax = style.axes_or_new(ax, 8.0, 6.2)
    ax.plot(
        loop.real, -loop.imag, color=style.SKY, linewidth=0.6, linestyle="--",
        label="conjugate (f < 0)",
    )  # fmt: skip
    _curve(ax, result.frequency_hz, loop, loop.real, loop.imag)
    _arrows(ax, result.frequency_hz, loop)
    ax.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)
    ax.axvline(0.0, color=GREY, linewidth=0.8, zorder=1)
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    ax.plot(np.cos(angle), np.sin(angle), color=GREY, linewidth=0.8, linestyle=":", label="|L| = 1")
    if analysis is not None and analysis.margins is not None:
        _disk(ax, analysis.margins)
    _critical(ax, -1.0)
    left, right, high = WINDOW
    ax.set_xlim(left, right)
    ax.set_ylim(-high, high)
    ax.set_aspect("equal", adjustable="box")
    style.dress(ax, "real part of L", "imaginary part of L", "Nyquist curve at the top torque")
    _legend(ax)
    within = (loop.real > left) & (loop.real < right) & (np.abs(loop.imag) < high)
    notes = [_outside(result.frequency_hz, loop, within), _turns(loop, analysis)]
    _note(ax, notes)
    return figure


@style.picture(**OF_LOOP, analysis="Of the same loop: gives the disk of its margin.")
def nichols(
    result: FrequencyResponse, ax: Axes | None = None, analysis: LoopAnalysis | None = None
) -> Figure:
    """Draw magnitude against phase of the loop, with curves of constant sensitivity.

    Phase from -360 to 0 degrees, so that -1 is in the middle; what leaves on one side comes back
    on the other.
    """
    loop = _loop(result, analysis)
    figure, ax = style.axes_or_new(ax, 8.5, 5.4)
    phase, level = np.meshgrid(np.linspace(-360.0, 0.0, 721), np.linspace(*LEVELS_DB, 601))
    plane = 10.0 ** (level / 20.0) * np.exp(1j * np.radians(phase))
    away = np.abs(1.0 + plane)
    if analysis is not None and analysis.margins is not None:
        _disk_of_levels(
            ax, phase, level, np.abs(1.0 - plane) / np.maximum(away, 1e-9), analysis.margins.disk
        )
    inverse = [1.0 / peak for peak in reversed(PEAKS)]
    lines = ax.contour(phase, level, away, inverse, colors=GREY, linewidths=0.8, linestyles="--")
    below = [(-180.0, 20.0 * np.log10(1.0 - value)) for value in inverse]
    ax.clabel(lines, fmt=lambda value: f"|S| {1.0 / value:.3g}", fontsize=8.0, manual=below)
    _curve(ax, result.frequency_hz, loop, *_on_chart(loop))
    _critical(ax, -180.0)
    ax.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)
    ax.axvline(-180.0, color=GREY, linewidth=0.8, zorder=1)
    ax.set_xlim(-360.0, 0.0)
    ax.set_ylim(*LEVELS_DB)
    ax.xaxis.set_major_locator(MultipleLocator(45.0))
    style.dress(ax, "phase of L (deg)", "magnitude of L (dB)", "Nichols curve at the top torque")
    _legend(ax)
    size = 20.0 * np.log10(np.abs(loop))
    within = (size > LEVELS_DB[0]) & (size < LEVELS_DB[1])
    _note(ax, [_outside(result.frequency_hz, loop, within)])
    return figure


@style.picture(
    **OF_LOOP,
    analysis="Of the same loop: gives the peak to full digits; by default that of the curve.",
)
def sensitivity(
    result: FrequencyResponse, ax: Axes | None = None, analysis: LoopAnalysis | None = None
) -> Figure:
    """Draw sensitivity S = 1/(1 + L) and its complement T = L/(1 + L) over frequency.

    The highest peak of S is marked, with its frequency.
    """
    loop = _loop(result, analysis)
    figure, ax = style.axes_or_new(ax, 7.5, 4.6)
    frequency = result.frequency_hz
    sensitive, rest = np.abs(1.0 / (1.0 + loop)), np.abs(loop / (1.0 + loop))
    ax.loglog(frequency, sensitive, color=style.BLUE, linewidth=style.LINE, label="|S|")
    ax.loglog(
        frequency, rest, color=style.VERMILLION, linestyle="--", linewidth=style.LINE, label="|T|"
    )
    best = int(np.argmax(sensitive))
    peak, where = float(sensitive[best]), float(frequency[best])
    margins = None if analysis is None else analysis.margins
    if margins is not None and margins.peak_sensitivity_hz is not None:
        peak, where = margins.peak_sensitivity, margins.peak_sensitivity_hz
    if margins is None or margins.peak_sensitivity_hz is not None:
        ax.plot(
            where, peak, "o", color=style.BLACK, markersize=6,
            label=f"largest |S|: {peak:.4g} at {where:.3g} Hz",
        )  # fmt: skip
    ax.axhline(1.0, color=GREY, linewidth=0.9, zorder=1)
    style.dress(ax, "frequency (Hz)", "magnitude", "Sensitivity at the top torque")
    hertz(ax)
    low, high = min(SHOWN_HZ[0], where / 3.0), max(SHOWN_HZ[1], 3.0 * where)
    ax.set_xlim(max(low, float(frequency[0])), min(high, float(frequency[-1])))
    ax.set_ylim(1e-2, 3.0 * max(peak, float(rest.max())))
    style.legend(ax, loc="lower left")
    return figure


def _loop(result: FrequencyResponse, analysis: LoopAnalysis | None) -> ComplexArray:
    """L, refused where there is none or where it is not that of the analysis."""
    loop = result.between("speed_error", "top_speed")
    if not np.any(loop):
        raise InputError("the drive does not react to speed: there is no loop to draw")
    if analysis is not None:
        first = int(np.argmin(result.frequency_hz))
        bit, frequency = analysis.bit_side, result.frequency_hz[first]
        own = frequency_response(
            analysis.design, frequency, "open_loop", slope=bit.slope, path=bit.path
        )
        expected = own.between("speed_error", "top_speed")[0]
        # Elements and continuum agree at the lowest frequency; other gains or slopes do not.
        if abs(loop[first] - expected) > 1e-2 * abs(expected):
            raise InputError(
                f"the response is not that of the analysed loop, whose slope is {bit.slope:.6g} "
                f"N m s/rad: L is {loop[first]:.4g} at {frequency:.3g} Hz, not {expected:.4g}",
                "analysis",
            )
    return loop


def _disk(ax: Axes, margins: Margins) -> None:
    """The disk that L stays out of."""
    if margins.disk_ends is None:
        return
    low, high = margins.disk_ends
    ax.add_patch(
        Circle(
            (0.5 * (low + high), 0.0), 0.5 * (high - low), facecolor=SHADE,
            edgecolor=style.VERMILLION, linewidth=1.0, label=f"disk margin {margins.disk:.3g}",
            zorder=1.5,
        )
    )  # fmt: skip


def _disk_of_levels(ax: Axes, phase: Array, level: Array, ratio: Array, alpha: float) -> None:
    if alpha >= 2.0:
        return
    ax.contourf(phase, level, ratio, [2.0 / alpha, np.inf], colors=[SHADE])
    ax.contour(phase, level, ratio, [2.0 / alpha], colors=style.VERMILLION, linewidths=1.0)
    ax.fill([], [], facecolor=SHADE, edgecolor=style.VERMILLION, label=f"disk margin {alpha:.3g}")


def _critical(ax: Axes, x: float) -> None:
    ax.plot(
        x, 0.0, "+", color=style.VERMILLION, markersize=12, markeredgewidth=2.0, label="-1",
        linestyle="none",
    )  # fmt: skip


def _arrows(ax: Axes, frequency: Array, loop: ComplexArray) -> None:
    """An arrow and the frequency where the curve comes nearest to -1, before and after."""
    if len(loop) < 3:  # points that show no way to go
        return
    near = int(np.argmin(np.abs(1.0 + loop)))
    written: list[complex] = []
    for share in (1.0, 0.7, 1.4, 2.0):
        i = int(np.argmin(np.abs(frequency - share * frequency[near])))
        i = min(max(i, 1), len(loop) - 2)
        step = loop[i + 1] - loop[i - 1]
        if step == 0.0:
            continue
        tip = loop[i] + 1e-3 * step / abs(step)
        ax.annotate(
            "", (tip.real, tip.imag), (loop[i].real, loop[i].imag), annotation_clip=True,
            arrowprops={"arrowstyle": "-|>", "color": style.BLUE, "mutation_scale": 14},
        )  # fmt: skip
        if any(abs(loop[i] - place) < APART for place in written):
            continue
        written.append(loop[i])
        # Beside the curve, on the side away from -1, with a rim that keeps lines off the digits.
        beside = 1j * step / abs(step)
        if (beside * np.conj(1.0 + loop[i])).real < 0.0:
            beside = -beside
        ax.annotate(
            f"{frequency[i]:.3g} Hz", (loop[i].real, loop[i].imag),
            xytext=(12.0 * beside.real, 12.0 * beside.imag), textcoords="offset points",
            fontsize=style.SMALL, color=style.BLUE, annotation_clip=True, zorder=6,
            ha="left" if beside.real > 0.0 else "right", va="center",
            path_effects=[withStroke(linewidth=3.0, foreground="white")],
        )  # fmt: skip


def _curve(
    ax: Axes, frequency: Array, loop: ComplexArray, x: NDArray[Any], y: NDArray[Any]
) -> None:
    """L over rising frequency, thin where its many high modes lie on each other."""
    near = float(frequency[np.argmin(np.abs(1.0 + loop))])
    last = int(np.searchsorted(frequency, LOW * near, side="right"))
    ax.plot(
        x[:last], y[:last], color=style.BLUE, linewidth=style.LINE, label="L, f > 0", zorder=2.2
    )
    if last < len(frequency):
        start = max(last - 1, 0)
        ax.plot(
            x[start:], y[start:], color=style.BLUE, linewidth=0.5,
            label=f"L beyond {frequency[start]:.2g} Hz",
        )  # fmt: skip


def _legend(ax: Axes) -> None:
    style.legend(ax, loc="upper left", bbox_to_anchor=(1.01, 1.0))


def _on_chart(loop: ComplexArray) -> tuple[Array, Array]:
    """Phase (deg, -360 to 0, with gaps where it wraps) and magnitude (dB)."""
    angle = np.mod(np.degrees(np.angle(loop)), 360.0) - 360.0
    decibel = 20.0 * np.log10(np.abs(loop))
    wraps = np.flatnonzero(np.abs(np.diff(angle)) > 180.0) + 1
    angle[wraps] = np.nan
    return angle, decibel


def _outside(frequency: Array, loop: ComplexArray, within: Mask) -> str:
    """How often and how far the curve leaves the picture."""
    if within.all():
        return ""
    left = int((within[:-1] & ~within[1:]).sum()) + int(not within[0])
    top = int(np.argmax(np.abs(loop)))
    where = f"|L| = {abs(loop[top]):.2g} at {frequency[top]:.2g} Hz"
    return f"outside the picture {_times(left)}, up to {where}"


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def _turns(loop: ComplexArray, analysis: LoopAnalysis | None) -> str:
    """Unstable poles and turns about -1; empty unless curve and poles agree."""
    if analysis is None or not analysis.design.simple_drive or analysis.bit_side.path is not None:
        return ""
    design = analysis.design
    free = loop_poles(design.sliding_string, 0.0, 0.0, analysis.operating_point.slope)
    growing, left = int((free.real > 0.0).sum()), int((analysis.poles.real > 0.0).sum())
    turns = turns_about_critical(loop, len(analysis.poles) - len(free))
    if turns is None or turns != growing - left or (left == 0) != analysis.stable:
        return ""
    verdict = "stable" if analysis.stable else "not stable"
    return (
        f"unstable poles: {growing} in the open loop, {left} in the closed loop, {verdict}:\n"
        f"L with its conjugate goes {_times(turns)} counter-clockwise around -1"
    )


def turns_about_critical(loop: ComplexArray, at_rest: int) -> int | None:
    """How often L with its conjugate goes counter-clockwise about -1."""
    step = np.diff(np.unwrap(np.angle(1.0 + loop)))
    if np.abs(step).max(initial=0.0) > 0.5 * np.pi:
        return None
    # Twice from zero to infinity, less what the detour about the poles at zero takes back.
    total = float(step.sum()) / np.pi - 0.5 * at_rest
    return round(total) if abs(total - round(total)) < 0.2 else None


def _note(ax: Axes, notes: list[str]) -> None:
    text = "\n".join(note for note in notes if note)
    if text:
        ax.annotate(
            text, (0.0, 0.0), xycoords="axes fraction", xytext=(0, -38),
            textcoords="offset points", fontsize=style.SMALL, va="top", annotation_clip=False,
        )  # fmt: skip
