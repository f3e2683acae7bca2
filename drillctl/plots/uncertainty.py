"""Under uncertainty: areas against the number of draws, J1 at chosen cells, Sobol indices.

Regions of a map under uncertainty: bands of probability, and what is not known of them.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from drillctl import units
from drillctl.arrays import Array
from drillctl.design.paths import USUAL_NAMES
from drillctl.ensemble.envelopes import ENVELOPED
from drillctl.ensemble.probability import INNER, MEDIAN, OUTER, called, needed
from drillctl.errors import InputError
from drillctl.plots import style
from drillctl.store.tables import quantity

if TYPE_CHECKING:
    from drillctl.studies import Axis, Uncertainty


BEST = ("mean", "q95")  # objectives whose best cells are shown unless others are chosen


@style.picture()
def area_convergence(result: Uncertainty, ax: Axes | None = None) -> Figure:
    """Area of the 95 % regions against the number of draws, with its sampling error."""
    figure, ax = style.axes_or_new(ax)
    curves = result.convergence
    for k, (level, areas) in enumerate(curves.areas.items()):
        value = 100.0 * np.array([one.value for one in areas])
        low, high = (100.0 * np.array([one.interval[end] for one in areas]) for end in (0, 1))
        # Side by side: intervals of several levels overlap.
        at = np.array(curves.counts) * 2.0 ** (0.08 * (k - 0.5 * (len(curves.areas) - 1)))
        ax.errorbar(
            at, value, yerr=np.maximum([value - low, high - value], 0.0), marker="o",
            markersize=4, capsize=3, elinewidth=1.0, label=f"J1 <= {level:g} s", **style.look(k),
        )  # fmt: skip
    if len(curves.counts) > 1:
        ax.set_xscale("log", base=2)
        ax.set_xticks(curves.counts, [f"{count:,}" for count in curves.counts])
        ax.minorticks_off()
    title = style.heading(result, "Area of the inner regions against the number of draws")
    style.dress(ax, "draws", "area of the 95 % region (% of the map)", title)
    style.legend(ax)
    text = "bars: 95 % interval of the sampling error, at each number of draws by itself"
    style.note(figure, text)
    return figure


@style.picture(
    cells="Of the flattened map; by default the best of the design, and those of `BEST`."
)
def cell_distributions(
    result: Uncertainty,
    cells: Sequence[int] | None = None,
    ax: Axes | None = None,
    system: units.System = "si",
) -> Figure:
    """Distribution of J1 over the draws at some cells of the map."""
    figure, ax = style.axes_or_new(ax)
    named = _named(result) if cells is None else dict.fromkeys(cells, "")
    j1 = result.j1.reshape(result.realizations, -1)
    top = 2.0 * result.levels[-1] if not result.censored.any() else result.levels[-1]
    for k, (cell, name) in enumerate(named.items()):
        column = np.sort(np.nan_to_num(j1[:, cell], nan=np.inf))
        share = np.arange(1, len(column) + 1) / len(column)
        place = ", ".join(_shown(result, cell, axis, system) for axis in result.axes)
        ax.step(
            [0.0, *column, top], [0.0, *share, share[-1]], where="post",
            label=f"{place}\n{name}".strip(), **style.look(k),
        )  # fmt: skip
    for level in result.levels:
        ax.axvline(level, color=style.GREY, linewidth=0.8, linestyle="--")
    ax.axhline(0.95, color="#BBBBBB", linewidth=0.8)
    ax.set_xlim(0.0, top)
    ax.set_ylim(0.0, 1.02)
    title = style.heading(result, "Distribution of J1 over the draws")
    style.dress(ax, "J1 (s)", "share of the draws at or under it", title)
    style.legend_under(ax, 1)
    style.note(figure, f"{result.realizations} draws; levels dashed")
    return figure


@style.picture(raises="No draw gave a response.")
def response_envelope(
    result: Uncertainty, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Bit speed and pipe torque over time at the design's own setting: 5 to 95 % of the draws."""
    band = result.envelope
    if band is None:
        raise InputError("no draw of the design gives a response")
    figure, panels = style.grid_or_new(ax, 2, 1, 7.5, 5.6, share_x=True)
    for panel, name in zip(panels, ("bit_speed", "pipe_torque"), strict=True):
        (low, middle, high), unit = units.displayed(band.signals[name], ENVELOPED[name], system)
        panel.fill_between(
            band.time, low, high, color=style.SKY, alpha=0.5, linewidth=0.0,
            label="5 to 95 % of the draws",
        )  # fmt: skip
        panel.plot(band.time, middle, color=style.BLUE, linewidth=1.2, label="median")
        panel.set_xlim(0.0, float(band.time[-1]))
        title = style.heading(result, "Responses over the draws") if name == "bit_speed" else ""
        style.dress(panel, "time (s)", f"{name.replace('_', ' ')} ({unit})", title)
        panel.label_outer()
    style.legend(panels[0], loc="upper right")
    text = f"{band.count} draws, at each moment apart: no curve is a single run"
    style.note(figure, text)
    return figure


def _named(result: Uncertainty) -> dict[int, str]:
    """Cells worth a look, with what they are best by."""
    results: dict[int, list[str]] = {}
    if not np.isnan(result.nominal).all():
        results.setdefault(int(np.nanargmin(result.nominal)), []).append("least J1 without draws")
    for name in BEST:
        try:
            results.setdefault(result.best(name).cell, []).append(called(name))
        except InputError:  # not known without --full
            continue
    return {cell: textwrap.fill(", ".join(names), 64) for cell, names in results.items()}


def _shown(result: Uncertainty, cell: int, axis: Axis, system: units.System) -> str:
    value = quantity(result.at(cell)[axis.path], axis.unit, system)
    return f"{USUAL_NAMES.get(axis.path, axis.path)} {value}"


@style.picture(result="With indices.", raises="The result has no indices.")
def sensitivity_bars(
    result: Uncertainty, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """First and total Sobol indices with their intervals, a panel a figure that they explain."""
    sobol = result.sensitivity
    if sobol is None:
        raise InputError("the result has no Sobol indices: ask for uncertainty.sensitivity")
    shown = [one for one in sobol.indices if one.variance > 0.0]
    if not shown:
        raise InputError("nothing varies, so there are no Sobol indices")
    height = 0.24 * len(sobol.parameters) + 1.0
    figure, panels = style.panels_or_new(ax, len(shown), (4.6, height), (1.6, 0.8))
    places = np.arange(len(sobol.parameters))
    for number, (panel, one) in enumerate(zip(panels, shown, strict=True)):
        for shift, key, colour in (
            (-0.19, "first", style.COLOURS[0]),
            (0.19, "total", style.COLOURS[1]),
        ):
            panel.barh(
                places + shift, getattr(one, key), 0.36, xerr=getattr(one, f"{key}_error"),
                color=colour, label=f"{key} index", error_kw={"linewidth": 1.0, "capsize": 2},
            )  # fmt: skip
        left = ax is not None or number % 2 == 0
        names = [path.removeprefix("drillstring.sections.") for path in sobol.parameters]
        panel.set_yticks(places, names if left else [""] * len(places))
        panel.invert_yaxis()
        panel.set_xlim(-0.25, 1.1)  # what reaches further is error
        style.dress(panel, "Sobol index", "", _short(units.told(one.of, system)))
    text = f"{sobol.samples} points of Saltelli's design; bars: 95 % interval of the error"
    style.legend_of_all(figure, panels[0], 2, text)
    return figure


def _short(of: str) -> str:
    """What is explained, by the usual names."""
    for path, name in USUAL_NAMES.items():
        of = of.replace(path, name)
    return of


SHADES = {OUTER: "#D6E6F2", MEDIAN: "#8FBFE0", INNER: style.BLUE}
"""Colour of the region of each probability."""
FEW = 20  # realizations up to which the outline of every one is drawn


@style.picture(**style.OVER_TWO, ax="A panel for each level.")
def uncertain_regions(
    result: Uncertainty, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Nominal contours with inner, median and outer regions: variability alone.

    The picture of Monteiro & Trindade (2012), Fig. 6, a panel a level. Up to `FEW` realizations
    are drawn one by one beside the bands.
    """
    figure, panels, x, y = _panels(result, ax, system)
    # Between a cell that is known and one that was stopped an outline is not.
    few = result.realizations <= FEW and not result.censored.any()
    for panel, level in zip(panels, result.levels, strict=True):
        probability = result.maps[level].probability
        for bound, colour in SHADES.items():
            at = border(bound, result.realizations)
            if probability.max() > at:
                panel.contourf(x, y, probability.T, levels=[at, 2.0], colors=[colour])
        for number in np.flatnonzero(result.possible) if few else ():
            # A cell that failed is far above any level.
            j1 = np.nan_to_num(result.j1[number], nan=10.0 * level)
            _outline(panel, x, y, j1, level, "#555555", 0.6)
        _outline(panel, x, y, result.nominal, level, style.BLACK, style.LINE)
    handles: list[Patch | Line2D] = [
        Line2D([], [], color=style.BLACK, linewidth=style.LINE, label="design itself"),
        Patch(color=SHADES[INNER], label="in at least 95 % of the draws"),
        Patch(color=SHADES[MEDIAN], label="in at least half"),
        Patch(color=SHADES[OUTER], label="in at least 5 %"),
    ]
    if few:
        handles.insert(1, Line2D([], [], color="#555555", linewidth=0.6, label="each draw"))
    _finish(figure, result, "Regions by probability", handles, "variability, not error")
    return figure


@style.picture(**style.OVER_TWO, ax="A panel for each level.")
def probability_map(
    result: Uncertainty, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Probability that J1 keeps to each level, over two parameters."""
    figure, panels, x, y = _panels(result, ax, system)
    share = Normalize(0.0, 1.0)
    scale = ScalarMappable(share, "cividis")
    for panel, level in zip(panels, result.levels, strict=True):
        probability = result.maps[level].probability
        style.cells(panel, x, y, probability, cmap=scale.cmap, norm=share)
        shown = [v for v in (OUTER, MEDIAN, INNER) if probability.min() < v < probability.max()]
        if shown:
            names = {border(v, result.realizations): v for v in shown}  # of few draws one for two
            at = list(names)
            lines = panel.contour(x, y, probability.T, levels=at, colors="white", linewidths=1.0)
            panel.clabel(lines, fmt=lambda v, names=names: f"{names[v]:.0%}", fontsize=style.SMALL)
    style.colour_bar(figure, scale, panels, "probability that J1 is at or under the level")
    _finish(figure, result, "Probability of each level", [], "variability, not error")
    return figure


@style.picture(**style.OVER_TWO, ax="A panel for each level.")
def region_error(
    result: Uncertainty, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """What is not known of the inner regions because draws are finite in number.

    Cells whose probability is at least 95 %, or is not, by intervals that hold in all cells at
    once with 95 %; and those of which neither can be said.
    """
    figure, panels, x, y = _panels(result, ax, system)
    colours = ("#FFFFFF", "#F2C59F", style.VERMILLION)
    for panel, level in zip(panels, result.levels, strict=True):
        low, high = result.maps[level].simultaneous
        kind = np.where(low >= INNER, 2, np.where(high >= INNER, 1, 0))
        style.cells(panel, x, y, kind, cmap=ListedColormap(colours), vmin=-0.5, vmax=2.5)
        value, (least, most) = result.areas[level][INNER]
        panel.annotate(
            f"area {value:.1%} ({100 * least:.1f} to {100 * most:.1f})", (0.98, 0.96),
            xycoords="axes fraction", ha="right", va="top", fontsize=style.SMALL,
        )  # fmt: skip
    names = ("not in the 95 % region", "not known", "in the 95 % region")
    handles = [
        Patch(facecolor=colour, edgecolor=style.GREY, label=name)
        for colour, name in zip(colours, names, strict=True)
    ]
    what = "sampling error: all cells at once, with 95 %"
    _finish(figure, result, "Sampling error of the inner regions", handles, what)
    return figure


def _panels(
    result: Uncertainty, ax: Sequence[Axes] | None, system: units.System
) -> tuple[Figure, list[Axes], Array, Array]:
    if len(result.axes) != 2:
        raise InputError(f"a map shows 2 parameters, the result has {len(result.axes)}")
    figure, panels = style.panels_or_new(ax, len(result.levels), (4.2, 3.6), (1.0, 0.8))
    x, x_label = style.axis_label(result.axes[0], system)
    y, y_label = style.axis_label(result.axes[1], system)
    for panel, level in zip(panels, result.levels, strict=True):
        style.dress(panel, x_label, y_label, f"J1 <= {level:g} s")
        panel.grid(visible=False)
        panel.set_xlim(x[0], x[-1])
        panel.set_ylim(y[0], y[-1])
    return figure, panels, x, y


def border(probability: float, total: int) -> float:
    """Share of the draws between the largest out of a region and the smallest in it.

    A contour through a share that draws can have would be a matter of rounding.
    """
    return (needed(probability, total) - 0.5) / total


def _outline(
    panel: Axes, x: Array, y: Array, j1: Array, level: float, colour: str, width: float
) -> None:
    if (j1 < level).any() and (j1 > level).any():
        panel.contour(x, y, j1.T, levels=[level], colors=[colour], linewidths=width)


def _finish(
    figure: Figure, result: Uncertainty, title: str, handles: Sequence[Patch | Line2D], what: str
) -> None:
    style.headline(figure, style.heading(result, title))
    method = result.design.tables.uncertainty.sampling
    draws = f"{result.realizations} draws ({method}, seed {result.seed}); {what}"
    text = style.caption(result, draws)
    if handles:
        style.legend_of_all(figure, None, len(handles), text, handles)
    else:
        style.note(figure, text)
