"""Logs over time with their oscillations, and their spectra."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.plots import style

if TYPE_CHECKING:
    from drillctl.studies.log.compute import LogOverview

MARKED = 5  # oscillations that are shaded
ROWS = (
    ("top_torque", "torque", "N*m", style.BLUE), ("top_speed", "speed", "rad/s", style.VERMILLION),
    ("weight_on_bit", "weight", "N", style.GREEN),
)  # fmt: skip


@style.picture()
def log_overview(
    result: LogOverview, ax: Axes | Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Least and largest torque, speed and weight over time; the strongest oscillations shaded."""
    held = [row for row in ROWS if any(row[0] in one.least for one in result.outlines)]
    given = [ax] if isinstance(ax, Axes) else ax
    figure, panels = style.grid_or_new(
        given, len(held), 1, 9.0, 1.9 * len(held) + 1.2, share_x=True
    )
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
        style.dress(panel, "", f"{text} ({shown})")
    panels[-1].set_xlabel(f"time ({unit})", fontsize=style.LABEL)
    panels[0].set_title(", ".join(result.files), fontsize=style.TITLE, loc="left", pad=16.0)
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
    last = 2.0 if not len(result.frequencies) else 1.15 * float(result.frequencies[min(2, len(result.frequencies) - 1)])  # fmt: skip  # noqa: E501
    axes.set_xlim(0.0, min(last, float(result.spectra[0].frequency[-1])))
    axes.set_ylim(0.0, None)
    style.dress(axes, "frequency (Hz)", "share of variance", "Spectrum of the surface torque")
    axes.legend(fontsize=style.SMALL, frameon=False)
    return figure
