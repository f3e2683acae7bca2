"""Measures of a block of lanes, updated after each step."""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import any_of, fma, least, most
from drillctl.simulation.kernels.vectors import at, each, pick, put, when
from drillctl.simulation.kernels.weight_step import stays
from drillctl.simulation.measures import NARROW_BAND, WIDE_BAND


class Before(NamedTuple):
    """What moved as a step began."""

    # rad/s, the top speed in the frame
    bit_speed: Any
    top_speed: Any
    load: Any  # weight on the bit (N)


def begin_measures(work: Any, top_torque: Any) -> None:
    """Set the measures of a run that has not begun, where they do not begin at zero."""
    put(work, r.PEAK_TOP, abs(each(top_torque)))
    speed = at(work, r.BIT_SPEED)
    put(work, r.LOW, speed)
    put(work, r.HIGH, speed)
    put(work, r.LATE_LOW, 1e300)
    put(work, r.LATE_HIGH, -1e300)
    put(work, r.STICKS, pick(at(work, r.DIRECTION) == 0.0, 1.0, 0.0))


def _add(work: Any, place: int, factor: Any, value: Any) -> None:
    put(work, place, fma(factor, value, at(work, place)))


def measure(
    work: Any, before: Any, outcome: Any, begin: Any, step: Any, in_j1: Any, in_window: Any
) -> None:
    """Add one step to the measures.

    `in_j1` and `in_window` are the shares of the step that lie in the J1 window and in the
    window at the end of the run.
    """
    set_speed, speed = at(work, r.SET_SPEED), outcome.speed
    error_before, error = before.bit_speed - set_speed, speed - set_speed
    size_before, size = abs(error_before), abs(error)
    _add(work, r.J1, 0.5 * step * in_j1, size_before + size)
    _measure_bands(work, set_speed, size_before, size, begin, step)
    crosses = error_before * error < 0.0
    with when(any_of(crosses)):
        # Two triangles instead of the trapezoid, where the deviation changes sign.
        excess = step * in_j1 * size_before * size / (size_before + size)
        put(work, r.J1, at(work, r.J1) - pick(crosses, excess, 0.0))

    turned = before.bit_speed + speed
    _add(work, r.BIT_ANGLE, 0.5 * step, turned)
    _add(work, r.WORK, outcome.torque, 0.5 * step * turned)
    _add(work, r.STUCK_TIME, step, outcome.stuck)
    put(work, r.LOW, least(at(work, r.LOW), speed))
    put(work, r.HIGH, most(at(work, r.HIGH), speed))
    top_torque = at(work, r.TOP_TORQUE) + at(work, r.DRAG)
    put(work, r.PEAK_TOP, most(at(work, r.PEAK_TOP), abs(top_torque)))
    with when(in_window > 0.0):
        _measure_window(work, before.bit_speed, outcome, step, in_window)


def _measure_bands(
    work: Any, set_speed: Any, size_before: Any, size: Any, begin: Any, step: Any
) -> None:
    """Date the entry into each band; the last one counts."""
    narrow, wide = NARROW_BAND * set_speed, WIDE_BAND * set_speed
    enters_narrow = (size_before > narrow) & (size <= narrow)
    enters_wide = (size_before > wide) & (size <= wide)
    with when(any_of(enters_narrow | enters_wide)):
        since = step / (size_before - size)
        entered = begin + since * (size_before - narrow)
        put(work, r.OUTSIDE_NARROW, pick(enters_narrow, entered, at(work, r.OUTSIDE_NARROW)))
        entered = begin + since * (size_before - wide)
        put(work, r.OUTSIDE_WIDE, pick(enters_wide, entered, at(work, r.OUTSIDE_WIDE)))


def conclude_bands(work: Any, duration: Any) -> None:
    """A run that ends outside a band has been outside to the end."""
    set_speed = at(work, r.SET_SPEED)
    size = abs(at(work, r.BIT_SPEED) - set_speed)
    last = at(work, r.OUTSIDE_NARROW)
    put(work, r.OUTSIDE_NARROW, pick(size > NARROW_BAND * set_speed, duration, last))
    last = at(work, r.OUTSIDE_WIDE)
    put(work, r.OUTSIDE_WIDE, pick(size > WIDE_BAND * set_speed, duration, last))


def _measure_window(work: Any, speed_before: Any, outcome: Any, step: Any, in_window: Any) -> None:
    """The window at the end of the run.

    A step that lies in it as a whole brings its beginning too: the window's first moment.
    """
    speed = outcome.speed
    _add(work, r.LATE_ANGLE, 0.5 * step * in_window, speed_before + speed)
    _add(work, r.LATE_STUCK, step * in_window, outcome.stuck)
    low, high = least(at(work, r.LATE_LOW), speed), most(at(work, r.LATE_HIGH), speed)
    put(work, r.LATE_LOW, low)
    put(work, r.LATE_HIGH, high)
    with when(in_window >= 1.0):
        put(work, r.LATE_LOW, least(low, speed_before))
        put(work, r.LATE_HIGH, most(high, speed_before))


def measure_load(
    weight: Any, program: Any, work: Any, before: Any, outcome: Any, step: Any
) -> None:
    """Add the weight on bit of a step, and what it drills, to the measures."""
    # A weight that stays needs no sums: only what is drilled under it follows the speed.
    if stays(weight, program):
        return _add(work, r.ROP_SUM, 0.5 * step, abs(before.bit_speed) + abs(outcome.speed))
    return _measure_moving_load(work, before, outcome, step)


def _measure_moving_load(work: Any, before: Any, outcome: Any, step: Any) -> None:
    load = at(work, r.LOAD)
    outside = (load < at(work, r.TABLE_LOW)) | (load > at(work, r.TABLE_HIGH))
    put(work, r.OUTSIDE_TABLE, at(work, r.OUTSIDE_TABLE) + pick(outside, step, 0.0))
    _add(work, r.WEIGHT_SUM, 0.5 * step, before.load + load)
    drilled = before.load * abs(before.bit_speed) + load * abs(outcome.speed)
    _add(work, r.ROP_SUM, 0.5 * step, drilled)


def conclude_load(weight: Any, program: Any, work: Any, duration: Any) -> None:
    """What a weight that stays adds up to at the end of a run."""
    if stays(weight, program):
        return _conclude_steady_load(work, duration)
    return None


def _conclude_steady_load(work: Any, duration: Any) -> None:
    load = at(work, r.LOAD)
    outside = (load < at(work, r.TABLE_LOW)) | (load > at(work, r.TABLE_HIGH))
    put(work, r.OUTSIDE_TABLE, pick(outside, duration, 0.0))
    put(work, r.WEIGHT_SUM, duration * load)
    put(work, r.ROP_SUM, load * at(work, r.ROP_SUM))


def measure_pipe(work: Any, pipe: Any) -> None:
    """Largest pipe torque so far; the pass over the string has just read it."""
    torque = abs(pipe + at(work, r.PIPE_OFFSET))
    put(work, r.PEAK_PIPE, most(at(work, r.PEAK_PIPE), torque))
