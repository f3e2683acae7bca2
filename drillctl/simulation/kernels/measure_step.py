"""Measures of a block of lanes, updated after each step."""

from __future__ import annotations

from typing import Any

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined, widest_vectors
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.measures import NARROW_BAND, WIDE_BAND


@inlined
def begin_measures(work: Any) -> None:
    """Set the measures of a run that has not begun."""
    widest_vectors()
    for lane in range(WIDTH):
        for measure in range(r.MEASURES):
            work[r.FIRST_MEASURE + measure * WIDTH + lane] = 0.0
        speed = work[r.BIT_SPEED + lane]
        work[r.LOW + lane] = speed
        work[r.HIGH + lane] = speed
        work[r.LATE_LOW + lane] = 1e300
        work[r.LATE_HIGH + lane] = -1e300
        work[r.STICKS + lane] = 1.0 if work[r.DIRECTION + lane] == 0.0 else 0.0


@inlined
def measure(work: Any, begin: float, step: float, in_j1: float, in_window: float) -> int:
    """Add one step to the measures; returns how many lanes cross the set speed or a band.

    `in_j1` and `in_window` are the shares of the step that lie in the J1 window and in the
    window at the end of the run.
    """
    widest_vectors()
    crossings = 0
    end = begin + step
    for lane in range(WIDTH):
        before, speed = work[r.SPEED_BEFORE + lane], work[r.BIT_SPEED + lane]
        set_speed, load = work[r.SET_SPEED + lane], work[r.LOAD + lane]
        load_before = work[r.LOAD_BEFORE + lane]
        error_before, error = before - set_speed, speed - set_speed
        size_before, size = abs(error_before), abs(error)
        work[r.J1 + lane] += in_j1 * step * 0.5 * (size_before + size)
        narrow, wide = NARROW_BAND * set_speed, WIDE_BAND * set_speed
        work[r.OUTSIDE_NARROW + lane] = end if size > narrow else work[r.OUTSIDE_NARROW + lane]
        work[r.OUTSIDE_WIDE + lane] = end if size > wide else work[r.OUTSIDE_WIDE + lane]
        crosses = error_before * error < 0.0
        enters_narrow = size_before > narrow and size <= narrow
        enters_wide = size_before > wide and size <= wide
        crossings += 1 if crosses or enters_narrow or enters_wide else 0

        angle = 0.5 * step * (before + speed)
        work[r.BIT_ANGLE + lane] += angle
        work[r.LATE_ANGLE + lane] += in_window * angle
        work[r.WORK + lane] += work[r.BIT_TORQUE + lane] * angle
        outside = load < work[r.TABLE_LOW + lane] or load > work[r.TABLE_HIGH + lane]
        work[r.OUTSIDE_TABLE + lane] += step if outside else 0.0
        work[r.WEIGHT_SUM + lane] += 0.5 * step * (load_before + load)
        drilled = load_before * abs(before) + load * abs(speed)
        work[r.ROP_SUM + lane] += 0.5 * step * drilled

        stuck = step * work[r.STUCK_SHARE + lane]
        work[r.STUCK_TIME + lane] += stuck
        work[r.LATE_STUCK + lane] += in_window * stuck

        work[r.LOW + lane] = min(work[r.LOW + lane], speed)
        work[r.HIGH + lane] = max(work[r.HIGH + lane], speed)
        top_torque = work[r.TOP_TORQUE + lane] + work[r.DRAG + lane]
        work[r.PEAK_TOP + lane] = max(work[r.PEAK_TOP + lane], abs(top_torque))
    return crossings


@inlined
def measure_crossings(work: Any, begin: float, step: float, in_j1: float) -> None:
    """Mend J1 where the deviation changes sign, and date the last departure from each band."""
    widest_vectors()
    for lane in range(WIDTH):
        set_speed = work[r.SET_SPEED + lane]
        error_before = work[r.SPEED_BEFORE + lane] - set_speed
        error = work[r.BIT_SPEED + lane] - set_speed
        size_before, size = abs(error_before), abs(error)
        # Two triangles instead of the trapezoid.
        excess = step * size_before * size / (size_before + size)
        work[r.J1 + lane] -= in_j1 * excess if error_before * error < 0.0 else 0.0
        narrow, wide = NARROW_BAND * set_speed, WIDE_BAND * set_speed
        since = step / (size_before - size)
        last = work[r.OUTSIDE_NARROW + lane]
        entered = begin + since * (size_before - narrow)
        work[r.OUTSIDE_NARROW + lane] = entered if size_before > narrow >= size else last
        last = work[r.OUTSIDE_WIDE + lane]
        entered = begin + since * (size_before - wide)
        work[r.OUTSIDE_WIDE + lane] = entered if size_before > wide >= size else last


@inlined
def measure_window(work: Any, in_window: float) -> None:
    """Extremes of the bit speed in the window at the end of the run.

    A step that lies in it as a whole brings its beginning too: the window's first moment.
    """
    widest_vectors()
    for lane in range(WIDTH):
        speed = work[r.BIT_SPEED + lane]
        before = work[r.SPEED_BEFORE + lane] if in_window >= 1.0 else speed
        work[r.LATE_LOW + lane] = min(work[r.LATE_LOW + lane], min(before, speed))
        work[r.LATE_HIGH + lane] = max(work[r.LATE_HIGH + lane], max(before, speed))


@inlined
def measure_pipe(work: Any) -> None:
    """Largest pipe torque so far; the pass over the string has just read it."""
    widest_vectors()
    for lane in range(WIDTH):
        torque = abs(work[r.PIPE + lane] + work[r.PIPE_OFFSET + lane])
        work[r.PEAK_PIPE + lane] = max(work[r.PEAK_PIPE + lane], torque)
