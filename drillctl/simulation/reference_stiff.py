"""Linearly implicit steps of the reference solver, compiled, for stiff strings.

Rodas5P of order 5(4) with its dense output of order 4 (Steinebach, BIT Numer. Math. 63, 27,
2023). L-stable: fast modes that have died out stay out at any step. No Newton iteration: a law
with a kink cannot make one fail. Each stage solves (s I - J) u = r, s = 1 / (gamma h), with J of
the whole rig: the string leaves a tridiagonal system of its speeds,

    (s M + C + K / s) u = M r_v - K r_u / s + e_top dT_m - e_bit dT_b,

the memories of drive and weight a small full one beside it. J of the laws is by differences.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array
from drillctl.simulation import reference_rates as f
from drillctl.simulation.reference_steps import Dense

STAGES = 8
GAMMA = 0.21193756319429014
DIFFERENCE = 1e-6
"""Of the central differences that give J, over the size of what is moved: truncation, which goes
with the square, and rounding over it are then both some 1e-10 of J, below any tolerance in use."""


class StiffTableau(NamedTuple):
    """Coefficients of Rodas5P."""

    a: Any  # shape (8, 8): weights of the stages' arguments
    c: Any  # shape (8, 8): of the right-hand sides, over the step
    times: Any  # shape (8,)
    slopes: Any  # shape (8,): of the rate of change with time, times the step


def stiff_tableau() -> StiffTableau:
    """The coefficients as published."""
    last = (-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256,
            0.030198172008377946)  # fmt: skip
    rows = [
        (), (3.0,), (2.849394379747939, 0.45842242204463923),
        (-6.954028509809101, 2.489845061869568, -10.358996098473584),
        (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
        last, (*last, 1.0), (*last, 1.0, 1.0),
    ]  # fmt: skip
    shifts = [
        (), (-14.155112264123755,), (-17.97296035885952, -2.859693295451294),
        (147.12150275711716, -1.41221402718213, 71.68940251302358),
        (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
        (24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125,
         -0.6610691825249471),
        (30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783,
         -19.097331116725623, -28.087943162872662),
        (37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047,
         -40.06618937091002, -54.66780262877968, -9.48861652309627),
    ]  # fmt: skip
    times = (0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664,
             1.0, 1.0, 1.0)  # fmt: skip
    slopes = (GAMMA, -0.42387512638858027, -0.3384627126235924, 1.8046452872882734,
              2.325825639765069, 0.0, 0.0, 0.0)  # fmt: skip
    return StiffTableau(_lower(rows), _lower(shifts), np.array(times), np.array(slopes))


def stiff_dense_output() -> Dense:
    """The dense output as published, in the nested form."""
    first = (
        25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204,
        0.524948541321073, 1.1241088310450404, 0.4272876194431874, -0.17202221070155493,
    )  # fmt: skip
    second = (
        -9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796,
        20.176138334709044, 15.98066361424651, -6.789040303419874, -6.710236069923372,
    )  # fmt: skip
    third = (
        11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643,
        -52.072871366152654, -59.78993625266729, -0.15582684282751913, 4.883087185713722,
    )  # fmt: skip
    one, two, three = np.array(first), np.array(second), np.array(third)
    weights = np.zeros((STAGES, 6))
    weights[:, 0], weights[:, 1], weights[:, 2] = one, two + three, -three
    return Dense(weights, 1 + np.arange(STAGES), np.zeros(6), by_step=False)


def _lower(rows: list[tuple[float, ...]]) -> Array:
    matrix = np.zeros((STAGES, STAGES))
    for k, row in enumerate(rows):
        matrix[k, : len(row)] = row
    return matrix


class StiffWork(NamedTuple):
    """What a step is solved with: m numbers of memory, n nodes."""

    # of the string's system: shape (n,) each a row: one over the pivots, factors, answers to a
    # torque at the top and at the bit, right-hand side
    rows: Any  # shape (5, n)
    # of the memories' system
    matrix: Any  # shape (m, m)
    order: Any  # shape (m,): of its rows
    right: Any  # shape (m,)
    # J of the laws: torque of the drive and rates by top angle, speed, free acceleration, then of
    # the memory; torque of the rock by memory; rates by bit speed and by top torque
    top: Any  # shape (3 + m,)
    rates: Any  # shape (5 + m, m)
    rock: Any  # shape (1 + m,)
    change: Any  # shape (states,): rates per time
    moved: Any  # shape (2, states)


def stiff_work(nodes: int, states: int) -> StiffWork:
    """Memory of the steps of a rig."""
    m = states - 2 * nodes - f.WORKS
    return StiffWork(
        np.zeros((5, nodes)), np.zeros((m, m)), np.zeros(m, dtype=np.int64), np.zeros(m),
        np.zeros(3 + m), np.zeros((5 + m, m)), np.zeros(1 + m), np.zeros(states),
        np.zeros((2, states)),
    )  # fmt: skip


PIVOT_ROW, FACTOR_ROW, TOP_ROW, BIT_ROW, RIGHT_ROW = range(5)
BY_ANGLE, BY_SPEED, BY_FREE, BY_MEMORY = range(4)
BY_BIT, BY_TORQUE, BY_OWN = 3, 4, 5  # of the rates of the memories, after those three


# J of the laws.


@f.compiled
def linearise(rig: Any, solver: Any, time: float, phase: int, state: Any, rates: Any) -> float:
    """Take J of the laws at the begin of a step; returns the torque of the drive (N m)."""
    n, drives = rig.nodes, rig.drive_states
    first = 2 * n + f.WORKS
    gain = f.band(rig, f.HELD_TOP if f.is_held(phase) else f.FREE_TOP)[0]
    moved, out = solver.moved[0], solver.moved[1]
    f.copy(moved, state)
    solver.top[:] = 0.0
    solver.rates[:] = 0.0
    solver.rock[:] = 0.0
    # The torque of the drive follows from its own acceleration, or is known without it.
    at_top = _torque_now(rig, time, state, rates, gain, out)
    free = rates[n] - gain * at_top
    for k in range(3 + drives):  # top angle, top speed, free acceleration, own memory
        place = (0, n, -1)[k] if k < 3 else first + k - 3
        row = k if k < 3 else BY_OWN + k - 3
        size, given = DIFFERENCE * max(1.0, abs(free if k == BY_FREE else state[place])), free
        for sign in (1.0, -1.0):
            if k == BY_FREE:
                given = free + sign * size
            else:
                moved[place] = state[place] + sign * size
            solver.top[k] += sign * f.drive_torque(rig, time, moved, given, gain, out)
            for j in range(drives):
                solver.rates[row, j] += sign * out[first + j]
        if k != BY_FREE:
            moved[place] = state[place]
        solver.top[k] /= 2.0 * size
        for j in range(drives):
            solver.rates[row, j] /= 2.0 * size
    _linearise_rock(rig, solver, time, phase, state)
    _linearise_weight(rig, solver, time, state, at_top)
    return at_top


@f.compiled
def _torque_now(rig: Any, time: float, state: Any, rates: Any, gain: float, out: Any) -> float:
    """Torque of the drive (N m), from the acceleration of the top that it goes with."""
    n = rig.nodes
    torque = f.drive_torque(rig, time, state, rates[n], gain, out)
    # It is a straight line over the free acceleration: two points of it, and where they meet.
    other = f.drive_torque(rig, time, state, rates[n] - gain * torque, gain, out)
    if other == torque:
        return torque
    slope = (other - torque) / (-gain * torque)
    return torque / (1.0 + slope * gain)


@f.compiled
def _linearise_rock(rig: Any, solver: Any, time: float, phase: int, state: Any) -> None:
    moved, weights = solver.moved[0], rig.weight_states
    for k in range(0 if f.is_held(phase) else 1 + weights):  # bit speed, memory of the weight
        place = 2 * rig.nodes - 1 if k == 0 else rig.states - weights + k - 1
        slot = 0 if k == 0 else rig.drive_states + k
        size = DIFFERENCE * max(1.0, abs(state[place]))
        for sign in (1.0, -1.0):
            moved[place] = state[place] + sign * size
            solver.rock[slot] += sign * f.slip_torque(rig, time, moved, phase)
        solver.rock[slot] /= 2.0 * size
        moved[place] = state[place]


@f.compiled
def _linearise_weight(rig: Any, solver: Any, time: float, state: Any, top_torque: float) -> None:
    n, drives, weights = rig.nodes, rig.drive_states, rig.weight_states
    moved, out, last = solver.moved[0], solver.moved[1], rig.states - rig.weight_states
    for k in range(3 + weights if weights else 0):  # bit speed, top torque, top speed, own memory
        place = (2 * n - 1, -1, n)[k] if k < 3 else last + k - 3
        row = (BY_BIT, BY_TORQUE, BY_SPEED)[k] if k < 3 else BY_OWN + drives + k - 3
        by_torque, torque = place < 0, top_torque
        size = DIFFERENCE * max(1.0, abs(top_torque if by_torque else state[place]))
        for sign in (1.0, -1.0):
            if by_torque:
                torque = top_torque + sign * size
            else:
                moved[place] = state[place] + sign * size
            f.weight_rates(rig, time, moved, torque, out)
            for j in range(weights):
                solver.rates[row, drives + j] += sign * out[last + j] / (2.0 * size)
        if not by_torque:
            moved[place] = state[place]


# The linear systems.


@f.compiled
def _solve_string(solver: Any, count: int, x: Any) -> None:
    f.solve_factorised(solver.rows[PIVOT_ROW], solver.rows[FACTOR_ROW], count, x)
    for i in range(count, len(x)):
        x[i] = 0.0


@f.compiled
def _drive_by_speed(rig: Any, solver: Any, phase: int, s: float) -> tuple[float, float, float]:
    """Top acceleration per torque, what its feedback leaves of a torque, torque per top speed."""
    gain, top = f.band(rig, f.HELD_TOP if f.is_held(phase) else f.FREE_TOP)[0], solver.top
    shrink = 1.0 / (1.0 + top[BY_FREE] * gain)
    return gain, shrink, (top[BY_ANGLE] / s + top[BY_SPEED] + top[BY_FREE] * s) * shrink


@f.compiled
def _memory_by_top(j: Any, row: int, gain: float, s: float, by_speed: float) -> tuple[float, float]:
    """Rate of a memory per torque of the drive, and per top speed."""
    by_torque = j[BY_TORQUE, row] - j[BY_FREE, row] * gain
    by_top = j[BY_ANGLE, row] / s + j[BY_SPEED, row] + j[BY_FREE, row] * s
    return by_torque, by_top + by_torque * by_speed


@f.compiled
def factorise(rig: Any, solver: Any, phase: int, s: float) -> None:
    """Factorise s I - J.

    The torque of the drive changes by dT = (T_u / s + T_v + T_a s) dv + T_m dm + alone, over
    1 + T_a gain, as T follows from the acceleration of the top without it. What of that goes
    with the top speed stands on the diagonal of the string's system; the memories m of drive and
    weight pull at its ends, whence its answers to a torque at each end close their own system.
    """
    n, held = rig.nodes, f.is_held(phase)
    count = n - 1 if held else n
    mass, side_mass = f.band(rig, f.MASS), f.band(rig, f.SIDE_MASS)
    damping, side_damping = f.band(rig, f.DAMPING), f.band(rig, f.SIDE_DAMPING)
    stiffness = f.band(rig, f.STIFFNESS)
    top, m = solver.top, len(solver.right)
    gain, shrink, by_speed = _drive_by_speed(rig, solver, phase, s)
    pivot, factor = solver.rows[PIVOT_ROW], solver.rows[FACTOR_ROW]
    before = 0.0
    for i in range(count):
        spring = 0.0
        if i > 0:
            spring += stiffness[i - 1]
        if i < n - 1:
            spring += stiffness[i]
        own = s * mass[i] + damping[i] + spring / s
        if i == 0:
            own -= by_speed
        if i == n - 1:
            own += solver.rock[0]
        if i > 0:
            own -= factor[i - 1] * before
        pivot[i] = 1.0 / own
        if i < n - 1:
            before = s * side_mass[i] + side_damping[i] - stiffness[i] / s
            factor[i] = before * pivot[i]
    if m == 0:
        return
    at_top, at_bit = solver.rows[TOP_ROW], solver.rows[BIT_ROW]
    at_top[:] = 0.0
    at_bit[:] = 0.0
    at_top[0] = 1.0
    _solve_string(solver, count, at_top)
    if not held:
        at_bit[n - 1] = 1.0
        _solve_string(solver, count, at_bit)
    j = solver.rates
    for row in range(m):
        by_torque, by_top = _memory_by_top(j, row, gain, s, by_speed)
        for column in range(m):
            own = top[BY_MEMORY + column] * shrink
            rock = solver.rock[1 + column]
            value = j[BY_OWN + column, row] + by_torque * own
            value += by_top * (at_top[0] * own - at_bit[0] * rock)
            value += j[BY_BIT, row] * (at_top[n - 1] * own - at_bit[n - 1] * rock)
            solver.matrix[row, column] = (s if row == column else 0.0) - value
    _factorise_full(solver.matrix, solver.order)


@f.compiled
def _factorise_full(a: Any, order: Any) -> None:
    """Gauss with partial pivoting, in place."""
    m = len(order)
    for k in range(m):
        best = k
        for i in range(k + 1, m):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        order[k] = best
        for j in range(m):
            a[k, j], a[best, j] = a[best, j], a[k, j]
        for i in range(k + 1, m):
            a[i, k] /= a[k, k]
            for j in range(k + 1, m):
                a[i, j] -= a[i, k] * a[k, j]


@f.compiled
def _solve_full(a: Any, order: Any, x: Any) -> None:
    m = len(order)
    for k in range(m):
        x[k], x[order[k]] = x[order[k]], x[k]
    for i in range(m):
        for j in range(i):
            x[i] -= a[i, j] * x[j]
    for i in range(m - 1, -1, -1):
        for j in range(i + 1, m):
            x[i] -= a[i, j] * x[j]
        x[i] /= a[i, i]


@f.compiled
def _solve_stage(
    rig: Any, solver: Any, phase: int, s: float, state: Any, torques: tuple[float, float], r: Any
) -> None:
    """Solve (s I - J) u = r in place; `torques`: of drive and rock at the begin (N m)."""
    n, held, frame = rig.nodes, f.is_held(phase), rig.set_speed
    count = n - 1 if held else n
    first, m, top, j = 2 * n + f.WORKS, len(solver.right), solver.top, solver.rates
    mass, side_mass = f.band(rig, f.MASS), f.band(rig, f.SIDE_MASS)
    stiffness = f.band(rig, f.STIFFNESS)
    gain, shrink, by_speed = _drive_by_speed(rig, solver, phase, s)
    alone = (top[BY_ANGLE] * r[0] / s - top[BY_FREE] * r[n]) * shrink
    x = solver.rows[RIGHT_ROW]
    for i in range(n):
        value = mass[i] * r[n + i]
        if i > 0:
            value += side_mass[i - 1] * r[n + i - 1] - stiffness[i - 1] * (r[i] - r[i - 1]) / s
        if i < n - 1:
            value += side_mass[i] * r[n + i + 1] - stiffness[i] * (r[i] - r[i + 1]) / s
        x[i] = value
    x[0] += alone
    _solve_string(solver, count, x)
    by_memory, by_load = 0.0, 0.0
    if m:
        right = solver.right
        for row in range(m):
            by_torque, by_top = _memory_by_top(j, row, gain, s, by_speed)
            right[row] = r[first + row] + j[BY_ANGLE, row] * r[0] / s - j[BY_FREE, row] * r[n]
            right[row] += by_torque * alone + by_top * x[0] + j[BY_BIT, row] * x[n - 1]
        _solve_full(solver.matrix, solver.order, right)
        for row in range(m):
            by_memory += top[BY_MEMORY + row] * shrink * right[row]
            by_load += solver.rock[1 + row] * right[row]
            r[first + row] = right[row]
        at_top, at_bit = solver.rows[TOP_ROW], solver.rows[BIT_ROW]
        for i in range(n):
            x[i] += at_top[i] * by_memory - at_bit[i] * by_load
    for i in range(n):
        r[i] = (r[i] + x[i]) / s
        r[n + i] = x[i]
    top_change = alone + by_speed * x[0] + by_memory
    bit_change = solver.rock[0] * x[n - 1] + by_load
    r[2 * n] += top_change * (state[n] + frame) + torques[0] * x[0]
    r[2 * n + 1] += bit_change * (state[2 * n - 1] + frame) + torques[1] * x[n - 1]
    if rig.damped:
        own, side = f.band(rig, f.DAMPING), f.band(rig, f.SIDE_DAMPING)
        for i in range(n):
            value = own[i] * x[i]
            if i > 0:
                value += side[i - 1] * x[i - 1]
            if i < n - 1:
                value += side[i] * x[i + 1]
            r[2 * n + 2] += 2.0 * (state[n + i] + frame) * value
    for k in range(f.WORKS):
        r[2 * n + k] /= s


# The step.


@f.compiled
def stiff_step(
    rig: Any, method: Any, work: Any, solver: Any, time: float, step: float, phase: int,
    state: Any, torques: tuple[float, float],
) -> float:  # fmt: skip
    """One trial step from a linearised state; returns the bit torque at its end.

    The rates at the begin are in the first stage; the stages of the method come after it, the
    rates at the end in the thirteenth.
    """
    s, size, stages = 1.0 / (GAMMA * step), len(state), work.stages
    factorise(rig, solver, phase, s)
    for k in range(STAGES):
        u = stages[1 + k]
        if k == 0:
            f.copy(u, stages[0])
        else:
            for i in range(size):
                work.trial[i] = state[i]
            for j in range(k):
                weight = method.a[k, j]
                for i in range(size):
                    work.trial[i] += weight * stages[1 + j, i]
            f.rates_of(rig, time + method.times[k] * step, phase, work.trial, u)
        for j in range(k):
            weight = method.c[k, j] / step
            for i in range(size):
                u[i] += weight * stages[1 + j, i]
        slope = step * method.slopes[k]
        if slope != 0.0:
            for i in range(size):
                u[i] += slope * solver.change[i]
        _solve_stage(rig, solver, phase, s, state, torques, u)
    for i in range(size):
        work.after[i] = work.trial[i] + stages[STAGES, i]
    return f.rates_of(rig, time + step, phase, work.after, stages[12])


@f.compiled
def stiff_error(work: Any, tolerance: float, state: Any) -> float:
    """Estimated error of a step over the tolerance: the last stage is the difference."""
    size, total = len(state), 0.0
    for i in range(size):
        scale = tolerance + tolerance * max(abs(state[i]), abs(work.after[i]))
        total += (work.stages[STAGES, i] / scale) ** 2
    return math.sqrt(total / size)


@f.compiled
def change_with_time(rig: Any, solver: Any, time: float, step: float, phase: int, state: Any,
                     rates: Any) -> None:  # fmt: skip
    """Rates per time at the same state: of programs, and of what comes late."""
    ahead = 1e-3 * step
    f.rates_of(rig, time + ahead, phase, state, solver.change)
    for i in range(len(state)):
        solver.change[i] = (solver.change[i] - rates[i]) / ahead
