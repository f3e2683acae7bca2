"""Estimated errors of the batch engine over a sample of lanes, and what the audit found."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl.errors import InputError
from drillctl.plots.plane import title_of
from drillctl.plots.style import BLACK, BLUE, LINE, SMALL, VERMILLION, axes_or_new, dress
from drillctl.studies.diagnosis.error_estimate import PROMISES, ROUNDING, SMALLEST

if TYPE_CHECKING:
    from drillctl.studies import Doctor


def error_estimate(result: Doctor, ax: Axes | None = None) -> Figure:
    """Estimated error of each lane over its J1, beside what the accuracy promises.

    Parameters
    ----------
    result : Doctor
        Of a design that the batch engine takes.
    ax : Axes, optional
        Axes to draw on.

    Returns
    -------
    Figure
        Circles are audited differences, on the lanes that were simulated again.

    Raises
    ------
    InputError
        The engine refused the design: there is nothing to draw.
    """
    if not len(result.cells):
        raise InputError("there is no estimate to draw: the batch engine refused this design")
    figure, ax = axes_or_new(ax, 7.0, 4.5)
    j1 = np.maximum(result.estimate.j1[0], SMALLEST)
    ax.loglog(
        j1, np.maximum(result.estimate.of_lanes, ROUNDING), ".", color=BLUE,
        label=f"{len(j1)} lanes, estimated",
    )  # fmt: skip
    if len(result.audit.cells):
        ax.loglog(
            np.maximum(result.audit.batch, SMALLEST),
            np.maximum(result.audit.differences, ROUNDING),
            "o", markerfacecolor="none", markeredgecolor=VERMILLION, markersize=8,
            label="beside the reference solver",
        )  # fmt: skip
    promise = PROMISES[result.accuracy]
    for value, style, name in ((promise.median, "--", "median"), (promise.p99, "-", "99 %")):
        if value is not None:
            label = f"'{result.accuracy}' over the paper's map: {name}"
            ax.axhline(value, color=BLACK, linestyle=style, linewidth=0.6 * LINE, label=label)
    title = title_of(result)
    dress(ax, "J1 (s)", "relative error of J1", title)
    ax.legend(fontsize=SMALL, frameon=False)
    return figure
