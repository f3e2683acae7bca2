"""The top drive as the string feels it: impedance against that of the pipe, and reflection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl.errors import InputError
from drillctl.linear.tuning import DriveImpedance
from drillctl.plots import style
from drillctl.plots.modes import hertz, listed

GREY = "#777777"


def drive_impedance(
    results: DriveImpedance | Sequence[DriveImpedance],
    ax: Sequence[Axes] | None = None,
    marks: Mapping[str, float] | Sequence[float] = (),
) -> Figure:
    """Draw impedance and reflection of one or several top drives over frequency.

    Parameters
    ----------
    results : DriveImpedance or sequence of DriveImpedance
        From `drillctl.linear.drive_impedance`; each is named by its `label`.
    ax : sequence of Axes, optional
        Two panels: impedance and reflection.
    marks : mapping of str to float or sequence of float, optional
        Frequencies (Hz) that are marked, such as that of stick-slip; by name, if they have one.

    Returns
    -------
    Figure
        Above, the magnitude of the drive's impedance over that of the pipe: the drive takes
        most of a wave near 1, where the line is drawn. Below, the share of the amplitude of
        a wave that is sent back: 0 takes all, 1 takes nothing.

    Raises
    ------
    InputError
        Nothing to draw, or a mark that is not more than 0 Hz.
    """
    drives = listed(results)
    figure, (above, below) = style.grid_or_new(ax, 2, 1, 7.5, 6.0, share_x=True)
    for number, drive in enumerate(drives):
        look = {
            "color": style.COLOURS[number % len(style.COLOURS)],
            "linestyle": style.DASHES[number % len(style.DASHES)],
            "linewidth": style.LINE,
        }
        frequency = drive.frequency_hz
        above.loglog(frequency, np.abs(drive.impedance) / drive.pipe, label=drive.label, **look)
        below.semilogx(frequency, np.abs(drive.reflection), label=drive.label, **look)
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
    above.legend(
        handles=[line for line in above.get_lines() if line.get_label() in _names(drives)],
        fontsize=style.SMALL, frameon=False, loc="lower right", bbox_to_anchor=(1.0, 1.0),
        handlelength=3.5,
    )  # fmt: skip
    return figure


def _names(drives: Sequence[DriveImpedance]) -> set[str]:
    return {drive.label for drive in drives}


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
