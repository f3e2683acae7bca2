"""The equations of `phases.py` as numba compiles them, for integrators that take compiled ones.

All that a right-hand side needs lies in one flat array, so that it can be passed as a pointer:
[direction, kp, ki, a1 W, (a2 - a1) W, beta, set speed, static torque], the reaction's row, the two
diagonals of the stiffness, and the inverse mass by columns.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from benchmarks.job import Array
from benchmarks.peers.phases import Phases

HEAD = 8


def packed(system: Phases, direction: int) -> Array:
    """The flat array of one phase."""
    rig = system.rig
    head = [
        direction, rig.kp, rig.ki, rig.a1 * rig.weight, (rig.a2 - rig.a1) * rig.weight, rig.beta,
        rig.set_speed, system.static,
    ]  # fmt: skip
    diagonal, beside = np.diag(rig.stiffness), np.append(np.diag(rig.stiffness, 1), 0.0)
    inverse = system.turning if direction else system.stuck
    parts = [np.array(head, dtype=float), system.reaction, diagonal, beside, inverse.T.ravel()]
    return np.concatenate(parts)


@njit(fastmath=True, error_model="numpy", cache=True)
def rates(y: Array, out: Array, numbers: Array) -> None:
    """Time derivative of y, written to `out`."""
    n = (len(y) - 1) // 2
    s, kp, ki, high, fall, beta = numbers[:6]
    speed = numbers[6]
    diagonal = numbers[HEAD + 2 * n : HEAD + 3 * n]
    beside = numbers[HEAD + 3 * n : HEAD + 4 * n]
    inverse = numbers[HEAD + 4 * n :]
    for i in range(n):
        out[i] = y[n + i]
        out[n + i] = 0.0
    bit = y[2 * n - 1]
    for j in range(n):
        force = -diagonal[j] * y[j]
        if j > 0:
            force -= beside[j - 1] * y[j - 1]
        else:
            force -= kp * y[n] + ki * y[0]
        if j < n - 1:
            force -= beside[j] * y[j + 1]
        elif s != 0.0:
            force -= s * (high + fall * math.exp(min(-beta * s * (bit + speed), 50.0)))
        for i in range(n):
            out[n + i] += inverse[j * n + i] * force
    out[2 * n] = abs(bit) / speed


@njit(error_model="numpy", cache=True)
def event(y: Array, numbers: Array) -> float:
    """What ends the phase by falling through zero."""
    n = (len(y) - 1) // 2
    s, speed, static = numbers[0], numbers[6], numbers[7]
    if s != 0.0:
        return s * (y[2 * n - 1] + speed)
    held = 0.0
    for i in range(2 * n):
        held += numbers[HEAD + i] * y[i]
    return static - abs(held)


def compile_for(system: Phases) -> None:
    """Compile both, by a call, before a clock runs; views that may not be written to as CVODE's."""
    y, numbers = system.start(), packed(system, 1)
    y.flags.writeable = False
    rates(y, np.empty(len(y)), numbers)
    event(y, numbers)
