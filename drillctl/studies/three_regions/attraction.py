"""Which lanes end in steady drilling: long runs from a bit at rest and from a wound-up string."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drillctl.simulation.batch import Prepared, prepare, run_batch, trace
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.measures import NARROW_BAND, STATUSES, WINDOW
from drillctl.simulation.start import Kind
from drillctl.studies.grid import Group
from drillctl.studies.three_regions.steady import gains_of

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

HORIZON = 200.0
"""Length of the runs (s): on the paper's map sticking that will end has ended by 80 s."""
STARTS: tuple[Kind, ...] = ("rest", "wound_up")
"""Starts that a cell must leave for steady drilling: both are far from it."""
TRACED_LANES = 128
"""Lanes traced together: some 70 MB at 20 ms."""


@dataclass(frozen=True, eq=False)
class Ended:
    """How runs from one start ended."""

    # shape (lanes,): Bit speed within the band of the operating speed throughout the last window
    attracted: Mask
    sticking: Mask  # shape (lanes,): The bit stood still at some time in that window
    failed: Mask  # shape (lanes,): No finite answer; neither of the others holds then


def long_runs(group: Group) -> Prepared:
    """The string of a group, prepared for runs over `HORIZON`."""
    table = group.design.tables.simulation
    return prepare(group.lanes, table.model_copy(update={"duration": HORIZON, "j1_from": 0.0}))


def ends_from(kind: Kind, lanes: Lanes, operating_speed: Array, prepared: Prepared) -> Ended:
    """Run every lane from a start and see where it ends.

    A drive without any speed control has no set speed, only a frame: there the operating speed
    takes its place, also as the speed of the top of a wound-up string. Proportional control
    alone has a set speed that it never holds, and it cannot be moved: those lanes are traced.
    """
    kp, ki = gains_of(lanes)
    steady = np.isfinite(operating_speed)
    framed = steady & (kp == 0.0) & (ki == 0.0)
    lanes = replace(lanes, start=kind, set_speed=np.where(framed, operating_speed, lanes.set_speed))
    batch = run_batch(lanes, prepared)
    # NaN is more than any time: not settled.
    attracted = batch.measures["settling_time"] <= HORIZON - WINDOW
    traced = np.flatnonzero(steady & (kp != 0.0) & (ki == 0.0))
    for first in range(0, len(traced), TRACED_LANES):
        some = traced[first : first + TRACED_LANES]
        attracted[some] = _stays(lanes[some], operating_speed[some], prepared)
    failed = batch.status == STATUSES.index("failed")
    stuck = [STATUSES.index("sticking"), STATUSES.index("stalled")]
    return Ended(attracted & steady & ~failed, np.isin(batch.status, stuck), failed)


def _stays(lanes: Lanes, speed: Array, prepared: Prepared) -> Mask:
    """Whether the bit speed stays in the band around `speed` (rad/s) to the end, lane by lane."""
    time, signals = trace(lanes, prepared, prepared.scheme.step)
    late = signals["bit_speed"][time >= HORIZON - WINDOW]
    return np.asarray((np.abs(late - speed) <= NARROW_BAND * speed).all(axis=0))
