"""Reference solver of a bit that cuts its own wake: located events, the surface behind the bit.

Torsion and axial motion are linear systems x' = A x + B f + c, coupled at the bit by the rock
alone. In each phase the bit slides, sticks axially, is off bottom or stands still; within it the
motion is smooth and followed by the pair of order 5(4) of Dormand & Prince. The surface left behind
is a function of the angle of the bit, which never turns back: where the bit was in contact, its own
depth as a Hermite polynomial of degree five a step; where it was not, the surface a blade before.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drillctl.rig import program
from drillctl.rig.top_drive import real_drive
from drillctl.rig.weight_on_bit import following_speed, stick_slip_alarm
from drillctl.simulation import cutting_hook, cutting_tape, law_calls, reference_rates
from drillctl.simulation.cutting_hook import (
    Hook,
    hook_force,
    hook_rates,
    keep_followed,
    longest_delayed,
    next_reading,
    read_signal,
)
from drillctl.simulation.cutting_tape import CLOSE, FIRST, LAST, compiled, surface
from drillctl.simulation.kernel_cache import on_disk
from drillctl.simulation.reference_rates import (
    CONTINUOUS,
    IDEAL,
    SAMPLED,
    answer,
    answer_held,
    path_at,
    path_integral,
    real_of,
    sampled,
    sampled_of,
)

UP, STUCK, DOWN, OFF = -1, 0, 1, 2
"""Axial phases: rising, at rest and sinking in contact with the rock; off bottom.

A bit that does not turn is at rest or off bottom."""
AXIAL_STICK, AXIAL_SLIP, STICK, RELEASE, LOST, REGAINED = range(6)
"""Events; `EVENTS` has their names."""
EVENTS = (
    "axial_stick", "axial_slip", "stick", "release", "lost_contact", "regained_contact"
)  # fmt: skip
DONE, MORE, TOO_SHORT, CHATTERS = range(4)
WORKS = 7
"""States beside the motion: work of drive, hook, cutting, wear flat and dampers (J), the integral
of abs(bit speed - set speed) (rad), and the weight's (N s)."""
MOST_CHANGES = 200_000
REACH = 0.3  # share of the angle between two blades that a step may turn


class Side(NamedTuple):
    """One of the two strings as x' = A x + by_top f_top + by_bit f_bit + load."""

    a: Any  # shape (states, states)
    by_top: Any  # shape (states,): per torque, or force, at the top
    by_bit: Any  # shape (states,): per braking torque, or per force, at the bit
    load: Any  # shape (states,)
    # shape (7, states): displacement and velocity at the bit, at the top and at the node below it;
    # power of dampers per state at the set speed
    read: Any
    damping: Any  # shape (states, states): power of dampers as a quadratic form
    steady_loss: float  # power of dampers at the set speed alone (W)


PER_DEPTH, TORQUE_PER_DEPTH, FLAT, FLAT_TORQUE = range(4)
"""Of a rock: force and torque on all blades per depth of one (N/m, N), force and torque of the
wear flat (N, N m)."""


class Bit(NamedTuple):
    """The bit."""

    between: float  # angle between two blades (rad)
    blades: float


class Drive(NamedTuple):
    """The drive at the top."""

    kind: int  # of `reference_rates`
    # an ideal one
    constant: float  # N m
    kp: float  # N m s/rad
    ki: float  # N m/rad
    # any other: its numbers, and those of its memory among the states
    numbers: Any
    states: int


class Task(NamedTuple):
    """A run."""

    torsion: Side
    axial: Side
    bit: Bit
    drive: Drive
    hook: Hook
    speed: Any  # numbers of the programs of set speed and weight
    weight: Any
    rock: Any  # shape (4,), by the names above; from `rock_until` (s) on
    rock_until: float
    breaks: Any  # times at which something jumps or bends (s), infinity the last
    set_speed: float
    duration: float
    tolerance: float
    scale: Any  # shape (states,): below which errors do not matter
    # surface at the start: straight with this slope (m/rad) through the bit's own place
    slope: float
    hold: Any  # shape (2,): axial mobility and torsional one of the bit (1/kg, 1/(kg m2))
    path: Any  # X of a rock that varies, at its nodes; and
    vary: Any  # shape (5,): spread, spacing, way per time, per angle, per depth


@compiled
def _dot(row: Any, x: Any, offset: int) -> float:
    total = 0.0
    for i in range(len(row)):
        total += row[i] * x[offset + i]
    return total


@compiled
def _bit(task: Any, x: Any, time: float) -> tuple[float, float, float, float]:
    """Angle, speed, depth and sinking of the bit."""
    n = len(task.torsion.by_bit)
    angle = _dot(task.torsion.read[0], x, 0) + task.set_speed * time
    speed = _dot(task.torsion.read[1], x, 0) + task.set_speed
    return angle, speed, _dot(task.axial.read[0], x, n), _dot(task.axial.read[1], x, n)


@compiled
def hardness(task: Any, time: float, angle: float, depth: float, memory: Any) -> float:
    """Factor of a rock that varies along the way."""
    vary = task.vary
    if vary[0] == 0.0:
        return 1.0
    way = vary[2] * time + vary[3] * (angle - memory.now[2]) + vary[4] * (depth - memory.now[3])
    place = min(max(way / vary[1], 0.0), len(task.path) - 2.0)
    node = int(place)
    value = task.path[node] + (place - node) * (task.path[node + 1] - task.path[node])
    return math.exp(vary[0] * (value - 0.5 * vary[0]))


class Contact(NamedTuple):
    """What the rock does to the bit at a moment."""

    depth: Any  # of cut per blade (m), negative off bottom
    force: Any  # on the bit upwards (N)
    torque: Any  # that brakes (N m)
    share: Any  # of the wear flat's full force that is needed to hold it; its own in other phases
    top: Any  # torque of the drive (N m)
    spare: Any  # torque of the rock beyond what holds a bit that stands still (N m)
    cutting: Any  # force of the cutters (N)
    hook: Any  # of hook and string (N)


@compiled
def _top(task: Any, time: float, turning: bool, torque: float, x: Any, rates: Any) -> float:
    """Torque of the drive (N m), and rates of its memory; `torque` of the rock on a turning bit."""
    drive, torsion = task.drive, task.torsion
    angle, speed = _dot(torsion.read[2], x, 0), _dot(torsion.read[3], x, 0)
    lead = path_at(task.speed, time)
    if drive.kind == IDEAL:
        angle -= path_integral(task.speed, time)
        return drive.constant - drive.kp * (speed - lead) - drive.ki * angle
    first = len(torsion.by_bit) + len(task.axial.by_bit)
    memory = x[first : first + drive.states]
    if drive.kind == SAMPLED:
        given, seen, motor, impulse = answer_held(sampled_of(drive.numbers), memory, speed)
        for i in range(drive.states):
            rates[first + i] = 0.0
        rates[first], rates[first + 4], rates[first + 8] = seen, motor, impulse
        return given
    assert drive.kind == CONTINUOUS
    # Acceleration of the top without its torque, and per torque; a bit at rest holds its place.
    by_top = _dot(torsion.read[3], torsion.by_top, 0)
    by_bit = _dot(torsion.read[3], torsion.by_bit, 0)
    at_bit = _dot(torsion.read[1], torsion.by_top, 0)
    free = _free(torsion, 3, x, 0)
    if turning:
        free -= by_bit * torque
    else:
        free -= by_bit * _free(torsion, 1, x, 0) / task.hold[1]
        by_top -= by_bit * at_bit / task.hold[1]
    given, changes = answer(
        real_of(drive.numbers), memory, speed, lead, speed + task.set_speed, (free, by_top)
    )
    for i in range(drive.states):
        rates[first + i] = changes[i]
    return given


@compiled
def _contact(
    task: Any, memory: Any, time: float, axial: int, turning: bool, x: Any, rates: Any
) -> Contact:
    rock, torsion, other, n = memory.rock, task.torsion, task.axial, len(task.torsion.by_bit)
    angle, speed, place, _ = _bit(task, x, time)
    depth = place - surface(task.bit, task.slope, memory, angle - task.bit.between)
    hard = hardness(task, time, angle, place, memory)
    cut = rock[PER_DEPTH] * hard * depth if axial != OFF else 0.0
    hook = hook_force(task, memory, time, speed if turning else 0.0, x)
    share = used = 1.0 if axial == DOWN else 0.0
    force = cut + rock[FLAT] * used
    if axial == STUCK:  # held by what the rock gives, at rest by more than the wear flat
        force = hook + _free(other, 1, x, n) / task.hold[0]
        share = (force - cut) / rock[FLAT]
        used = share if turning else min(max(share, 0.0), 1.0)
    torque = rock[TORQUE_PER_DEPTH] * hard * (depth if axial != OFF else 0.0)
    torque += rock[FLAT_TORQUE] * used
    top = _top(task, time, turning, torque, x, rates)
    spare = 0.0
    if not turning:
        by_top = _dot(torsion.read[1], torsion.by_top, 0)
        pull = (_free(torsion, 1, x, 0) + by_top * top) / task.hold[1]
        spare = torque - pull
        torque = pull
    return Contact(depth, force, torque, share, top, spare, cut, hook)


@compiled
def _free(side: Any, row: int, x: Any, offset: int) -> float:
    """Acceleration of the bit (row 1), or of the top (3), without forces of drive and rock."""
    total = 0.0
    read = side.read[row]
    size = len(read)
    for i in range(size):
        if read[i] != 0.0:
            rate = side.load[i]
            for j in range(size):
                rate += side.a[i, j] * x[offset + j]
            total += read[i] * rate
    return total


@compiled
def _rates(
    task: Any, memory: Any, time: float, axial: int, turning: bool, x: Any, out: Any
) -> None:
    torsion, other = task.torsion, task.axial
    n, m = len(torsion.by_bit), len(other.by_bit)
    now = _contact(task, memory, time, axial, turning, x, out)
    held, force = axial == STUCK, now.force
    push = -_free(other, 1, x, n) / task.hold[0] if held else now.hook - force
    for i in range(n):
        rate = torsion.load[i] + torsion.by_top[i] * now.top - torsion.by_bit[i] * now.torque
        for j in range(n):
            rate += torsion.a[i, j] * x[j]
        out[i] = rate
    for i in range(m):
        rate = other.load[i] + other.by_bit[i] * push
        for j in range(m):
            rate += other.a[i, j] * x[n + j]
        out[n + i] = rate
    _, speed, _, sinking = _bit(task, x, time)
    first = n + m + task.drive.states + task.hook.states
    if held:
        force, sinking = now.hook - push, 0.0
    turned = 0.0 if not turning else speed
    top_speed = _dot(torsion.read[3], x, 0)
    hook_rates(task, memory, time, turned, (now.top, top_speed), x, out)
    out[first] = now.top * (top_speed + task.set_speed)
    out[first + 1] = now.hook * sinking + _dot(other.read[6], x, n)
    flat = force - now.cutting
    flat_torque = memory.rock[FLAT_TORQUE] / memory.rock[FLAT] * flat
    out[first + 2] = now.cutting * sinking + (now.torque - flat_torque) * turned
    out[first + 3] = flat * sinking + flat_torque * turned
    loss = torsion.steady_loss + 2.0 * _dot(torsion.read[6], x, 0)
    for i in range(n):
        for j in range(n):
            if torsion.damping[i, j] != 0.0:
                loss += x[i] * torsion.damping[i, j] * x[j]
    for i in range(m):
        for j in range(m):
            if other.damping[i, j] != 0.0:
                loss += x[n + i] * other.damping[i, j] * x[n + j]
    out[first + 4] = loss
    out[first + 5] = abs(turned - task.set_speed)
    out[first + 6] = force


# Steps.

_A = np.array([
    [1 / 5, 0, 0, 0, 0, 0],
    [3 / 40, 9 / 40, 0, 0, 0, 0],
    [44 / 45, -56 / 15, 32 / 9, 0, 0, 0],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
])  # fmt: skip
_C = np.array([1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
_E = np.array(
    [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40]
)  # fmt: skip


@compiled
def _step(task: Any, memory: Any, time: float, h: float, axial: int, turning: bool) -> float:
    """A trial step from a state whose rates are in the first row of work; its error."""
    work, x = memory.work, memory.state
    size = len(x)
    for k in range(6):
        for i in range(size):
            total = 0.0
            for j in range(k + 1):
                total += _A[k, j] * work[j, i]
            work[7, i] = x[i] + h * total
        _rates(task, memory, time + _C[k] * h, axial, turning, work[7], work[k + 1])
    error = 0.0
    for i in range(size):
        total = 0.0
        for j in range(7):
            total += _E[j] * work[j, i]
        limit = task.tolerance * max(task.scale[i], max(abs(x[i]), abs(work[7, i])))
        error = max(error, abs(h * total) / limit)
    return error


@compiled
def _ends(task: Any, memory: Any, row: Any, column: int, time: float, x: Any, rates: Any) -> None:
    """Values, slopes and curvatures of what the tape holds, at one end of a step."""
    n, read, other = len(task.torsion.by_bit), task.torsion.read, task.axial.read
    turned = task.set_speed * time
    for which in range(4):
        k = FIRST + 6 * which + column
        if which == 1:
            row[k], row[k + 1] = _dot(other[0], x, n), _dot(other[1], x, n)
            row[k + 2] = _dot(other[1], rates, n)
            continue
        pair = 0 if which == 0 else 2 * which - 2
        row[k] = _dot(read[pair], x, 0) + turned
        row[k + 1] = _dot(read[pair + 1], x, 0) + task.set_speed
        row[k + 2] = _dot(read[pair + 1], rates, 0)
    keep_followed(task.hook, row, column // 3, x, rates)


@compiled
def _margins(task: Any, memory: Any, time: float, axial: int, turning: bool, x: Any, out: Any
             ) -> Contact:  # fmt: skip
    """What is left until a phase ends: of contact, of the axial phase twice, of turning.

    Returns what the rock does then.
    """
    _, speed, _, sinking = _bit(task, x, time)
    now = _contact(task, memory, time, axial, turning, x, memory.work[8])
    out[0] = -now.depth if axial == OFF else now.depth
    out[1] = out[2] = 1.0
    if axial in (UP, DOWN):
        out[1] = axial * sinking
    elif axial == STUCK and turning:
        out[1], out[2] = now.share, 1.0 - now.share
    elif axial == STUCK:
        out[0] = 1.0
    out[3] = speed if turning else now.spare
    return now


@compiled
def _used_up(margins: Any, fresh: bool) -> int:
    """The last margin that a step has used up, or -1; none that a new phase begins without."""
    found = -1
    for k in range(4):
        if margins[1, k] < 0.0 and (margins[0, k] > 0.0 or not fresh):
            found = k
    return found


@compiled
def _stop_bit(task: Any, memory: Any, side: Any, offset: int, wanted: float) -> None:
    """Give the bit a velocity by an impulse; notes the energy that is lost."""
    x, by = memory.state, _dot(side.read[1], side.by_bit, 0)
    speed = _dot(side.read[1], x, offset)
    change = wanted - speed
    full = speed + (task.set_speed if offset == 0 else 0.0)
    memory.now[4] += 0.5 * (full * full - (full + change) ** 2) / abs(by)
    for i in range(len(side.by_bit)):
        x[offset + i] += side.by_bit[i] * change / by


@compiled
def _note(memory: Any, kind: int) -> None:
    count = memory.count
    memory.events[count[3], 0], memory.events[count[3], 1] = memory.now[0], kind
    count[3] += 1


@compiled
def _axial_phase(task: Any, memory: Any, time: float) -> int:
    """The phase of a bit that turns in contact, and neither rises nor sinks."""
    share = _contact(task, memory, time, STUCK, True, memory.state, memory.work[8]).share
    return DOWN if share > 1.0 else UP if share < 0.0 else STUCK


@compiled
def _after(task: Any, memory: Any, which: int) -> None:
    """The phases after a margin has come down to zero."""
    count, x, time = memory.count, memory.state, memory.now[0]
    n = len(task.torsion.by_bit)
    axial, turning = count[0], count[1] != 0
    if which == 3 and turning:
        _stop_bit(task, memory, task.torsion, 0, -task.set_speed)
        if axial != OFF:
            if axial != STUCK:
                _stop_bit(task, memory, task.axial, n, 0.0)
                _note(memory, AXIAL_STICK)
            count[0] = STUCK
        count[1] = 0
        _note(memory, STICK)
        if not _contact(task, memory, time, count[0], False, x, memory.work[8]).spare < 0.0:
            return
    if which == 3:
        count[1] = 1
        _note(memory, RELEASE)
        if axial != OFF:
            count[0] = _axial_phase(task, memory, time)
            if count[0] != STUCK:
                _note(memory, AXIAL_SLIP)
        return
    if which == 0 and axial == OFF:
        sinking = _dot(task.axial.read[1], x, n)
        _note(memory, REGAINED)
        if not turning:
            _stop_bit(task, memory, task.axial, n, 0.0)
            count[0] = STUCK
        else:
            count[0] = DOWN if sinking > 0.0 else UP
        return
    if which == 0:
        count[0] = OFF
        _note(memory, LOST)
        return
    if axial in (UP, DOWN):
        _stop_bit(task, memory, task.axial, n, 0.0)
        count[0] = _axial_phase(task, memory, time)
        _note(memory, AXIAL_STICK)
        if count[0] != STUCK:
            _note(memory, AXIAL_SLIP)
        return
    count[0] = DOWN if which == 2 else UP
    _note(memory, AXIAL_SLIP)


@compiled
def _next_stop(task: Any, memory: Any) -> float:
    """Time at which something jumps or bends next."""
    stop = task.breaks[memory.count[4]]
    if task.drive.kind == SAMPLED:
        stop = min(stop, memory.count[5] * sampled_of(task.drive.numbers).period)
    return min(stop, next_reading(task.hook, memory.count[6]))


@compiled
def _turn_over(task: Any, memory: Any) -> None:
    """Pass what is due now: a break, a sample of the drive, a reading of the weight."""
    time, count, x = memory.now[0], memory.count, memory.state
    close = 1e-12 * task.duration
    while task.breaks[count[4]] <= time + close:
        count[4] += 1
        if time + close >= task.rock_until:
            for i in range(4):
                memory.rock[i] = task.rock[i]
    if task.drive.kind == SAMPLED:
        drive = sampled_of(task.drive.numbers)
        if count[5] * drive.period <= time + close:
            first = len(task.torsion.by_bit) + len(task.axial.by_bit)
            speed = _dot(task.torsion.read[3], x, 0)
            lead = path_at(task.speed, time)
            after = sampled(drive, x[first:], speed, lead, speed + task.set_speed)
            for i in range(9):
                x[first + i] = after[i]
            count[5] += 1
    if next_reading(task.hook, count[6]) <= time + close:
        read_signal(task, memory, count[6], x)
        count[6] += 1


def _advance(task: Any, memory: Any, most: int) -> int:
    """Advance a run by at most so many steps."""
    now, count, work = memory.now, memory.count, memory.work
    size = len(memory.state)
    margins = np.zeros((2, 4))
    fresh = True
    for _ in range(most):
        time = now[0]
        if time >= task.duration * (1.0 - 1e-14):
            return DONE
        _turn_over(task, memory)
        if count[2] + 2 >= len(memory.tape) or count[3] + 4 >= len(memory.events):
            return MORE
        axial, turning = count[0], count[1] != 0
        _rates(task, memory, time, axial, turning, memory.state, work[0])
        begin = _margins(task, memory, time, axial, turning, memory.state, margins[0])
        _, speed, _, _ = _bit(task, memory.state, time)
        longest = REACH * task.bit.between / max(speed, task.set_speed)
        longest = min(longest, longest_delayed(task.hook))
        h = min(now[1], longest, task.duration - time, _next_stop(task, memory) - time)
        if fresh:
            h = min(h, 1e-3 * longest)
        while True:
            error = _step(task, memory, time, h, axial, turning)
            if error <= 1.0:
                break
            h *= max(0.2, 0.9 * error**-0.2) if error < 1e30 else 0.1
            if h < 1e-13 * max(time, task.duration * 1e-3):
                return TOO_SHORT
        grown = min(5.0, 0.9 * max(error, 1e-12) ** -0.2)
        end = _margins(task, memory, time + h, axial, turning, work[7], margins[1])
        first = _used_up(margins, fresh)
        if first >= 0:
            # Bisection of the length of the step: each trial is a step of its own.
            low, high = 0.0, h
            for _ in range(60):
                trial = 0.5 * (low + high)
                _step(task, memory, time, trial, axial, turning)
                _margins(task, memory, time + trial, axial, turning, work[7], margins[1])
                over = _used_up(margins, fresh)
                if over >= 0:
                    high, first = trial, over
                else:
                    low = trial
                if high - low < CLOSE * max(time, h):
                    break
            h = high
            _step(task, memory, time, h, axial, turning)
            end = _contact(task, memory, time + h, axial, turning, work[7], work[8])
        row = memory.tape[count[2]]
        row[0], row[1], row[2] = time, h, 1.0 if axial != OFF else 0.0
        _ends(task, memory, row, 0, time, memory.state, work[0])
        _ends(task, memory, row, 3, time + h, work[7], work[6])
        row[LAST], row[LAST + 1] = begin.force, end.force
        row[LAST + 2], row[LAST + 3] = begin.torque, end.torque
        row[LAST + 5] = max(begin.depth, 0.0) * task.bit.blades
        row[LAST + 6] = max(end.depth, 0.0) * task.bit.blades
        row[LAST + 7], row[LAST + 8] = begin.top, end.top
        row[LAST + 4] = axial + (10.0 if turning else 0.0)
        if not turning:
            row[FIRST + 3], row[FIRST + 1], row[FIRST + 4] = row[FIRST], 0.0, 0.0
            row[FIRST + 2], row[FIRST + 5] = 0.0, 0.0
        count[2] += 1
        for i in range(size):
            memory.state[i] = work[7, i]
        now[0] = time + h
        fresh = False
        if first >= 0:
            _after(task, memory, first)
            fresh = True
            now[1] = longest
            if count[3] > MOST_CHANGES:
                return CHATTERS
        else:
            now[1] = h * grown
    return MORE


advance = on_disk(
    _advance,
    __file__,
    *(
        str(one.__file__)
        for one in (
            cutting_hook,
            cutting_tape,
            law_calls,
            program,
            real_drive,
            reference_rates,
            following_speed,
            stick_slip_alarm,
        )
    ),
)
"""Compiled, and kept on disk under a name that its source is part of."""
