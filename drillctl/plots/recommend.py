"""Settings of a drive side by side: J1, probability, where they work, loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.arrays import runs
from drillctl.plots import rows, style

if TYPE_CHECKING:
    from drillctl.studies.recommend.compute import Recommendation
    from drillctl.studies.recommend.window import Line

SHOWN = (0.05, 0.25, 0.5, 0.75, 0.95)


@style.picture(ax="Five panels.")
def recommended(
    result: Recommendation, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """J1, probability, speeds and weights without sticking, slope margin; a row a setting."""
    some = result.candidates
    height = 2.2 + rows.HEIGHT * len(some)
    figure, panels = style.grid_or_new(ax, 1, 5, 11.0, height, share_y=True)
    spread, chance, speed, weight, margin = panels
    for place, one in enumerate(some):
        colour = style.VERMILLION if one is result.recommended else style.BLUE
        values = one.j1[np.isfinite(one.j1)]
        quantiles = np.quantile(values, SHOWN) if len(values) else np.full(len(SHOWN), np.nan)
        rows.row(spread, chance, place, quantiles.tolist(), one.probability, one.interval, colour)
        _free(speed, place, one.window.speed, colour, system)
        _free(weight, place, one.window.weight, colour, system)
        if one.loop.slope > 0.0 and np.isfinite(one.loop.slope_margin):
            margin.plot(one.loop.slope_margin / one.loop.slope, place, "o", color=colour)
    table, asked = result.design.tables.tune, result.design.tables.recommend
    rows.finish(spread, chance, [one.name for one in some], table.level, table.probability)
    rows.limit(margin, asked.slope_reserve)
    for panel, line in ((speed, some[0].window.speed), (weight, some[0].window.weight)):
        own = units.displayed(line.own, line.unit, system)[0]
        panel.axvline(own, color=style.BLACK, linewidth=1.0, linestyle=":")
        panel.set_xlim(left=0.0)
    chance.set_xticks([0.0, 0.5, 1.0])  # ends beside those of the other panels
    margin.set_xlim(left=0.0)
    names = (
        "J1 (s)", f"P(J1 ≤ {table.level:g} s)",
        f"speed ({units.unit_name('rad/s', system)})", f"WOB ({units.unit_name('N', system)})",
        "slope margin over slope",
    )  # fmt: skip
    for panel, name in zip(panels, names, strict=True):
        style.dress(panel, name, "")
        panel.tick_params(labelleft=panel is spread)
    # Over the whole picture: a long title of the first panel alone would push the others aside.
    style.headline(figure, style.heading(result, "What to set"))
    text = (
        f"{len(result.present.j1)} fresh draws (seed {result.seed}): 5 to 95 % (line), 25 to 75 % "
        "(bar), median (dot) of J1; 95 % interval of the probability. Bars: speeds and weights "
        "without sticking in the last 20 s at nominal rock. Dashed: limits; dotted: as designed. "
        f"{_chosen(result)}."
    )
    style.note(figure, style.caption(result, text))
    return figure


def _chosen(result: Recommendation) -> str:
    name = result.recommended.name
    return {
        "passes": f"{name} (red) is recommended: it passes",
        "fragile": f"{name} (red) is recommended: it passes, but is fragile",
        "none": f"No setting passes; {name} (red) is the least bad",
    }[result.verdict]


def _free(ax: Axes, place: int, line: Line, colour: str, system: units.System) -> None:
    """Every stretch of values without sticking, on a row."""
    shown = np.asarray(units.displayed(line.values, line.unit, system)[0])
    for begin, end in runs(line.free):
        ax.plot([shown[begin], shown[end - 1]], [place, place], "-", color=colour,
                linewidth=6.0, solid_capstyle="butt")  # fmt: skip
