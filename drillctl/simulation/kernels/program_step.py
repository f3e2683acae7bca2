"""Numbers of programs as the kernels take them; made in `simulation.step_laws`.

What changes by the clock: set speed, nominal weight, rock.
"""

from __future__ import annotations

import functools
import operator
from collections import namedtuple
from typing import Any, NamedTuple

from drillctl.rig.bit_rock import contact
from drillctl.rig.program import OF_A_PATH, Path, Ramp
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import any_of, exp, law_at, least, load_block, most
from drillctl.simulation.kernels.variation_step import varied
from drillctl.simulation.kernels.vectors import at, pick, put, when
from drillctl.simulation.kernels.weight_step import acting


class NoProgram(NamedTuple):
    """Nothing changes by the clock."""

    unused: Any  # numba wants a number


class Programs(NamedTuple):
    """`drillctl.rig.program.Program` of every lane, of two `Ramp`s."""

    # set speed less the final one (rad/s) up to a time, zero from a time on (s)
    speed_first: Any
    speed_begin: Any
    speed_end: Any
    # nominal weight over the final one less one, likewise
    weight_first: Any
    weight_begin: Any
    weight_end: Any
    rock_until: Any  # time until which the rock is another one (s)


LongPrograms: Any = namedtuple(  # type: ignore[misc]
    "LongPrograms",
    [*(f"{name}_{number}" for name in ("speed", "weight") for number in OF_A_PATH), "rock_until"],
)
"""The same where a value goes through several ramps, or behind a lag: two `Path`s."""

NO_LAG = 1e-12  # time constant (s) in the place of none under a line
ROUNDING = 1e-6  # share of a step by which a moment that falls on its end may miss it


def begin_program(program: Any, before: Any, work: Any, first: Any) -> None:
    """Rows at time zero; the rock there was."""
    if isinstance(program, NoProgram):
        return None
    return _first_rows(program, before, work, first)


def _first_rows(program: Any, before: Any, work: Any, first: Any) -> None:
    load_block(program, work, r.PROGRAM, first)
    law = law_at(program, work, r.PROGRAM)
    put(work, r.LEAD, _value(_speed(law), 0.0))
    put(work, r.NOMINAL, at(work, r.WEIGHT))
    _set_nominal(law, work, 0.0)
    load_block(before, work, r.FRICTION, first)


def advance_program(
    program: Any, friction: Any, weight: Any, variation: Any, work: Any, first: Any, begin: Any,
    step: Any,
) -> None:  # fmt: skip
    """Rows of the step from `begin` on; what jumps at its beginning has jumped."""
    if isinstance(program, NoProgram):
        return None
    return _move(program, friction, weight, variation, work, first, begin, step)


def _speed(law: Any) -> Any:
    """Ramp or path of the set speed."""
    return Ramp(*law[:3]) if isinstance(law, Programs) else Path(*law[: len(OF_A_PATH)])


def _weight(law: Any) -> Any:
    """Ramp or path of the nominal weight."""
    return Ramp(*law[3:6]) if isinstance(law, Programs) else Path(*law[len(OF_A_PATH) : -1])


def _value(path: Any, time: Any) -> Any:
    """A ramp or path at a time; of a step, the value after it."""
    if isinstance(path, Path):
        return _sum(_late_value(ramp, path.lag, time) for ramp in path.ramps)
    return _ramp_value(path, time)


def _integral(path: Any, time: Any) -> Any:
    """Its integral from zero."""
    if isinstance(path, Path):
        return _sum(_late_integral(ramp, path.lag, time) for ramp in path.ramps)
    return _ramp_integral(path, time)


def _sum(values: Any) -> Any:
    return functools.reduce(operator.add, values)


def _ramp_value(ramp: Any, time: Any) -> Any:
    first, begin, end = ramp
    sloped = pick(begin >= time, first, first * (end - time) / (end - begin))
    return pick(end <= time, 0.0, sloped)


def _ramp_integral(ramp: Any, time: Any) -> Any:
    first, begin, end = ramp
    level = first * least(begin, time)
    passed = least(end, time) - begin
    sloped = first * passed * (1.0 - 0.5 * passed / (end - begin))
    return level + pick((begin < time) & (end > begin), sloped, 0.0)


def _late_value(ramp: Any, lag: Any, time: Any) -> Any:
    """`Ramp.late_at` where there is a lag, else the ramp itself."""
    first, begin, end = ramp
    plain, rate = _ramp_value(ramp, time), 1.0 / most(lag, NO_LAG)
    behind = first * lag / (end - begin) * (1.0 - exp((begin - least(end, time)) * rate))
    behind = pick(end > begin, behind, first) * exp((end - most(end, time)) * rate)
    return pick(lag > 0.0, pick(begin >= time, first, plain + behind), plain)


def _late_integral(ramp: Any, lag: Any, time: Any) -> Any:
    return _ramp_integral(ramp, time) - lag * (_late_value(ramp, lag, time) - ramp.first)


def _move(
    program: Any, friction: Any, weight: Any, variation: Any, work: Any, first: Any, begin: Any,
    step: Any,
) -> None:  # fmt: skip
    # A moment that falls on the end of a step does so but for rounding.
    end, late = begin + step, ROUNDING * step
    law = law_at(program, work, r.PROGRAM)
    put(work, r.LEAD, _value(_speed(law), begin + late))
    put(work, r.SHIFT, _integral(_speed(law), begin))
    put(work, r.SHIFT_NEW, _integral(_speed(law), end))
    since, now = begin - step + late, begin + late
    changes = (law.rock_until > since) & (law.rock_until <= now)
    for ramp in _weight(law).ramps:
        changes = changes | ((ramp.end > since) & (ramp.end <= now))
    with when(any_of(changes)):
        _turn(program, friction, weight, variation, work, first, now)
    _set_nominal(law, work, end - late)


def _turn(
    program: Any, friction: Any, weight: Any, variation: Any, work: Any, first: Any, now: Any
) -> None:
    """Put the new rock in where it is due, and let a turning bit feel what has jumped."""
    law = law_at(program, work, r.PROGRAM)
    load_block(friction, work, r.FRICTION, first, law.rock_until <= now)
    _set_nominal(law, work, now)
    direction, speed = at(work, r.DIRECTION), abs(at(work, r.BIT_SPEED))
    load = acting(weight, work)
    if hasattr(friction, "torque_and_slope"):  # else it is one of the rock that it cuts
        rock = varied(law_at(friction, work, r.FRICTION), variation, work)
        torque, slope = contact(rock, load, speed, exp)
        turning = direction != 0.0
        put(work, r.KINETIC, pick(turning, torque, at(work, r.KINETIC)))
        put(work, r.SLOPE, pick(turning, slope, at(work, r.SLOPE)))
    put(work, r.LOAD, load.weight(speed))
    put(work, r.REST_END, load.weight(speed * 0.0))


def _set_nominal(law: Any, work: Any, time: Any) -> None:
    """Put in the nominal weight at a time (s): the first number of every weight law."""
    over = _value(_weight(law), time)
    put(work, r.WEIGHT, at(work, r.NOMINAL) * (1.0 + over))
