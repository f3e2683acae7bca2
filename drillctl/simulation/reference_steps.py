"""Steps of the reference solver, compiled: adaptive, with dense output.

`explicit`: the pair of order 8(5, 3) of Dormand & Prince with its dense output of order 7
(Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, 1993).

`stiff`: Rodas5P of order 5(4) with its dense output of order 4 (Steinebach, BIT Numer. Math. 63,
27, 2023): linearly implicit, so that short pieces and stiff damping do not bound the step.
"""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array, Index
from drillctl.simulation.reference_rates import BEGIN, FIRST, LENGTH, compiled, on_tape, rates_of

STAGES, DENSE_STAGES = 12, 16
TOGETHER = 4  # stages that a sum takes in at once
# Of a change of the step's length: aimed below the tolerance, as a refused step costs all of its
# stages, and bounded, as an error estimate is no guide far from the step that it is of.
SAFETY, SMALLEST, LARGEST = 0.9, 0.2, 10.0


class Tableau(NamedTuple):
    """Coefficients of DOP853: a row for each stage, its weights that are not zero first."""

    a: Any  # shape (16, 16): weights
    of: Any  # shape (16, 16): stages that they belong to
    count: Any  # shape (16,): how many, filled up to a multiple of `TOGETHER`
    c: Any  # shape (16,): times
    errors: Any  # shape (2, 16): error estimates of order 5 and 3, then
    errors_of: Any
    errors_count: Any


class Dense(NamedTuple):
    """A dense output: F1 to F6 of the nested form as sums of the stages and of the change."""

    weights: Any  # shape (stages, 6)
    of: Any  # shape (stages,): stages that these belong to
    changes: Any  # shape (6,)
    by_step: bool  # whether the stages are rates, to be multiplied with the step


@cache
def _published() -> dict[str, Any]:
    """The coefficients of DOP853; a file, as SciPy's own integrators take long to import."""
    path = Path(__file__).with_name("dop853.json")
    return dict(json.loads(path.read_text(encoding="utf-8")))


def tableau() -> Tableau:
    """The weights of the stages and of the error estimates."""
    numbers = _published()
    a, errors = np.zeros((DENSE_STAGES, DENSE_STAGES)), np.zeros((2, DENSE_STAGES))
    for k, row in enumerate(numbers["a"]):
        a[k, : len(row)] = row
    errors[:, : STAGES + 1] = numbers["fifth"], numbers["third"]
    return Tableau(*_without_zeros(a), np.array(numbers["c"]), *_without_zeros(errors))


def explicit_dense_output() -> Dense:
    """The dense output of order 7."""
    weights = np.zeros((DENSE_STAGES, 6))
    weights[0, 0], weights[[0, STAGES], 1] = 1.0, -1.0
    weights[:, 2:] = np.transpose(_published()["dense"])
    of = np.flatnonzero(np.any(weights != 0.0, axis=1))
    return Dense(weights[of], of, np.array([-1.0, 2.0, 0.0, 0.0, 0.0, 0.0]), by_step=True)


def _without_zeros(weights: Array) -> tuple[Array, Index, Index]:
    """Weights that are not zero, the columns they stand in, how many with zeros to fill up."""
    first = np.argsort(weights == 0.0, axis=1, kind="stable")
    count = np.count_nonzero(weights, axis=1)
    padded = -(-count // TOGETHER) * TOGETHER
    return np.take_along_axis(weights, first, axis=1), first, padded


class Work(NamedTuple):
    """Memory of the steps, shared by all phases of a run; rows end with zeros, see `aligned`."""

    stages: Any  # shape (16, states)
    trial: Any  # shape (states,): argument of a stage
    after: Any  # shape (states,): end of the step
    errors: Any  # shape (3, states)
    one: Any  # shape (16,): a state, or a sum of states, of each stage
    values: Any  # shape (8,): of events, at both ends of a step
    every: Any  # shape (states,): all of them, and
    none: Any  # shape (0, states): no sums, for
    whole: Any  # shape (2 + 8 states,): whole dense output of a step, where an event ends it


@compiled
def _combine(
    stages: Any, weights: Any, of: Any, count: int, step: float, state: Any, out: Any
) -> None:
    """State + step times a sum of stages, four at a time: a sum is loaded and stored less often."""
    size = len(state)
    for i in range(size):
        out[i] = state[i]
    for j in range(0, count, TOGETHER):
        a, b = step * weights[j], step * weights[j + 1]
        c, d = step * weights[j + 2], step * weights[j + 3]
        one, two, three, four = (
            stages[of[j]],
            stages[of[j + 1]],
            stages[of[j + 2]],
            stages[of[j + 3]],
        )
        for i in range(size):
            out[i] += (a * one[i] + b * two[i]) + (c * three[i] + d * four[i])


@compiled
def _product(first: Any, second: Any) -> float:
    """Scalar product in eight sums, none of which waits for another."""
    size, a, b, c, d, e, f, g, h = len(first), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    whole = size - size % 8
    for i in range(0, whole, 8):
        a += first[i] * second[i]
        b += first[i + 1] * second[i + 1]
        c += first[i + 2] * second[i + 2]
        d += first[i + 3] * second[i + 3]
        e += first[i + 4] * second[i + 4]
        f += first[i + 5] * second[i + 5]
        g += first[i + 6] * second[i + 6]
        h += first[i + 7] * second[i + 7]
    for i in range(whole, size):
        a += first[i] * second[i]
    return ((a + b) + (c + d)) + ((e + f) + (g + h))


@compiled
def _stages(
    rig: Any, method: Any, work: Any, time: float, step: float, phase: int, state: Any,
    first: int, last: int,
) -> float:  # fmt: skip
    """Rates of some stages; returns the bit torque of the last of them."""
    torque = 0.0
    for k in range(first, last):
        _combine(work.stages, method.a[k], method.of[k], method.count[k], step, state, work.trial)
        torque = rates_of(rig, time + method.c[k] * step, phase, work.trial, work.stages[k])
    return torque


@compiled
def explicit_step(
    rig: Any, method: Any, work: Any, time: float, step: float, phase: int, state: Any
) -> float:
    """One trial step from a state whose rates are in the first stage; returns the bit torque."""
    torque = _stages(rig, method, work, time, step, phase, state, 1, STAGES + 1)
    for i in range(len(state)):
        work.after[i] = work.trial[i]
    return torque


@compiled
def explicit_dense(
    rig: Any, method: Any, work: Any, time: float, step: float, phase: int, state: Any
) -> None:
    """The stages that only the dense output needs."""
    _stages(rig, method, work, time, step, phase, state, STAGES + 1, DENSE_STAGES)


@compiled
def explicit_error(method: Any, work: Any, step: float, tolerance: float, state: Any) -> float:
    """Estimated error of a step over the tolerance, as Hairer weighs the two estimates."""
    size, total, after = len(state), work.errors, work.after
    for k in range(2):
        for i in range(size):
            total[2, i] = 0.0
        _combine(
            work.stages, method.errors[k], method.errors_of[k], method.errors_count[k], 1.0,
            total[2], total[k],
        )  # fmt: skip
    for i in range(size):
        scale = 1.0 / (tolerance + tolerance * max(abs(state[i]), abs(after[i])))
        total[0, i] *= scale
        total[1, i] *= scale
    fifth, third = _product(total[0], total[0]), _product(total[1], total[1])
    if fifth == 0.0 and third == 0.0:
        return 0.0
    # The square of the estimate of order 5 (h^6) over that of order 3 (h^4) goes with h^8, as the
    # error of the pair does; the former below too, lest the latter is zero by chance.
    return step * fifth / math.sqrt((fifth + 0.01 * third) * size)


# The dense output: value = begin + x (F0 + (1 - x) (F1 + x (F2 + (1 - x) (F3 + ...)))), x the share
# of the step, F0 the change over it and the others sums of that and of the stages.


@compiled
def _record_one(
    dense: Any, unit: float, begin: float, change: float, stages: Any, row: Any, place: int
) -> None:
    a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(len(dense.of)):
        rate, weights = stages[j], dense.weights[j]
        a += weights[0] * rate
        b += weights[1] * rate
        c += weights[2] * rate
        d += weights[3] * rate
        e += weights[4] * rate
        f += weights[5] * rate
    changes = dense.changes
    row[place], row[place + 1] = begin, change
    row[place + 2], row[place + 3] = changes[0] * change + unit * a, changes[1] * change + unit * b
    row[place + 4], row[place + 5] = changes[2] * change + unit * c, changes[3] * change + unit * d
    row[place + 6], row[place + 7] = changes[4] * change + unit * e, changes[5] * change + unit * f


@compiled
def record(
    dense: Any, work: Any, time: float, step: float, state: Any, sums: Any, kept: Any, row: Any
) -> None:
    """Keep the dense output of some states and of sums of states."""
    row[BEGIN], row[LENGTH] = time, step
    stages, after, unit = work.stages, work.after, step if dense.by_step else 1.0
    of, one, moved = dense.of, work.one, work.errors[0]
    for i in range(len(state)):
        moved[i] = after[i] - state[i]
    for c in range(len(kept)):
        i = kept[c]
        for j in range(len(of)):
            one[j] = stages[of[j], i]
        _record_one(dense, unit, state[i], moved[i], one, row, FIRST + 8 * c)
    for c in range(len(sums)):
        weights = sums[c]
        count = len(weights)
        begin = _product(weights, state[:count])
        change = _product(weights, moved[:count])
        for j in range(len(of)):
            one[j] = _product(weights, stages[of[j], :count])
        _record_one(dense, unit, begin, change, one, row, FIRST + 8 * (len(kept) + c))


@compiled
def state_at(work: Any, share: float, out: Any) -> None:
    """Every state at a share of the step whose whole dense output is kept."""
    for i in range(len(out)):
        out[i] = on_tape(work.whole, i, share)


@compiled
def first_length(
    rig: Any, work: Any, time: float, end: float, longest: float, tolerance: float,
    order: float, phase: int, state: Any,
) -> float:  # fmt: skip
    """Length of a first step, from the rates and how fast they change (Hairer et al., II.4)."""
    size = len(state)
    rates, second = work.stages[0], work.stages[1]
    at_rest, moving = 0.0, 0.0
    for i in range(size):
        scale = tolerance + tolerance * abs(state[i])
        at_rest += (state[i] / scale) ** 2
        moving += (rates[i] / scale) ** 2
    at_rest, moving = math.sqrt(at_rest / size), math.sqrt(moving / size)
    guess = 1e-6 if at_rest < 1e-5 or moving < 1e-5 else 0.01 * at_rest / moving
    guess = min(guess, end - time)
    for i in range(size):
        work.trial[i] = state[i] + guess * rates[i]
    rates_of(rig, time + guess, phase, work.trial, second)
    change = 0.0
    for i in range(size):
        scale = tolerance + tolerance * abs(state[i])
        change += ((second[i] - rates[i]) / scale) ** 2
    change = math.sqrt(change / size) / guess
    if moving <= 1e-15 and change <= 1e-15:
        length = max(1e-6, guess * 1e-3)
    else:
        length = (0.01 / max(moving, change)) ** (1.0 / order)
    return min(min(100.0 * guess, length), min(end - time, longest))
