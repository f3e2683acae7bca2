"""The boundary of the stable gains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from drillctl import units
from drillctl.linear.boundary import GainBoundary
from drillctl.plots import style
from drillctl.plots.colour_bars import beyond, colours, plain_ticks
from drillctl.plots.frequency import listed
from drillctl.plots.plane import legend_under, named_values, title_of

Array = NDArray[np.float64]

GAINS = ("controller.kp", "controller.ki")
GAIN_UNITS = {"controller.kp": "N*m*s/rad", "controller.ki": "N*m/rad"}
STABLE = "#D5E8DF"
"""Stable gains."""
DIAMOND: dict[str, Any] = {
    "color": "white", "markeredgecolor": style.BLACK, "markersize": 8, "markeredgewidth": 1.4,
    "linestyle": "none", "zorder": 6,
}  # fmt: skip
"""Mark of the design's own values."""


def gain_boundary(
    result: GainBoundary | Sequence[GainBoundary],
    ax: Axes | None = None,
    system: units.System = "si",
) -> Figure:
    """Draw the curve of poles on the imaginary axis and the stable gains it bounds.

    Parameters
    ----------
    result : GainBoundary or sequence of GainBoundary
        From `drillctl.linear.gain_boundary`. The first is coloured by frequency, its region
        filled; of others, such as the continuum, curve and outline are dashed.
    ax : Axes, optional
        Axes to draw on.
    system : {'si', 'field'}
        Units of the gains.

    Returns
    -------
    Figure
        Each mode brings a branch; those of high modes are thin.

    Raises
    ------
    InputError
        Nothing to draw.
    """
    boundaries = listed(result)
    first = boundaries[0]
    figure, ax = style.axes_or_new(ax, 7.8, 5.8)
    sides = [
        named_values(path, GAIN_UNITS[path], np.array(span), system)
        for path, span in zip(GAINS, first.window, strict=True)
    ]
    _fill(ax, first, system)
    _coloured(figure, ax, first, system)
    for number, other in enumerate(boundaries[1:]):
        _dashed(ax, other, number, system)
    own = first.design.top_drive.gains()
    kp, ki = shown_gains(own[0], own[1], system)
    if kp > 0.0 or ki > 0.0:
        ax.plot(kp, ki, "D", **DIAMOND, label="gains of the design")
    style.dress(ax, sides[0][1], sides[1][1], title_of(first))
    ax.set_xlim(*sides[0][0])
    ax.set_ylim(*sides[1][0])
    legend_under(ax, 2)
    figure.supxlabel(f"falling slope of the rock {first.slope:.4g} N m s", fontsize=style.SMALL)
    return figure


def rings_of(boundary: GainBoundary) -> list[Array]:
    """Outer and inner rings of the region, Kp and Ki by rows."""
    return [
        np.asarray(ring.coords)
        for part in boundary.region.geoms
        for ring in (part.exterior, *part.interiors)
    ]


def _fill(ax: Axes, boundary: GainBoundary, system: units.System) -> None:
    rings = rings_of(boundary)
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
    # Towards Ki = 0 a branch goes to no frequency at all; the modes are to be told apart.
    high = float(frequency.max())
    low = min(max(float(frequency.min()), 1e-3 * high), 0.99 * high)
    norm = LogNorm(low, high)
    share = np.log(np.maximum(frequency, low) / low) / np.log(high / low)
    lines = LineCollection(
        list(np.concatenate(pieces)), cmap=colours(0.0, 0.88),
        norm=norm, linewidths=4.0 - 3.3 * share,
        capstyle="round", zorder=3,
    )  # fmt: skip
    lines.set_array(frequency)
    ax.add_collection(lines)
    bar = figure.colorbar(lines, ax=ax, extend=beyond(frequency, norm), pad=0.02)
    plain_ticks(bar)
    bar.set_label("frequency of the poles on the axis (Hz)", fontsize=style.LABEL)
    bar.ax.tick_params(labelsize=style.SMALL)


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
    return (
        units.displayed(kp, GAIN_UNITS["controller.kp"], system)[0],
        units.displayed(ki, GAIN_UNITS["controller.ki"], system)[0],
    )
