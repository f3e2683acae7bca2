"""Figures of the loop over two parameters, and the boundary of the stable gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import FormatStrFormatter, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import parameter
from drillctl.errors import InputError, nearest
from drillctl.linear.boundary import GainBoundary
from drillctl.plots import style
from drillctl.plots.frequency import listed
from drillctl.plots.map import axis_label

if TYPE_CHECKING:
    from drillctl.studies.loop_maps import LoopMap

Array = NDArray[np.float64]

GAINS = ("controller.kp", "controller.ki")
EMPTY = "#D9D9D9"
"""Cells without a value."""
STABLE = "#D5E8DF"
"""Stable gains."""
NAMES = {
    "slope_margin": "slope margin D*",
    "deciding_frequency": "deciding frequency",
    "slope": "falling slope D",
    "spectral_abscissa": "largest real part",
    "low_damping": "damping ratio of the low modes",
    "peak_sensitivity": "largest |S|",
}
"""What the colour bar says; the unit comes from `displayed`."""
REASONS = {
    "peak_sensitivity": "grey: loop not stable, or no steady drilling",
}


@dataclass(frozen=True)
class _Look:
    """Colours of a quantity, their limits, and levels drawn as lines."""

    norm: Normalize
    colours: Colormap
    levels: tuple[float, ...]


def loop_map(
    result: LoopMap,
    quantity: str = "slope_margin",
    ax: Axes | None = None,
    boundary: GainBoundary | None = None,
    system: units.System = "si",
) -> Figure:
    """Draw one figure of the loop over two parameters.

    Parameters
    ----------
    result : LoopMap
        Over two parameters.
    quantity : str
        What of it: one of `drillctl.studies.loop_maps.QUANTITIES` that was mapped.
    ax : Axes, optional
        Axes to draw on.
    boundary : GainBoundary, optional
        Outline of the stable gains, drawn over a map of both gains.
    system : {'si', 'field'}
        Units of the axes.

    Returns
    -------
    Figure
        The heavy line is the boundary of local stability, where the rock's slope equals the
        margin. Colours stop at limits that leave the stable cells legible; cells without a
        value are grey.

    Raises
    ------
    InputError
        Another number of parameters than two, a quantity that was not mapped, or a boundary
        over parameters that are not the gains.
    """
    if len(result.axes) != 2:
        raise InputError(f"a map shows 2 parameters, the result has {len(result.axes)}")
    if quantity not in result.values:
        raise InputError(f"no {quantity!r} in this map; {nearest(quantity, result.values)}")
    paths = tuple(axis.path for axis in result.axes)
    if boundary is not None and set(paths) != set(GAINS):
        raise InputError(f"a boundary of gains does not fit {' and '.join(paths)}", "boundary")
    figure, ax = style.axes_or_new(ax, 8.0, 6.2)
    (x, x_label), (y, y_label) = (axis_label(axis, system) for axis in result.axes)
    _colour(figure, ax, result, quantity, x, y, system)
    _stability(ax, result, x, y)
    if boundary is not None:
        _outline(ax, boundary, paths, system)
    _marks(ax, result, quantity, system)
    style.dress(ax, x_label, y_label, result.design.tables.title or result.design.name)
    ax.grid(visible=False)
    ax.set_xlim(_edges(x))
    ax.set_ylim(_edges(y))
    if ax.get_legend_handles_labels()[0]:
        ax.legend(
            loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, fontsize=style.SMALL,
            frameon=False,
        )  # fmt: skip
    figure.supxlabel(_caption(result, quantity), fontsize=style.SMALL)
    return figure


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
        named_values(path, _GAIN_UNITS[path], np.array(span), system)
        for path, span in zip(GAINS, first.window, strict=True)
    ]
    _fill(ax, first, system)
    _coloured(figure, ax, first, system)
    for number, other in enumerate(boundaries[1:]):
        _dashed(ax, other, number, system)
    own = first.design.top_drive.gains()
    kp, ki = _gains(own[0], own[1], system)
    if kp > 0.0 or ki > 0.0:
        ax.plot(kp, ki, "D", **_DIAMOND, label="gains of the design")
    style.dress(ax, sides[0][1], sides[1][1], first.design.tables.title or first.design.name)
    ax.set_xlim(*sides[0][0])
    ax.set_ylim(*sides[1][0])
    ax.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, fontsize=style.SMALL,
        frameon=False,
    )  # fmt: skip
    figure.supxlabel(f"falling slope of the rock {first.slope:.4g} N m s", fontsize=style.SMALL)
    return figure


_GAIN_UNITS = {"controller.kp": "N*m*s/rad", "controller.ki": "N*m/rad"}
_DIAMOND: dict[str, Any] = {
    "color": "white", "markeredgecolor": style.BLACK, "markersize": 8, "markeredgewidth": 1.4,
    "linestyle": "none", "zorder": 6,
}  # fmt: skip


def colours(low: float, high: float) -> Colormap:
    """A part of viridis: 0.2 to 1 under black lines, 0 to 0.88 for lines on white."""
    from matplotlib import colormaps

    return ListedColormap(colormaps["viridis"](np.linspace(low, high, 256)))


def named_values(
    path: str, unit: str, values: Array, system: units.System
) -> tuple[np.ndarray, str]:
    """Values of a parameter in the units people read, and the label of their axis."""
    from drillctl.studies.grid import Axis

    return axis_label(Axis(path, unit, values), system)


def _diverging() -> Colormap:
    from matplotlib import colormaps

    return colormaps["RdBu_r"]


def _look(quantity: str, values: Array) -> _Look:
    """Limits that show what matters of each quantity, whatever a few cells do."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    plain = colours(0.2, 1.0)
    if quantity == "deciding_frequency" and low > 0.0:
        return _Look(LogNorm(low, max(high, 1.01 * low)), plain, ())
    if quantity == "spectral_abscissa":
        # Undamped high modes sit at almost zero: what decays is all but white.
        reach = float(np.quantile(np.abs(finite), 0.95)) if finite.size else 1.0
        return _Look(Normalize(-reach or -1.0, reach or 1.0), _diverging(), ())
    if quantity == "low_damping":
        reach = min(1.0, max(1.25 * high, 0.05))
        levels = tuple(v for v in (0.02, 0.05, 0.1, 0.2, 0.5) if v < high)
        return _Look(Normalize(-reach, reach), _diverging().reversed(), levels)
    if quantity == "peak_sensitivity":
        top = max(10.0, 3.0 * low)
        levels = tuple(v for v in (1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 20.0) if low < v < top)
        return _Look(LogNorm(1.0, top), colours(0.3, 1.0).reversed(), levels)
    if not _varies(finite):
        return _Look(Normalize(0.9 * low - 0.1, 1.1 * high + 0.1), plain, ())
    return _Look(Normalize(low, high), plain, _round_levels(low, high))


def _extend(values: Array, norm: Normalize) -> Literal["neither", "both", "min", "max"]:
    """On which side values go beyond the limits of the colours."""
    finite = values[np.isfinite(values)]
    low, high = norm.vmin, norm.vmax
    below = low is not None and bool((finite < low).any())
    above = high is not None and bool((finite > high).any())
    if below and above:
        return "both"
    return "min" if below else "max" if above else "neither"


def _plain_ticks(bar: Colorbar) -> None:
    bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    bar.ax.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    bar.ax.yaxis.set_minor_formatter(NullFormatter())


def _round_levels(low: float, high: float) -> tuple[float, ...]:
    ticks = MaxNLocator(7).tick_values(low, high)
    return tuple(float(v) for v in ticks if low < v < high)


def _colour(
    figure: Figure, ax: Axes, result: LoopMap, quantity: str, x: Array, y: Array,
    system: units.System,
) -> None:  # fmt: skip
    from drillctl.studies.loop_maps import QUANTITIES

    values, unit = units.displayed(result.values[quantity], QUANTITIES[quantity][0], system)
    look = _look(quantity, values)
    ax.set_facecolor(EMPTY)
    mesh = ax.pcolormesh(
        x, y, np.ma.masked_invalid(values.T), cmap=look.colours, norm=look.norm,
        shading="nearest", rasterized=True,
    )  # fmt: skip
    bar = figure.colorbar(mesh, ax=ax, extend=_extend(values, look.norm), pad=0.02)
    if isinstance(look.norm, LogNorm):
        _plain_ticks(bar)
    name = NAMES.get(quantity, quantity)
    bar.set_label(name if unit in ("", "1") else f"{name} ({unit})", fontsize=style.LABEL)
    bar.ax.tick_params(labelsize=style.SMALL)
    if look.levels and min(values.shape) > 1:
        lines = ax.contour(x, y, values.T, levels=look.levels, colors="#333333", linewidths=0.8)
        ax.clabel(lines, fmt=lambda level: f"{level:g}", fontsize=8.0, inline_spacing=2)


def _stability(ax: Axes, result: LoopMap, x: Array, y: Array) -> None:
    """The line at which the slope of the rock equals the margin."""
    reserve = result.values["slope_margin"] - result.values["slope"]
    finite = reserve[np.isfinite(reserve)]
    if not (finite.size and finite.min() < 0.0 < finite.max() and min(reserve.shape) > 1):
        return
    ax.contour(x, y, reserve.T, levels=[0.0], colors=style.BLACK, linewidths=2.6)
    ax.plot([], [], color=style.BLACK, linewidth=2.6, label="stability boundary, D* = D")


def _outline(
    ax: Axes, boundary: GainBoundary, paths: tuple[str, ...], system: units.System
) -> None:
    for number, ring in enumerate(_rings(boundary)):
        kp, ki = _gains(ring[:, 0], ring[:, 1], system)
        x, y = (kp, ki) if paths == GAINS else (ki, kp)
        label = "stable gains, closed form" if number == 0 else "_"
        ax.plot(x, y, color=style.VERMILLION, linewidth=1.4, linestyle="--", label=label)


def _marks(ax: Axes, result: LoopMap, quantity: str, system: units.System) -> None:
    if quantity == "slope_margin" and result.best is not None and _varies(result.values[quantity]):
        margin, at = result.best
        x, y = (_shown(at[axis.path], axis.unit, system) for axis in result.axes)
        ax.plot(
            x, y, "*", color=style.VERMILLION, markeredgecolor="white", markersize=15,
            linestyle="none", zorder=6, label=f"largest D*: {_text(margin, system)}",
        )  # fmt: skip
    own = [_own(result, axis.path) for axis in result.axes]
    inside = all(
        axis.values.min() <= value <= axis.values.max()
        for axis, value in zip(result.axes, own, strict=True)
    )
    if inside:
        x, y = (
            _shown(value, axis.unit, system) for axis, value in zip(result.axes, own, strict=True)
        )
        ax.plot(x, y, "D", **_DIAMOND, label="the design")


def _own(result: LoopMap, path: str) -> float:
    """Value of a parameter of the design (SI); NaN for one that it leaves open."""
    value = parameter(result.design, path).value
    return np.nan if value is None else float(value)


def _varies(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size > 0 and float(np.ptp(finite)) > 1e-9 * float(np.abs(finite).max())


def _text(margin: float, system: units.System) -> str:
    value, unit = units.displayed(margin, "N*m*s/rad", system)
    return f"{value:.4g} {unit}"


def _shown(value: float, unit: str, system: units.System) -> float:
    return float(units.displayed(value, unit, system)[0])


def _gains(kp: Any, ki: Any, system: units.System) -> tuple[Any, Any]:
    """Gains in the units of the axes."""
    return (
        units.displayed(kp, _GAIN_UNITS["controller.kp"], system)[0],
        units.displayed(ki, _GAIN_UNITS["controller.ki"], system)[0],
    )


def _edges(values: Array) -> tuple[float, float]:
    """From half a cell before the first value to half a cell after the last."""
    if len(values) == 1:
        return float(values[0] - 0.5), float(values[0] + 0.5)
    return (
        float(values[0] - 0.5 * (values[1] - values[0])),
        float(values[-1] + 0.5 * (values[-1] - values[-2])),
    )


def _caption(result: LoopMap, quantity: str) -> str:
    found = result.values[quantity]
    status = result.design.tables.status
    notes = ["string reconstructed"] if status == "reconstructed" else []
    notes.append(f"{int(result.stable.sum())} of {result.stable.size} cells stable")
    if np.isnan(found).any():
        notes.append(REASONS.get(quantity, "grey: no steady drilling"))
    if quantity == "spectral_abscissa" and np.isfinite(found).any():
        least, most = float(np.nanmin(found)), float(np.nanmax(np.abs(found)))
        if -1e-3 * most < least < 0.0:
            notes.append(f"none under {least:.1e}/s: some mode hardly decays")
    return "; ".join(notes)


def _rings(boundary: GainBoundary) -> list[Array]:
    """Outer and inner rings of the region, Kp and Ki by rows."""
    return [
        np.asarray(ring.coords)
        for part in boundary.region.geoms
        for ring in (part.exterior, *part.interiors)
    ]


def _fill(ax: Axes, boundary: GainBoundary, system: units.System) -> None:
    rings = _rings(boundary)
    if not rings:
        ax.fill([], [], facecolor=STABLE, label="no stable gains within the picture")
        return
    paths = [Path(np.column_stack(_gains(r[:, 0], r[:, 1], system)), closed=True) for r in rings]
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
        points = np.column_stack(_gains(branch.kp, branch.ki, system))
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
    bar = figure.colorbar(lines, ax=ax, extend=_extend(frequency, norm), pad=0.02)
    _plain_ticks(bar)
    bar.set_label("frequency of the poles on the axis (Hz)", fontsize=style.LABEL)
    bar.ax.tick_params(labelsize=style.SMALL)


def _dashed(ax: Axes, boundary: GainBoundary, number: int, system: units.System) -> None:
    dashes = style.DASHES[1 + number % (len(style.DASHES) - 1)]
    name = "continuum" if boundary.model == "wave" else boundary.model.replace("-", " ")
    for place, branch in enumerate(boundary.branches):
        ax.plot(
            *_gains(branch.kp, branch.ki, system), color=style.BLACK, linewidth=0.9,
            linestyle=dashes, zorder=4, label=name if place == 0 else "_",
        )  # fmt: skip
