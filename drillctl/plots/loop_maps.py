"""Figures of the loop over two parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import parameter
from drillctl.errors import InputError, nearest
from drillctl.linear.boundary import GainBoundary
from drillctl.plots import style
from drillctl.plots.loop_gains import DIAMOND, GAINS, shown_gains
from drillctl.plots.style import colours

if TYPE_CHECKING:
    from drillctl.studies.loop_mapping.compute import LoopMap


EMPTY = "#D9D9D9"
"""Cells without a value."""
NAMES = {
    "slope_margin": "slope margin D*",
    "deciding_frequency": "deciding frequency",
    "slope": "falling slope D",
    "spectral_abscissa": "largest real part",
    "low_damping": "damping ratio of the low modes",
    "peak_sensitivity": "largest |S|",
    "growth": "growth of the rightmost root",
    "unstable_roots": "roots in the right half-plane",
}
"""What the colour bar says; the unit comes from `displayed`."""


@dataclass(frozen=True)
class _Look:
    """Colours of a quantity, their limits, and levels drawn as lines."""

    norm: Normalize
    colours: Colormap | str
    levels: tuple[float, ...]


@style.picture(
    result="Over two parameters.",
    quantity="One of `QUANTITIES` or `CUTTING` of `drillctl.studies.loop_mapping.compute`.",
    boundary="Outline of the stable gains, drawn over a map of both gains.",
    raises="Not two parameters, a quantity that was not mapped, or a boundary of other parameters.",
)
def loop_map(
    result: LoopMap,
    quantity: str = "slope_margin",
    ax: Axes | None = None,
    boundary: GainBoundary | None = None,
    system: units.System = "si",
) -> Figure:
    """Draw one figure of the loop over two parameters.

    The heavy line is the boundary of local stability, where the rock's slope equals the margin.
    Colours stop at limits that leave the stable cells legible; cells without a value are grey.
    """
    if quantity not in result.values:
        raise InputError(f"no {quantity!r} in this map; {nearest(quantity, result.values)}")
    paths = tuple(axis.path for axis in result.axes)
    if boundary is not None and set(paths) != set(GAINS):
        raise InputError(f"a boundary of gains does not fit {' and '.join(paths)}", "boundary")
    shown = NAMES.get(quantity, quantity)
    figure, ax, x, y = style.plane(result, ax, 6.2, system, f"{shown[0].upper()}{shown[1:]}")
    _colour(figure, ax, result, quantity, x, y, system)
    _stability(ax, result, x, y)
    if boundary is not None:
        _outline(ax, boundary, paths, system)
    _marks(ax, result, quantity, system)
    style.within_cells(ax, x, y)
    if ax.get_legend_handles_labels()[0]:
        style.legend_under(ax, 2)
    style.note(figure, _caption(result, quantity))
    return figure


def _look(quantity: str, values: Array) -> _Look:
    """Limits that show what matters of each quantity, whatever a few cells do."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    plain = colours(0.2, 1.0)
    if quantity == "deciding_frequency" and low > 0.0:
        return _Look(LogNorm(low, max(high, 1.01 * low)), plain, ())
    if quantity in ("spectral_abscissa", "growth"):
        # Undamped high modes sit at almost zero: what decays is all but white.
        reach = float(np.quantile(np.abs(finite), 0.95)) if finite.size else 1.0
        return _Look(Normalize(-reach or -1.0, reach or 1.0), "RdBu_r", ())
    if quantity == "low_damping":
        reach = min(1.0, max(1.25 * high, 0.05))
        levels = tuple(v for v in (0.02, 0.05, 0.1, 0.2, 0.5) if v < high)
        return _Look(Normalize(-reach, reach), "RdBu", levels)
    if quantity == "peak_sensitivity":
        top = max(10.0, 3.0 * low)
        levels = tuple(v for v in (1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 20.0) if low < v < top)
        return _Look(LogNorm(1.0, top), colours(0.3, 1.0).reversed(), levels)
    if not _varies(finite):
        return _Look(Normalize(0.9 * low - 0.1, 1.1 * high + 0.1), plain, ())
    rounded = MaxNLocator(7).tick_values(low, high)
    levels = tuple(float(v) for v in rounded if low < v < high)
    return _Look(Normalize(low, high), plain, levels)


def _colour(
    figure: Figure, ax: Axes, result: LoopMap, quantity: str, x: Array, y: Array,
    system: units.System,
) -> None:  # fmt: skip
    values, unit = units.displayed(result.values[quantity], result.unit(quantity), system)
    look = _look(quantity, values)
    ax.set_facecolor(EMPTY)
    known = np.ma.masked_invalid(values)
    mesh = style.cells(ax, x, y, known, cmap=look.colours, norm=look.norm)
    name = NAMES.get(quantity, quantity)
    label = name if unit in ("", "1") else f"{name} ({unit})"
    style.colour_bar(figure, mesh, ax, label, style.beyond(values, look.norm))
    if look.levels and min(values.shape) > 1:
        lines = ax.contour(x, y, values.T, levels=look.levels, colors="#333333", linewidths=0.8)
        ax.clabel(lines, fmt=lambda level: f"{level:g}", fontsize=8.0, inline_spacing=2)


def _stability(ax: Axes, result: LoopMap, x: Array, y: Array) -> None:
    """The line at which the slope of the rock equals the margin, or a root the imaginary axis."""
    cuts = "growth" in result.values
    reserve = (
        -result.values["growth"] if cuts
        else result.values["slope_margin"] - result.values["slope"]
    )  # fmt: skip
    finite = reserve[np.isfinite(reserve)]
    if not (finite.size and finite.min() < 0.0 < finite.max() and min(reserve.shape) > 1):
        return
    ax.contour(x, y, reserve.T, levels=[0.0], colors=style.BLACK, linewidths=2.6)
    ax.plot([], [], color=style.BLACK, linewidth=2.6,
            label="stability boundary" if cuts else "stability boundary, D* = D")  # fmt: skip


def _outline(
    ax: Axes, boundary: GainBoundary, paths: tuple[str, ...], system: units.System
) -> None:
    for number, ring in enumerate(boundary.rings):
        kp, ki = shown_gains(ring[:, 0], ring[:, 1], system)
        x, y = (kp, ki) if paths == GAINS else (ki, kp)
        label = "stable gains, closed form" if number == 0 else "_"
        ax.plot(x, y, color=style.VERMILLION, linewidth=1.4, linestyle="--", label=label)


def _marks(ax: Axes, result: LoopMap, quantity: str, system: units.System) -> None:
    if quantity == "slope_margin" and result.best is not None and _varies(result.values[quantity]):
        margin, at = result.best
        value, unit = units.displayed(margin, "N*m*s/rad", system)
        place = _placed(result, [at[axis.path] for axis in result.axes], system)
        ax.plot(*place, "*", **style.STAR, zorder=6, label=f"largest D*: {value:.4g} {unit}")
    # A parameter that the design leaves open is nowhere in the map.
    own = [parameter(result.design, axis.path).value for axis in result.axes]
    if all(
        value is not None and axis.values.min() <= value <= axis.values.max()
        for axis, value in zip(result.axes, own, strict=True)
    ):
        ax.plot(*_placed(result, own, system), "D", **DIAMOND, label="the design")


def _placed(result: LoopMap, values: list[Any], system: units.System) -> list[float]:
    """Values of the two parameters (SI) in the units of the axes."""
    return [
        float(units.displayed(value, axis.unit, system)[0])
        for axis, value in zip(result.axes, values, strict=True)
    ]


def _varies(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size > 0 and float(np.ptp(finite)) > 1e-9 * float(np.abs(finite).max())


def _caption(result: LoopMap, quantity: str) -> str:
    values = result.values[quantity]
    notes = [f"{int(result.stable.sum())} of {result.stable.size} cells stable"]
    empty, at_rest = np.isnan(values), np.isnan(result.values.get("slope", values))
    unstable = "unstable" if quantity == "peak_sensitivity" else "unstable without any slope too"
    why = [unstable] * bool((empty & ~at_rest).any()) + ["no steady drilling"] * bool(at_rest.any())
    if empty.any():
        notes.append(f"grey: {', or '.join(why)}")
    if quantity == "spectral_abscissa" and np.isfinite(values).any():
        least, most = float(np.nanmin(values)), float(np.nanmax(np.abs(values)))
        if -1e-3 * most < least < 0.0:
            notes.append(f"none under {least:.1e}/s: some mode hardly decays")
    return style.caption(result, "; ".join(notes), width=120)
