"""Single runs and limit cycles as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl import units
from drillctl.cli.console import line, table
from drillctl.printing.words import title_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from drillctl.simulation.limit_cycle import LimitCycle


def cycle(result: LimitCycle, system: units.System) -> None:
    """What each method says of the limit cycle, side by side."""
    orbit, predicted, run = result.orbit, result.predicted, result.simulated.summary()

    def speed(value: float | None) -> str:
        return "-" if value is None else f"{units.displayed(value, 'rad/s', system)[0]:.2f}"

    def spread(values: list[float] | None, shown: Callable[[float], str]) -> str:
        return "-" if values is None else " to ".join(dict.fromkeys(map(shown, values)))

    rows = [
        [
            "period (s)",
            "-" if predicted is None else f"{predicted.period:.3f}",
            "-" if orbit is None else f"{orbit.period:.6f}",
            spread(run["period_spread"], lambda x: f"{x:.4f}"),
        ],
        [
            "peak bit speed (rpm)",
            speed(None if predicted is None else predicted.peak_speed),
            speed(None if orbit is None else orbit.peak_bit_speed),
            spread(run["peak_spread"], speed),
        ],
        [
            "stuck in a period (s)",
            "-",
            "-" if orbit is None else f"{orbit.stuck_time:.4f}",
            spread(run["stuck_time_spread"], lambda x: f"{x:.4f}"),
        ],
        [
            "largest multiplier",
            "-",
            "-" if orbit is None else f"{abs(orbit.multipliers[0]):.4f}",
            "-",
        ],
    ]
    heads = ["figure", "one harmonic", "exact (shooting)", "last ten returns of a long run"]
    table(f"{title_of(result)}: {result.status}", heads, rows)
    for unstable in (x for x in result.harmonic if not x.stable):
        line(
            f"unstable cycle by one harmonic: {unstable.period:.3f} s, "
            f"{speed(unstable.least_speed)} to {speed(unstable.peak_speed)} rpm"
        )
    line(f"status: {result.status} (wound up, {result.simulated.duration:.0f} s)")
