"""Top speed at the ends of steps, for the drives and observers that ask for it."""

from __future__ import annotations

from typing import Any

from numba.extending import overload

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined
from drillctl.simulation.kernels.drive_numbers import RealStep, SampledStep
from drillctl.simulation.kernels.observer_step import ObserverStep


def asks_for_top(drive: Any, observer: Any) -> bool:
    """Whether drive or observer, as numba knows them, need the top speed."""
    return (
        drive.instance_class in (RealStep, SampledStep) or observer.instance_class is ObserverStep
    )


def move_top(drive: Any, observer: Any, string: Any, work: Any, lane: int) -> None:
    """Top speed of a lane at the end of the step, where something asks for it."""
    raise NotImplementedError("compiled only")


@overload(move_top)
def _move_top(drive, observer, string, work, lane):
    if not asks_for_top(drive, observer):
        return lambda drive, observer, string, work, lane: None
    return lambda drive, observer, string, work, lane: _move(string, work, lane)


@inlined
def _move(string: Any, work: Any, lane: int) -> None:
    work[r.TOP_SPEED_BEFORE + lane] = work[r.TOP_SPEED + lane]
    work[r.TOP_SPEED + lane] = (
        work[r.TOP_SPEED_FREE + lane]
        + string.top_speed_by_top * work[r.TOP_TORQUE + lane]
        - string.top_speed_by_bit * work[r.BIT_TORQUE + lane]
    )
