"""Logs over time with their oscillations, their spectra, and what was fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.plots import style

if TYPE_CHECKING:
    from drillctl.studies.identify.compute import Identification
    from drillctl.studies.log.compute import LogOverview

MARKED = 5  # oscillations that are shaded
ROWS = (
    ("top_torque", "torque", "N*m", style.BLUE), ("top_speed", "speed", "rad/s", style.VERMILLION),
    ("weight_on_bit", "weight", "N", style.GREEN),
)  # fmt: skip


@style.picture()
def log_overview(
    result: LogOverview, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Least and largest torque, speed and weight over time; oscillations and sticking marked."""
    held = [row for row in ROWS if any(row[0] in one.least for one in result.outlines)]
    figure, panels = style.grid_or_new(ax, len(held), 1, 9.0, 1.9 * len(held) + 1.2, share_x=True)
    scale, unit = (3600.0, "h") if result.duration > 7200.0 else (1.0, "s")
    for panel, (name, text, si, colour) in zip(panels, held, strict=True):
        shown = ""
        for offset, outline in zip(result.offsets, result.outlines, strict=True):
            for other, tint in ((name, colour), ("bit_speed", style.SKY)):
                if other in outline.least and (other == name or name == "top_speed"):
                    shown = _band(panel, outline, other, offset, scale, si, tint, system)
        for number, event in enumerate(result.events[:MARKED], start=1):
            offset = float(result.offsets[event.log])
            ends = (event.begin + offset) / scale, (event.end + offset) / scale
            panel.axvspan(*ends, color=style.ORANGE, alpha=0.3, linewidth=0.0)
            if panel is panels[0]:
                panel.annotate(
                    f"{number}", (sum(ends) / 2.0, 1.0), xycoords=("data", "axes fraction"),
                    ha="center", va="bottom", fontsize=style.SMALL,
                )  # fmt: skip
        panel.broken_barh(
            [(a / scale, (b - a) / scale) for a, b in result.sticking.tolist()],
            (0.0, 0.03), transform=panel.get_xaxis_transform(), color=style.BLACK, linewidth=0.0,
        )  # fmt: skip
        style.dress(panel, "", f"{text} ({shown})")
    still = f"; black: the bit stands still, by the {result.sticking_from}"
    panels[-1].set_xlabel(
        f"time ({unit}){still if len(result.sticking) else ''}", fontsize=style.LABEL
    )
    style.title(panels[0], ", ".join(result.files), pad=16.0)
    return figure


def _band(
    ax: Axes, outline: Any, name: str, offset: float, scale: float, si: str, colour: str,
    system: units.System,
) -> str:  # fmt: skip
    """Fill between least and largest values; the unit they are shown in."""
    factor, unit = units.displayed(1.0, si, system)
    time = (outline.begin + offset) / scale
    low, high = outline.least[name] * factor, outline.most[name] * factor
    ax.fill_between(time, low, high, color=colour, alpha=0.5, linewidth=0.0)
    ax.plot(time, 0.5 * (low + high), color=colour, linewidth=0.5)
    return unit


@style.picture()
def log_spectrum(result: LogOverview, ax: Axes | None = None) -> Figure:
    """Share of the torque's variance over frequency; the string's frequencies drawn in."""
    figure, axes = style.axes_or_new(ax, 7.0, 4.2)
    axes.axvspan(*result.band, color=style.ORANGE, alpha=0.15, linewidth=0.0, label="searched")
    for number, one in enumerate(result.spectra):
        axes.plot(one.frequency, one.power, label=one.name, **style.look(number, 1.2))
    for number, frequency in enumerate(np.asarray(result.frequencies)):
        axes.axvline(
            frequency, color=style.BLACK, linewidth=0.8, linestyle=":",
            label="string, top held" if number == 0 else None,
        )  # fmt: skip
    first = result.frequencies[:3]
    last = 1.15 * float(first[-1]) if len(first) else 2.0
    axes.set_xlim(0.0, min(last, float(result.spectra[0].frequency[-1])))
    axes.set_ylim(0.0, None)
    style.dress(axes, "frequency (Hz)", "share of variance", "Spectrum of the surface torque")
    style.legend(axes)
    return figure


@style.picture()
def identified_curve(
    result: Identification, ax: Axes | None = None, system: units.System = "si"
) -> Figure:
    """The friction curve with its band over the speeds that were seen."""
    figure, axes = style.axes_or_new(ax, 7.0, 4.6)
    factor, unit = units.displayed(1.0, "N*m", system)
    one = result.fitted
    axes.plot(
        result.portrait_speed / units.RPM, factor * result.portrait_torque, linestyle="none",
        marker=".", markersize=2.0, color="#BBBBBB", label="from the waves, no law",
    )  # fmt: skip
    axes.fill_between(
        one.speed / units.RPM, factor * one.low, factor * one.high, color=style.BLUE, alpha=0.3,
        linewidth=0.0, label=f"band of {100 * result.design.tables.identify.confidence:g} %",
    )  # fmt: skip
    for number, law in enumerate((one, *(f for f in result.fits if f is not one))):
        axes.plot(
            law.speed / units.RPM, factor * law.torque, label=law.name,
            **style.look(number, 1.6 if law is one else 1.0),
        )  # fmt: skip
    if result.identifiable["static_friction"]:
        axes.plot([0.0], [factor * one.static], color=style.BLUE, marker="o", linestyle="none")
    top = 1.25 * factor * float(max(one.static, one.torque.max()))
    axes.set_ylim(0.0, top)
    axes.set_xlim(-0.02 * one.speed[-1] / units.RPM, 1.02 * one.speed[-1] / units.RPM)
    at, force = units.displayed(result.weight, "N", system)
    style.dress(
        axes, "bit speed (rpm)", f"torque ({unit})", f"Friction of the log at {at:.4g} {force}"
    )
    style.legend(axes)
    return figure


@style.picture()
def identified_window(
    result: Identification, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """A window of the log beside the fit: the wave that comes up, its residual, the bit speed."""
    figure, panels = style.grid_or_new(ax, 3, 1, 8.0, 6.4, share_x=True)
    factor, unit = units.displayed(1.0, "N*m", system)
    one = result.trace
    panels[0].plot(one.time, factor * one.measured, label="log", **style.look(0, 1.4))
    panels[0].plot(one.time, factor * one.predicted, label="fit", **style.look(1, 1.0))
    panels[1].plot(one.time, factor * (one.measured - one.predicted), **style.look(2, 0.8))
    panels[2].plot(one.time, one.bit_speed / units.RPM, label="fit", **style.look(1, 1.2))
    if one.downhole is not None:
        panels[2].plot(one.time, one.downhole / units.RPM, label="log", **style.look(0, 1.0))
    for panel, text in zip(
        panels, (f"upward wave ({unit})", f"log - fit ({unit})", "bit speed (rpm)"), strict=True
    ):
        style.dress(panel, "", text)
    style.title(panels[0], "A window of the log beside the fit")
    style.legend(panels[0])
    panels[-1].set_xlabel("time (s)", fontsize=style.LABEL)
    return figure


@style.picture()
def identified_profile(
    result: Identification, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Rise of the misfit over each coefficient, the others fitted anew."""
    count = len(result.profile)
    figure, panels = style.grid_or_new(ax, 1, count, 3.0 * count + 0.8, 3.0, share_y=True)
    for panel, (name, (values, rises)) in zip(panels, result.profile.items(), strict=True):
        values, unit = units.displayed(values, "s/rad" if name == "beta" else "m", system)
        panel.plot(values, np.maximum(rises, 0.0), marker="o", markersize=3.5, **style.look(0, 1.2))
        style.dress(panel, f"{name} ({unit})", "rise of the misfit" if panel is panels[0] else "")
    return figure
