"""The step of a weight on bit: the law that the rock meets, and what comes late.

A law that acts at once is a function of the bit speed, solved together with the friction. A law
with a memory gives a number for the end of the step beforehand: its signal comes from the past.
Signals are kept at every step in a ring; between two of them the past is a straight line, and a
signal that is not known yet, since the delay is shorter than a step, continues the last one.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.weight_on_bit import AlarmWeight, ConstantWeight, RealWeight
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import (
    any_of,
    exp,
    gather,
    lane_number,
    law_at,
    least,
    most,
    rounded_down,
)
from drillctl.simulation.kernels.observer_step import move_observer, read_observer, start_observer
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.vectors import Array, at, loop, pick, put, when

# The laws' own equations; they read numbers that the laws' steps have too.
_asked: Any = RealWeight.command
_next_level: Any = AlarmWeight.next_level


class RealWeightStep(NamedTuple):
    """`RealWeight` for steps of one length."""

    # as in the law
    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any
    # whole steps to the older of the two signals that are seen at the end of a step, which is at
    # the soonest the one before the last
    back: Any
    share: Any  # share of the newer one; over 1 where the delay is under a step
    # share of its value that the sensor keeps over a step; share of the change of a straight
    # input that it has followed at the end
    seen_keep: Any
    seen_ramp: Any
    # the same of the hoist
    hoist_keep: Any
    hoist_ramp: Any
    most_moved: Any  # largest change of the weight in a step (N)


class ReadWeightStep(NamedTuple):
    """`RealWeight` with a signal that is read at equal intervals, for steps of one length."""

    # as in the law
    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any
    # in steps
    delay: Any
    period: Any
    # by how much the hoist decays in a step, as the exponent: step over time constant
    hoist_decay: Any
    # as in `RealWeightStep`
    seen_keep: Any
    seen_ramp: Any
    hoist_keep: Any
    hoist_ramp: Any
    most_moved: Any


class AlarmWeightStep(NamedTuple):
    """`AlarmWeight` for steps of one length."""

    # as in the law
    nominal: Any
    floor: Any
    delay: Any
    window: Any
    alarm: Any
    calm: Any
    reduction: Any
    # as in `RealWeightStep`
    seen_keep: Any
    seen_ramp: Any
    hoist_keep: Any
    hoist_ramp: Any
    most_moved: Any


class Memory(NamedTuple):
    """What a block of lanes remembers beside its named rows; parts of the same flat array."""

    # shape (steps x WIDTH,): Signals of the last steps, step after step; a power of two of them,
    # so that a place in the ring is a mask away. Places before the start hold the first signal.
    ring: Any
    # shape (states x WIDTH,): States of the observer, and room for them
    estimate: Any
    moved: Any
    cutting: Any  # rows of `cutting_step`
    surface: Any  # rings of it, a lane after the other: shape (2 x points x WIDTH,)

    def part(self, first: Any) -> Memory:
        """The same from a lane on; each lane knows where its ring begins."""
        parts = [Array(rows.address(first), rows.shape) for rows in self[:-1]]
        return Memory._make([*parts, self.surface])


def has_memory(weight: Any) -> bool:
    """Whether a weight law keeps a memory."""
    return isinstance(weight, (RealWeightStep, ReadWeightStep, AlarmWeightStep))


def stays(weight: Any, program: Any) -> bool:
    """Whether the weight is the same throughout a run."""
    return not (has_memory(weight) or weight.moves or _changes(program))


def _changes(program: Any) -> bool:
    return hasattr(program, "rock_until")


def acting(weight: Any, work: Any) -> Any:
    """The weight law that the rock meets in this step."""
    if has_memory(weight):
        return ConstantWeight(at(work, r.HOISTED))
    return law_at(weight, work, r.WEIGHT)


def begin_weight(weight: Any, observer: Any, work: Any, memory: Any, first: Any) -> None:
    """Memory at time zero."""
    if isinstance(weight, (RealWeightStep, ReadWeightStep)):
        return _begin_real(weight, observer, work, memory, first)
    if isinstance(weight, AlarmWeightStep):
        return _begin_alarm(weight, work)
    return None


def _begin_real(weight: Any, observer: Any, work: Any, memory: Any, first: Any) -> None:
    start_observer(observer, memory, first)
    put(work, r.SIGNAL, abs(at(work, r.BIT_SPEED)))
    read_observer(observer, memory, work)
    signal = at(work, r.SIGNAL)
    with loop(memory.ring.shape[0] // WIDTH) as slots:
        put(memory.ring, slots.index * WIDTH, signal)
    law = law_at(weight, work, r.WEIGHT)
    asked = _asked(law, signal, law.nominal)
    put(work, r.CALLED, asked)
    put(work, r.HOISTED, asked)


def _begin_alarm(weight: Any, work: Any) -> None:
    speed = abs(at(work, r.BIT_SPEED))
    law = law_at(weight, work, r.WEIGHT)
    put(work, r.SIGNAL, speed)
    put(work, r.CALLED, law.nominal)
    put(work, r.HOISTED, law.nominal)
    put(work, r.LEVEL, 1.0)
    put(work, r.LEVEL_NEXT, 1.0)
    put(work, r.LEVEL_FROM, 0.0)
    put(work, r.WINDOW_END, law.window)
    put(work, r.WINDOW_LOW, speed)
    put(work, r.WINDOW_HIGH, speed)


def raise_weight(weight: Any, program: Any, work: Any, memory: Any, n: Any, step: Any) -> None:
    """Weight at the end of step `n`, as far as it is known beforehand."""
    if isinstance(weight, RealWeightStep):
        return _raise_real(weight, work, memory, n)
    if isinstance(weight, ReadWeightStep):
        return _raise_read(weight, work, memory, n)
    if isinstance(weight, AlarmWeightStep):
        return _raise_alarm(weight, work, (n + 1) * step)
    if _changes(program):
        return _rest(weight, work)
    return None


def _rest(weight: Any, work: Any) -> None:
    """Weight on a bit at rest, on the mean over the step."""
    end = acting(weight, work).weight(0.0 * at(work, r.BIT_SPEED))
    put(work, r.REST_LOAD, 0.5 * (at(work, r.REST_END) + end))
    put(work, r.REST_END, end)


def _hoist(law: Any, work: Any, asked: Any, followed: Any) -> None:
    """Let the hoist follow what is asked for, `followed` of its change by the end of the step."""
    before, weight = at(work, r.CALLED), at(work, r.HOISTED)
    new = law.hoist_keep * weight + (1.0 - law.hoist_keep) * before
    new += followed * (asked - before)
    moved = most(-law.most_moved, least(law.most_moved, new - weight))
    put(work, r.HOISTED, weight + moved)
    put(work, r.CALLED, asked)


def _between(ring: Any, older: Any, share: Any) -> Any:
    """A signal between two steps of the ring; one that is not known yet continues the last ones."""
    steps = ring.shape[0] // WIDTH
    # A step's place in the ring: what is left of it over the ring's length, itself a power of two.
    # A delay that is no number must not lead out of the ring.
    place = least(most(older - steps * rounded_down(older / steps), 0.0), steps - 1.0)
    after = pick(place + 1.0 < steps, place + 1.0, 0.0)
    lane = lane_number()
    left = gather(ring, place * WIDTH + lane)
    right = gather(ring, after * WIDTH + lane)
    return most(left + share * (right - left), 0.0)  # a speed is not negative


def _raise_real(weight: Any, work: Any, memory: Any, n: Any) -> None:
    law = law_at(weight, work, r.WEIGHT)
    seen = _between(memory.ring, n - law.back, law.share)
    _hoist(law, work, _asked(law, seen, law.nominal), law.hoist_ramp)
    _rest(weight, work)


def _raise_read(weight: Any, work: Any, memory: Any, n: Any) -> None:
    law = law_at(weight, work, r.WEIGHT)
    place = n + 1.0 - law.delay
    # A reading whose time falls on the end of a step is there, but for rounding.
    reading = rounded_down(place / law.period + 1e-9) * law.period
    # It jumps within the step: the hoist follows for the rest of it.
    followed = 1.0 - exp(-law.hoist_decay * least(place - reading, 1.0))
    reading = most(reading, 0.0)
    older = least(rounded_down(reading), n - 1.0)
    seen = _between(memory.ring, older, reading - older)
    _hoist(law, work, _asked(law, seen, law.nominal), followed)
    _rest(weight, work)


def _raise_alarm(weight: Any, work: Any, end: Any) -> None:
    law = law_at(weight, work, r.WEIGHT)
    due = at(work, r.LEVEL_FROM) <= end
    level = pick(due, at(work, r.LEVEL_NEXT), at(work, r.LEVEL))
    put(work, r.LEVEL, level)
    _hoist(law, work, law.nominal * level, law.hoist_ramp)
    _rest(weight, work)


def move_load(weight: Any, program: Any, work: Any) -> None:
    """Weight on the bit at the end of the step, where it moves at all."""
    if stays(weight, program):
        return None
    return put(work, r.LOAD, acting(weight, work).weight(abs(at(work, r.BIT_SPEED))))


def follow_weight(
    weight: Any, observer: Any, work: Any, memory: Any, before: Any, n: Any, step: Any
) -> None:
    """Signal at the end of step `n`; `before`: `Before`, what moved as it began."""
    if isinstance(weight, (RealWeightStep, ReadWeightStep)):
        return _follow_real(weight, observer, work, memory, before, n)
    if isinstance(weight, AlarmWeightStep):
        return _follow_alarm(weight, work, before, (n + 1) * step)
    return None


def _sense(law: Any, work: Any, speed_before: Any) -> Any:
    """Move the sensor's filter; returns what it shows."""
    before, after = abs(speed_before), abs(at(work, r.BIT_SPEED))
    shown = law.seen_keep * at(work, r.SIGNAL) + (1.0 - law.seen_keep) * before
    shown += law.seen_ramp * (after - before)
    put(work, r.SIGNAL, shown)
    return shown


def _follow_real(weight: Any, observer: Any, work: Any, memory: Any, before: Any, n: Any) -> None:
    _sense(law_at(weight, work, r.WEIGHT), work, before.bit_speed)
    move_observer(observer, memory, work, before.top_speed)
    read_observer(observer, memory, work)
    slot = ((n + 1) & (memory.ring.shape[0] // WIDTH - 1)) * WIDTH
    put(memory.ring, slot, at(work, r.SIGNAL))


def _follow_alarm(weight: Any, work: Any, before: Any, end: Any) -> None:
    law = law_at(weight, work, r.WEIGHT)
    signal_before = at(work, r.SIGNAL)
    speed = _sense(law, work, before.bit_speed)
    low, high = least(speed, at(work, r.WINDOW_LOW)), most(speed, at(work, r.WINDOW_HIGH))
    total = at(work, r.WINDOW_SUM) + 0.5 * (signal_before + speed)
    count, ends = at(work, r.WINDOW_COUNT) + 1.0, at(work, r.WINDOW_END)
    # A window that ends within rounding of a step's end ends with it.
    over = ends <= end * (1.0 + 1e-12)
    with when(any_of(over)):
        level = _next_level(law, at(work, r.LEVEL), low, high, total / count)
        put(work, r.LEVEL_NEXT, pick(over, level, at(work, r.LEVEL_NEXT)))
        put(work, r.LEVEL_FROM, pick(over, ends + law.delay, at(work, r.LEVEL_FROM)))
        put(work, r.WINDOW_END, pick(over, ends + law.window, ends))
    put(work, r.WINDOW_LOW, pick(over, speed, low))
    put(work, r.WINDOW_HIGH, pick(over, speed, high))
    put(work, r.WINDOW_SUM, pick(over, 0.0, total))
    put(work, r.WINDOW_COUNT, pick(over, 0.0, count))
