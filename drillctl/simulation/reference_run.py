"""A run of the reference solver, compiled: phases, located events, stops.

A run advances some steps at a time; between calls its whole state lies in arrays, so that the
caller can make room, show progress and be interrupted.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import types

from drillctl.arrays import aligned
from drillctl.rig.top_drive import SampledDrive
from drillctl.simulation import reference_rates as f
from drillctl.simulation import reference_steps as s
from drillctl.simulation import reference_stiff as stiff_steps
from drillctl.simulation import reference_wall as wall
from drillctl.simulation.law_calls import STATE, on_disk

LONGEST_STEP = 0.05  # longest step (s): a touch of zero speed shorter than that could go unseen
WITHIN_STEP = 2e-3
"""Longest step (s) within the printed law's tolerance: a bit passes through it in milliseconds."""
MOST_PHASES = 100_000
"""Give up beyond this many phases: the bit chatters and time no longer advances."""
CLOSE = 4.0 * 2.220446049250313e-16
"""To which an event is located, as a share of its step: four roundings of a share near 1."""

DRIVE_PERIOD = SampledDrive._fields.index("period")

DONE, MORE, TOO_SHORT, CHATTERS, NOT_FINITE = range(5)
"""How a call ends: at the end of the run, out of room or steps, or for good."""


class Clock(NamedTuple):
    """What a run is asked for, and where it is; one number an array so that calls can change it."""

    tolerance: float
    duration: float  # s
    room: int  # steps that the tape has room for
    kept: Any  # states that are kept of each step
    breaks: Any  # times at which a program begins, ends or jumps (s)
    # shape (7,): time, length of the next step, end of the piece, its begin, bit torque; margins
    now: Any
    count: Any  # shape (7,): phase, in a piece, pieces, changes, crossings, extremes, steps refused
    # shape (room, 4): begin, end, phase and first step; (room, 3): time, release or stick,
    # direction; (room, 2): time and angle, time and speed
    pieces: Any
    changes: Any
    crossings: Any
    extremes: Any


TIME, STEP, STOP, PIECE_BEGIN, BIT_TORQUE, MARGINS = range(6)
PHASE, IN_PIECE, PIECES, CHANGES, CROSSINGS, EXTREMES, REFUSED = range(7)


@f.compiled
def direction_of(phase: int) -> int:
    """Direction of slip; 0 where the bit counts as stuck."""
    return phase if abs(phase) == 1 else 0


# The edges of the printed law.


@f.compiled
def _border(rig: Any, side: int) -> float:
    return side * rig.tolerance - rig.set_speed


@f.compiled
def _beyond(rig: Any, state: Any, side: int) -> float:
    """How far the bit turns beyond an edge (rad/s), exactly zero at it."""
    return side * (state[2 * rig.nodes - 1] - _border(rig, side))


@f.compiled
def _overload(rig: Any, time: float, state: Any) -> float:
    """Pipe torque beyond the static one (N m)."""
    return abs(f.pipe_torque(rig, state)) - f.static_torque(rig, time, state)


@f.compiled
def _side(phase: int) -> int:
    """Side of the tolerance of a phase at or beyond an edge."""
    if phase == f.FORWARD_EDGE:
        return 1
    return -1 if phase == f.BACKWARD_EDGE else phase


@f.compiled
def _edge_margins(
    rig: Any, time: float, state: Any, side: int, holding: float
) -> tuple[float, float]:
    """What keeps a bit at an edge (N m): against leaving outward, and inward.

    The bit keeps its speed under the holding torque. It turns faster where Equation 5 takes
    less than that, and falls back where Equation 3 or 4 takes more.
    """
    static = f.static_torque(rig, time, state)
    within = min(max(f.pipe_torque(rig, state), -static), static)
    turning = side * f.friction(rig, time, state, side * f.bit_speed(rig, state))
    return side * (turning - holding), side * (holding - within) + f.ROUNDING * static


@f.compiled
def _printed_phase(rig: Any, unused: Any, time: float, phase: int, state: Any) -> int:
    """The phase of a bit under the printed law: by its speed, and at an edge by its margins.

    From an edge a bit goes to where it left it, be it by rounding alone; at an edge that it comes
    to it stays if both margins keep it.
    """
    side = _side(phase) if phase >= f.FORWARD_EDGE else 0
    for other in (1, -1):
        beyond = _beyond(rig, state, other)
        if side == 0 and beyond > 0.0:
            return other
        if side == 0 and beyond == 0.0:
            side = other
    if side != 0:
        holding = f.rates_of(rig, time, f.STUCK, state, unused)
        outward, inward = _edge_margins(rig, time, state, side, holding)
        if phase >= f.FORWARD_EDGE:
            if outward <= inward:
                return side
        elif outward < 0.0:
            return side
        elif inward >= 0.0:
            return f.FORWARD_EDGE if side == 1 else f.BACKWARD_EDGE
    # Equation 3 or 4: by the pipe's torque in a moment, as now it may be at its limit.
    f.rates_of(rig, time, f.CREEPING, state, unused)
    for i in range(len(state)):
        unused[i] = state[i] + f.AHEAD * unused[i]
    return f.PUSHED if _overload(rig, time + f.AHEAD, unused) > 0.0 else f.CREEPING


# What is called by its address.

BEGIN_RUN, AT_STOP, BY_ITSELF, BY_WALL = range(4)  # what there is to decide
_MARGIN = (types.float64, types.int64, types.int64, types.float64, STATE)
_DECISION = (types.float64, types.int64, types.int64, STATE, STATE)
_STOP, _WALL_MARGIN = (types.float64, STATE), (types.float64, types.int64, STATE)
_PIECE, _DRIFT = (types.float64, STATE), (types.float64, types.int64, STATE, STATE, STATE, STATE)
_margin_of, _decided = f.by_address("margin", *_MARGIN), f.by_address("decision", *_DECISION)
_started, _stopped = f.by_address("starting", STATE), f.by_address("stopping", *_STOP)
_wall_margin_of = f.by_address("wall_margin", *_WALL_MARGIN)
_work_of_piece = f.by_address("piece_work", *_PIECE)
_work_of_drift = f.by_address("drift_work", *_DRIFT)

# From phase to phase.


@f.compiled
def _put_at_end(rig: Any, time: float, phase: int, state: Any) -> None:
    """A phase ended by itself: put the bit at rest, or at an edge, not to the locator's rounding.

    Between the edges only if it ended at one, and not where Equations 3 and 4 met.
    """
    last = 2 * rig.nodes - 1
    if rig.tolerance == 0.0:
        state[last] = -rig.set_speed
        return
    side = _side(phase)
    if phase in (f.CREEPING, f.PUSHED):
        side = 1 if f.bit_speed(rig, state) > 0.0 else -1
        to_edge = abs(_beyond(rig, state, side)) / rig.tolerance
        static = f.static_torque(rig, time, state)
        if abs(_overload(rig, time, state)) / static < to_edge:
            return
    state[last] = _border(rig, side)


# Stops.


@f.compiled
def _next_stop(rig: Any, clock: Any, time: float) -> float:
    """Next time (s) at which a controller works, a signal is read or a program turns."""
    stop = clock.duration
    if rig.drive_kind == f.SAMPLED:
        period = f.law(rig, f.DRIVE)[DRIVE_PERIOD]
        stop = min(stop, (math.floor(time / period * (1.0 + 1e-12)) + 1.0) * period)
    if rig.weight_kind != f.AT_ONCE:
        path = f.law(rig, f.PATH)
        delay, every, window = path[f.DELAY], path[f.PERIOD], path[f.WINDOW]
        if rig.weight_kind == f.ALARMED:
            k = max(1.0, math.floor((time - delay + f.LATE) / window) + 1.0)
            stop = min(stop, k * window + delay)
        elif every > 0.0:
            k = max(0.0, math.floor((time - delay + f.LATE) / every) + 1.0)
            stop = min(stop, k * every + delay)
        elif delay > 0.0:  # the method of steps: what comes late is known before it is asked for
            stop = min(stop, time + delay)
    if rig.spread > 0.0 and rig.advance > 0.0:  # where the path has a kink
        every = rig.spacing / rig.advance
        stop = min(stop, (math.floor(time / every * (1.0 + 1e-12)) + 1.0) * every)
    for moment in clock.breaks:
        if moment > time:
            return min(stop, moment)
    return stop


@f.compiled
def _stop(rig: Any, time: float, state: Any) -> float:
    """What happens at a stop, of drives and weights that read at times."""
    if rig.drive_kind == f.SAMPLED:
        turns = time / f.law(rig, f.DRIVE)[DRIVE_PERIOD]
        if abs(turns - round(turns)) < 1e-6:
            f.sample_drive(rig, time, state)
    if rig.weight_kind != f.AT_ONCE:
        f.read_weight(rig, time, state)
    return 0.0


# Events.


@f.compiled
def _margin(rig: Any, time: float, phase: int, which: int, torque: float, state: Any) -> float:
    """What is left until a phase ends, by its first or second way to end; 1 if there is none.

    Exactly zero is where the phase came from, in a step too short to move the bit.
    """
    tiny = 1e-300
    if which == 1 and rig.wall_nodes >= 0:
        return _wall_margin_of(rig, time, phase, state)
    if which == 1 and phase not in (f.CREEPING, f.PUSHED):
        return 1.0
    if phase == f.STUCK:
        return f.static_torque(rig, time, state) - abs(torque)
    if phase >= f.FORWARD_EDGE:
        outward, inward = _edge_margins(rig, time, state, _side(phase), torque)
        return min(outward, inward)
    if phase >= f.CREEPING:
        if which == 1:
            over = _overload(rig, time, state)
            return over if phase == f.PUSHED else -over
        return min(-_beyond(rig, state, 1), -_beyond(rig, state, -1)) or tiny
    if rig.tolerance > 0.0:
        return _beyond(rig, state, phase) or tiny
    if rig.set_valued:
        return phase * f.bit_speed(rig, state) or tiny
    return 1.0


@f.compiled
def _wall_margin(rig: Any, time: float, phase: int, state: Any) -> float:
    """What is left until some node of the wall changes, the bit's critical speed among that."""
    n, table, least = rig.nodes, f.wall_of(rig), 1.0
    if rig.wall_nodes > 0:
        f.rates_of(rig, time, phase, state, f.scratch_of(rig))
    for k in range(rig.wall_nodes):
        speed = state[n + int(table[wall.NODE, k])] + rig.set_speed
        margin = wall.margin_of(table, k, speed, rig.wall_ratio, rig.wall_critical)
        least = min(least, margin)
    if abs(phase) == 1 and rig.wall_ratio < 1.0 and not rig.drifts:
        ahead = phase * f.bit_speed(rig, state)
        least = min(least, wall.to_critical(ahead, rig.bit_level, rig.wall_critical))
    return least


@f.compiled
def _turn_wall(rig: Any, time: float, phase: int, state: Any) -> None:
    """Change the nodes whose margins are used up, at least the one that has the least left."""
    n, table = rig.nodes, f.wall_of(rig)
    ratio, critical = rig.wall_ratio, rig.wall_critical
    # An event that was located to the last bit looks like the place that a node came from: the one
    # with the least left changes in any case.
    least = _wall_margin(rig, time, phase, state)
    for k in range(rig.wall_nodes):
        i = n + int(table[wall.NODE, k])
        speed = state[i] + rig.set_speed
        margin = wall.margin_of(table, k, speed, ratio, critical)
        if margin <= least or (margin <= wall.SAME and margin != 1e-300):
            stuck = table[wall.MODE, k] == 0.0
            exact = wall.turn_node(table, k, speed, ratio, critical)
            if not stuck:
                state[i] = exact - rig.set_speed
    if abs(phase) == 1 and ratio < 1.0 and not rig.drifts:
        ahead = phase * f.bit_speed(rig, state)
        if abs(ahead - critical) <= max(abs(least), wall.SAME):
            rig.bit_level = ratio if rig.bit_level == 1.0 else 1.0
            state[2 * n - 1] = phase * critical - rig.set_speed


@f.compiled
def _settle(rig: Any, time: float, phase: int, state: Any) -> int:
    """Make the sets of nodes that stick, the bit among them, agree with the torques; the phase."""
    n, table, rates = rig.nodes, f.wall_of(rig), f.scratch_of(rig)
    for _ in range(wall.MOST_TURNS):
        f.factorise_anew(rig)
        holding = f.rates_of(rig, time, phase, state, rates)
        changed = False
        for k in range(rig.wall_nodes):
            i = int(table[wall.NODE, k])
            push = f.band(rig, f.MASS)[i] * rates[n + i]
            if wall.settle_node(table, k, state[n + i] + rig.set_speed, push):
                changed = True
        static = f.static_torque(rig, time, state)
        if phase == f.STUCK and abs(holding) > static * (1.0 + 1e-12):
            phase, changed = 1 if holding > 0.0 else -1, True
        if not changed:
            break
    f.factorise_anew(rig)
    return phase


@f.compiled
def _begin_wall(rig: Any, state: Any) -> None:
    """Nodes at rest stick, others slide."""
    table = f.wall_of(rig)
    for k in range(rig.wall_nodes):
        speed = state[rig.nodes + int(table[wall.NODE, k])] + rig.set_speed
        table[wall.MODE, k] = 0.0 if speed == 0.0 else math.copysign(1.0, speed)
        slow = abs(speed) <= rig.wall_critical
        if rig.drifts:
            table[wall.MODE, k] = wall.DRIFTS
            slow = abs(speed) <= table[wall.CRITICAL, k] > 0.0
        table[wall.LEVEL, k] = 1.0 if slow else rig.wall_ratio
    slow = abs(f.bit_speed(rig, state)) <= rig.wall_critical
    rig.bit_level = 1.0 if slow else rig.wall_ratio
    f.factorise_anew(rig)


@f.compiled
def _decide_with_wall(rig: Any, time: float, phase: int, what: int, state: Any, unused: Any) -> int:
    """What happens between two pieces, the nodes of the wall included; the phase that follows."""
    if what == BEGIN_RUN:
        _begin_wall(rig, state)
    if what == BY_WALL:
        _turn_wall(rig, time, phase, state)
        f.factorise_anew(rig)
        return _settle(rig, time, phase, state)
    after = _decide(rig, time, phase, what, state, unused)
    if after != phase and what != BEGIN_RUN:
        rig.bit_level = 1.0
    return _settle(rig, time, after, state)


@f.compiled
def _decide(rig: Any, time: float, phase: int, what: int, state: Any, unused: Any) -> int:
    """What happens to the bit between two pieces; returns the phase that follows.

    A bit that came to rest sticks if the rock can hold it. A bit that was stuck may be loose at
    once after a stop, by a jump of weight or torque.
    """
    if what == BEGIN_RUN and rig.weight_kind != f.AT_ONCE:
        _started(rig, state)
    if what == BY_ITSELF:
        _put_at_end(rig, time, phase, state)
    elif rig.drive_kind == f.SAMPLED or rig.weight_kind != f.AT_ONCE:
        _stopped(rig, time, state)
    if what == AT_STOP and abs(phase) == 1:
        return phase
    if rig.tolerance > 0.0:
        return _printed_phase(rig, unused, time, phase if what == BY_ITSELF else 0, state)
    speed = f.bit_speed(rig, state)
    if not rig.set_valued or (what == BEGIN_RUN and speed > 0.0):
        return 1
    if what == BEGIN_RUN and speed < 0.0:
        return -1
    holding = f.rates_of(rig, time, f.STUCK, state, unused)
    slack = 1.0 + 1e-12 if what == AT_STOP else 1.0
    # A bit that was held is not held again at once: where a rock without weight bears no torque,
    # and there is none, the phase would end for ever.
    released = what == BY_ITSELF and phase == f.STUCK
    if not released and abs(holding) <= f.static_torque(rig, time, state) * slack:
        return f.STUCK
    return 1 if holding > 0.0 else -1


@cache
def addresses(drive: int, weight: int, walled: bool) -> dict[str, int]:
    """Where the functions lie that a rig is run with, by the fields of `RIG`.

    Those alone that kinds of drive and weight, and a wall, ask for: compiling takes seconds.
    """
    used = {
        "rates": (f.rates_in_place, *f.RATES), "weighing": (f.weight_in_place, *f.WEIGHING),
        "margin": (_margin, *_MARGIN),
        "decision": (_decide_with_wall if walled else _decide, *_DECISION),
    }  # fmt: skip
    if drive != f.IDEAL:
        used["driving"] = f.drive_in_place, *f.DRIVING
    if weight != f.AT_ONCE:
        used |= {
            "following": (f.follow_in_place, *f.FOLLOWING), "starting": (f.begin_weight, STATE),
        }  # fmt: skip
    if drive == f.SAMPLED or weight != f.AT_ONCE:
        used["stopping"] = _stop, *_STOP
    if walled:
        used |= {
            "pushing": (f.push_in_place, *f.PUSHING), "holding": (f.hold_in_place, *f.PUSHING),
            "wall_margin": (_wall_margin, *_WALL_MARGIN), "piece_work": (_add_work, *_PIECE),
            "drift_work": (_add_drift_work, *_DRIFT),
        }  # fmt: skip
    return {name: int(f.callable_at(*one).address) for name, one in used.items()}


@f.compiled
def _value(which: int, rig: Any, work: Any, row: Any, phase: int, share: float) -> float:
    """A function of the share of a step: margins (0, 1), bit speed (2), its slope (3)."""
    if which == 2:
        return f.on_tape(row, f.BIT_SPEED, share)
    if which == 3:
        return f.slope_on_tape(row, f.BIT_SPEED, share)
    time, torque = row[f.BEGIN] + share * row[f.LENGTH], 0.0
    s.state_at(work, share, work.trial)
    if f.is_held(phase):
        torque = f.rates_of(rig, time, phase, work.trial, work.stages[1])
    return _margin_of(rig, time, phase, which, torque, work.trial)


@f.compiled
def _locate(
    which: int, rig: Any, work: Any, row: Any, phase: int, low_value: float, high_value: float
) -> float:
    """The share of a step at which a function changes its sign (Chandrupatla 1997)."""
    a, fa, b, fb = 1.0, high_value, 0.0, low_value
    c, fc, t = a, fa, 0.5
    for _ in range(100):
        x = a + t * (b - a)
        fx = _value(which, rig, work, row, phase, x)
        if (fx > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, b, fc, fb = b, a, fb, fa
        a, fa = x, fx
        best, least = (a, fa) if abs(fa) < abs(fb) else (b, fb)
        limit = CLOSE / abs(b - c) if b != c else 1.0
        if limit > 0.5 or least == 0.0:
            return best
        ratio, third = (a - b) / (c - b), (fa - fb) / (fc - fb)
        if third * third < ratio and (1.0 - third) ** 2 < 1.0 - ratio:
            t = fa / (fb - fa) * fc / (fb - fc)
            t += (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        else:
            t = 0.5
        t = min(max(t, limit), 1.0 - limit)
    return a


# The run.


@on_disk
def begin(rigs: Any, clock: Any, work: Any, state: Any) -> None:
    """Time zero: the weight's reading, the controller's first sample, the first phase."""
    clock.count[PHASE] = int(_decided(rigs[0], 0.0, 1, BEGIN_RUN, state, work.trial))


@f.compiled
def _begin_piece(rig: Any, method: Any, clock: Any, work: Any, state: Any) -> None:
    now, phase = clock.now, clock.count[PHASE]
    time = now[TIME]
    torque = f.rates_of(rig, time, phase, state, work.stages[0])
    now[STOP], now[PIECE_BEGIN] = _next_stop(rig, clock, time), time
    now[STEP] = s.first_length(
        rig, work, time, now[STOP], _longest(phase), clock.tolerance, method.order, phase, state
    )
    now[BIT_TORQUE] = torque
    for which in range(2):
        now[MARGINS + which] = _margin_of(rig, time, phase, which, torque, state)
    clock.pieces[clock.count[PIECES], 3] = rig.steps
    if rig.wall_nodes > 0:
        table = f.wall_of(rig)
        for k in range(rig.wall_nodes):
            clock.pieces[clock.count[PIECES], 4 + k] = table[wall.MODE, k]
            table[wall.ANGLE, k] = state[int(table[wall.NODE, k])]
    clock.count[IN_PIECE] = 1


@f.compiled
def _longest(phase: int) -> float:
    return WITHIN_STEP if phase >= f.CREEPING else LONGEST_STEP


@f.compiled
def _end_piece(rig: Any, clock: Any, work: Any, state: Any, what: int) -> None:
    """Close a piece, and go over to the next phase."""
    count, time = clock.count, clock.now[TIME]
    phase, piece = count[PHASE], clock.pieces[count[PIECES]]
    piece[0], piece[1], piece[2] = clock.now[PIECE_BEGIN], time, phase
    count[PIECES] += 1
    count[IN_PIECE] = 0
    if rig.wall_nodes > 0 and not rig.drifts:
        _work_of_piece(rig, time - piece[0], state)
    if time >= clock.duration:
        return
    after = int(_decided(rig, time, phase, what, state, work.trial))
    if after == phase and what != BY_ITSELF:
        return
    count[PHASE] = after
    change, direction = clock.changes[count[CHANGES]], direction_of(after)
    change[0], change[1], change[2] = time, direction != 0, direction
    # A change between two phases of a bit that counts as stuck is none for the user.
    change[3] = direction != 0 or direction_of(phase) != 0
    count[CHANGES] += 1


@f.compiled
def _add_work(rig: Any, length: float, state: Any) -> float:
    """Work of the wall in a piece: torques that stayed, times angles."""
    table = f.wall_of(rig)
    for k in range(rig.wall_nodes):
        turned = state[int(table[wall.NODE, k])] - table[wall.ANGLE, k] + rig.set_speed * length
        torque = table[wall.MODE, k] * table[wall.LEVEL, k] * table[wall.FRICTION, k]
        rig.wall_work += torque * turned
    return 0.0


@f.compiled
def _add_drift_work(
    rig: Any, length: float, whole: int, before: Any, after: Any, rates: Any, rates_after: Any
) -> float:
    """The same of a string that drifts, in a step: the mean power of its ends.

    Of a `whole` step corrected by the rates of that, to fourth order.
    """
    n, table, frame = rig.nodes, f.wall_of(rig), rig.set_speed
    first, last = before[n : 2 * n], after[n : 2 * n]
    power = wall.drift_power(table, first, frame)
    power += wall.drift_power(table, last, frame)
    rig.wall_work += 0.5 * length * power
    if whole:
        bent = wall.drift_power_rate(table, first, frame, rates[n : 2 * n])
        bent -= wall.drift_power_rate(table, last, frame, rates_after[n : 2 * n])
        rig.wall_work += bent * length**2 / 12.0
    return 0.0


@f.compiled
def _has_room(rig: Any, clock: Any) -> bool:
    count = clock.count
    return (
        rig.steps + 1 < clock.room
        and count[PIECES] + 1 < len(clock.pieces)
        and count[CHANGES] + 1 < len(clock.changes)
        and count[CROSSINGS] + 1 < len(clock.crossings)
        and count[EXTREMES] + 1 < len(clock.extremes)
    )


@f.compiled
def _trial(
    rig: Any, method: Any, solver: Any, clock: Any, work: Any, state: Any, step: float,
    torque: float,
) -> tuple[float, float]:  # fmt: skip
    """One trial step: the bit torque at its end, and its error over the tolerance."""
    time, phase = clock.now[TIME], clock.count[PHASE]
    if solver is not None:
        torques = torque, clock.now[BIT_TORQUE]
        end = stiff_steps.stiff_step(
            rig, method.implicit, work, solver, time, step, phase, state, torques
        )
        return end, stiff_steps.stiff_error(work, clock.tolerance, state)
    end = s.explicit_step(rig, method.explicit, work, time, step, phase, state)
    return end, s.explicit_error(method.explicit, work, step, clock.tolerance, state)


@f.compiled
def _try_step(
    rig: Any, method: Any, solver: Any, clock: Any, work: Any, state: Any
) -> tuple[float, float]:
    """Take a step within the tolerance; its length, 0 if there is none, and the bit torque."""
    now, phase = clock.now, clock.count[PHASE]
    time, end = now[TIME], now[STOP]
    # A step of fewer units in the last place of the time would be mostly rounding.
    least = 10.0 * (math.nextafter(time, math.inf) - time)
    length, refused, torque = min(max(now[STEP], least), _longest(phase)), False, 0.0
    power = -1.0 / method.order
    if solver is not None:
        torque = stiff_steps.linearise(rig, solver, time, phase, state, work.stages[0])
        stiff_steps.change_with_time(rig, solver, time, length, phase, state, work.stages[0])
    while length >= least:
        step = min(length, end - time)
        bit_torque, error = _trial(rig, method, solver, clock, work, state, step, torque)
        if error < 1.0:
            factor = s.LARGEST if error == 0.0 else min(s.LARGEST, s.SAFETY * error**power)
            now[STEP] = step * (min(1.0, factor) if refused else factor)
            return step, bit_torque
        refused = True
        clock.count[REFUSED] += 1
        factor = s.SMALLEST
        if error < math.inf:
            factor = max(s.SMALLEST, s.SAFETY * error**power)
        length = step * factor
    return 0.0, 0.0


@f.compiled
def _keep_step(
    rig: Any, method: Any, solver: Any, clock: Any, work: Any, sums: Any, state: Any, step: float,
    torque: float,
) -> int:  # fmt: skip
    """Record a step and its events, move on; how the phase ended, `AT_STOP` if it did not."""
    now, phase, last = clock.now, clock.count[PHASE], 2 * rig.nodes - 1
    time = now[TIME]
    if solver is None:
        s.explicit_dense(rig, method.explicit, work, time, step, phase, state)
    row = f.tape_row(rig, rig.steps)
    summed = sums[0 if f.is_held(phase) else 1]
    s.record(method.dense, work, time, step, state, summed, clock.kept, row)
    if rig.wall_nodes > 0:  # which holds nodes of the wall, no sum tells the bit's torque
        place = f.FIRST + 8 * (len(clock.kept) + 2)
        for i in range(2, 8):
            row[place + i] = 0.0
        row[place], row[place + 1] = now[BIT_TORQUE], torque - now[BIT_TORQUE]
    rig.steps += 1
    values, until, what = work.values, 2.0, AT_STOP
    values[2], values[3] = state[last], work.stages[0, last]
    for which in range(2):
        values[which] = now[MARGINS + which]
        values[4 + which] = _margin_of(rig, time + step, phase, which, torque, work.after)
    values[6], values[7] = work.after[last], work.stages[s.STAGES, last]
    for which in range(2):
        now[MARGINS + which] = values[4 + which]
    for which in range(4):
        before, after = values[which], values[4 + which]
        if not _happens(which, phase, before, after):
            continue
        if which < 2 and until == 2.0:
            s.record(method.dense, work, time, step, state, work.none, work.every, work.whole)
        share = _locate(which, rig, work, row, phase, before, after)
        if which < 2 and share < until:
            until = share
            what = BY_WALL if which == 1 and rig.wall_nodes >= 0 else BY_ITSELF
        elif which < 2:
            continue
        elif share <= until:
            _note(which, clock, row, share)
    if until <= 1.0:
        now[TIME] = time + until * step
        s.state_at(work, until, work.trial)
        if rig.drifts:
            rates = work.stages[0]
            _work_of_drift(rig, until * step, 0, state, work.trial, rates, rates)
        f.copy(state, work.trial)
        return what
    if rig.drifts:
        rates, ends = work.stages[0], work.stages[s.STAGES]
        _work_of_drift(rig, step, 1, state, work.after, rates, ends)
    now[TIME] = now[STOP] if step == now[STOP] - time else time + step
    f.copy(state, work.after)
    f.copy(work.stages[0], work.stages[s.STAGES])
    now[BIT_TORQUE] = torque
    return AT_STOP


@f.compiled
def _happens(which: int, phase: int, before: float, after: float) -> bool:
    """Whether an event lies within a step: a margin comes down to zero, a value changes sign."""
    down = before >= 0.0 and after <= 0.0
    if which < 2:
        return down
    return abs(phase) == 1 and (down or (before <= 0.0 and after >= 0.0))


@f.compiled
def _note(which: int, clock: Any, row: Any, share: float) -> None:
    """Keep when the bit turned at the set speed, and its angle; or of an extreme, its speed."""
    count = clock.count
    at, value = (CROSSINGS, f.BIT_ANGLE) if which == 2 else (EXTREMES, f.BIT_SPEED)
    event = (clock.crossings if which == 2 else clock.extremes)[count[at]]
    event[0], event[1] = row[f.BEGIN] + share * row[f.LENGTH], f.on_tape(row, value, share)
    count[at] += 1


@on_disk
def advance(
    rigs: Any, method: Any, solver: Any, clock: Any, work: Any, sums: Any, state: Any, steps: int
) -> int:
    """Advance a run by at most so many steps."""
    rig = rigs[0]
    now, count = clock.now, clock.count
    for _ in range(steps):
        if not count[IN_PIECE]:
            if now[TIME] >= clock.duration:
                return DONE
            _begin_piece(rig, method, clock, work, state)
        step, torque = _try_step(rig, method, solver, clock, work, state)
        if step == 0.0:
            return TOO_SHORT
        ended = _keep_step(rig, method, solver, clock, work, sums, state, step, torque)
        if ended != AT_STOP or now[TIME] >= now[STOP]:
            _end_piece(rig, clock, work, state, ended)
        if not math.isfinite(state[0]) or not math.isfinite(state[2 * rig.nodes - 1]):
            return NOT_FINITE
        if count[CHANGES] >= MOST_PHASES:
            return CHATTERS
        if not _has_room(rig, clock):
            return MORE
    return MORE


def work_for(size: int) -> s.Work:
    """Memory of the steps of a rig with so many states."""
    return s.Work(
        aligned(s.DENSE_STAGES, size), aligned(size), aligned(size), aligned(3, size),
        np.zeros(s.DENSE_STAGES), np.zeros(8),
        np.arange(size), np.zeros((0, size)), np.zeros(f.FIRST + 8 * size),
    )  # fmt: skip


class Method(NamedTuple):
    """How steps are taken."""

    order: float  # power of the length of a step that its error goes with
    explicit: s.Tableau
    implicit: stiff_steps.StiffTableau
    dense: s.Dense


def method_for(stiff: bool, nodes: int, states: int) -> tuple[Method, stiff_steps.StiffWork | None]:
    """Explicit steps, or linearly implicit ones with what they are solved with."""
    if stiff:
        method = Method(
            5.0, s.tableau(), stiff_steps.stiff_tableau(), stiff_steps.stiff_dense_output()
        )
        return method, stiff_steps.stiff_work(nodes, states)
    return Method(8.0, s.tableau(), stiff_steps.stiff_tableau(), s.explicit_dense_output()), None
