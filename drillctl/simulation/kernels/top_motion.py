"""Top speed at the ends of steps, for the drives and observers that ask for it."""

from __future__ import annotations

from typing import Any

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import at, put
from drillctl.simulation.kernels.compiling import by_type, inlined
from drillctl.simulation.kernels.drive_numbers import RealStep, SampledStep
from drillctl.simulation.kernels.observer_step import ObserverStep


def asks_for_top(drive: Any, observer: Any) -> bool:
    """Whether drive or observer, as numba knows them, need the top speed."""
    return (
        drive.instance_class in (RealStep, SampledStep) or observer.instance_class is ObserverStep
    )


def move_top(drive: Any, observer: Any, string: Any, swing: Any, work: Any) -> None:
    """Top speed at the end of the step, where something asks for it."""
    raise NotImplementedError("compiled only")


@by_type(move_top)
def _move_top(drive, observer, string, swing, work):
    if not asks_for_top(drive, observer):
        return lambda drive, observer, string, swing, work: None
    return lambda drive, observer, string, swing, work: _move(string, swing, work)


@inlined
def _move(string: Any, swing: Any, work: Any) -> None:
    top, bit = at(work, r.TOP_TORQUE), at(work, r.BIT_TORQUE)
    speed = swing.top_speed + string.top_speed_by_top * top - string.top_speed_by_bit * bit
    put(work, r.TOP_SPEED, speed)
