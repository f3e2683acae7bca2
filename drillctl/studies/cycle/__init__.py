"""The stick-slip cycle: by one harmonic, exact by shooting, and by a long run."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from drillctl import plots, units
from drillctl.store.tables import Column, Table, number, quantity
from drillctl.studies.base import Picture, Study

if TYPE_CHECKING:
    from drillctl.simulation.limit_cycle import LimitCycle


def tables(result: LimitCycle) -> Iterator[Table]:
    """Period, peak speed and stuck time of the cycle by each method."""
    orbit, predicted, run = result.orbit, result.predicted, result.simulated.summary()
    columns = (
        Column("method"),
        Column("period", unit="s", digits=6),
        Column("peak_bit_speed", "peak bit speed", "rad/s"),
        Column("stuck_time", "stuck in a period", "s"),
        Column("largest_multiplier", "largest multiplier"),
    )
    rows: list[list[Any]] = [
        ["one harmonic", predicted and predicted.period, predicted and predicted.peak_speed,
         None, None],
        ["exact (shooting)", orbit and orbit.period, orbit and orbit.peak_bit_speed,
         orbit and orbit.stuck_time, orbit and float(abs(orbit.multipliers[0]))],
    ]  # fmt: skip
    spreads = [run[f"{name}_spread"] for name in ("period", "peak", "stuck_time")]
    for place, which in enumerate(("least", "largest")):
        ends = [None if spread is None else spread[place] for spread in spreads]
        rows.append([f"last ten returns of a long run, {which}", *ends, None])
    yield Table("cycle", f"stick-slip cycle, {result.status}", columns, rows)


def pictures(result: LimitCycle) -> Iterator[Picture]:
    """One period by each method."""
    yield Picture(
        "limit-cycle", "Bit speed over one cycle: exact, simulated, and as one harmonic.",
        f"Bit speed over one cycle by three methods; the motion is {result.status}.",
        lambda system: plots.limit_cycle(result),
    )  # fmt: skip


def remarks(result: LimitCycle, system: units.System) -> Iterator[str]:
    """Unstable cycles, and the run that decides the status."""
    for one in (x for x in result.harmonic if not x.stable):
        yield (
            f"Unstable cycle by one harmonic: {number(one.period)} s, "
            f"{quantity(one.least_speed, 'rad/s', system)} to "
            f"{quantity(one.peak_speed, 'rad/s', system)}."
        )
    if result.status == "repeating":
        yield "The exact cycle is not followed: drive or weight on bit has a memory."
    yield (
        f"Status: {result.status}, of a run of {result.simulated.duration:.0f} s from a string "
        "wound up."
    )


STUDY = Study(
    module=__name__,
    name="cycle",
    help="Find the limit cycle of stick-slip, stable or not",
    group="Simulate",
    python="limit_cycle",
    call="drillctl.simulation.limit_cycle:limit_cycle",
)
