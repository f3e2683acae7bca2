"""Numbers of programs as the kernels take them; made in `simulation.step_laws`.

What changes by the clock: set speed, nominal weight, rock.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import (
    any_of,
    at,
    by_type,
    compiled,
    inlined,
    least,
    pick,
    put,
)
from drillctl.simulation.kernels.laws import contact, law_at, load_block, load_where, weight_at
from drillctl.simulation.kernels.weight_step import acting


class NoProgram(NamedTuple):
    """Nothing changes by the clock."""

    unused: Any  # numba wants a number


class Programs(NamedTuple):
    """`drillctl.rig.program.Program` of every lane."""

    # set speed less the final one (rad/s) up to a time, zero from a time on (s)
    speed_first: Any
    speed_begin: Any
    speed_end: Any
    # nominal weight over the final one less one, likewise
    weight_first: Any
    weight_begin: Any
    weight_end: Any
    rock_until: Any  # time until which the rock is another one (s)


ROUNDING = 1e-6  # share of a step by which a moment that falls on its end may miss it


def begin_program(program: Any, before: Any, work: Any, first: int) -> None:
    """Rows at time zero; the rock there was."""
    raise NotImplementedError("compiled only")


@by_type(begin_program)
def _begin_program(program, before, work, first):
    if program.instance_class is NoProgram:
        return lambda program, before, work, first: None
    return lambda program, before, work, first: _first_rows(program, before, work, first)


@compiled
def _first_rows(program: Any, before: Any, work: Any, first: int) -> None:
    load_block(program, work, r.PROGRAM, first)
    law = law_at(program, work, r.PROGRAM)
    put(work, r.LEAD, _value(law.speed_first, law.speed_begin, law.speed_end, 0.0))
    put(work, r.NOMINAL, at(work, r.WEIGHT))
    _set_nominal(law, work, 0.0)
    load_block(before, work, r.FRICTION, first)


def advance_program(
    program: Any, friction: Any, weight: Any, work: Any, first: int, begin: float, step: float
) -> None:
    """Rows of the step from `begin` on; what jumps at its beginning has jumped."""
    raise NotImplementedError("compiled only")


@by_type(advance_program)
def _advance_program(program, friction, weight, work, first, begin, step):
    if program.instance_class is NoProgram:
        return lambda program, friction, weight, work, first, begin, step: None
    return lambda program, friction, weight, work, first, begin, step: _move(
        program, friction, weight, work, first, begin, step
    )


@inlined
def _value(first: Any, begin: Any, end: Any, time: float) -> Any:
    """A ramp to zero, at a time; of a step, the value after it."""
    ramp = pick(begin >= time, first, first * (end - time) / (end - begin))
    return pick(end <= time, 0.0, ramp)


@inlined
def _integral(first: Any, begin: Any, end: Any, time: float) -> Any:
    """Its integral from zero."""
    level = first * least(begin, time)
    passed = least(end, time) - begin
    sloped = first * passed * (1.0 - 0.5 * passed / (end - begin))
    return level + pick((begin < time) & (end > begin), sloped, 0.0)


@compiled
def _move(
    program: Any, friction: Any, weight: Any, work: Any, first: int, begin: float, step: float
) -> None:
    # A moment that falls on the end of a step does so but for rounding.
    end, late = begin + step, ROUNDING * step
    law = law_at(program, work, r.PROGRAM)
    put(work, r.LEAD, _value(law.speed_first, law.speed_begin, law.speed_end, begin + late))
    put(work, r.SHIFT, _integral(law.speed_first, law.speed_begin, law.speed_end, begin))
    put(work, r.SHIFT_NEW, _integral(law.speed_first, law.speed_begin, law.speed_end, end))
    since, now = begin - step + late, begin + late
    changes = (law.rock_until > since) & (law.rock_until <= now)
    jumps = (law.weight_end > since) & (law.weight_end <= now)
    if any_of(changes | jumps):
        _turn(program, friction, weight, work, first, now)
    _set_nominal(law, work, end - late)


@inlined
def _turn(program: Any, friction: Any, weight: Any, work: Any, first: int, now: float) -> None:
    """Put the new rock in where it is due, and let a turning bit feel what has jumped."""
    law = law_at(program, work, r.PROGRAM)
    load_where(law.rock_until <= now, friction, work, r.FRICTION, first)
    _set_nominal(law, work, now)
    direction, speed = at(work, r.DIRECTION), abs(at(work, r.BIT_SPEED))
    load = acting(weight, work)
    torque, slope = contact(law_at(friction, work, r.FRICTION), load, speed)
    turning = direction != 0.0
    put(work, r.KINETIC, pick(turning, direction * torque, at(work, r.KINETIC)))
    put(work, r.SLOPE, pick(turning, slope, at(work, r.SLOPE)))
    put(work, r.LOAD, weight_at(load, speed))
    put(work, r.REST_END, weight_at(load, speed * 0.0))


@inlined
def _set_nominal(law: Any, work: Any, time: float) -> None:
    """Nominal weight of the hour: the first number of every weight law."""
    over = _value(law.weight_first, law.weight_begin, law.weight_end, time)
    put(work, r.WEIGHT, at(work, r.NOMINAL) * (1.0 + over))
