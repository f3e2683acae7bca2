"""Force of hook and string on a bit that cuts its own wake, compiled: at once, or with a memory.

The laws are those of `rig.weight_on_bit`, what they do between the bit and the hoist that of
`reference_rates`; the past is read from the tape of `cutting_tape`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from drillctl.rig.weight_on_bit import AlarmWeight, RealWeight
from drillctl.simulation.cutting_tape import (
    FOLLOWED,
    Memory,
    compiled,
    slope_on_step,
    step_at,
)
from drillctl.simulation.law_calls import jitted
from drillctl.simulation.reference_rates import (
    ALARMED,
    AT_ONCE,
    OBSERVED,
    READ_EVERY,
    path_at,
)

_command, _next_level = jitted(RealWeight.command), jitted(AlarmWeight.next_level)


class Hook(NamedTuple):
    """A law of the weight with its path and its memory among the states; 0 of what it lacks."""

    kind: int  # of `reference_rates`
    first: int  # of the states: those of sensor or observer, the reading, the hoist's weight
    states: int
    nominal: float  # N
    begin: float  # what stands for the bit speed at time zero (rad/s)
    # as in the laws
    gain: float
    set_speed: float
    least: float
    most: float
    delay: float
    period: float
    sensor: float
    hoist: float
    rate: float
    window: float
    floor: float
    alarm: float
    calm: float
    reduction: float
    # of an observer, shape (3 + states, states): by torque, by speed, read, then the free motion
    observer: Any
    drag: float  # torque of all damping to ground at the set speed (N m)


@compiled
def _signed(hook: Hook, speed: float, x: Any) -> float:
    """What stands for the bit speed (rad/s), from the memory and the bit speed; with its sign."""
    if hook.kind == OBSERVED:
        total = hook.set_speed
        for i in range(hook.states - 2):
            total += hook.observer[2, i] * x[hook.first + i]
        return total
    return x[hook.first] if hook.sensor > 0.0 else speed


@compiled
def _past(hook: Hook, memory: Memory, time: float) -> float:
    """What stood for the bit speed (rad/s) at a time (s); before the start, that of the start."""
    if time <= 0.0 or memory.count[2] == 0:
        return hook.begin
    low = step_at(memory, time)
    row = memory.tape[low]
    h = row[1]
    share = min((time - row[0]) / h, 1.0)
    if hook.kind != OBSERVED and hook.sensor == 0.0:
        return abs(slope_on_step(memory, low, share, 0))
    a, b, p, q = row[FOLLOWED], row[FOLLOWED + 1], h * row[FOLLOWED + 2], h * row[FOLLOWED + 3]
    c = 3.0 * (b - a) - 2.0 * p - q
    return abs(a + share * (p + share * (c + share * (b - a - p - c))))


@compiled
def _asked(task: Any, memory: Memory, time: float, speed: float, x: Any) -> float:
    """Weight (N) that a law with a memory asks for."""
    hook, nominal = task.hook, _nominal(task, time)
    reading = x[hook.first + hook.states - 2]
    if hook.kind == ALARMED:
        return nominal * reading
    if hook.period > 0.0:
        seen = reading
    elif hook.delay > 0.0:
        seen = _past(hook, memory, time - hook.delay)
    else:
        seen = abs(_signed(hook, speed, x))
    return _command(hook, seen, nominal)


@compiled
def _nominal(task: Any, time: float) -> float:
    """Nominal weight (N) under its program."""
    if task.weight[0] == 0.0:
        return task.hook.nominal
    return task.hook.nominal * (1.0 + path_at(task.weight, time))


@compiled
def hook_force(task: Any, memory: Memory, time: float, speed: float, x: Any) -> float:
    """Force on the bit (N)."""
    hook = task.hook
    if hook.kind == AT_ONCE:
        free = _nominal(task, time) + hook.gain * (speed - hook.set_speed)
        return min(max(free, hook.least), hook.most)
    if hook.hoist > 0.0:
        return x[hook.first + hook.states - 1]
    return _asked(task, memory, time, speed, x)


@compiled
def hook_rates(
    task: Any, memory: Memory, time: float, speed: float, top: tuple[float, float], x: Any,
    rates: Any,
) -> None:  # fmt: skip
    """Rates of the memory, of bit speed, and of torque and speed of the top."""
    hook = task.hook
    first, last = hook.first, hook.first + hook.states - 1
    for i in range(hook.states):
        rates[first + i] = 0.0
    if hook.kind == OBSERVED:
        seen = hook.observer
        for i in range(hook.states - 2):
            rate = seen[0, i] * (top[0] - hook.drag) + seen[1, i] * top[1]
            for j in range(hook.states - 2):
                rate += seen[3 + i, j] * x[first + j]
            rates[first + i] = rate
    elif hook.sensor > 0.0:
        rates[first] = (abs(speed) - x[first]) / hook.sensor
    if hook.hoist > 0.0:
        wanted = (_asked(task, memory, time, speed, x) - x[last]) / hook.hoist
        rates[last] = min(max(wanted, -hook.rate), hook.rate)


@compiled
def keep_followed(hook: Hook, row: Any, end: int, x: Any, rates: Any) -> None:
    """Keep of one end of a step what the weight follows, and its rate."""
    if hook.kind == OBSERVED:
        rate = 0.0
        for i in range(hook.states - 2):
            rate += hook.observer[2, i] * rates[hook.first + i]
        row[FOLLOWED + 2 + end] = rate
    elif hook.sensor > 0.0:
        row[FOLLOWED + 2 + end] = rates[hook.first]
    else:
        return
    row[FOLLOWED + end] = _signed(hook, 0.0, x)


@compiled
def next_reading(hook: Hook, count: int) -> float:
    """When the reading of this number arrives (s)."""
    if hook.kind == ALARMED:
        return (count + 1) * hook.window + hook.delay
    return count * hook.period + hook.delay if hook.period > 0.0 else math.inf


@compiled
def longest_delayed(hook: Hook) -> float:
    """Longest step (s): what comes late is known before it is asked for."""
    late = hook.kind != AT_ONCE and hook.delay > 0.0 and next_reading(hook, 0) == math.inf
    return hook.delay if late else math.inf


@compiled
def read_signal(task: Any, memory: Memory, count: int, x: Any) -> None:
    """Take in the reading of this number."""
    hook = task.hook
    reading = hook.first + hook.states - 2
    if hook.kind != ALARMED:
        x[reading] = _past(hook, memory, count * hook.period)
        return
    samples = max(2, math.ceil(hook.window / READ_EVERY) + 1)
    low, high, total = math.inf, -math.inf, 0.0
    for i in range(samples):
        speed = _past(hook, memory, (count + i / (samples - 1.0)) * hook.window)
        low, high, total = min(low, speed), max(high, speed), total + speed
    x[reading] = _next_level(hook, x[reading], low, high, total / samples)
