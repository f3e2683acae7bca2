"""What changes by the clock: set speed, nominal weight, rock."""

from __future__ import annotations

from typing import Any, NamedTuple

from numba.extending import overload

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import inlined
from drillctl.simulation.kernels.laws import at_lane, contact, load_block, load_lane, weight_at
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.weight_step import acting


class NoProgram(NamedTuple):
    """Nothing changes by the clock.

    Attributes
    ----------
    unused : float
        numba wants a number.
    """

    unused: Any


class Programs(NamedTuple):
    """`drillctl.program.Program` of every lane.

    Attributes
    ----------
    speed_first, speed_begin, speed_end : ndarray
        Set speed less the final one (rad/s) up to a time, zero from a time on (s).
    weight_first, weight_begin, weight_end : ndarray
        Nominal weight over the final one less one, likewise.
    rock_until : ndarray
        Time until which the rock is another one (s).
    """

    speed_first: Any
    speed_begin: Any
    speed_end: Any
    weight_first: Any
    weight_begin: Any
    weight_end: Any
    rock_until: Any


def begin_program(program: Any, before: Any, work: Any, first: int) -> None:
    """Rows at time zero; the rock there was."""
    raise NotImplementedError("compiled only")


@overload(begin_program)
def _begin_program(program, before, work, first):
    if program.instance_class is NoProgram:
        return lambda program, before, work, first: _no_program(work)
    return lambda program, before, work, first: _first_rows(program, before, work, first)


@inlined
def _no_program(work: Any) -> None:
    for lane in range(WIDTH):
        for row in (r.LEAD, r.SHIFT, r.SHIFT_NEW):
            work[row + lane] = 0.0


@inlined
def _first_rows(program: Any, before: Any, work: Any, first: int) -> None:
    _no_program(work)
    load_block(program, work, r.PROGRAM, first)
    for lane in range(WIDTH):
        law = at_lane(program, work, r.PROGRAM, lane)
        work[r.LEAD + lane] = _value(law.speed_first, law.speed_begin, law.speed_end, 0.0)
        work[r.NOMINAL + lane] = work[r.WEIGHT + lane]
        _set_nominal(law, work, lane, 0.0)
    load_block(before, work, r.FRICTION, first)


def advance_program(
    program: Any, friction: Any, weight: Any, work: Any, first: int, begin: float, step: float
) -> None:
    """Rows of the step from `begin` on; what jumps at its beginning has jumped."""
    raise NotImplementedError("compiled only")


@overload(advance_program)
def _advance_program(program, friction, weight, work, first, begin, step):
    if program.instance_class is NoProgram:
        return lambda program, friction, weight, work, first, begin, step: None
    return lambda program, friction, weight, work, first, begin, step: _move(
        program, friction, weight, work, first, begin, step
    )


@inlined
def _value(first: float, begin: float, end: float, time: float) -> float:
    """A ramp to zero, at a time; of a step, the value after it."""
    if time >= end:
        return 0.0
    return first if time <= begin else first * (end - time) / (end - begin)


@inlined
def _integral(first: float, begin: float, end: float, time: float) -> float:
    """Its integral from zero."""
    total = first * min(time, begin)
    if time > begin and end > begin:
        passed = min(time, end) - begin
        total += first * passed * (1.0 - 0.5 * passed / (end - begin))
    return total


@inlined
def _move(
    program: Any, friction: Any, weight: Any, work: Any, first: int, begin: float, step: float
) -> None:
    # A moment that falls on the end of a step does so but for rounding.
    end, late = begin + step, 1e-6 * step
    turns = 0
    for lane in range(WIDTH):
        law = at_lane(program, work, r.PROGRAM, lane)
        ramp = law.speed_first, law.speed_begin, law.speed_end
        work[r.LEAD + lane] = _value(*ramp, begin + late)
        work[r.SHIFT + lane] = _integral(*ramp, begin)
        work[r.SHIFT_NEW + lane] = _integral(*ramp, end)
        for moment in (law.rock_until, law.weight_end):
            turns += 1 if begin - step + late < moment and moment <= begin + late else 0
    if turns > 0:
        _turn(program, friction, weight, work, first, begin, late)
    for lane in range(WIDTH):
        _set_nominal(at_lane(program, work, r.PROGRAM, lane), work, lane, end - late)


@inlined
def _turn(
    program: Any, friction: Any, weight: Any, work: Any, first: int, begin: float, late: float
) -> None:
    """Put the new rock in where it is due, and let a turning bit feel what has jumped."""
    for lane in range(WIDTH):
        law = at_lane(program, work, r.PROGRAM, lane)
        if law.rock_until <= begin + late:
            load_lane(friction, work, r.FRICTION, first, lane)
        rock = at_lane(friction, work, r.FRICTION, lane)
        _set_nominal(law, work, lane, begin + late)
        direction, speed = work[r.DIRECTION + lane], abs(work[r.BIT_SPEED + lane])
        load = acting(weight, work, lane)
        torque, slope = contact(rock, load, speed)
        turning = direction != 0.0
        work[r.KINETIC + lane] = direction * torque if turning else work[r.KINETIC + lane]
        work[r.SLOPE + lane] = slope if turning else work[r.SLOPE + lane]
        work[r.LOAD + lane] = weight_at(load, speed)
        work[r.REST_END + lane] = weight_at(load, 0.0)


@inlined
def _set_nominal(law: Any, work: Any, lane: int, time: float) -> None:
    """Nominal weight of the hour: the first number of every weight law."""
    over = _value(law.weight_first, law.weight_begin, law.weight_end, time)
    work[r.WEIGHT + lane] = work[r.NOMINAL + lane] * (1.0 + over)
