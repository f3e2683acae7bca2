"""The batch engine: thousands of lanes at a fixed step, set-valued friction, no events.

`run_batch` prepares the string once, feeds blocks of lanes to the compiled kernels and turns
what they measured into arrays by name.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array, aligned
from drillctl.design.tables import SimulationTable
from drillctl.errors import InputError
from drillctl.rig.bit_rock import PrintedThreeBranch
from drillctl.rig.top_drive import RealDrive, SampledDrive
from drillctl.simulation import measures as m
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.propagator import StringStep, string_step
from drillctl.simulation.scheme import Bound, Scheme, choose_scheme, step_bounds
from drillctl.simulation.step_laws import (
    drive_step,
    observer_step,
    program_step,
    remembered,
    variation_step,
    weight_step,
    within_run,
)

Watch = NDArray[np.int64]
"""Shape (1,): runs stop once it is other than zero, by whichever thread."""

CHUNK = 16384
"""Lanes given to the kernels at a time: a fraction of a second, so that progress and an
interruption are felt."""


@dataclass(frozen=True, eq=False)
class Batch:
    """What was measured of a number of lanes."""

    # shape (lanes,): By the names of `BATCH_MEASURES`; NaN where a measure is undefined
    measures: dict[str, Array]
    status: NDArray[np.int8]  # shape (lanes,): Index into `measures.STATUSES`


@dataclass(frozen=True, eq=False)
class Prepared:
    """A string and a scheme, ready for any number of lanes."""

    stepper: StringStep  # the string's exact step
    scheme: Scheme  # step and modes
    # length of the run, and where the J1 window begins (s)
    duration: float
    j1_from: float


def prepare(lanes: Lanes, table: SimulationTable) -> Prepared:
    """Choose step and modes and prepare the string."""
    _refuse_printed_law(lanes)
    period = lanes.drive.period if isinstance(lanes.drive, SampledDrive) else None
    bounds, turns = bounds_of(lanes, table), _turns(lanes)
    scheme = choose_scheme(lanes.string, table, bounds, _shared(period), turns)
    stepper = string_step(lanes.string, scheme.step, scheme.modes, lanes.wall)
    return Prepared(stepper, scheme, table.duration, table.j1_from)


def bounds_of(lanes: Lanes, table: SimulationTable) -> tuple[Bound, ...]:
    """What bounds the step of lanes."""
    seen = "the rock along the way" if lanes.axial is None else "the cutting from blade to blade"
    rock = Bound("rock", lanes.longest_step, f"{seen}, seen often enough")
    return step_bounds(lanes.string, table, lanes.steepest_fall, rock, lanes.wall is not None)


def _refuse_printed_law(lanes: Lanes) -> None:
    """Within its tolerance the torque is not a function of speed and weight alone."""
    if isinstance(lanes.friction, PrintedThreeBranch):
        raise InputError(
            "'printed-three-branch' is not a law of the batch engine, on which maps, regions and "
            "comparisons run; use 'navarro-lopez-suarez', the set that it stands in for, or "
            "simulate single runs with the reference engine",
            "bit_rock.law",
        )


def _shared(period: Array | None) -> float | None:
    """Period of the controllers (s), the same in all lanes."""
    return None if period is None else float(period[0])


def _turns(lanes: Lanes) -> Array:
    """Times (s) at which a program begins, ends or jumps, each once."""
    program = lanes.program
    moments = [np.where(program.rock_until > 0.0, program.rock_until, 0.0)]
    for ramp in (*program.speed.ramps, *program.weight.ramps):
        moments += [np.where(ramp.first != 0.0, time, 0.0) for time in (ramp.begin, ramp.end)]
    result = np.unique(np.concatenate(moments))
    return result[result > 0.0]


def run_batch(
    lanes: Lanes, prepared: Prepared, give_up: float = math.inf, watch: Watch | None = None
) -> Batch:
    """Simulate every lane."""
    raw = [_run(part, prepared, 0, give_up, watch)[0] for part in _chunks(lanes)]
    return _measured(np.concatenate(raw, axis=1), lanes, prepared)


def warm_up(lanes: Lanes, prepared: Prepared) -> None:
    """Compile the kernel for these laws, or load it from disk, by a run of a single step."""
    one = replace(prepared.scheme, steps=1)
    _run(lanes[:1], Prepared(prepared.stepper, one, one.step, 0.0), 0)


def trace(lanes: Lanes, prepared: Prepared, interval: float) -> tuple[Array, dict[str, Array]]:
    """Signals of every lane at equal intervals."""
    from drillctl.simulation.kernels.advance import TRACED

    every = max(1, round(interval / prepared.scheme.step))
    parts = [_run(part, prepared, every)[1] for part in _chunks(lanes)]
    traces = np.concatenate(parts, axis=2)
    time = np.arange(len(traces), dtype=float) * every * prepared.scheme.step
    signals = {name: traces[:, i] for i, name in enumerate(TRACED)}
    if lanes.wall is not None:  # which nodes stick, the bit last
        signals["wall_stuck"] = np.concatenate(
            [traces[:, len(TRACED) :], signals["stuck"][:, None]], axis=1
        )
    if lanes.axial is not None:
        signals |= {"bit_depth": traces[:, -2], "penetration": traces[:, -1]}
    return time, signals


def _chunks(lanes: Lanes) -> Iterator[Lanes]:
    for first in range(0, len(lanes), CHUNK):
        yield lanes[first : first + CHUNK]


def _run(
    lanes: Lanes, prepared: Prepared, every: int, give_up: float = math.inf,
    watch: Watch | None = None,
) -> tuple[Array, Array]:  # fmt: skip
    """Raw measures, shape (MEASURES, lanes), and traces, shape (samples, signals, lanes)."""
    from drillctl.simulation.kernels.advance import TRACED, Clock, kernel
    from drillctl.simulation.kernels.rows import MEASURES, ROWS, WIDTH
    from drillctl.simulation.kernels.string_step import MOST_READ
    from drillctl.simulation.kernels.wall_step import room_rows

    count = len(lanes)
    # Every block is full: the last one is filled up with copies of the last lane.
    padded = lanes[np.minimum(np.arange(-(-count // WIDTH) * WIDTH), count - 1)]
    begin = padded.begin
    state = prepared.stepper.state(begin, padded.set_speed)
    top_speed, *_, bit_speed = begin.speeds
    scheme, duration = prepared.scheme, prepared.duration
    samples = scheme.steps // every + 1 if every else 0
    measures = np.empty((MEASURES, len(padded)))
    wall = () if padded.wall is None else padded.wall.torque
    friction, before, more, surface = _rock(padded, scheme)
    axial = 2 if more else 0
    traces = np.empty((samples, len(TRACED) + max(len(wall) - 1, 0) + axial, len(padded)))
    window = min(m.WINDOW, duration)
    observer, weight = padded.observer, within_run(padded.weight, duration)
    ticks = Clock(
        scheme.step, scheme.steps, prepared.j1_from, duration - window, every, scheme.sampling,
        remembered(weight, scheme.step, duration), 0 if observer is None else observer.states,
        more, surface, give_up,
    )  # fmt: skip
    numbers = np.stack([
        padded.set_speed, bit_speed + padded.set_speed, padded.table_low, padded.table_high,
        top_speed, *wall,
    ])  # fmt: skip
    arguments = (
        prepared.stepper.string, friction, before,
        drive_step(
            _at_whole_steps(padded.drive, scheme), scheme.step, prepared.stepper.string
        ),
        weight_step(weight, scheme.step), program_step(padded.program),
        variation_step(padded.variation, duration, padded.set_speed, _rate(padded)),
        observer_step(observer, scheme.step, begin),
        numbers, np.ascontiguousarray(state), ticks,
    )  # fmt: skip
    run = kernel(*arguments[1:8])
    rows = ROWS + 2 * len(state) + ticks.remembered + 2 * ticks.estimated
    rows += more + 2 * surface
    rows += -(-MOST_READ * len(state) // WIDTH) + room_rows(len(wall))

    watch = new_watch() if watch is None else watch

    def advance(begin: int, end: int) -> None:
        run(begin, end, *arguments, aligned(rows * WIDTH), measures, traces, watch)

    _in_threads(advance, len(padded) // WIDTH, watch)
    return measures[:, :count], traces[:, :, :count]


def _rock(lanes: Lanes, scheme: Scheme) -> tuple[Any, Any, int, int]:
    """What the kernel takes of the rock, and of that before; rows of memory, points of surface."""
    if lanes.axial is None:
        return lanes.friction, lanes.before, 0, 0
    from drillctl.simulation import cutting
    from drillctl.simulation.kernels.cutting_step import cutting_rows

    rock, before, points = cutting.cutting_step(lanes, scheme.step)
    return rock, before, cutting_rows(rock), points


def _rate(lanes: Lanes) -> float | Array:
    """Rate of penetration (m/s) of a bit that drills by itself."""
    if lanes.axial is None:
        return 0.0
    return np.asarray(lanes.friction.rate(lanes.weight_at_rest, lanes.begin_speed))


def new_watch() -> Watch:
    """A watch of runs that go on."""
    return np.zeros(1, dtype=np.int64)


def _in_threads(advance: Callable[[int, int], Any], blocks: int, watch: Watch) -> None:
    """Advance all blocks, some at a time in each of numba's number of threads.

    The caller's own thread waits, so that an interruption reaches it: it tells the kernels.
    """
    import numba

    threads = min(numba.get_num_threads(), blocks)
    shares = deque(_shares(blocks, threads))

    def work() -> None:
        while shares:
            try:
                share = shares.popleft()
            except IndexError:  # another thread took the last one
                return
            advance(*share)

    with ThreadPoolExecutor(threads) as pool:
        working = [pool.submit(work) for _ in range(threads)]
        try:
            for one in working:
                one.result()
        except BaseException:  # interrupted, or one has failed: the others stop
            shares.clear()
            watch[0] = 1
            raise


def _shares(blocks: int, threads: int) -> Iterator[tuple[int, int]]:
    """Half of what each thread has left at a time: few calls, and all threads end together."""
    begin = 0
    while begin < blocks:
        end = begin + max(1, (blocks - begin) // (2 * threads))
        yield begin, end
        begin = end


def _at_whole_steps(drive: Any, scheme: Scheme) -> Any:
    """A drive whose period is a whole number of steps."""
    if not isinstance(drive, SampledDrive):
        return drive
    return drive._replace(period=np.full_like(drive.period, scheme.sampling * scheme.step))


def _measured(raw: Array, lanes: Lanes, prepared: Prepared) -> Batch:
    """Measures by name, and a status, from the kernel's rows."""
    from drillctl.simulation.kernels import rows as r

    def row(name: int) -> Array:
        return raw[(name - r.FIRST_MEASURE) // r.WIDTH]

    duration = prepared.duration
    window = min(m.WINDOW, duration)
    with np.errstate(all="ignore"):  # undefined measures become NaN and are told as such
        j1 = row(r.J1) / lanes.set_speed
        late_mean = row(r.LATE_ANGLE) / window
        index = (row(r.LATE_HIGH) - row(r.LATE_LOW)) / (2.0 * late_mean)
        turned = np.abs(row(r.BIT_ANGLE)) / (2.0 * np.pi)
        nominal = lanes.nominal_weight * lanes.set_speed * duration
        values = {
            "j1": j1,
            "j1_rate": j1 / (duration - prepared.j1_from),
            "stuck_time": row(r.STUCK_TIME),
            "sticks": row(r.STICKS),
            "stick_slip_index": _where((row(r.LATE_HIGH) > 0.0) & (late_mean > 0.0), index),
            "mean_bit_speed": row(r.BIT_ANGLE) / duration,
            "min_bit_speed": row(r.LOW),
            "peak_bit_speed": row(r.HIGH),
            "peak_pipe_torque": row(r.PEAK_PIPE),
            "peak_top_torque": row(r.PEAK_TOP),
            "settling_time": _settled(row(r.OUTSIDE_NARROW), duration),
            "settling_time_wide": _settled(row(r.OUTSIDE_WIDE), duration),
            "mean_weight_on_bit": row(r.WEIGHT_SUM) / duration,
            "rop_proxy": row(r.ROP_SUM) / nominal,
            "work_at_bit": row(r.WORK),
            "work_at_wall": row(r.WALL_WORK),
            "work_per_turn": _where(turned > 1e-3, row(r.WORK) / turned),
            "time_outside_table": row(r.OUTSIDE_TABLE),
            "time_at_torque_limit": row(r.AT_TORQUE_LIMIT),
            "time_at_power_limit": row(r.AT_POWER_LIMIT),
            "time_over_continuous": row(r.OVER_CONTINUOUS),
            "peak_drive_power": _where(
                np.full(len(lanes), isinstance(lanes.drive, RealDrive)), row(r.PEAK_POWER)
            ),
            **_axial(
                [row(x) for x in (r.DRILLED, r.CUT_SUM, r.AXIAL_STUCK, r.OFF_BOTTOM)],
                lanes,
                duration,
                row(r.WORK),
            ),
        }
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(raw).all(axis=0))
    status = _statuses(finite, row(r.LATE_STUCK), window, values["settling_time_wide"])
    for name in m.BATCH_MEASURES:  # a lane that failed has no measures at all
        values[name] = _where(finite, values[name])
    given_up = row(r.BOUND) > 0.0
    status[given_up] = m.STATUSES.index("censored")
    for name in m.BATCH_MEASURES:
        values[name] = _where(~given_up, values[name])
    values["j1"] = np.where(given_up, row(r.BOUND) / lanes.set_speed, values["j1"])
    return Batch(values, status)


def _axial(rows: list[Array], lanes: Lanes, duration: float, work: Array) -> dict[str, Array]:
    """Measures of axial motion; undefined without any."""
    if lanes.axial is None:
        return dict.fromkeys(m.AXIAL_MEASURES, np.full(len(lanes), np.nan))
    from drillctl.simulation.cutting import axial_measures

    drilled, cut, at_rest, off = rows
    blades = lanes.friction.blades
    return axial_measures(
        lanes.friction, duration, drilled, blades * cut / duration, at_rest, off, work
    )


def _where(condition: NDArray[np.bool_], values: Array) -> Array:
    return np.where(condition, values, np.nan)


def _settled(last_outside: Array, duration: float) -> Array:
    return _where(last_outside <= duration - min(m.SETTLED_FOR, duration), last_outside)


def _statuses(
    finite: NDArray[np.bool_], late_stuck: Array, window: float, settled: Array
) -> NDArray[np.int8]:
    """The rules of `measures.status_of`, for all lanes."""
    code = {name: np.int8(i) for i, name in enumerate(m.STATUSES)}
    status = np.where(np.isnan(settled), code["not_settled"], code["ok"])
    status = np.where(late_stuck > 0.0, code["sticking"], status)
    status = np.where(late_stuck >= window * (1.0 - 1e-9), code["stalled"], status)
    return np.where(finite, status, code["failed"]).astype(np.int8)


def measures_of(batch: Batch, lane: int) -> m.Measures:
    """The measures of one lane; None where undefined."""
    values: dict[str, Any] = {}
    for name in m.BATCH_MEASURES:
        value = float(batch.measures[name][lane])
        values[name] = None if np.isnan(value) else value
    if values["sticks"] is not None:
        values["sticks"] = int(values["sticks"])
    return m.Measures(**values)
