"""What is measured of a run, in both engines by the same definitions."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, fields
from typing import Any, NamedTuple

WINDOW = 20.0  # length of the window at the end of a run in which sticking and SSI are judged (s)
SETTLED_FOR = 5.0
"""A run has settled when it stays in the band for at least this long at its end (s)."""
WIDE_BAND = 0.05  # settling bands as a share of the set speed: 5 % decides the status
AT_LIMIT = 0.99  # share of a limit from which on a drive counts as at it
NARROW_BAND = 0.02  # ... and 2 % gives `settling_time`.

STATUSES = ("ok", "sticking", "stalled", "not_settled", "censored", "failed")
"""What a run can end as.

`stalled`: the bit stood still throughout the last window; `sticking`: it stuck at some time
in the last window; `not_settled`: it turned, but had not stayed within 5 % of the set speed
for the last 5 s; `censored`: stopped early on request; `failed`: no finite answer.
"""


@dataclass(frozen=True)
class Event:
    """A change of phase."""

    time: float  # when (s)
    # the bit came to rest (`stick`), or broke loose (`release`); of axial motion, `EVENTS`
    kind: str
    direction: int  # +1 or -1 for a bit that breaks loose forward or backward; 0 for a stick


@dataclass(frozen=True)
class EnergyAudit:
    """Where the energy of a run went (J)."""

    # work of the drive, work taken by the bit, work taken by damping
    drive: float
    bit: float
    damping: float
    stored: float  # change of kinetic plus elastic energy
    hook: float = 0.0  # work of hook and weight of the string, of a rig with axial motion
    wall: float = 0.0  # work taken by the friction of the wall, but for that at the bit

    @property
    def residual(self) -> float:
        """What does not balance (J)."""
        return self.drive + self.hook - self.bit - self.damping - self.stored - self.wall

    @property
    def relative_residual(self) -> float:
        """The residual over the largest of the terms; 0 for a run without any work."""
        terms = (self.drive, self.hook, self.bit, self.damping, self.stored, self.wall)
        largest = max(map(abs, terms))
        return abs(self.residual) / largest if largest > 0.0 else 0.0

    def summary(self) -> dict[str, float]:
        """The terms (J) and the relative residual, by name."""
        names = ("drive", "bit", "damping", "stored", "hook", "wall", "relative_residual")
        return {name: getattr(self, name) for name in names}


def status_counts(status: Any) -> dict[str, int]:
    """How many runs ended in each way, those that occur; an array of indices into `STATUSES`."""
    counts = {name: int((status == code).sum()) for code, name in enumerate(STATUSES)}
    return {name: count for name, count in counts.items() if count}


class Measure(NamedTuple):
    """What is known of a measure beside its values."""

    name: str
    label: str  # as axes of pictures, heads of tables and legends call it
    unit: str  # SI; "1" for a number without
    meaning: str
    # by how much two engines may differ in it: a share of its value, or of what it counts for at
    # least, which may be the `duration` or the `set speed` of the run
    tolerance: float = 1e-2
    least: float | str = 1e-7


def _row(label: str, unit: str, meaning: str, *agreement: float | str) -> Any:
    return field(metadata={"measure": (label, unit, meaning, *agreement)})


@dataclass(frozen=True)
class Measures:
    """Measures of one run; SI units; None where a measure is undefined. Rows of `MEASURES`."""

    j1: float = _row("J1", "s", "integral of |bit speed - set speed| over the set speed")
    j1_rate: float = _row("J1 rate", "1", "J1 over the length of its window")
    stuck_time: float = _row(
        "stuck time", "s", "total time that the bit stands still", 1e-2, "duration"
    )
    sticks: int = _row(  # those shorter than a step of the batch engine escape it
        "sticks", "1", "times the bit comes to rest; a start at rest is one", 0.25, 16.0
    )
    stick_slip_index: float | None = _row(
        "stick-slip index", "1",
        "(max - min) / (2 mean) of the bit speed over the last 20 s; none if it never turned",
        5e-2, 1.0,
    )  # fmt: skip
    mean_bit_speed: float = _row("mean bit speed", "rad/s", "over the whole run", 1e-2, "set speed")
    min_bit_speed: float = _row(
        "lowest bit speed", "rad/s", "over the whole run", 2e-2, "set speed"
    )
    peak_bit_speed: float = _row("peak bit speed", "rad/s", "over the whole run", 2e-2, "set speed")
    peak_pipe_torque: float = _row(
        "peak pipe torque", "N*m", "largest magnitude in the uppermost element", 2e-2
    )
    peak_top_torque: float = _row("peak top torque", "N*m", "largest magnitude at the drive", 2e-2)
    settling_time: float | None = _row(
        "settling time", "s",
        "after which the bit stays within 2 % of the set speed; none if not for the last 5 s",
        1e-2, "duration",
    )  # fmt: skip
    settling_time_wide: float | None = _row(
        "settling time to 5 %", "s", "the same within 5 %", 1e-2, "duration"
    )
    mean_weight_on_bit: float = _row("mean WOB", "N", "time mean over the whole run")
    rop_proxy: float = _row(
        "ROP proxy", "1", "mean of weight x |bit speed| over nominal weight x set speed"
    )
    work_at_bit: float = _row("work at bit", "J", "work done on the rock")
    work_at_wall: float = _row(
        "work at wall", "J", "work taken by the friction of the wall, but for that at the bit",
        2e-2,
    )  # fmt: skip
    work_per_turn: float | None = _row(
        "work per turn", "J", "the same per revolution of the bit; none if it hardly turned"
    )
    time_outside_table: float = _row(
        "time outside table",
        "s",
        "with the weight on bit outside the friction table",
        1e-2,
        "duration",
    )

    time_at_torque_limit: float = _row(
        "time at torque limit", "s", "with at least 99 % of the drive's largest torque",
        1e-2, "duration",
    )  # fmt: skip
    time_at_power_limit: float = _row(
        "time at power limit", "s", "with at least 99 % of the drive's power", 1e-2, "duration"
    )
    time_over_continuous: float = _row(
        "time over continuous torque", "s", "above the torque that the drive bears for any time",
        1e-2, "duration",
    )  # fmt: skip
    peak_drive_power: float | None = _row(
        "peak drive power", "W", "largest power of the drive; none of an ideal one", 3e-2
    )

    rate_of_penetration: float | None = _row(
        "rate of penetration", "m/s", "mean over the run; none without axial motion", 1e-2
    )
    depth_of_cut: float | None = _row(
        "depth of cut", "m", "of all blades in a turn, time mean; none without axial motion", 1e-2
    )
    axial_stick_time: float | None = _row(
        "axial stick time", "s", "that the bit neither sinks nor rises on the rock",
        2e-2, "duration",
    )  # fmt: skip
    lost_contact_time: float | None = _row(
        "lost contact time", "s", "that the bit is off bottom", 2e-2, "duration"
    )
    specific_energy: float | None = _row(
        "mechanical specific energy", "Pa", "work of weight and torque per volume drilled", 2e-2
    )

    def as_dict(self) -> dict[str, Any]:
        """The measures by name; None for what is undefined or not finite."""
        return {
            key: None if isinstance(value, float) and not math.isfinite(value) else value
            for key, value in asdict(self).items()
        }


AXIAL_MEASURES = (
    "rate_of_penetration", "depth_of_cut", "axial_stick_time", "lost_contact_time",
    "specific_energy",
)  # fmt: skip
"""Measures of axial motion, which a bit that cuts its own wake alone has."""
BATCH_MEASURES = tuple(one.name for one in fields(Measures))
"""Names of what the batch engine returns of a lane, NaN where `Measures` has None."""
MEASURES = {
    name: Measure(name, *about)
    for name, about in (
        *((one.name, one.metadata["measure"]) for one in fields(Measures)),
        (
            "mean_weight_after_start",
            ("mean WOB after start", "N", "time mean without the first 20 s; of draws alone"),
        ),
    )
}
"""Every measure by its name."""


def with_axial(names: tuple[str, ...], axial: bool) -> tuple[str, ...]:
    """Names of measures, followed by those of axial motion where rigs have it."""
    return (*names, *AXIAL_MEASURES) if axial else names


def units_of(*names: str) -> dict[str, str]:
    """SI units of some measures, by name."""
    return {name: MEASURES[name].unit for name in names}


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
