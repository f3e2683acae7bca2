"""The step of a weight on bit: the law that the rock meets, and what comes late.

A law that acts at once is a function of the bit speed, solved together with the friction. A law
with a memory gives a number for the end of the step beforehand: its signal comes from the past.
Signals are kept at every step in a ring; between two of them the past is a straight line, and a
signal that is not known yet, since the delay is shorter than a step, continues the last one.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from numba.extending import overload

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined, widest_vectors
from drillctl.simulation.kernels.exponential import exp
from drillctl.simulation.kernels.laws import at_lane, weight_at
from drillctl.simulation.kernels.observer_step import move_observer, read_observer, start_observer
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.weight_on_bit import AlarmWeight, ConstantWeight, RealWeight

# The laws' own equations; they read numbers that the laws' steps have too.
_asked = inlined(RealWeight.command)
_next_level = inlined(AlarmWeight.next_level)


class RealWeightStep(NamedTuple):
    """`RealWeight` for steps of one length.

    Attributes
    ----------
    nominal, gain, set_speed, least, most : ndarray
        As in the law.
    back : ndarray
        Whole steps to the older of the two signals that are seen at the end of a step, which is
        at the soonest the one before the last.
    share : ndarray
        Share of the newer one; over 1 where the delay is under a step.
    seen_keep, seen_ramp : ndarray
        Share of its value that the sensor keeps over a step; share of the change of a straight
        input that it has followed at the end.
    hoist_keep, hoist_ramp : ndarray
        The same of the hoist.
    most_moved : ndarray
        Largest change of the weight in a step (N).
    """

    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any
    back: Any
    share: Any
    seen_keep: Any
    seen_ramp: Any
    hoist_keep: Any
    hoist_ramp: Any
    most_moved: Any


class ReadWeightStep(NamedTuple):
    """`RealWeight` with a signal that is read at equal intervals, for steps of one length.

    Attributes
    ----------
    nominal, gain, set_speed, least, most : ndarray
        As in the law.
    delay, period : ndarray
        In steps.
    hoist_decay : ndarray
        By how much the hoist decays in a step, as the exponent: step over time constant.
    seen_keep, seen_ramp, hoist_keep, hoist_ramp, most_moved : ndarray
        As in `RealWeightStep`.
    """

    nominal: Any
    gain: Any
    set_speed: Any
    least: Any
    most: Any
    delay: Any
    period: Any
    hoist_decay: Any
    seen_keep: Any
    seen_ramp: Any
    hoist_keep: Any
    hoist_ramp: Any
    most_moved: Any


class AlarmWeightStep(NamedTuple):
    """`AlarmWeight` for steps of one length.

    Attributes
    ----------
    nominal, floor, delay, window, alarm, calm, reduction : ndarray
        As in the law.
    seen_keep, seen_ramp, hoist_keep, hoist_ramp, most_moved : ndarray
        As in `RealWeightStep`.
    """

    nominal: Any
    floor: Any
    delay: Any
    window: Any
    alarm: Any
    calm: Any
    reduction: Any
    seen_keep: Any
    seen_ramp: Any
    hoist_keep: Any
    hoist_ramp: Any
    most_moved: Any


class Memory(NamedTuple):
    """What a block of lanes remembers beside its rows.

    Attributes
    ----------
    ring : ndarray, shape (steps x WIDTH,)
        Signals of the last steps, step after step; a power of two of them, so that a place in the
        ring is a mask away. Places before the start hold the first signal.
    estimate, moved : ndarray, shape (states, WIDTH)
        States of the observer, and room for them.
    """

    ring: Any
    estimate: Any
    moved: Any


def has_memory(weight: Any) -> bool:
    """Whether a weight law, as numba knows it, keeps a memory."""
    return weight.instance_class in (RealWeightStep, ReadWeightStep, AlarmWeightStep)


def acting(weight: Any, work: Any, lane: int) -> Any:
    """The weight law that the rock meets in this step."""
    raise NotImplementedError("compiled only")


@overload(acting)
def _acting(weight, work, lane):
    if has_memory(weight):
        return lambda weight, work, lane: ConstantWeight(work[r.HOISTED + lane])
    return lambda weight, work, lane: at_lane(weight, work, r.WEIGHT, lane)


def begin_weight(weight: Any, observer: Any, work: Any, memory: Any, first: int) -> None:
    """Memory at time zero."""
    raise NotImplementedError("compiled only")


@overload(begin_weight)
def _begin_weight(weight, observer, work, memory, first):
    if weight.instance_class in (RealWeightStep, ReadWeightStep):
        return lambda weight, observer, work, memory, first: _begin_real(
            weight, observer, work, memory, first
        )
    if weight.instance_class is AlarmWeightStep:
        return lambda weight, observer, work, memory, first: _begin_alarm(weight, work)
    return lambda weight, observer, work, memory, first: None


@inlined
def _begin_real(weight: Any, observer: Any, work: Any, memory: Any, first: int) -> None:
    start_observer(observer, memory, first)
    for lane in range(WIDTH):
        work[r.SIGNAL + lane] = abs(work[r.BIT_SPEED + lane])
    read_observer(observer, memory, work)
    for lane in range(WIDTH):
        signal = work[r.SIGNAL + lane]
        for place in range(0, memory.ring.shape[0], WIDTH):
            memory.ring[place + lane] = signal
        law = at_lane(weight, work, r.WEIGHT, lane)
        asked = _asked(law, signal, law.nominal)
        work[r.CALLED + lane] = asked
        work[r.HOISTED + lane] = asked


@inlined
def _begin_alarm(weight: Any, work: Any) -> None:
    for lane in range(WIDTH):
        speed = abs(work[r.BIT_SPEED + lane])
        law = at_lane(weight, work, r.WEIGHT, lane)
        work[r.SIGNAL + lane] = speed
        work[r.CALLED + lane] = law.nominal
        work[r.HOISTED + lane] = law.nominal
        work[r.LEVEL + lane] = 1.0
        work[r.LEVEL_NEXT + lane] = 1.0
        work[r.LEVEL_FROM + lane] = 0.0
        work[r.WINDOW_END + lane] = law.window
        _open_window(work, lane, speed)


@inlined
def _open_window(work: Any, lane: int, speed: float) -> None:
    work[r.WINDOW_LOW + lane] = speed
    work[r.WINDOW_HIGH + lane] = speed
    work[r.WINDOW_SUM + lane] = 0.0
    work[r.WINDOW_COUNT + lane] = 0.0


def raise_weight(weight: Any, program: Any, work: Any, memory: Any, n: int, step: float) -> None:
    """Weight at the end of step `n`, as far as it is known beforehand."""
    raise NotImplementedError("compiled only")


@overload(raise_weight)
def _raise_weight(weight, program, work, memory, n, step):
    if weight.instance_class is RealWeightStep:
        return lambda weight, program, work, memory, n, step: _raise_real(weight, work, memory, n)
    if weight.instance_class is ReadWeightStep:
        return lambda weight, program, work, memory, n, step: _raise_read(weight, work, memory, n)
    if weight.instance_class is AlarmWeightStep:
        return lambda weight, program, work, memory, n, step: _raise_alarm(
            weight, work, (n + 1) * step
        )
    if "weight_end" in program.fields:
        return lambda weight, program, work, memory, n, step: _rest(weight, work)
    return lambda weight, program, work, memory, n, step: None


@inlined
def _rest(weight: Any, work: Any) -> None:
    """Weight on a bit at rest, on the mean over the step."""
    widest_vectors()
    for lane in range(WIDTH):
        end = weight_at(acting(weight, work, lane), 0.0)
        work[r.REST_LOAD + lane] = 0.5 * (work[r.REST_END + lane] + end)
        work[r.REST_END + lane] = end


@inlined
def _hoist(law: Any, work: Any, lane: int, asked: float, followed: float) -> None:
    """Let the hoist follow what is asked for, `followed` of its change by the end of the step."""
    before, weight = work[r.CALLED + lane], work[r.HOISTED + lane]
    new = law.hoist_keep * weight + (1.0 - law.hoist_keep) * before
    new += followed * (asked - before)
    moved = new - weight
    moved = law.most_moved if moved > law.most_moved else moved
    moved = -law.most_moved if moved < -law.most_moved else moved
    work[r.HOISTED + lane] = weight + moved
    work[r.CALLED + lane] = asked


@inlined
def _raise_real(weight: Any, work: Any, memory: Any, n: int) -> None:
    widest_vectors()
    mask = memory.ring.shape[0] // WIDTH - 1
    for lane in range(WIDTH):
        law = at_lane(weight, work, r.WEIGHT, lane)
        older = (n - int(law.back)) & mask
        left = memory.ring[older * WIDTH + lane]
        right = memory.ring[((older + 1) & mask) * WIDTH + lane]
        # A signal that is not known yet continues the last ones; a speed is not negative.
        seen = left + law.share * (right - left)
        seen = seen if seen > 0.0 else 0.0
        _hoist(law, work, lane, _asked(law, seen, law.nominal), law.hoist_ramp)
    _rest(weight, work)


@inlined
def _raise_read(weight: Any, work: Any, memory: Any, n: int) -> None:
    mask = memory.ring.shape[0] // WIDTH - 1
    for lane in range(WIDTH):
        law = at_lane(weight, work, r.WEIGHT, lane)
        place = n + 1.0 - law.delay
        # A reading whose time falls on the end of a step is there, but for rounding.
        reading = math.floor(place / law.period + 1e-9) * law.period
        # It jumps within the step: the hoist follows for the rest of it.
        share = place - reading
        followed = 1.0 - exp(-law.hoist_decay * (share if share < 1.0 else 1.0))
        reading = reading if reading > 0.0 else 0.0
        older = min(int(reading), n - 1)
        left = memory.ring[(older & mask) * WIDTH + lane]
        right = memory.ring[((older + 1) & mask) * WIDTH + lane]
        seen = left + (reading - older) * (right - left)
        seen = seen if seen > 0.0 else 0.0
        _hoist(law, work, lane, _asked(law, seen, law.nominal), followed)
    _rest(weight, work)


@inlined
def _raise_alarm(weight: Any, work: Any, end: float) -> None:
    for lane in range(WIDTH):
        law = at_lane(weight, work, r.WEIGHT, lane)
        due = end >= work[r.LEVEL_FROM + lane]
        work[r.LEVEL + lane] = work[r.LEVEL_NEXT + lane] if due else work[r.LEVEL + lane]
        _hoist(law, work, lane, law.nominal * work[r.LEVEL + lane], law.hoist_ramp)
    _rest(weight, work)


def follow_weight(weight: Any, observer: Any, work: Any, memory: Any, n: int, step: float) -> None:
    """Signal at the end of step `n`, whose motion is known."""
    raise NotImplementedError("compiled only")


@overload(follow_weight)
def _follow_weight(weight, observer, work, memory, n, step):
    if weight.instance_class in (RealWeightStep, ReadWeightStep):
        return lambda weight, observer, work, memory, n, step: _follow_real(
            weight, observer, work, memory, n
        )
    if weight.instance_class is AlarmWeightStep:
        return lambda weight, observer, work, memory, n, step: _follow_alarm(
            weight, work, (n + 1) * step
        )
    return lambda weight, observer, work, memory, n, step: None


@inlined
def _sense(law: Any, work: Any, lane: int) -> float:
    """Move the sensor's filter; returns what it shows."""
    before, after = abs(work[r.SPEED_BEFORE + lane]), abs(work[r.BIT_SPEED + lane])
    shown = law.seen_keep * work[r.SIGNAL + lane] + (1.0 - law.seen_keep) * before
    shown += law.seen_ramp * (after - before)
    work[r.SIGNAL + lane] = shown
    return shown


@inlined
def _follow_real(weight: Any, observer: Any, work: Any, memory: Any, n: int) -> None:
    widest_vectors()
    for lane in range(WIDTH):
        _sense(at_lane(weight, work, r.WEIGHT, lane), work, lane)
    move_observer(observer, memory, work)
    read_observer(observer, memory, work)
    slot = ((n + 1) & (memory.ring.shape[0] // WIDTH - 1)) * WIDTH
    for lane in range(WIDTH):
        memory.ring[slot + lane] = work[r.SIGNAL + lane]


@inlined
def _follow_alarm(weight: Any, work: Any, end: float) -> None:
    for lane in range(WIDTH):
        law = at_lane(weight, work, r.WEIGHT, lane)
        before = work[r.SIGNAL + lane]
        speed = _sense(law, work, lane)
        low, high = work[r.WINDOW_LOW + lane], work[r.WINDOW_HIGH + lane]
        low = speed if speed < low else low
        high = speed if speed > high else high
        work[r.WINDOW_LOW + lane] = low
        work[r.WINDOW_HIGH + lane] = high
        work[r.WINDOW_SUM + lane] += 0.5 * (before + speed)
        work[r.WINDOW_COUNT + lane] += 1.0
        # A window that ends within rounding of a step's end ends with it.
        if end * (1.0 + 1e-12) >= work[r.WINDOW_END + lane]:
            mean = work[r.WINDOW_SUM + lane] / work[r.WINDOW_COUNT + lane]
            work[r.LEVEL_NEXT + lane] = _next_level(law, work[r.LEVEL + lane], low, high, mean)
            work[r.LEVEL_FROM + lane] = work[r.WINDOW_END + lane] + law.delay
            work[r.WINDOW_END + lane] += law.window
            _open_window(work, lane, speed)
