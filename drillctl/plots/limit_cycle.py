"""One cycle of the bit speed: exact, simulated, and as one harmonic tells it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl import units
from drillctl.plots.style import BLACK, BLUE, SMALL, VERMILLION, axes_or_new, dress

if TYPE_CHECKING:
    from drillctl.simulation.limit_cycle import LimitCycle


def limit_cycle(result: LimitCycle, ax: Axes | None = None) -> Figure:
    """Bit speed over one cycle, from the moment it rises through its mean.

    Parameters
    ----------
    result : LimitCycle
        Orbit, harmonic prediction and simulation; what there is none of is left out.
    ax : Axes, optional
        Axes to draw on.

    Returns
    -------
    Figure
        Speeds in rpm. The orbit grey below the last simulated cycle, which hides it where they
        agree; an orbit's harmonic prediction is drawn over the same time.
    """
    figure, axes = axes_or_new(ax, 7.0, 4.2)
    run, orbit, cycle = result.simulated, result.orbit, result.predicted
    time = run.time if orbit is None else orbit.time
    if orbit is not None:
        axes.plot(
            time, orbit.bit_speed / units.RPM, color="#BBBBBB", linewidth=5.0,
            label=f"exact orbit, {orbit.period:.2f} s",
        )  # fmt: skip
    axes.plot(
        run.time, run.bit_speed / units.RPM, color=BLUE, linewidth=1.3,
        label=f"last simulated, {run.time[-1]:.2f} s",
    )  # fmt: skip
    if cycle is not None:
        axes.plot(
            time, cycle.bit_speed(time) / units.RPM, color=VERMILLION, linewidth=1.3,
            linestyle="--", label=f"one harmonic, {cycle.period:.2f} s",
        )  # fmt: skip
    axes.axhline(run.mean_speed / units.RPM, color=BLACK, linewidth=0.7, linestyle=":")
    axes.set_xlim(0.0, max(float(time[-1]), float(run.time[-1])))
    dress(axes, "time from the rise through the mean (s)", "bit speed (rpm)", _title(result))
    axes.legend(fontsize=SMALL, frameon=False)
    return figure


def _title(result: LimitCycle) -> str:
    name, run = result.design.name, result.simulated
    if result.orbit is not None:
        return f"{name}: periodic, largest multiplier {abs(result.orbit.multipliers[0]):.3f}"
    if result.status != "not periodic" or len(run.peaks) == 0:
        return f"{name}: {result.status}"
    low, high = (peak / units.RPM for peak in (run.last_peaks.min(), run.last_peaks.max()))
    return f"{name}: not periodic, last peaks {low:.1f} to {high:.1f} rpm"
