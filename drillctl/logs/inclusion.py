"""The driven set-valued inclusion at the bit, in time, compiled.

The string below a measured wave is a sum of exponentials, x' = lambda x + a u - b T, whose outputs
are the bit speed w = Re(sum c x) and one more. T is the torque of the rock: T(w) of a turning bit,
anything within the static torque of one at rest. Input and torque are straight within a step, so
that a step of a turning bit is one equation for its speed at the end, w + G T(w) = w_free; a bit
at rest has the torque that keeps it there. Where it stops or leaves, the step is parted there.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np

from drillctl.arrays import Array
from drillctl.simulation import law_calls
from drillctl.simulation.kernel_cache import on_disk
from drillctl.simulation.law_calls import INNER

inlined = numba.njit(nogil=True, _nrt=False, forceinline=True, **INNER)
"""Decorator of a part of the run: to pass its arrays to a function would take as long as a step."""

EXPONENTIAL, POINTS = 0, 1
"""Kinds of law: numbers (a1, a2, beta), or torques at the speeds of `knots`."""


class Exponentials(NamedTuple):
    """The string as the bit feels it; complex arrays of shape (states,)."""

    rates: Any  # lambda (1/s)
    drive: Any  # a
    torque: Any  # b
    speed: Any  # c, of the bit speed
    other: Any  # of the other output


class Rock(NamedTuple):
    """A law of friction at some weight."""

    kind: int
    static: float  # torque that a bit at rest can take (N m)
    numbers: Any
    knots: Any  # speeds (rad/s)


class Bit(NamedTuple):
    """What the bit does at a moment."""

    speed: float  # (rad/s)
    torque: float  # of the rock (N m)
    side: float  # 1 or -1: to which side it turns, or turned last
    rests: bool


class Step(NamedTuple):
    """A step of some length, or a part of one."""

    # shape (5, states), complex: what the state, the drive at both ends and the torque at both ends
    # give to the state at the end
    weights: Any
    length: float  # (s)
    by_first: float  # bit speed per torque at the beginning (rad/s per N m)
    by_last: float  # and at the end


KEPT, FIRST_DRIVE, LAST_DRIVE, FIRST_TORQUE, LAST_TORQUE = range(5)  # rows of `Step.weights`
LEAST_LEFT = 1e-9  # share of a step that is not worth another part
MOST_PARTS = 8  # stops and starts within a step


@inlined
def _at_rest(rock: Any) -> float:
    """Torque of a bit that turns ever more slowly (N m)."""
    return rock.numbers[1] if rock.kind == EXPONENTIAL else rock.numbers[0]


@inlined
def _torque_of(rock: Any, speed: float) -> tuple[float, float]:
    """Torque and slope at a speed of zero or more."""
    numbers, knots = rock.numbers, rock.knots
    if rock.kind == EXPONENTIAL:
        fall = (numbers[1] - numbers[0]) * math.exp(-numbers[2] * speed)
        return numbers[0] + fall, -numbers[2] * fall
    last = len(knots) - 1
    if speed >= knots[last]:
        return numbers[last], 0.0
    k = 0
    while speed >= knots[k + 1]:
        k += 1
    slope = (numbers[k + 1] - numbers[k]) / (knots[k + 1] - knots[k])
    return numbers[k] + slope * (speed - knots[k]), slope


@inlined
def _speed_of(rock: Any, gain: float, target: float, guess: float) -> float:
    """The positive root of v + gain T(v) = target: Newton, kept between bounds."""
    v = max(guess, 0.0)
    low, high = 0.0, target
    for _ in range(60):
        torque, slope = _torque_of(rock, v)
        excess = v + gain * torque - target
        if excess > 0.0:
            high = v
        else:
            low = v
        trial = v - excess / (1.0 + gain * slope)
        if not low <= trial <= high:
            trial = 0.5 * (low + high)
        if abs(trial - v) <= 1e-14 * (1.0 + v):
            return trial
        v = trial
    return v


@inlined
def _weighed(string: Any, length: float, weights: Any) -> Any:
    """A step of some length (s): integrals of straight inputs against the exponentials."""
    by_first = by_last = 0.0
    for k in range(len(string.rates)):
        z = string.rates[k] * length
        e = np.exp(z)
        if abs(z) < 1e-3:
            total = length * (1.0 + z / 2.0 + z * z / 6.0)
            last = length * (0.5 + z / 6.0 + z * z / 24.0)
        else:
            total = (e - 1.0) / string.rates[k]
            last = (e - 1.0 - z) / (string.rates[k] * z)
        weights[KEPT, k] = e
        weights[FIRST_DRIVE, k] = string.drive[k] * (total - last)
        weights[LAST_DRIVE, k] = string.drive[k] * last
        weights[FIRST_TORQUE, k] = string.torque[k] * (total - last)
        weights[LAST_TORQUE, k] = string.torque[k] * last
        by_first += (string.speed[k] * weights[FIRST_TORQUE, k]).real
        by_last += (string.speed[k] * weights[LAST_TORQUE, k]).real
    return Step(weights, length, by_first, by_last)


@inlined
def _move(step: Any, drive: Any, torque: Any, state: Any, to: Any) -> None:
    """The state at the end of a step of drives and torques at both ends."""
    weights = step.weights
    for k in range(len(state)):
        to[k] = (
            weights[KEPT, k] * state[k]
            + weights[FIRST_DRIVE, k] * drive[0] + weights[LAST_DRIVE, k] * drive[1]
            - weights[FIRST_TORQUE, k] * torque[0] - weights[LAST_TORQUE, k] * torque[1]
        )  # fmt: skip


@inlined
def _copy(state: Any, to: Any) -> None:
    for k in range(len(state)):
        to[k] = state[k]


@inlined
def _output(row: Any, state: Any) -> float:
    total = 0.0
    for k in range(len(state)):
        total += row[k].real * state[k].real - row[k].imag * state[k].imag
    return total


@inlined
def _holding(string: Any, drive: float, state: Any) -> float:
    """Torque that keeps the speed of the bit where it is."""
    needed = per_torque = 0.0
    for k in range(len(state)):
        needed += (string.speed[k] * (string.rates[k] * state[k] + string.drive[k] * drive)).real
        per_torque += (string.speed[k] * string.torque[k]).real
    return needed / per_torque


@inlined
def _rest(string: Any, step: Any, drive: Any, state: Any, to: Any) -> None:
    """The state after a step of a bit at rest, held by a torque that is level within the step."""
    _move(step, drive, (0.0, 0.0), state, to)
    level = _output(string.speed, to) / (step.by_first + step.by_last)
    for k in range(len(state)):
        to[k] -= (step.weights[FIRST_TORQUE, k] + step.weights[LAST_TORQUE, k]) * level


@inlined
def _from_rest(
    string: Any, rock: Any, step: Any, drive: Any, bit: Any, state: Any, trial: Any, spare: Any
) -> Any:
    """The share of a step until a bit at rest leaves, and what it does then."""
    _rest(string, step, drive, state, trial)
    after = _holding(string, drive[1], trial)
    if abs(after) <= rock.static:
        _copy(trial, state)
        return 1.0, Bit(0.0, after, bit.side, True)
    # It leaves where the torque reaches the static one, straight within the step.
    side = 1.0 if after > 0.0 else -1.0
    now = min(max(side * bit.torque, -rock.static), rock.static)
    share = (rock.static - now) / (side * after - now) if side * after > now else 0.0
    if share > 0.0:
        part = _weighed(string, share * step.length, spare)
        _rest(string, part, _until(drive, share), state, state)
    return share, Bit(0.0, side * _at_rest(rock), side, False)


@inlined
def _until(drive: Any, share: float) -> tuple[float, float]:
    """The drive at both ends of the first share of a step."""
    return drive[0], drive[0] + share * (drive[1] - drive[0])


@inlined
def _from_slip(
    string: Any, rock: Any, step: Any, drive: Any, bit: Any, state: Any, trial: Any, spare: Any
) -> Any:
    """The share of a step until a turning bit stops, and what it does then."""
    side, at_rest = bit.side, _at_rest(rock)
    _move(step, drive, (bit.torque, 0.0), state, trial)
    free = side * _output(string.speed, trial)
    if free > step.by_last * at_rest:
        speed = _speed_of(rock, step.by_last, free, side * bit.speed)
        torque = side * _torque_of(rock, speed)[0]
        for k in range(len(state)):
            state[k] = trial[k] - step.weights[LAST_TORQUE, k] * torque
        return 1.0, Bit(side * speed, torque, side, False)
    share = _stop(string, step, drive, bit, side * at_rest, free, state, trial, spare)
    held = _holding(string, _until(drive, share)[1], state)
    if abs(held) <= rock.static:
        return share, Bit(0.0, held, side, True)
    side = 1.0 if held > 0.0 else -1.0  # it turns on, or back
    return share, Bit(0.0, side * at_rest, side, False)


@inlined
def _stop(
    string: Any, step: Any, drive: Any, bit: Any, end: float, free: float, state: Any, trial: Any,
    spare: Any,
) -> float:  # fmt: skip
    """Move on to where the bit stops, found by the secant of speeds with the torque at rest."""
    low, high, share = 0.0, 1.0, 0.0
    at_low, at_high = bit.side * bit.speed, free - step.by_last * abs(end)
    for _ in range(40):
        if at_low <= 0.0:
            break
        share = low + (high - low) * at_low / (at_low - at_high)
        part = _weighed(string, share * step.length, spare)
        _move(part, _until(drive, share), (bit.torque, end), state, trial)
        speed = bit.side * _output(string.speed, trial)
        if speed > 0.0:
            low, at_low = share, speed
            at_high *= 0.5  # Illinois
        else:
            high, at_high = share, speed
            at_low *= 0.5
        if abs(speed) < 1e-12 or high - low < 1e-12:
            break
    if share > 0.0:
        _copy(trial, state)
    return share


@inlined
def _at_begin(string: Any, rock: Any, rests: bool, drive: float, state: Any) -> Any:
    speed = _output(string.speed, state)
    side = 1.0 if speed >= 0.0 else -1.0
    if rests:
        return Bit(0.0, _holding(string, drive, state), side, True)
    return Bit(speed, side * _torque_of(rock, abs(speed))[0], side, False)


@inlined
def _move_on(
    string: Any, rock: Any, step: Any, drive: Any, bit: Any, state: Any, trial: Any, spare: Any
) -> Any:
    """Move on by a step, or to where the bit stops or leaves in it; its share, and the bit."""
    if bit.rests:
        return _from_rest(string, rock, step, drive, bit, state, trial, spare)
    return _from_slip(string, rock, step, drive, bit, state, trial, spare)


@inlined
def _advance(
    string: Any, rock: Any, length: float, drive: Any, rests: bool, state: Any, trial: Any,
    weights: Any, signals: Any,
) -> None:  # fmt: skip
    whole = _weighed(string, length, weights[0])
    bit = _at_begin(string, rock, rests, drive[0], state)
    for i in range(len(drive)):
        signals[0, i], signals[1, i] = bit.speed, _output(string.other, state)
        signals[2, i] = bit.torque
        if i == len(drive) - 1:
            break
        step, left, at_ends = whole, 1.0, (drive[i], drive[i + 1])
        for _ in range(MOST_PARTS):
            share, bit = _move_on(string, rock, step, at_ends, bit, state, trial, weights[1])
            left *= 1.0 - share
            if left <= LEAST_LEFT:
                break
            if share > 0.0:
                at_ends = _until(at_ends, share)[1], at_ends[1]
                step = _weighed(string, left * length, weights[2])


def _run(string, rock, length, drive, rests, state, trial, weights, signals):  # type: ignore[no-untyped-def]
    # A function of its own, as no references are counted in the others: steps are returned there.
    _advance(string, rock, length, drive, rests, state, trial, weights, signals)


_compiled_run: Any = on_disk(_run, __file__, str(law_calls.__file__))


def advance(
    string: Exponentials, rock: Rock, length: float, drive: Array, rests: bool, state: Any
) -> Array:
    """Bit speed (rad/s), other output and torque (N m) over a drive at even times (s), in rows.

    The state is that at the beginning, and then that at the end.
    """
    signals = np.empty((3, len(drive)))
    weights = np.empty((3, 5, len(state)), dtype=complex)
    _compiled_run(string, rock, length, drive, rests, state, np.empty_like(state), weights, signals)
    return signals
