"""Measures of a block of lanes.

A step only notes what is to be measured of it (`note`). Every `CHUNK` steps their measures are
added up, in rows of one register each: all sums and extremes stay in registers meanwhile.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import any_of, fma, least, most
from drillctl.simulation.kernels.rows import REGISTER, WIDTH
from drillctl.simulation.kernels.vectors import (
    Variable,
    as_integer,
    at,
    each,
    loop,
    pick,
    put,
    rows_of,
    when,
)
from drillctl.simulation.kernels.weight_step import stays
from drillctl.simulation.measures import NARROW_BAND, WIDE_BAND

PART = min(WIDTH, REGISTER)
"""Lanes whose measures are added up at a time: those of one register."""


class Before(NamedTuple):
    """What moved as a step began."""

    # rad/s, the top speed in the frame
    bit_speed: Any
    top_speed: Any
    load: Any  # weight on the bit (N)


def begin_measures(work: Any, top_torque: Any) -> None:
    """Set the measures of a run that has not begun, where they do not begin at zero."""
    net_torque = each(top_torque) - at(work, r.DRAG)
    put(work, r.TOP_LOW, net_torque)
    put(work, r.TOP_HIGH, net_torque)
    put(work, r.PIPE_LOW, 1e300)
    put(work, r.PIPE_HIGH, -1e300)
    speed = at(work, r.BIT_SPEED)
    put(work, r.SPEED_LAST, speed)
    put(work, r.LOW, speed)
    put(work, r.HIGH, speed)
    put(work, r.LATE_LOW, 1e300)
    put(work, r.LATE_HIGH, -1e300)
    put(work, r.STICKS, pick(at(work, r.DIRECTION) == 0.0, 1.0, 0.0))


def _add(work: Any, place: Any, factor: Any, value: Any) -> None:
    put(work, place, fma(factor, value, at(work, place)))


def note(work: Any, slot: Any, outcome: Any, pipe: Any) -> None:
    """Keep what is measured of a step."""
    place = slot * WIDTH
    put(work, r.SPEEDS + place, outcome.speed)
    put(work, r.BIT_TORQUES + place, outcome.torque)
    put(work, r.TOP_TORQUES + place, at(work, r.TOP_TORQUE))
    put(work, r.PIPE_TORQUES + place, pipe)
    put(work, r.STUCK + place, outcome.stuck)


class Window:
    """A part of a run that begins at a moment (s) and lasts to its end; steps of one length (s)."""

    def __init__(self, step: Any, moment: Any) -> None:
        # The step in which it begins, and the share of that step which lies in it.
        self.first = as_integer(moment / step)
        self.partly = least(most((self.first * step + step - moment) / step, 0.0), 1.0)

    def share(self, n: Any) -> Any:
        """Share of step `n` that lies in it."""
        return pick(n > self.first, 1.0, pick(n == self.first, self.partly, 0.0))


def measure(work: Any, step: Any, of_j1: Window, late: Window, first: Any, count: Any) -> None:
    """Add `count` noted steps, of which step `first` is the first one, to the measures."""
    with loop(count) as steps:
        # Seconds of each that count for J1, over two.
        work[r.WEIGHTS + steps.index] = 0.5 * step * of_j1.share(first + steps.index)
    with rows_of(PART), loop(WIDTH // PART) as parts:
        begin = parts.index * PART
        part = work[begin:]
        _measure_part(part, step, work, first, count)
        with when(first + count > late.first):
            _measure_window(part, step, late, first, count)
        last = at(part, r.SPEEDS + (count - 1) * WIDTH)
        put(part, r.SPEED_LAST, last)


def _measure_part(work: Any, step: Any, block: Any, first: Any, count: Any) -> None:
    half = 0.5 * step
    set_speed = at(work, r.SET_SPEED)
    summed = (
        r.J1, r.BIT_ANGLE, r.WORK, r.STUCK_TIME, r.TOP_LOW, r.TOP_HIGH, r.PIPE_LOW, r.PIPE_HIGH,
    )  # fmt: skip
    j1, angle, done, stuck, top_low, top_high, pipe_low, pipe_high = rows = [
        Variable(at(work, place)) for place in summed
    ]
    before = Variable(at(work, r.SPEED_LAST))
    error_before = Variable(before.get() - set_speed)
    low, high, largest = Variable(before.get()), Variable(at(work, r.HIGH)), Variable(each(0.0))
    with loop(count) as steps:
        place = steps.index * WIDTH
        speed = at(work, r.SPEEDS + place)
        weight = block[r.WEIGHTS + steps.index]
        error, was = speed - set_speed, error_before.get()
        last, size = abs(was), abs(error)
        total = last + size
        j1.set(fma(weight, total, j1.get()))
        crosses = was * error < 0.0
        with when(any_of(crosses)):
            # Two triangles instead of the trapezoid, where the deviation changes sign.
            excess = pick(crosses, (last * size) / total, 0.0)
            j1.set(fma(2.0 * weight, -excess, j1.get()))
        largest.set(most(largest.get(), last))
        turned = half * (before.get() + speed)
        angle.set(angle.get() + turned)
        done.set(fma(at(work, r.BIT_TORQUES + place), turned, done.get()))
        stuck.set(stuck.get() + at(work, r.STUCK + place))
        low.set(least(low.get(), speed))
        high.set(most(high.get(), speed))
        top, pipe = at(work, r.TOP_TORQUES + place), at(work, r.PIPE_TORQUES + place)
        top_low.set(least(top, top_low.get()))
        top_high.set(most(top, top_high.get()))
        pipe_low.set(least(pipe, pipe_low.get()))
        pipe_high.set(most(pipe, pipe_high.get()))
        before.set(speed)
        error_before.set(error)
    for row, value in zip(summed, rows, strict=True):
        put(work, row, value.get())
    put(work, r.HIGH, high.get())
    put(work, r.LOW, least(low.get(), at(work, r.LOW)))
    with when(any_of(low.get() < 0.0)):
        _measure_backwards(work, half, count)
    _measure_bands(work, step, first, count, largest.get(), abs(error_before.get()))


def _measure_bands(work: Any, step: Any, first: Any, count: Any, largest: Any, end: Any) -> None:
    """Date the entry into each band; the last one counts.

    Only bits that end these steps inside a band and were outside before have to be dated: the entry
    of others is not their last one.
    """
    set_speed = at(work, r.SET_SPEED)
    for row, share in ((r.OUTSIDE_NARROW, NARROW_BAND), (r.OUTSIDE_WIDE, WIDE_BAND)):
        band = share * set_speed
        with when(any_of((largest > band) & (end <= band))):
            last = Variable(abs(at(work, r.SPEED_LAST) - set_speed))
            with loop(count) as steps:
                before, n = last.get(), steps.index
                size = abs(at(work, r.SPEEDS + n * WIDTH) - set_speed)
                entered = (first + n) * step + step / (before - size) * (before - band)
                enters = (before > band) & (size <= band)
                put(work, row, pick(enters, entered, at(work, row)))
                last.set(size)


def _measure_backwards(work: Any, half: Any, count: Any) -> None:
    """What a bit that turns backwards drills beyond what it turns."""
    before = Variable(at(work, r.SPEED_LAST))
    with loop(count) as steps:
        last, speed = before.get(), at(work, r.SPEEDS + steps.index * WIDTH)
        _add(work, r.BACKWARDS, half, (abs(last) - last) + (abs(speed) - speed))
        before.set(speed)


def _measure_window(work: Any, step: Any, late: Window, first: Any, count: Any) -> None:
    """The window at the end of the run.

    A step that lies in it as a whole brings its beginning too: the window's first moment.
    """
    before = Variable(at(work, r.SPEED_LAST))
    summed = (r.LATE_ANGLE, r.LATE_STUCK, r.LATE_LOW, r.LATE_HIGH)
    angle, stuck, low, high = rows = [Variable(at(work, place)) for place in summed]
    with loop(count) as steps:
        place = steps.index * WIDTH
        share = late.share(first + steps.index)
        speed = at(work, r.SPEEDS + place)
        with when(share > 0.0):
            angle.set(fma(0.5 * step * share, before.get() + speed, angle.get()))
            stuck.set(fma(step * share, at(work, r.STUCK + place), stuck.get()))
            low.set(least(low.get(), speed))
            high.set(most(high.get(), speed))
            with when(share >= 1.0):
                low.set(least(low.get(), before.get()))
                high.set(most(high.get(), before.get()))
        before.set(speed)
    for row, value in zip(summed, rows, strict=True):
        put(work, row, value.get())


def conclude(work: Any, step: Any) -> None:
    """Measures of a run from its sums and extremes, and from the pipe torque at its very end."""
    pipe = at(work, r.PIPE)
    put(work, r.STUCK_TIME, step * at(work, r.STUCK_TIME))
    drag, offset = at(work, r.DRAG), at(work, r.PIPE_OFFSET)
    low, high = least(pipe, at(work, r.PIPE_LOW)), most(pipe, at(work, r.PIPE_HIGH))
    put(work, r.PEAK_PIPE, most(abs(low + offset), abs(high + offset)))
    low, high = at(work, r.TOP_LOW) + drag, at(work, r.TOP_HIGH) + drag
    put(work, r.PEAK_TOP, most(abs(low), abs(high)))


def conclude_bands(work: Any, duration: Any) -> None:
    """A run that ends outside a band has been outside to the end."""
    set_speed = at(work, r.SET_SPEED)
    size = abs(at(work, r.BIT_SPEED) - set_speed)
    last = at(work, r.OUTSIDE_NARROW)
    put(work, r.OUTSIDE_NARROW, pick(size > NARROW_BAND * set_speed, duration, last))
    last = at(work, r.OUTSIDE_WIDE)
    put(work, r.OUTSIDE_WIDE, pick(size > WIDE_BAND * set_speed, duration, last))


def measure_load(
    weight: Any, program: Any, work: Any, before: Any, outcome: Any, step: Any
) -> None:
    """Add the weight on bit of a step, and what it drills, where it moves."""
    if not stays(weight, program):
        load = at(work, r.LOAD)
        outside = (load < at(work, r.TABLE_LOW)) | (load > at(work, r.TABLE_HIGH))
        put(work, r.OUTSIDE_TABLE, at(work, r.OUTSIDE_TABLE) + pick(outside, step, 0.0))
        _add(work, r.WEIGHT_SUM, 0.5 * step, before.load + load)
        drilled = before.load * abs(before.bit_speed) + load * abs(outcome.speed)
        _add(work, r.ROP_SUM, 0.5 * step, drilled)


def conclude_load(weight: Any, program: Any, work: Any, duration: Any) -> None:
    """What a weight that stays adds up to at the end of a run."""
    if stays(weight, program):
        load = at(work, r.LOAD)
        outside = (load < at(work, r.TABLE_LOW)) | (load > at(work, r.TABLE_HIGH))
        put(work, r.OUTSIDE_TABLE, pick(outside, duration, 0.0))
        put(work, r.WEIGHT_SUM, duration * load)
        put(work, r.ROP_SUM, load * (at(work, r.BIT_ANGLE) + at(work, r.BACKWARDS)))
