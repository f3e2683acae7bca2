"""What smoothing the friction does to a map."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl.plots import style
from drillctl.studies.regularisation import Regularisation


def regularisation(result: Regularisation, ax: Sequence[Axes] | None = None) -> Figure:
    """Draw the shift of J1 and the size of the regions against the width of the smoothing.

    Parameters
    ----------
    result : Regularisation
        From `drillctl.studies.regularisation`.
    ax : sequence of Axes, optional
        Two panels.

    Returns
    -------
    Figure
        Left: median, 95th percentile and worst relative change of J1 over the cells. Right:
        cells at or under each level over those of the set-valued map.
    """
    figure, (left, right) = style.grid_or_new(ax, 1, 2, 10.5, 4.6)
    size = np.abs(result.shifts)
    for number, (share, name) in enumerate(((0.5, "median cell"), (0.95, "95th percentile"),
                                            (1.0, "worst cell"))):  # fmt: skip
        change = [100.0 * np.nanquantile(x, share) for x in size]
        left.loglog(
            result.widths, change, "o", color=style.COLOURS[number],
            linestyle=style.DASHES[number], linewidth=style.LINE, markersize=4, label=name,
        )  # fmt: skip
    for number, level in enumerate(result.levels):
        exact, cells = result.cells(level)
        if exact == 0:
            continue
        right.semilogx(
            result.widths, np.array(cells) / exact, "o", color=style.COLOURS[number],
            linestyle=style.DASHES[number % 4], linewidth=style.LINE, markersize=4,
            label=f"J1 at or under {level:g} s ({exact} cells)",
        )  # fmt: skip
    right.axhline(1.0, color=style.BLACK, linewidth=0.8)
    over = "width of the regularisation (rad/s)"
    style.dress(left, over, "change of J1 (%)", "Friction smoothed by tanh")
    style.dress(right, over, "cells over those of set-valued friction", "Size of the regions")
    for panel in (left, right):
        panel.legend(fontsize=style.SMALL, frameon=False)
    table = result.design.tables
    origin = "string reconstructed; " if table.status == "reconstructed" else ""
    extent = f"{result.j1.size} cells, {table.simulation.duration:g} s"
    figure.supxlabel(f"{table.title or result.design.name}; {origin}{extent}", fontsize=style.SMALL)
    return figure
