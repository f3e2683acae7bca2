"""Mobility at the ends of the string: how fast an end turns per torque on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.linear.response import FrequencyResponse
from drillctl.plots import style
from drillctl.plots.frequency import WIDTHS, hertz, listed

PER_TORQUE = 1e3 / units.RPM
"""Revolutions a minute per kN m in one rad/s per N m."""
UNIT = "rpm/(kN m)"
ENDS = (("bit", "bit_torque", "bit_speed"), ("top", "top_torque", "top_speed"))
"""Name, input and output of each end."""


def mobility(
    results: FrequencyResponse | Sequence[FrequencyResponse], ax: Sequence[Axes] | None = None
) -> Figure:
    """Draw the magnitude of the mobility at bit and top.

    Parameters
    ----------
    results : FrequencyResponse or sequence of FrequencyResponse
        From `drillctl.linear.frequency_response`: the string alone (`plant`), with its drive
        (`closed_loop`), of elements or of the continuum; told apart by their `title`.
    ax : sequence of Axes, optional
        A panel for the bit and one for the top; the latter only where a result has the top
        torque among its inputs, which a string with its drive has not.

    Returns
    -------
    Figure
        In rpm per kN m. High peaks at the bit are where the rock's falling slope feeds the
        string; those of an undamped string end where the nearest frequency lies.

    Raises
    ------
    InputError
        Nothing to draw, a result without mobility at the bit, not as many axes as panels.
    """
    given = listed(results)
    for one in given:
        one.between("bit_torque", "bit_speed")
    shown = [end for end in ENDS if any(_has(one, end) for one in given)]
    figure, panels = style.grid_or_new(ax, len(shown), 1, 7.5, 2.6 * len(shown) + 1.2, share_x=True)
    for panel, end in zip(panels, shown, strict=True):
        for number, one in enumerate(given):
            if _has(one, end):
                _draw(panel, one, end, number, len(given))
        style.dress(panel, "", f"mobility at the {end[0]} ({UNIT})")
    panels[-1].set_xlabel("frequency (Hz)", fontsize=style.LABEL)
    for panel in panels:
        hertz(panel)
    panels[0].legend(
        fontsize=style.SMALL, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0),
        handlelength=3.5,
    )  # fmt: skip
    return figure


def _has(one: FrequencyResponse, end: tuple[str, str, str]) -> bool:
    return end[1] in one.inputs and end[2] in one.outputs


def _draw(
    panel: Axes, one: FrequencyResponse, end: tuple[str, str, str], number: int, count: int
) -> None:
    panel.loglog(
        one.frequency_hz,
        np.abs(one.between(*end[1:])) * PER_TORQUE,
        color=style.COLOURS[number % len(style.COLOURS)],
        linestyle=style.DASHES[number % len(style.DASHES)],
        linewidth=style.LINE if count == 1 else WIDTHS[min(number, len(WIDTHS) - 1)],
        label=one.title,
    )
