"""The equations of one rig for the reference solver, compiled: string, drive, weight and rock.

In the frame that turns at the set speed, with u the angles and v the speeds,

    M v' = -K u - C v - g Omega + e_top T_m - e_bit T_b,

where g Omega is what damping to ground takes at the set speed. In slip T_b is the torque of the
rock; while the bit keeps its speed T_b is the reaction that holds it. M is tridiagonal and
factorised from the top, so that the same factors serve the string without its last node.
"""

from __future__ import annotations

import inspect
import math
from functools import cache
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

from drillctl.arrays import Array
from drillctl.rig.program import MOST_RAMPS, Ramp
from drillctl.rig.top_drive import RealDrive, SampledDrive
from drillctl.rig.top_drive.real_drive import MEMORY, SAMPLED_MEMORY, respond, respond_held, sample
from drillctl.simulation import kernel_cache
from drillctl.simulation import reference_wall as wall
from drillctl.simulation.law_calls import (
    CALL,
    INNER,
    OPTIONS,
    STATE,
    compiled,
    from_numbers,
    jitted,
    on_disk,
    version,
)

shown = numba.njit(nogil=True, _nrt=True, **INNER)
"""Decorator of what returns an array, which numba does not compile without counting."""

STUCK, CREEPING, PUSHED, FORWARD_EDGE, BACKWARD_EDGE = 0, 2, 3, 4, 5
"""Phases beside +1 and -1 of a bit that turns; those from 2 on belong to the printed law.

Its torque jumps where the bit passes the tolerance delta, and has a kink within where the pipe's
torque passes the static one:

- `CREEPING`: Equation 3, the torque of the pipe, so that next to nothing is left to move the bit;
- `PUSHED`: Equation 4, the static torque against a larger one of the pipe;
- `FORWARD_EDGE`, `BACKWARD_EDGE`: at exactly plus or minus delta. There Equation 5 drives the bit
  into the tolerance and Equation 3 drives it out again, at once. What such chatter tends to is
  the motion in between, in the sense of Filippov: the bit keeps the speed delta, under the torque
  that this takes.
"""
IDEAL, CONTINUOUS, SAMPLED = 0, 1, 2  # how a drive works
AT_ONCE, MEASURED, OBSERVED, ALARMED = 0, 1, 2, 3  # how a weight on bit comes about
WORKS = 3  # integrals of power that every state carries: work of the drive, of the bit, of damping
READ_EVERY = 0.01  # interval (s) on which the extremes of an alarm's window are read
LATE = 1e-9  # how much after its time (s) a stop is taken to be at it
AHEAD = 1e-6
"""How far ahead (s) the pipe's torque is looked at, to tell on which side of its limit it is."""
ROUNDING = 1e-10
"""Share of the static torque under which nothing drives a bit away from an edge.

With lumped masses and no damping exactly nothing does, but for rounding.
"""


WHOLE_NUMBERS = (
    "nodes", "states", "drive_states", "weight_states", "observer_states",
    "damped", "coupled", "full",  # damping at all; M more than a diagonal; C no band
    "drive_kind", "drive_torque", "rock_torque", "static_torque", "set_valued", "smooth",
    "weight_kind", "weight",  # addresses of `law_calls` among them
    # addresses of what is compiled by itself; 0 of what a rig does without
    "rates", "margin", "decision", "weighing",
    "driving", "following", "starting", "stopping",
    "pushing", "holding", "wall_margin", "piece_work", "drift_work",
    "bands", "full_damping", "laws", "observer", "begin", "tape", "path",  # addresses of arrays
    "path_nodes", "wall", "wall_nodes", "drifts", "scratch",
    "components", "steps",  # kept of each step; on the tape
)  # fmt: skip
NUMBERS = (
    "tolerance",  # of the printed law (rad/s); 0 of any other
    "rock_until",  # s
    "set_speed",  # rad/s
    # of a rock that varies: standard deviation of its logarithm, 0 of one that does not; distance
    # of the nodes; way per time and per angle of the bit
    "spread",
    "spacing",
    "advance",
    "turns",
    "drag",  # torque of all damping to ground at the set speed (N m)
    # friction of the wall: at the bit (N m), the share of it that is left now; beyond which speed
    # (rad/s) what is left; work of the wall elsewhere (J)
    "bit_friction",
    "bit_level",
    "wall_critical",
    "wall_ratio",
    "wall_work",
)
RIG = np.dtype([(name, np.int64) for name in WHOLE_NUMBERS] + [(name, float) for name in NUMBERS])
"""A rig as the solver knows it: plain numbers, and where its arrays lie.

One pointer is all that a call passes on; tuples of arrays would be copied at each.
"""

STIFFNESS, DAMPING, SIDE_DAMPING, LOAD, SIDE_MASS, FACTOR, PIVOT, HELD_TOP, FREE_TOP, MASS = range(
    10
)
"""Rows of `bands`, shape (10, nodes): stiffness of each element (N m/rad), diagonal and side
diagonal of C (N m s/rad), g Omega (N m), diagonal and side diagonal of M (kg m2), its factors, one
over its pivots, accelerations per torque at the top with the bit held and free (1/(kg m2))."""
DRIVE, ROCK, ROCK_BEFORE, WEIGHT, PRESENT, PATH, SPEED_PROGRAM, WEIGHT_PROGRAM = range(8)
"""Rows of `laws`: the numbers of each law, of the weight law at the nominal weight of the moment,
of the path of the weight and of the programs of speed and weight."""
MOST_NUMBERS = 44  # columns of `laws`
DELAY, PERIOD, SENSOR, HOIST, RATE, WINDOW = range(6)  # of `PATH` (s; N/s)

BEGIN, LENGTH, FIRST = 0, 1, 2
"""Columns of the tape: begin (s) and length (s) of a step, then 8 numbers a component."""
TOP_ANGLE, TOP_SPEED, NEXT_ANGLE, NEXT_SPEED, BIT_ANGLE, BIT_SPEED, LAST_ANGLE = range(7)
"""Components of a tape; the memories of drive and weight follow, and two sums of states."""

_ramp = from_numbers(Ramp)
_ramp_at, _ramp_integral = jitted(Ramp.at), jitted(Ramp.integral)
_late_at = jitted(Ramp.late_at)
real_of, sampled_of = from_numbers(RealDrive), from_numbers(SampledDrive)
answer, answer_held, sampled = jitted(respond), jitted(respond_held), jitted(sample)
MEMORIES = (0, len(MEMORY), len(SAMPLED_MEMORY))  # numbers of memory of each kind of drive


@intrinsic
def view(typing_context: Any, address: Any, shape: Any) -> Any:
    """Numbers at an address as an array of some shape: `numba.carray`, which counts references."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        lengths = cgutils.unpack_tuple(builder, arguments[1])
        strides = [ir.Constant(ir.IntType(64), 8)]
        for length in reversed(lengths[1:]):
            strides.insert(0, builder.mul(strides[0], length))
        array = context.make_array(signature.return_type)(context, builder)
        place = builder.inttoptr if isinstance(address, types.Integer) else builder.bitcast
        data = place(arguments[0], array.data.type)
        populate_array(array, data, lengths, strides, 8, None)
        return array._getvalue()

    return types.Array(types.float64, shape.count, "C")(address, shape), generate


def by_address(field: str, *kinds: Any) -> Any:
    """A call of the function whose address a rig holds: of the rig and of `kinds`.

    What is called so is compiled once by itself, and not into each place that calls it. An array
    (`STATE`) is passed as the address of its numbers.
    """
    place = dict(RIG.fields or {})[field][1]

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        whole, byte = ir.IntType(64), ir.IntType(8)
        record = builder.bitcast(arguments[0], byte.as_pointer())
        spot = builder.gep(record, [ir.Constant(whole, place)])
        address = builder.load(builder.bitcast(spot, whole.as_pointer()))
        passed = [record]
        for kind, value in zip(signature.args[1:], arguments[1:], strict=True):
            is_array = isinstance(kind, types.Array)
            passed.append(
                context.make_array(kind)(context, builder, value).data if is_array else value
            )
        kind = ir.FunctionType(ir.DoubleType(), [value.type for value in passed])
        return builder.call(builder.inttoptr(address, kind.as_pointer()), passed)

    def typed(context: Any, rig: Any, *given: Any) -> Any:
        taken = [one if kind is STATE else kind for kind, one in zip(kinds, given, strict=True)]
        return types.float64(rig, *taken), generate

    names = ["context", "rig", *(f"a{k}" for k in range(len(kinds)))]
    typed.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in names]
    )
    return intrinsic(typed)


_weight_law, _drive_law = by_address("weight", *CALL), by_address("drive_torque", *CALL)
_rock_law, _static_law = by_address("rock_torque", *CALL), by_address("static_torque", *CALL)
WEIGHING = (types.float64, types.float64, STATE)
weight = by_address("weighing", *WEIGHING)
"""Weight on bit (N) at a time (s) and a bit speed in its own direction (rad/s), of a state."""
RATES = (types.float64, types.int64, STATE, STATE)
rates_of = by_address("rates", *RATES)
"""Rates of a state at a time (s) in a phase, in place; returns the torque on the bit (N m)."""
DRIVING = (types.float64, STATE, types.float64, types.float64, STATE)
_with_memory = by_address("driving", *DRIVING)
FOLLOWING = (types.float64, STATE, types.float64, STATE)
weight_rates = by_address("following", *FOLLOWING)
"""Rates of the memory of the weight at a time (s), of a state and the torque at the top (N m)."""
PUSHING = (STATE, STATE)
_push_wall, _hold_wall = by_address("pushing", *PUSHING), by_address("holding", *PUSHING)


@cache
def callable_at(function: Any, *kinds: Any) -> Any:
    """A function of a rig and of `kinds` compiled by itself; it has an `address` as it lives."""
    names = [f"a{k}" for k in range(len(kinds))]
    views = [
        f"view({name}, (rig.states,))" if kind is STATE else name
        for name, kind in zip(names, kinds, strict=True)
    ]
    name = f"{function.__name__.strip('_')}_{version()}"
    scope = {"__name__": __name__, "view": view, "function": function}
    text = (
        f"def {name}(rig, {', '.join(names)}):\n"
        f"    return float(function(rig, {', '.join(views)}))\n"
    )
    exec(compile(text, __file__, "exec"), scope)
    signature = types.float64(numba.from_dtype(RIG), *kinds)
    return kernel_cache.cfunc(signature, scope[name], **OPTIONS, fastmath={"contract"}, _nrt=False)


@shown
def band(rig: Any, row: int) -> Any:
    """A row of `bands`."""
    return view(rig.bands + 8 * row * rig.nodes, (rig.nodes,))


@shown
def law(rig: Any, row: int) -> Any:
    """A row of `laws`."""
    return view(rig.laws + 8 * row * MOST_NUMBERS, (MOST_NUMBERS,))


@shown
def wall_of(rig: Any) -> Any:
    """The table of the nodes at which the wall rubs, the bit aside."""
    return view(rig.wall, (wall.ROWS, rig.wall_nodes))


@shown
def scratch_of(rig: Any) -> Any:
    """Room for rates that nobody keeps."""
    return view(rig.scratch, (rig.states,))


@shown
def tape_row(rig: Any, step: int) -> Any:
    """A step on the tape."""
    width = FIRST + 8 * rig.components
    return view(rig.tape + 8 * step * width, (width,))


@shown
def memory_of_weight(rig: Any, state: Any) -> Any:
    """The last numbers of a state, or of its rates."""
    return state[rig.states - rig.weight_states :]


@compiled
def copy(to: Any, numbers: Any) -> None:
    """Copy numbers; numba takes a tenth of the time to compile this that a slice would take."""
    for i in range(len(to)):
        to[i] = numbers[i]


@compiled
def bit_speed(rig: Any, state: Any) -> float:
    """Absolute speed of the bit (rad/s)."""
    return state[2 * rig.nodes - 1] + rig.set_speed


@compiled
def is_held(phase: int) -> bool:
    """Whether the bit keeps its speed in a phase."""
    return phase == STUCK or phase >= FORWARD_EDGE


@compiled
def pipe_torque(rig: Any, state: Any) -> float:
    """Torque of the element next to the bit (N m), its stiffness times its twist."""
    n = rig.nodes
    return band(rig, STIFFNESS)[n - 2] * (state[n - 2] - state[n - 1])


# The string.


@shown
def _full_damping(rig: Any) -> Any:
    return view(rig.full_damping, (rig.nodes, rig.nodes))


@compiled
def _forces(rig: Any, state: Any, force: Any) -> None:
    """Torques of springs, dampers and ground on every node."""
    n = rig.nodes
    stiffness, load = band(rig, STIFFNESS), band(rig, LOAD)
    force[0] = -stiffness[0] * (state[0] - state[1]) - load[0]
    for i in range(1, n - 1):
        above = stiffness[i - 1] * (state[i - 1] - state[i])
        force[i] = above - stiffness[i] * (state[i] - state[i + 1]) - load[i]
    force[n - 1] = stiffness[n - 2] * (state[n - 2] - state[n - 1]) - load[n - 1]
    if not rig.damped:
        return
    speed = state[n : 2 * n]
    if rig.full:
        full = _full_damping(rig)
        for i in range(n):
            for j in range(n):
                force[i] -= full[i, j] * speed[j]
        return
    own, side = band(rig, DAMPING), band(rig, SIDE_DAMPING)
    for i in range(n):
        force[i] -= own[i] * speed[i]
    for i in range(n - 1):
        force[i] -= side[i] * speed[i + 1]
        force[i + 1] -= side[i] * speed[i]


@compiled
def solve_factorised(pivot: Any, factor: Any, count: int, x: Any) -> None:
    """Solve a tridiagonal system in place, of its factors and of one over its pivots.

    Each substitution waits for the one before last alone, as the last is put in by its own
    equation: the processor follows two chains at a time, in two thirds of the time.
    """
    given, last, before_last, share = x[0], x[0], 0.0, 0.0
    x[0] *= pivot[0]
    for i in range(1, count):
        own, new_share = x[i], factor[i - 1]
        value = (own - new_share * given) + new_share * share * before_last
        given, last, before_last, share = own, value, last, new_share
        x[i] = value * pivot[i]
    given, last, before_last, share = x[count - 1], x[count - 1], 0.0, 0.0
    for i in range(count - 2, -1, -1):
        own, new_share = x[i], factor[i]
        value = (own - new_share * given) + new_share * share * before_last
        given, last, before_last, share = own, value, last, new_share
        x[i] = value


@compiled
def _accelerate(rig: Any, force: Any, count: int) -> None:
    """Solve M a = f for the first `count` nodes, in place."""
    pivot = band(rig, PIVOT)
    if rig.coupled:
        solve_factorised(pivot, band(rig, FACTOR), count, force)
        return
    for i in range(count):
        force[i] *= pivot[i]


@compiled
def _damping_power(rig: Any, state: Any) -> float:
    """Power that damping takes (W)."""
    n, frame, power = rig.nodes, rig.set_speed, 0.0
    if not rig.damped:
        return 0.0
    if rig.full:
        full = _full_damping(rig)
        for i in range(n):
            for j in range(n):
                power += (state[n + i] + frame) * full[i, j] * (state[n + j] + frame)
        return power
    own, side = band(rig, DAMPING), band(rig, SIDE_DAMPING)
    for i in range(n):
        power += own[i] * (state[n + i] + frame) ** 2
    for i in range(n - 1):
        power += 2.0 * side[i] * (state[n + i] + frame) * (state[n + i + 1] + frame)
    return power


# The weight on bit.


@compiled
def on_tape(row: Any, component: int, share: float) -> float:
    """A component at a share of its step: the nested form of Hairer, Norsett & Wanner."""
    first, rest = FIRST + 8 * component, 1.0 - share
    value = row[first + 7] * share
    value = (value + row[first + 6]) * rest
    value = (value + row[first + 5]) * share
    value = (value + row[first + 4]) * rest
    value = (value + row[first + 3]) * share
    value = (value + row[first + 2]) * rest
    value = (value + row[first + 1]) * share
    return row[first] + value


@compiled
def slope_on_tape(row: Any, component: int, share: float) -> float:
    """Derivative of `on_tape` with respect to the share."""
    first = FIRST + 8 * component
    value, slope = 0.0, 0.0
    for k in range(7, 0, -1):
        value += row[first + k]
        if k % 2:
            slope = slope * share + value
            value *= share
        else:
            slope = slope * (1.0 - share) - value
            value *= 1.0 - share
    return slope


@compiled
def step_at(rig: Any, time: float) -> int:
    """The first step that ends at a time (s) or after it."""
    low, high = 0, rig.steps - 1
    while low < high:
        middle = (low + high + 1) // 2
        if tape_row(rig, middle)[BEGIN] < time:
            low = middle
        else:
            high = middle - 1
    return low


@shown
def _observer(rig: Any) -> Any:
    """Shape (3 + states, states): by torque, by speed, read, then the free motion."""
    n = rig.observer_states
    return view(rig.observer, (3 + n, n))


@compiled
def _signal(rig: Any, memory: Any, absolute: float) -> float:
    """What stands for the bit speed (rad/s), from the memory of the weight."""
    if rig.weight_kind == OBSERVED:
        estimate, read = rig.set_speed, _observer(rig)[2]
        for i in range(rig.observer_states):
            estimate += read[i] * memory[i]
        return abs(estimate)
    if rig.weight_kind == AT_ONCE or law(rig, PATH)[SENSOR] == 0.0:
        return abs(absolute)
    return memory[0]


@compiled
def past(rig: Any, time: float) -> float:
    """The signal of the weight law at a time (s) before; before the start, that of the start."""
    if time <= 0.0:
        begin = view(rig.begin, (rig.states,))
        return _signal(rig, memory_of_weight(rig, begin), bit_speed(rig, begin))
    row = tape_row(rig, step_at(rig, time))
    share = (time - row[BEGIN]) / row[LENGTH]
    first = LAST_ANGLE + 1 + rig.drive_states
    if rig.weight_kind == OBSERVED:
        estimate, read = rig.set_speed, _observer(rig)[2]
        for i in range(rig.observer_states):
            estimate += read[i] * on_tape(row, first + i, share)
        return abs(estimate)
    if law(rig, PATH)[SENSOR] == 0.0:
        return abs(on_tape(row, BIT_SPEED, share) + rig.set_speed)
    return on_tape(row, first, share)


@compiled
def path_at(numbers: Any, time: float) -> float:
    """`Path.at`, or `Ramp.at` where zeros follow its numbers."""
    lag, total = numbers[3 * MOST_RAMPS], 0.0
    for k in range(0, 3 * MOST_RAMPS, 3):
        if numbers[k] == 0.0:
            break
        ramp = _ramp(numbers[k : k + 3])
        total += _ramp_at(ramp, time) if lag == 0.0 else _late_at(ramp, lag, time)
    return total


@compiled
def path_integral(numbers: Any, time: float) -> float:
    """`Path.integral`, likewise."""
    lag, total = numbers[3 * MOST_RAMPS], 0.0
    for k in range(0, 3 * MOST_RAMPS, 3):
        if numbers[k] == 0.0:
            break
        ramp = _ramp(numbers[k : k + 3])
        total += _ramp_integral(ramp, time)
        if lag != 0.0:
            total -= lag * (_late_at(ramp, lag, time) - ramp.first)
    return total


@compiled
def _nominal(rig: Any, time: float) -> float:
    """Nominal weight (N), the first number of any law, under its program."""
    program = law(rig, WEIGHT_PROGRAM)
    if program[0] == 0.0:
        return law(rig, WEIGHT)[0]
    return law(rig, WEIGHT)[0] * (1.0 + path_at(program, time))


@compiled
def _asked(rig: Any, time: float, state: Any) -> float:
    """Weight (N) that a law with a memory asks for."""
    memory, path = memory_of_weight(rig, state), law(rig, PATH)
    nominal, reading = _nominal(rig, time), memory[rig.weight_states - 2]
    if rig.weight_kind == ALARMED:
        return nominal * reading
    if path[PERIOD] > 0.0:
        seen = reading
    elif path[DELAY] > 0.0:
        seen = past(rig, time - path[DELAY])
    else:
        seen = _signal(rig, memory, bit_speed(rig, state))
    return _weight_law(rig, law(rig, WEIGHT), seen, nominal, 0.0, 0.0)


@compiled
def weight_in_place(rig: Any, time: float, speed: float, state: Any) -> float:
    """What `weight` calls."""
    if rig.weight_kind == AT_ONCE:
        present = law(rig, PRESENT)
        present[0] = _nominal(rig, time)
        return _weight_law(rig, present, speed, 0.0, 0.0, 0.0)
    if law(rig, PATH)[HOIST] > 0.0:
        return state[rig.states - 1]
    return _asked(rig, time, state)


@compiled
def follow_in_place(rig: Any, time: float, state: Any, top_torque: float, rates: Any) -> float:
    """What `weight_rates` calls."""
    memory, out, path = memory_of_weight(rig, state), memory_of_weight(rig, rates), law(rig, PATH)
    count = rig.weight_states
    for i in range(count):
        out[i] = 0.0
    if rig.weight_kind == OBSERVED:
        top, torque, observer = state[rig.nodes], top_torque - rig.drag, _observer(rig)
        for i in range(rig.observer_states):
            rate = observer[0, i] * torque + observer[1, i] * top
            for j in range(rig.observer_states):
                rate += observer[3 + i, j] * memory[j]
            out[i] = rate
    elif path[SENSOR] > 0.0:
        out[0] = (abs(bit_speed(rig, state)) - memory[0]) / path[SENSOR]
    if path[HOIST] > 0.0:
        wanted = (_asked(rig, time, state) - memory[count - 1]) / path[HOIST]
        out[count - 1] = min(max(wanted, -path[RATE]), path[RATE])
    return 0.0


@compiled
def begin_weight(rig: Any, state: Any) -> float:
    """Reading and weight at time zero; the signal's own memory is in the state."""
    begin = view(rig.begin, (rig.states,))
    memory, count = memory_of_weight(rig, state), rig.weight_states
    memory[count - 2] = 1.0
    if rig.weight_kind != ALARMED:
        memory[count - 2] = _signal(rig, memory, bit_speed(rig, state))
    copy(begin, state)
    memory[count - 1] = _asked(rig, 0.0, state)
    copy(begin, state)
    return 0.0


@compiled
def read_weight(rig: Any, time: float, state: Any) -> None:
    """What the weight law reads at a stop."""
    memory, path = memory_of_weight(rig, state), law(rig, PATH)
    if rig.weight_kind == ALARMED:
        _read_window(rig, time, memory)
    elif path[PERIOD] > 0.0:
        k = math.floor((time - path[DELAY] + LATE) / path[PERIOD])
        if k >= 0:
            memory[rig.weight_states - 2] = past(rig, k * path[PERIOD])


@compiled
def _read_window(rig: Any, time: float, memory: Any) -> None:
    window = law(rig, PATH)[WINDOW]
    turns = (time - law(rig, PATH)[DELAY]) / window
    k = round(turns)
    if abs(turns - k) * window > LATE or k < 1:
        return
    samples = max(2, math.ceil(window / READ_EVERY) + 1)
    low, high, total = math.inf, -math.inf, 0.0
    for i in range(samples):
        speed = past(rig, (k - 1.0 + i / (samples - 1.0)) * window)
        low, high, total = min(low, speed), max(high, speed), total + speed
    reading = rig.weight_states - 2
    memory[reading] = _weight_law(
        rig, law(rig, WEIGHT), memory[reading], low, high, total / samples
    )


# The rock.


@shown
def _rock(rig: Any, time: float) -> Any:
    return law(rig, ROCK_BEFORE if time < rig.rock_until else ROCK)


@compiled
def rock_factor(rig: Any, time: float, state: Any) -> float:
    """What a rock that varies along the way multiplies its torques with."""
    if rig.spread == 0.0:
        return 1.0
    way = rig.advance * time
    if rig.turns > 0.0:
        last = rig.nodes - 1
        begin = view(rig.begin, (rig.states,))[last]
        way += rig.turns * (state[last] - begin + rig.set_speed * time)
    count = rig.path_nodes
    place = min(max(way / rig.spacing, 0.0), count - 2.0)
    node = int(place)
    path = view(rig.path, (count,))
    value = path[node] + (place - node) * (path[node + 1] - path[node])
    return math.exp(rig.spread * (value - 0.5 * rig.spread))


@compiled
def friction(rig: Any, time: float, state: Any, speed: float) -> float:
    """Torque of the rock (N m) at a bit speed in its own direction (rad/s).

    Continued smoothly past zero speed, so that the event can be located that ends the phase.
    """
    load = weight(rig, time, speed, state)
    torque = _rock_law(rig, _rock(rig, time), load, speed, 0.0, 0.0)
    return rock_factor(rig, time, state) * torque


@compiled
def static_torque(rig: Any, time: float, state: Any) -> float:
    """Largest torque on a bit at rest (N m)."""
    load = weight(rig, time, 0.0, state)
    if rig.smooth:
        torque = _rock_law(rig, _rock(rig, time), load, 0.0, 0.0, 0.0)
    else:
        torque = _static_law(rig, _rock(rig, time), load, 0.0, 0.0, 0.0)
    return rock_factor(rig, time, state) * torque + rig.bit_friction


@compiled
def slip_torque(rig: Any, time: float, state: Any, phase: int) -> float:
    """Torque on a bit that does not keep its speed (N m)."""
    speed = bit_speed(rig, state)
    if phase == CREEPING:
        return pipe_torque(rig, state)
    if phase == PUSHED:
        return math.copysign(static_torque(rig, time, state), pipe_torque(rig, state))
    direction = float(phase)
    if not rig.set_valued and rig.tolerance == 0.0:
        direction = 1.0 if speed >= 0.0 else -1.0
    of_wall = rig.bit_level * rig.bit_friction
    return direction * (friction(rig, time, state, direction * speed) + of_wall)


# The drive.


@compiled
def drive_torque(rig: Any, time: float, state: Any, free: float, gain: float, rates: Any) -> float:
    """Torque of the drive (N m); writes the rates of its memory."""
    if rig.drive_kind != IDEAL:
        return _with_memory(rig, time, state, free, gain, rates)
    angle, speed, program = state[0], state[rig.nodes], law(rig, SPEED_PROGRAM)
    if program[0] != 0.0:
        angle -= path_integral(program, time)
        speed -= path_at(program, time)
    return _drive_law(rig, law(rig, DRIVE), angle, speed, 0.0, 0.0)


@compiled
def drive_in_place(
    rig: Any, time: float, state: Any, free: float, gain: float, rates: Any
) -> float:
    """What `drive_torque` calls for a drive with a memory."""
    n, numbers, program = rig.nodes, law(rig, DRIVE), law(rig, SPEED_PROGRAM)
    speed, lead = state[n], 0.0
    if program[0] != 0.0:
        lead = path_at(program, time)
    first = 2 * n + WORKS
    memory = state[first : first + rig.drive_states]
    if rig.drive_kind == CONTINUOUS:
        torque, changes = answer(
            real_of(numbers), memory, speed, lead, speed + rig.set_speed, (free, gain)
        )
        for i in range(5):
            rates[first + i] = changes[i]
        return torque
    torque, seen, motor, impulse = answer_held(sampled_of(numbers), memory, speed)
    for i in range(rig.drive_states):
        rates[first + i] = 0.0
    rates[first], rates[first + 4], rates[first + 8] = seen, motor, impulse
    return torque


@compiled
def sample_drive(rig: Any, time: float, state: Any) -> None:
    """Let a sampled controller work."""
    n, first = rig.nodes, 2 * rig.nodes + WORKS
    speed, memory = state[n], state[first : first + rig.drive_states]
    lead = path_at(law(rig, SPEED_PROGRAM), time)
    after = sampled(sampled_of(law(rig, DRIVE)), memory, speed, lead, speed + rig.set_speed)
    for i in range(9):
        memory[i] = after[i]


# All together.


@compiled
def rates_in_place(rig: Any, time: float, phase: int, state: Any, rates: Any) -> float:
    """What `rates_of` calls."""
    n = rig.nodes
    held = is_held(phase)
    force = rates[n : 2 * n]
    for i in range(n):
        rates[i] = state[n + i]
    _forces(rig, state, force)
    if rig.wall_nodes > 0:
        _push_wall(rig, state, rates)
    at_bit, bit_torque, count = force[n - 1], 0.0, n - 1
    if not held:
        bit_torque, count = slip_torque(rig, time, state, phase), n
        force[n - 1] -= bit_torque
    _accelerate(rig, force, count)
    if held:
        force[n - 1] = 0.0
    by_top = band(rig, HELD_TOP if held else FREE_TOP)
    top_torque = drive_torque(rig, time, state, force[0], by_top[0], rates)
    for i in range(n):
        force[i] += by_top[i] * top_torque
    drift = 0.0
    if rig.wall_nodes > 0:
        drift = _hold_wall(rig, state, rates)
    if held:
        bit_torque = at_bit - band(rig, SIDE_MASS)[n - 2] * force[n - 2]
    rates[2 * n] = top_torque * (state[n] + rig.set_speed)
    rates[2 * n + 1] = bit_torque * bit_speed(rig, state)
    rates[2 * n + 2] = _damping_power(rig, state) + drift
    if rig.weight_states:
        weight_rates(rig, time, state, top_torque, rates)
    return bit_torque


@compiled
def push_in_place(rig: Any, state: Any, rates: Any) -> float:
    """Torques of the wall on what slides."""
    n = rig.nodes
    wall.push_wall(wall_of(rig), state[n : 2 * n], rig.set_speed, rates[n : 2 * n])
    return 0.0


@compiled
def hold_in_place(rig: Any, state: Any, rates: Any) -> float:
    """Torques of the wall on what it holds; the power that it takes from a drifting string (W)."""
    n = rig.nodes
    wall.hold_wall(wall_of(rig), band(rig, SIDE_MASS), rates[n : 2 * n])
    if not rig.drifts:
        return 0.0
    return wall.drift_power(wall_of(rig), state[n : 2 * n], rig.set_speed)


@compiled
def factorise_anew(rig: Any) -> None:
    """Factors of the masses, and accelerations per torque at the top, for the nodes that slide."""
    n = rig.nodes
    if rig.wall_nodes < 1:  # the bit alone: the factors have room for it held and free
        return
    wall.factorise(
        wall_of(rig), band(rig, MASS), band(rig, SIDE_MASS), band(rig, FACTOR), band(rig, PIVOT)
    )
    for row in (HELD_TOP, FREE_TOP):
        by_top = band(rig, row)
        for i in range(n):
            by_top[i] = 0.0
        by_top[0] = 1.0
        _accelerate(rig, by_top, n - 1 if row == HELD_TOP else n)


def factorised(bands: Array) -> Array:
    """`bands` with the accelerations per torque at the top, the bit held and free."""
    n = bands.shape[1]
    rig = np.zeros(1, dtype=RIG)
    rig["nodes"], rig["bands"] = n, bands.ctypes.data
    rig["coupled"] = np.any(bands[SIDE_MASS] != 0.0)
    for row, count in ((HELD_TOP, n - 1), (FREE_TOP, n)):
        bands[row] = 0.0
        bands[row, 0] = 1.0
        accelerate(rig, bands[row], count)
    return bands


@on_disk
def accelerate(rigs: Any, force: Array, count: int) -> None:
    """Solve M a = f for the first `count` nodes, in place."""
    _accelerate(rigs[0], force, count)
