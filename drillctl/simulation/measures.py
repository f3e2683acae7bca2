"""What is measured of a run, in both engines by the same definitions."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

WINDOW = 20.0
"""Length of the window at the end of a run in which sticking and SSI are judged (s)."""
SETTLED_FOR = 5.0
"""A run has settled when it stays in the band for at least this long at its end (s)."""
WIDE_BAND = 0.05
"""Settling bands as a share of the set speed: 5 % decides the status ..."""
NARROW_BAND = 0.02
"""... and 2 % gives `settling_time`."""

STATUSES = ("ok", "sticking", "stalled", "not_settled", "censored", "failed")
"""What a run can end as.

`stalled`: the bit stood still throughout the last window; `sticking`: it stuck at some time
in the last window; `not_settled`: it turned, but had not stayed within 5 % of the set speed
for the last 5 s; `censored`: stopped early on request; `failed`: no finite answer.
"""


@dataclass(frozen=True)
class Measures:
    """Measures of one run; SI units; None where a measure is undefined."""

    j1: float  # integral of abs(bit speed - set speed) / set speed over the J1 window (s)
    j1_rate: float  # `j1` over the length of its window
    stuck_time: float  # total time at rest (s)
    sticks: int  # number of times the bit came to rest; a start at rest counts as one
    # (max - min) / (2 mean) of the bit speed over the last 20 s; None if it never turned
    stick_slip_index: float | None
    # over the whole run (rad/s)
    mean_bit_speed: float
    min_bit_speed: float
    peak_bit_speed: float
    # largest magnitude in the uppermost element and at the drive (N m)
    peak_pipe_torque: float
    peak_top_torque: float
    # time after which the bit speed stays within 2 % and 5 % of the set speed to the end of the
    # run (s); None if that is not so for the last 5 s
    settling_time: float | None
    settling_time_wide: float | None
    mean_weight_on_bit: float  # time mean (N)
    rop_proxy: float  # time mean of weight x abs(bit speed), over nominal weight x set speed
    work_at_bit: float  # work done on the rock (J)
    # the same over the turns of the bit (J per revolution); None if it hardly turned
    work_per_turn: float | None
    time_outside_table: float  # time with the weight on bit outside the friction table (s)

    def as_dict(self) -> dict[str, Any]:
        """The measures by name; None for what is undefined or not finite."""
        return {
            key: None if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in asdict(self).items()
        }


def status_of(
    finite: bool, stuck_in_window: float, window: float, settling_time_wide: float | None
) -> str:
    """Judge a run."""
    if not finite:
        return "failed"
    if stuck_in_window >= window * (1.0 - 1e-9):
        return "stalled"
    if stuck_in_window > 0.0:
        return "sticking"
    return "ok" if settling_time_wide is not None else "not_settled"


def settled(last_outside: float, duration: float) -> float | None:
    """Settling time (s) given when the band was last left (s); None if too near the end."""
    return last_outside if last_outside <= duration - min(SETTLED_FOR, duration) else None


def ssi(low: float, high: float, mean: float) -> float | None:
    """Stick-slip index (max - min) / (2 mean) of a window; None for a bit that stood still."""
    return (high - low) / (2.0 * mean) if high > 0.0 and mean > 0.0 else None


def per_turn(work: float, mean_speed: float, duration: float) -> float | None:
    """Work (J) over revolutions; None under a thousandth of a turn."""
    turns = abs(mean_speed) * duration / (2.0 * math.pi)
    return work / turns if turns > 1e-3 else None
