"""Cases at their own values, nothing drawn: their regions and their motions in one picture."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import parameter
from drillctl.errors import InputError, shown
from drillctl.plots.comparison import WIDEST, case_colour, legend_below
from drillctl.plots.style import (
    BLACK,
    DASHES,
    SMALL,
    TITLE,
    axes_or_new,
    axis_label,
    dress,
    grid_or_new,
    title_of,
)

if TYPE_CHECKING:
    import shapely

    from drillctl.ensemble.grid import Axis
    from drillctl.studies.compare.compute import ComparedCase, Comparison

Array = NDArray[np.float64]

OUTLINES = (3.2, 1.7)
"""Outline of the first and the last case (points): under a later one an equal one is seen."""
TRACES = (2.0, 1.1)
"""Line of the first and the last case, likewise."""
FILL = 0.10
"""How much of its colour fills a region: enough to tell inside from outside."""


def compared_regions(
    result: Comparison,
    level: float | None = None,
    ax: Axes | None = None,
    system: units.System = "si",
) -> Figure:
    """Outlines of {J1 <= level} of every case, over the same two parameters.

    Parameters
    ----------
    result : Comparison
        With at least one case that has a map.
    level : float, optional
        Level of J1 (s); by default the lowest of the comparison. Any will do, the maps are kept.
    ax : Axes, optional
        Axes to draw on.
    system : {'si', 'field'}
        Units of the axes.

    Returns
    -------
    Figure
        With the share of the cells in the legend; a cross where a case is in the map.

    Raises
    ------
    InputError
        No case has a map, or the level is not a positive number.
    """
    level = result.levels[0] if level is None else level
    if not (math.isfinite(level) and level > 0.0):
        raise InputError(f"a level of J1 is a positive number of seconds, got {shown(level)}")
    axes = _axes(result)
    figure, ax = axes_or_new(ax, 8.0, 6.5)
    x, x_label = axis_label(axes[0], system)
    y, y_label = axis_label(axes[1], system)
    scales = np.array([units.displayed(1.0, axis.unit, system)[0] for axis in axes])
    widths = np.linspace(*OUTLINES, len(result.cases))
    for number, (case, width) in enumerate(zip(result.cases, widths, strict=True)):
        _outline(ax, case, level, number, float(width), scales)
    ax.plot(
        *zip(*_places(result, axes, scales), strict=True), "X", color=BLACK, markersize=9.0,
        markeredgewidth=2.0, linestyle="", label="where the cases are", zorder=5,
    )  # fmt: skip
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(y[0], y[-1])
    dress(ax, x_label, y_label, f"{title_of(result)}: J1 <= {level:g} s")
    legend_below(ax, 2)
    figure.supxlabel(_caption(result), fontsize=SMALL)
    return figure


def compared_responses(
    result: Comparison, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Bit speed, weight on bit and top torque of every case against time.

    Parameters
    ----------
    result : Comparison
        Any number of cases.
    ax : sequence of Axes, optional
        Three, from the top.
    system : {'si', 'field'}
        Units of weight and torque.

    Returns
    -------
    Figure
        A panel a signal, a line a case.

    Raises
    ------
    InputError
        Another number of axes than three.
    """
    figure, panels = grid_or_new(ax, 3, 1, 9.0, 8.0, share_x=True)
    signals = (
        ("bit_speed", "rad/s", "bit speed"), ("weight_on_bit", "N", "WOB"),
        ("top_torque", "N*m", "top torque"),
    )  # fmt: skip
    widths = np.linspace(*TRACES, len(result.cases))
    for panel, (name, si_unit, words) in zip(panels, signals, strict=True):
        factor, unit = units.displayed(1.0, si_unit, system)
        for number, case in enumerate(result.cases):
            run = case.nominal.response
            panel.plot(
                run.time, factor * run.signals[name], color=case_colour(number),
                linestyle=DASHES[number % len(DASHES)], linewidth=widths[number],
                label=f"{case.name} (J1 {_seconds(run.measures.j1)})",
            )  # fmt: skip
        panel.set_xlim(0.0, float(result.baseline.nominal.response.time[-1]))
        dress(panel, "time (s)" if panel is panels[-1] else "", f"{words} ({unit})")
    panels[0].set_title(title_of(result), fontsize=TITLE, loc="left")
    panels[-1].legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.22), ncols=2, fontsize=SMALL, frameon=False
    )
    figure.supxlabel(_caption(result), fontsize=SMALL)
    return figure


def _axes(result: Comparison) -> tuple[Axis, ...]:
    for case in result.cases:
        if case.nominal.map is not None:
            return case.nominal.map.axes
    reasons = "; ".join(f"{case.name}: {case.nominal.no_map}" for case in result.cases)
    raise InputError(f"no case has a map: {reasons}")


def _outline(
    ax: Axes, case: ComparedCase, level: float, number: int, width: float, scales: Array
) -> None:
    found = case.region(level)
    share = "no map" if found is None else f"{found.area_fraction:.1%} of the cells"
    colour = case_colour(number)
    parts = [] if found is None or found.polygons is None else found.polygons.geoms
    rings = [ring * scales for polygon in parts for ring in _rings(polygon)]
    # An empty region has its entry in the legend too.
    path = Path.make_compound_path(*map(Path, rings)) if rings else Path(np.empty((0, 2)))
    ax.add_patch(
        PathPatch(
            path, facecolor=to_rgba(colour, FILL), edgecolor=colour, linewidth=width,
            linestyle=DASHES[number % len(DASHES)], label=f"{case.name} ({share})",
        )
    )  # fmt: skip


def _rings(polygon: shapely.Polygon) -> list[Array]:
    """Corners of the border and of the holes, each of shape (corners, 2).

    Border and holes run in opposite senses: what fills a path leaves out a hole by that.
    """
    from shapely.geometry.polygon import orient

    turned = orient(polygon)
    return [np.asarray(ring.coords) for ring in (turned.exterior, *turned.interiors)]


def _places(result: Comparison, axes: tuple[Axis, ...], scales: Array) -> list[tuple[float, float]]:
    """Where the cases stand in the map, each place once; those outside are not seen."""
    places = []
    for case in result.cases:
        if case.nominal.map is not None:
            own = [parameter(case.nominal.map.design, axis.path).value for axis in axes]
            x, y = (math.nan if value is None else value for value in own)
            places.append((x * scales[0], y * scales[1]))
    return list(dict.fromkeys(places))


def _seconds(value: float | None) -> str:
    return "undefined" if value is None else f"{value:.1f} s"


def _caption(result: Comparison) -> str:
    status = result.design.tables.status
    origin = f"String {status}. " if status == "reconstructed" else ""
    equal = " Nominal weights shifted for equal means." if result.equal_mean_weight else ""
    text = f"{origin}Each case at its own values, without draws.{equal}"
    return "\n".join(textwrap.wrap(text, WIDEST))
