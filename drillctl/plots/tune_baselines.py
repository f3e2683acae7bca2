"""Tuned gains beside other gains and laws at the same fresh realizations."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl.plots.plane import origin_of, title_of
from drillctl.plots.style import BLACK, BLUE, SMALL, VERMILLION, dress, grid_or_new

if TYPE_CHECKING:
    from drillctl.studies.robust import Tune
    from drillctl.studies.robust.fresh import FreshRuns

ROW = 0.42
"""Height of a row (inches)."""
WIDEST = 120
"""Longest line of a caption (characters)."""


def tune_baselines(result: Tune, ax: Sequence[Axes] | None = None) -> Figure:
    """Quantiles of J1 and the probability of the level, a row the tuned gains and each baseline.

    Parameters
    ----------
    result : Tune
        Any.
    ax : sequence of Axes, optional
        Two panels to draw on.

    Returns
    -------
    Figure
        Baselines that do not apply are left out.
    """
    rows: dict[str, FreshRuns] = {"tuned": result.certificate.runs}
    rows |= {one.name: one.runs for one in result.baselines if one.runs is not None}
    figure, (left, right) = grid_or_new(ax, 1, 2, 9.5, 2.0 + ROW * len(rows), share_y=True)
    for place, (name, runs) in enumerate(rows.items()):
        colour = VERMILLION if name == "tuned" else BLUE
        _spread(left, place, runs, colour)
        low, high = runs.interval
        right.plot([low, high], [place, place], "-", color=colour, linewidth=2.2)
        right.plot(runs.probability, place, "o", color=colour, markersize=5.5)
    level, required = result.certificate.runs.level, result.certificate.required
    left.axvline(level, color=BLACK, linewidth=1.0, linestyle="--")
    right.axvline(required, color=BLACK, linewidth=1.0, linestyle="--")
    left.set_yticks(range(len(rows)), list(rows))
    left.set_ylim(len(rows) - 0.5, -0.5)
    left.set_xlim(left=0.0)
    right.set_xlim(-0.03, 1.03)
    dress(left, "J1 (s)", "", title_of(result))
    dress(right, f"probability that J1 is at or under {level:g} s", "")
    right.tick_params(labelleft=False)
    text = (
        f"{origin_of(result)}{len(result.certificate.runs.j1)} fresh realizations (seed "
        f"{result.certificate.seed}). Left: 5 to 95 % (line), 25 to 75 % (bar), median (dot); "
        "right: 95 % intervals. Dashed: level and required probability."
    )
    figure.supxlabel("\n".join(textwrap.wrap(text, WIDEST)), fontsize=SMALL)
    return figure


def _spread(ax: Axes, place: int, runs: FreshRuns, colour: str) -> None:
    """Quantiles of J1 on a row, those that are finite."""
    found = {name: value for name, value in runs.quantiles.items() if np.isfinite(value)}
    for low, high, width in (("q05", "q95", 1.6), ("q25", "q75", 7.0)):
        if low in found and high in found:
            ax.plot(
                [found[low], found[high]], [place, place], "-", color=colour, linewidth=width,
                solid_capstyle="butt", alpha=0.55 if width > 2.0 else 1.0,
            )  # fmt: skip
    if "q50" in found:
        ax.plot(found["q50"], place, "o", color=colour, markeredgecolor="white", markersize=6.5)
