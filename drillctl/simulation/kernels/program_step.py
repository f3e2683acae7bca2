"""Numbers of programs as the kernels take them; made in `simulation.step_laws`.

What changes by the clock: set speed, nominal weight, rock.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from drillctl.rig.bit_rock import contact
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import any_of, exp, law_at, least, load_block
from drillctl.simulation.kernels.vectors import at, pick, put, when
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


def begin_program(program: Any, before: Any, work: Any, first: Any) -> None:
    """Rows at time zero; the rock there was."""
    if isinstance(program, NoProgram):
        return None
    return _first_rows(program, before, work, first)


def _first_rows(program: Any, before: Any, work: Any, first: Any) -> None:
    load_block(program, work, r.PROGRAM, first)
    law = law_at(program, work, r.PROGRAM)
    put(work, r.LEAD, _value(law.speed_first, law.speed_begin, law.speed_end, 0.0))
    put(work, r.NOMINAL, at(work, r.WEIGHT))
    _set_nominal(law, work, 0.0)
    load_block(before, work, r.FRICTION, first)


def advance_program(
    program: Any, friction: Any, weight: Any, work: Any, first: Any, begin: Any, step: Any
) -> None:
    """Rows of the step from `begin` on; what jumps at its beginning has jumped."""
    if isinstance(program, NoProgram):
        return None
    return _move(program, friction, weight, work, first, begin, step)


def _value(first: Any, begin: Any, end: Any, time: Any) -> Any:
    """A ramp to zero, at a time; of a step, the value after it."""
    ramp = pick(begin >= time, first, first * (end - time) / (end - begin))
    return pick(end <= time, 0.0, ramp)


def _integral(first: Any, begin: Any, end: Any, time: Any) -> Any:
    """Its integral from zero."""
    level = first * least(begin, time)
    passed = least(end, time) - begin
    sloped = first * passed * (1.0 - 0.5 * passed / (end - begin))
    return level + pick((begin < time) & (end > begin), sloped, 0.0)


def _move(
    program: Any, friction: Any, weight: Any, work: Any, first: Any, begin: Any, step: Any
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
    with when(any_of(changes | jumps)):
        _turn(program, friction, weight, work, first, now)
    _set_nominal(law, work, end - late)


def _turn(program: Any, friction: Any, weight: Any, work: Any, first: Any, now: Any) -> None:
    """Put the new rock in where it is due, and let a turning bit feel what has jumped."""
    law = law_at(program, work, r.PROGRAM)
    load_block(friction, work, r.FRICTION, first, law.rock_until <= now)
    _set_nominal(law, work, now)
    direction, speed = at(work, r.DIRECTION), abs(at(work, r.BIT_SPEED))
    load = acting(weight, work)
    torque, slope = contact(law_at(friction, work, r.FRICTION), load, speed, exp)
    turning = direction != 0.0
    put(work, r.KINETIC, pick(turning, torque, at(work, r.KINETIC)))
    put(work, r.SLOPE, pick(turning, slope, at(work, r.SLOPE)))
    put(work, r.LOAD, load.weight(speed))
    put(work, r.REST_END, load.weight(speed * 0.0))


def _set_nominal(law: Any, work: Any, time: Any) -> None:
    """Nominal weight of the hour: the first number of every weight law."""
    over = _value(law.weight_first, law.weight_begin, law.weight_end, time)
    put(work, r.WEIGHT, at(work, r.NOMINAL) * (1.0 + over))
