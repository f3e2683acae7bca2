"""Tuned gains beside other gains and laws at the same fresh realizations.

How far tuned gains may drift: probability about the optimum, with the tolerance of each.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.arrays import Array
from drillctl.plots import rows, style

if TYPE_CHECKING:
    from drillctl.studies.tune.certificate import FreshRuns
    from drillctl.studies.tune.compute import Tune

SHOWN = ("q05", "q25", "q50", "q75", "q95")


@style.picture(ax="Two panels.")
def tune_baselines(result: Tune, ax: Sequence[Axes] | None = None) -> Figure:
    """Quantiles of J1 and the probability of the level, a row the tuned gains and each baseline.

    Baselines that do not apply are left out.
    """
    some: dict[str, FreshRuns] = {"tuned": result.certificate.runs}
    some |= {one.name: one.runs for one in result.baselines if one.runs is not None}
    height = 2.0 + rows.HEIGHT * len(some)
    figure, (left, right) = style.grid_or_new(ax, 1, 2, 9.5, height, share_y=True)
    for place, (name, runs) in enumerate(some.items()):
        colour = style.VERMILLION if name == "tuned" else style.BLUE
        quantiles = [runs.quantiles[key] for key in SHOWN]
        rows.row(left, right, place, quantiles, runs.probability, runs.interval, colour)
    level = result.certificate.runs.level
    rows.finish(left, right, list(some), level, result.certificate.required)
    style.dress(left, "J1 (s)", "", style.heading(result, "J1 of tuned gains and baselines"))
    style.dress(right, f"probability that J1 is at or under {level:g} s", "")
    right.tick_params(labelleft=False)
    text = (
        f"{len(result.certificate.runs.j1)} fresh realizations (seed "
        f"{result.certificate.seed}). Left: 5 to 95 % (line), 25 to 75 % (bar), median (dot); "
        "right: 95 % intervals. Dashed: level and required probability."
    )
    style.note(figure, style.caption(result, text))
    return figure


@style.picture(result="Over any number of parameters; the others stay at the optimum.")
def tune_neighbourhood(result: Tune, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """Probability of the level over the first two tuned parameters, or the only one.

    The contour is that of the required probability; bars are how far each parameter may drift
    alone, an arrow where the bound of the search ends it.
    """
    figure, ax = style.axes_or_new(ax, 8.0, 6.0)
    about = result.certificate.neighbourhood
    lines = [style.axis_label(axis, system) for axis in about.axes]
    title = style.heading(result, "Probability of the level about the tuned gains")
    name = f"probability that J1 is at or under {result.certificate.runs.level:g} s"
    if len(lines) == 1:
        (x, label), shares = lines[0], about.probability
        ax.plot(x, shares, "-", color=style.BLACK, linewidth=style.LINE)
        ax.axhline(result.certificate.required, color=style.BLACK, linewidth=0.9, linestyle="--")
        ax.set_ylim(-0.02, 1.02)
        style.dress(ax, label, name, title)
        _bars(result, ax, system, [result.certificate.runs.probability])
    else:
        (x, x_label), (y, y_label) = lines
        _map(result, figure, ax, x, y, name)
        style.dress(ax, x_label, y_label, title)
        ax.grid(visible=False)
        _bars(result, ax, system, [])
    style.legend_under(ax, 3)
    text = (
        f"{about.realizations} of {len(result.certificate.runs.j1)} fresh "
        f"realizations (seed {result.certificate.seed}) in the background, all of them for the "
        f"bars. Dashed: probability {result.certificate.required:g}."
    )
    style.note(figure, style.caption(result, text))
    return figure


def _map(result: Tune, figure: Figure, ax: Axes, x: Array, y: Array, name: str) -> None:
    shares = result.certificate.neighbourhood.probability
    mesh = style.cells(ax, x, y, shares, cmap="cividis", vmin=0.0, vmax=1.0)
    style.colour_bar(figure, mesh, ax, name)
    required = result.certificate.required
    if shares.min() < required <= shares.max():
        look: dict[str, Any] = {"colors": style.BLACK, "linewidths": style.LINE, "linestyles": "--"}
        ax.contour(x, y, shares.T, levels=[required], **look)


def _bars(result: Tune, ax: Axes, system: units.System, height: list[float]) -> None:
    """The optimum, and how far each shown parameter may drift alone."""
    tolerances = result.certificate.tolerances[: len(result.certificate.neighbourhood.axes)]
    centre = [float(units.displayed(one.value, one.unit, system)[0]) for one in tolerances]
    place = [*centre, *height]
    for k, one in enumerate(tolerances):
        ends = [float(units.displayed(end, one.unit, system)[0]) for end in (one.low, one.high)]
        line = [list(place), list(place)]
        line[0][k], line[1][k] = ends
        (x0, y0), (x1, y1) = line
        label = "each may drift alone" if k == 0 else None
        ax.plot([x0, x1], [y0, y1], "-", color=style.VERMILLION, linewidth=2.0, label=label)
        for (x, y), bound, arrow in zip(
            line, (one.low_at_bound, one.high_at_bound), ("<v"[k], ">^"[k]), strict=True
        ):
            marker = arrow if bound else "|_"[k]
            ax.plot(x, y, marker, color=style.VERMILLION, markersize=9.0, markeredgewidth=2.0)
    label = f"tuned, {result.certificate.runs.probability:.3f}"
    ax.plot(*place, "*", **style.STAR, label=label)
