"""Frequency response of the string."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, MultipleLocator
from numpy.typing import NDArray

from drillctl.linear.response import FrequencyResponse
from drillctl.plots import style

TARGETS = (("top_speed", "top speed"), ("bit_speed", "bit speed"))


def bode(result: FrequencyResponse, ax: Sequence[Axes] | None = None) -> Figure:
    """Draw the response of top and bit speed to the top torque, string without control.

    Parameters
    ----------
    result : FrequencyResponse
        From `drillctl.linear.frequency_response`.
    ax : sequence of Axes, optional
        Two panels: magnitude and phase.

    Returns
    -------
    Figure
        Magnitude in dB of 1 rad/s per N m; phase between -180 and 180 degrees. The peaks of
        an undamped string are infinite: as drawn they end where the nearest frequency lies.
    """
    figure, (magnitude, phase) = style.grid_or_new(ax, 2, 1, 7.5, 6.0, share_x=True)
    for number, (target, name) in enumerate(TARGETS):
        response = result.between("top_torque", target)
        look = {
            "color": style.COLOURS[number],
            "linestyle": style.DASHES[number],
            "linewidth": style.LINE,
        }
        magnitude.semilogx(result.frequency_hz, 20.0 * np.log10(np.abs(response)), **look)
        phase.semilogx(
            result.frequency_hz, _unbroken(response), label=f"top torque to {name}", **look
        )
    style.dress(magnitude, "", "magnitude (dB re 1 rad/s/(N m))", "String without control")
    style.dress(phase, "frequency (Hz)", "phase (deg)")
    phase.yaxis.set_major_locator(MultipleLocator(90.0))
    phase.set_ylim(-190.0, 190.0)
    phase.margins(x=0.0)
    phase.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    phase.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    magnitude.legend(
        handles=phase.get_lines(), fontsize=style.SMALL, frameon=False, loc="upper right"
    )
    return figure


def _unbroken(response: NDArray[np.complexfloating[Any, Any]]) -> NDArray[np.float64]:
    """Phase (deg) with a gap where it leaves at one edge and comes back at the other."""
    phase = np.degrees(np.angle(response))
    wraps = np.flatnonzero(np.abs(np.diff(phase)) > 270.0) + 1
    phase[wraps] = np.nan
    return phase
