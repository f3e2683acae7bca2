"""Gains of a drive over the depth of the well, in tune and kept from an earlier depth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.arrays import Array
from drillctl.design.paths import SI_OF, USUAL_NAMES
from drillctl.plots import style

if TYPE_CHECKING:
    from drillctl.studies.schedule.compute import Schedule


@style.picture(ax="Six panels.")
def schedule(
    result: Schedule, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Two gains, reflection, probability and window over the depth, with where gains change."""
    figure, panels = style.grid_or_new(ax, 2, 3, 11.5, 6.4, share_x=True)
    rows = result.rows
    x, unit = units.displayed(np.array([one.depth for one in rows]), result.unit, system)
    share = result.design.tables.schedule.kept_from
    for panel, path in zip(panels[:2], rows[0].gains, strict=False):
        key = path.removeprefix("controller.")
        si = SI_OF.get(key, "")
        values = [
            units.displayed(np.array([of[path] for of in each]), si, system)[0]
            for each in ([one.gains for one in rows], [one.stale_gains for one in rows])
        ]
        _pair(panel, x, values, share)
        name, spoken = units.unit_name(si, system), USUAL_NAMES.get(path, key)
        style.dress(panel, "", f"{spoken} ({name})" if name else spoken)
        panel.set_ylim(bottom=0.0)
    seen, chance, speed, weight = panels[2:]

    def both(key: str) -> list[Array]:
        return [np.array([getattr(one, f"{of}{key}") for one in rows]) for of in ("", "stale_")]

    _pair(seen, x, both("reflection"), share)
    seen.set_ylim(0.0, 1.02)
    low, high = np.array([one.interval for one in rows]).T
    chance.fill_between(x, low, high, color=style.BLUE, alpha=0.2, linewidth=0.0)
    _pair(chance, x, both("probability"), share)
    chance.set_ylim(-0.03, 1.03)
    required = result.design.tables.tune.probability
    chance.axhline(required, color=style.BLACK, linewidth=1.0, linestyle="--")
    point = result.design.tables.operating_point
    ends = (
        (speed, [one.lowest_speed for one in rows], "rad/s", point.speed),
        (weight, [one.highest_weight for one in rows], "N", point.weight_on_bit),
    )
    for panel, values_, si, own in ends:
        shown = units.displayed(np.array(values_, dtype=float), si, system)[0]
        panel.plot(x, shown, "o-", color=style.BLUE, linewidth=style.LINE, markersize=4)
        here, name = units.displayed(own, si, system)
        panel.axhline(here, color=style.BLACK, linewidth=1.0, linestyle=":")
        panel.set_ylim(bottom=0.0)
        of = "no sticking from" if panel is speed else "no sticking up to"
        style.dress(panel, "", f"{of} ({name})")
    style.dress(seen, "", "reflection at the stick-slip period")
    style.dress(chance, "", f"P(J1 ≤ {result.design.tables.tune.level:g} s)")
    for panel in panels:
        for one in result.changes:
            place = units.displayed(one.depth, result.unit, system)[0]
            panel.axvline(place, color=style.ORANGE, linewidth=0.9)
    for panel in panels[3:]:
        panel.set_xlabel(f"{result.path} ({unit})" if unit else result.path, fontsize=style.LABEL)
    style.title(panels[0], style.heading(result, f"Gains over depth: {result.law}"))
    style.legend(panels[0])
    text = (
        f"{rows[0].draws} fresh draws a depth. Vertical lines: where gains must be changed, going "
        "deeper. Dashed: required probability; dotted: as designed."
    )
    style.note(figure, style.caption(result, text))
    return figure


def _pair(ax: Axes, x: Array, values: list[Array], share: float) -> None:
    own, stale = values
    ax.plot(x, own, "o-", color=style.BLUE, linewidth=style.LINE, markersize=4, label="in tune")
    ax.plot(x, stale, "s--", color=style.VERMILLION, linewidth=style.LINE, markersize=4,
            label=f"of {share:g} of the depth")  # fmt: skip
