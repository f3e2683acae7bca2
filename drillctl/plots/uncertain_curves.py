"""Under uncertainty: areas against the number of draws, J1 at chosen cells, Sobol indices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.errors import InputError
from drillctl.plots.plane import NAMES, title_of
from drillctl.plots.style import COLOURS, DASHES, LINE, SMALL, axes_or_new, dress, grid_or_new

if TYPE_CHECKING:
    from drillctl.studies import Uncertainty

BEST = ("mean", "q95")
"""Objectives whose best cells are shown unless others are chosen."""


def area_convergence(result: Uncertainty, ax: Axes | None = None) -> Figure:
    """Area of the 95 % regions against the number of draws, with its sampling error.

    Parameters
    ----------
    result : Uncertainty
        Any map.
    ax : Axes, optional
        Axes to draw on.
    """
    figure, ax = axes_or_new(ax)
    curves = result.convergence
    for k, (level, areas) in enumerate(curves.areas.items()):
        colour = COLOURS[k % len(COLOURS)]
        value = 100.0 * np.array([one.value for one in areas])
        low, high = (100.0 * np.array([one.interval[end] for one in areas]) for end in (0, 1))
        # Side by side: intervals of several levels overlap.
        at = np.array(curves.counts) * 2.0 ** (0.08 * (k - 0.5 * (len(curves.areas) - 1)))
        ax.errorbar(
            at, value, yerr=np.maximum([value - low, high - value], 0.0), marker="o",
            markersize=4, capsize=3, elinewidth=1.0, color=colour, linewidth=LINE,
            linestyle=DASHES[k % len(DASHES)], label=f"J1 <= {level:g} s",
        )  # fmt: skip
    if len(curves.counts) > 1:
        ax.set_xscale("log", base=2)
        ax.set_xticks(curves.counts, [f"{count:,}" for count in curves.counts])
        ax.minorticks_off()
    title = title_of(result)
    dress(ax, "draws", "area of the 95 % region (% of the map)", title)
    ax.legend(fontsize=SMALL, frameon=False)
    figure.supxlabel(
        "bars: 95 % interval of the sampling error, at each number of draws by itself",
        fontsize=SMALL,
    )
    return figure


def cell_distributions(
    result: Uncertainty,
    cells: Sequence[int] | None = None,
    ax: Axes | None = None,
    system: units.System = "si",
) -> Figure:
    """Distribution of J1 over the draws at some cells of the map.

    Parameters
    ----------
    result : Uncertainty
        Any map.
    cells : sequence of int, optional
        Of the flattened map; by default the best of the design itself, and those of `BEST`.
    ax : Axes, optional
        Axes to draw on.
    system : {'si', 'field'}
        Units of the parameters.
    """
    figure, ax = axes_or_new(ax)
    named = _named(result) if cells is None else dict.fromkeys(cells, "")
    j1 = result.j1.reshape(result.realizations, -1)
    top = 2.0 * result.levels[-1] if not result.censored.any() else result.levels[-1]
    for k, (cell, name) in enumerate(named.items()):
        column = np.sort(np.nan_to_num(j1[:, cell], nan=np.inf))
        share = np.arange(1, len(column) + 1) / len(column)
        place = ", ".join(
            f"{NAMES.get(a.path, a.path)} {_shown(result, cell, a.path, system)}"
            for a in result.axes
        )
        ax.step(
            [0.0, *column, top], [0.0, *share, share[-1]], where="post", linewidth=LINE,
            color=COLOURS[k % len(COLOURS)], linestyle=DASHES[k % len(DASHES)],
            label=f"{place}{f' ({name})' if name else ''}",
        )  # fmt: skip
    for level in result.levels:
        ax.axvline(level, color="#888888", linewidth=0.8, linestyle="--")
    ax.axhline(0.95, color="#BBBBBB", linewidth=0.8)
    ax.set_xlim(0.0, top)
    ax.set_ylim(0.0, 1.02)
    dress(ax, "J1 (s)", "share of the draws at or under it",
          title_of(result))  # fmt: skip
    ax.legend(fontsize=SMALL, frameon=False, loc="lower right")
    figure.supxlabel(f"{result.realizations} draws; levels dashed", fontsize=SMALL)
    return figure


def _named(result: Uncertainty) -> dict[int, str]:
    """Cells worth a look, with what they are best by."""
    found: dict[int, list[str]] = {}
    if not np.isnan(result.nominal).all():
        found.setdefault(int(np.nanargmin(result.nominal)), []).append("J1 without draws")
    for name in BEST:
        try:
            found.setdefault(result.best(name).cell, []).append(name)
        except InputError:  # not known without --full
            continue
    return {cell: f"best by {', '.join(names)}" for cell, names in found.items()}


def _shown(result: Uncertainty, cell: int, path: str, system: units.System) -> str:
    unit = next(a.unit for a in result.axes if a.path == path)
    value, label = units.displayed(result.at(cell)[path], unit, system)
    return f"{value:g} {label}".rstrip()


def sensitivity_bars(result: Uncertainty, ax: Sequence[Axes] | None = None) -> Figure:
    """First and total Sobol indices with their intervals, a panel a figure that they explain.

    Parameters
    ----------
    result : Uncertainty
        With indices.
    ax : sequence of Axes, optional
        Panels to draw on.

    Raises
    ------
    InputError
        The result has no indices.
    """
    found = result.sensitivity
    if found is None:
        raise InputError("the result has no Sobol indices: ask for uncertainty.sensitivity")
    shown = [one for one in found.indices if one.variance > 0.0]
    if not shown:
        raise InputError("nothing varies, so there are no Sobol indices")
    columns = min(len(shown), 2)
    rows = -(-len(shown) // columns)
    if ax is None:
        height = (0.24 * len(found.parameters) + 1.0) * rows + 0.8
        figure, panels = grid_or_new(None, rows, columns, 4.6 * columns + 1.6, height)
    else:
        figure, panels = grid_or_new(ax, 1, len(shown), 0.0, 0.0)
    for spare in panels[len(shown) :]:
        spare.remove()
    places = np.arange(len(found.parameters))
    for number, (panel, one) in enumerate(zip(panels, shown, strict=False)):
        for shift, key, colour in ((-0.19, "first", COLOURS[0]), (0.19, "total", COLOURS[1])):
            panel.barh(
                places + shift, getattr(one, key), 0.36, xerr=getattr(one, f"{key}_error"),
                color=colour, label=f"{key} index", error_kw={"linewidth": 1.0, "capsize": 2},
            )  # fmt: skip
        left = ax is not None or number % columns == 0
        names = [path.removeprefix("drillstring.sections.") for path in found.parameters]
        panel.set_yticks(places, names if left else [""] * len(places))
        panel.invert_yaxis()
        panel.set_xlim(-0.25, 1.1)  # what reaches further is error
        dress(panel, "Sobol index", "", _short(one.of))
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=2, fontsize=SMALL, frameon=False,
        title=f"{found.samples} points of Saltelli's design; bars: 95 % interval of the error",
        title_fontsize=SMALL,
    )  # fmt: skip
    return figure


def _short(of: str) -> str:
    """What is explained, by the usual names and without the units of gains."""
    for path, name in NAMES.items():
        of = of.replace(path, name)
    return of.replace(" N*m*s/rad", "").replace(" N*m/rad", "")
