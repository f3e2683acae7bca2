"""The loop over blocks of lanes and over steps."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.compiling import OPTIONS, compiled, inlined, widest_vectors
from drillctl.simulation.kernels.drive_step import (
    begin_drive,
    follow_drive,
    sample_drive,
    top_torque_now,
)
from drillctl.simulation.kernels.held_rock import hold_rock
from drillctl.simulation.kernels.lane_step import conclude, eliminate
from drillctl.simulation.kernels.laws import at_lane, contact, load_block, weight_at
from drillctl.simulation.kernels.measure_step import (
    begin_measures,
    measure,
    measure_crossings,
    measure_pipe,
    measure_window,
)
from drillctl.simulation.kernels.program_step import advance_program, begin_program
from drillctl.simulation.kernels.rock_step import meet_rock
from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.string_step import complete_and_propagate, look
from drillctl.simulation.kernels.weight_step import (
    Memory,
    acting,
    begin_weight,
    follow_weight,
    raise_weight,
)

TRACED = (
    "top_speed", "bit_speed", "top_angle", "bit_angle", "pipe_torque", "bit_torque", "stuck",
    "top_torque", "weight_on_bit",
)  # fmt: skip
"""Signals of a trace, in the order in which they leave the kernel."""


class Clock(NamedTuple):
    """Time of a run.

    Attributes
    ----------
    step : float
        Length of a step (s).
    steps : int
        Number of steps.
    j1_from, window_from : float
        Where the J1 window and the window at the end of the run begin (s).
    every : int
        Steps from one sample of a trace to the next; 0 for no traces.
    sampling : int
        Steps from one sample of the controller to the next; 0 for a continuous one.
    remembered : int
        Steps whose signals a weight law may ask for; 0 if none does.
    estimated : int
        States of the observer; 0 without one.
    """

    step: float
    steps: int
    j1_from: float
    window_from: float
    every: int
    sampling: int
    remembered: int
    estimated: int


@inlined
def _begin(friction: Any, weight: Any, work: Any) -> None:
    """State of the laws at time zero."""
    for lane in range(WIDTH):
        speed = work[r.BIT_SPEED + lane]
        load = acting(weight, work, lane)
        work[r.REST_LOAD + lane] = weight_at(load, 0.0)
        work[r.REST_END + lane] = weight_at(load, 0.0)
        work[r.LOAD + lane] = weight_at(load, abs(speed))
        torque, slope = contact(at_lane(friction, work, r.FRICTION, lane), load, abs(speed))
        work[r.SLOPE + lane] = slope
        direction = 1.0 if speed > 0.0 else (-1.0 if speed < 0.0 else 0.0)
        work[r.DIRECTION + lane] = direction
        work[r.KINETIC + lane] = direction * torque
        work[r.HOLDING + lane] = -1.0
        work[r.ANGLE + lane] = 0.0
        work[r.TOP_TORQUE + lane] = 0.0
        work[r.BIT_TORQUE + lane] = 0.0


@compiled
def _look_around(string: Any, state: Any, work: Any, looks: Any) -> None:
    for lane in range(WIDTH):
        looks[0, lane], looks[1, lane] = look(string, state, work, lane)


@compiled
def _sample(
    string: Any, drive: Any, work: Any, looks: Any, traces: Any, sample: int, first: int
) -> None:
    """Store one sample of every lane; `looks` holds what was seen before the pass."""
    for lane in range(WIDTH):
        set_speed = work[r.SET_SPEED + lane]
        stuck = work[r.DIRECTION + lane] == 0.0
        held = work[r.BIT_TORQUE + lane]
        row = traces[sample, first + lane]
        row[0] = looks[0, lane] + set_speed
        row[1] = work[r.BIT_SPEED + lane]
        row[2] = work[r.ANGLE + lane]
        row[3] = looks[1, lane] - string.twist_offset * set_speed
        row[4] = work[r.PIPE + lane] + work[r.PIPE_OFFSET + lane]
        row[5] = held if stuck else work[r.KINETIC + lane]
        row[6] = 1.0 if stuck else 0.0
        row[7] = top_torque_now(drive, work, lane, looks[0, lane])
        row[8] = work[r.LOAD + lane]


@inlined
def _share_after(begin: float, step: float, moment: float) -> float:
    """Share of a step that lies after a moment."""
    return min(1.0, max(0.0, (begin + step - moment) / step))


@compiled
def _load(
    string: Any, friction: Any, drive: Any, weight: Any, speed: Any, work: Any, first: int
) -> None:
    """Numbers of the laws and of the lanes."""
    load_block(friction, work, r.FRICTION, first)
    load_block(drive, work, r.DRIVE, first)
    load_block(weight, work, r.WEIGHT, first)
    for lane in range(WIDTH):
        set_speed = speed[0, first + lane]
        work[r.SET_SPEED + lane] = set_speed
        work[r.BIT_SPEED + lane] = speed[1, first + lane]
        work[r.TABLE_LOW + lane] = speed[2, first + lane]
        work[r.TABLE_HIGH + lane] = speed[3, first + lane]
        work[r.TOP_SPEED + lane] = speed[4, first + lane]
        work[r.DRAG + lane] = string.drag * set_speed
        work[r.PIPE_OFFSET + lane] = string.pipe_offset * set_speed


@compiled
def advance_block(
    string: Any, friction: Any, before: Any, drive: Any, weight: Any, program: Any, observer: Any,
    speed: Any, start: Any, clock: Any, measures: Any, traces: Any, first: int,
) -> None:  # fmt: skip
    """Advance the lanes from `first` on, one block, from time zero to the end."""
    widest_vectors()
    work = np.zeros(r.ROWS * WIDTH)
    state = np.zeros(2 * start.shape[0] * WIDTH)
    looks = np.zeros((2, WIDTH))
    memory = Memory(
        np.zeros(clock.remembered * WIDTH),
        np.zeros((clock.estimated, WIDTH)),
        np.zeros((clock.estimated, WIDTH)),
    )
    _load(string, friction, drive, weight, speed, work, first)
    for lane in range(WIDTH):
        for i in range(start.shape[0]):
            state[i * WIDTH + lane] = start[i, first + lane]
    begin_program(program, before, work, first)
    begin_drive(drive, work)
    begin_weight(weight, observer, work, memory, first)
    _begin(friction, weight, work)
    begin_measures(work)
    rate = 1.0 / clock.step
    for n in range(clock.steps + 1):
        begin = n * clock.step
        advance_program(program, friction, weight, work, first, begin, clock.step)
        sampled = clock.every > 0 and n % clock.every == 0
        if sampled:
            _look_around(string, state, work, looks)
        complete_and_propagate(string, drive, observer, state, work)
        measure_pipe(work)
        if sampled:
            _sample(string, drive, work, looks, traces, n // clock.every, first)
        if n == clock.steps:
            break
        sample_drive(drive, work, clock.sampling > 0 and n % clock.sampling == 0)
        raise_weight(weight, program, work, memory, n, clock.step)
        hold_rock(friction, weight, work)
        eliminate(string, drive, work, rate)
        meet_rock(friction, weight, work)
        conclude(string, drive, weight, observer, work)
        follow_drive(drive, work, rate)
        follow_weight(weight, observer, work, memory, n, clock.step)
        in_j1 = _share_after(begin, clock.step, clock.j1_from)
        in_window = _share_after(begin, clock.step, clock.window_from)
        if measure(work, begin, clock.step, in_j1, in_window) > 0:
            measure_crossings(work, begin, clock.step, in_j1)
        if in_window > 0.0:
            measure_window(work, in_window)
    for measured in range(r.MEASURES):
        for lane in range(WIDTH):
            value = work[r.FIRST_MEASURE + measured * WIDTH + lane]
            measures[measured, first + lane] = value


def _compile() -> Any:
    # A constant of the compiled code, so that numba's disk cache, which looks at the date of
    # one file only, notices a change in any law or kernel.
    version = fingerprint(sources())

    # Threads are the caller's: numba's own loop in parallel compiles everything twice.
    @njit(nogil=True, cache=True, **OPTIONS)
    def run(
        begin: int, end: int,
        string: Any, friction: Any, before: Any, drive: Any, weight: Any, program: Any,
        observer: Any, speed: Any, start: Any, clock: Any, measures: Any, traces: Any,
    ) -> str:  # fmt: skip
        for block in range(begin, end):
            advance_block(
                string, friction, before, drive, weight, program, observer,
                speed, start, clock, measures, traces, block * WIDTH,
            )  # fmt: skip
        return version

    return run


def sources() -> list[Path]:
    """Every source that is compiled into the kernels."""
    package = Path(__file__).resolve().parents[2]
    folders = ("simulation/kernels", "bit_rock", "top_drive", "weight_on_bit")
    return [path for folder in folders for path in sorted((package / folder).glob("*.py"))]


def fingerprint(paths: list[Path]) -> str:
    """Hash of the block width and of these sources."""
    digest = hashlib.sha256(str(WIDTH).encode())
    for path in paths:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


run = _compile()
"""Advance lanes from time zero to the end: `run(begin, end, string, friction, before,
drive, weight, program, observer, speed, start, clock, measures, traces)`.

- `begin`, `end`: blocks of `WIDTH` lanes to advance, of all those there are. Blocks do not see each
  other: threads may take some each, the interpreter's lock is not held.
- `string`: `BlockString` or `DenseString`.
- `friction`, `before`, `drive`, `weight`, `program`: laws with an array, shape (lanes,), for each
  number, those with a memory as prepared by `simulation.step_laws`; `before` is the rock before
  the program changes it.
- `observer`: `NoObserver` or `ObserverStep`.
- `speed`, shape (5, lanes): set speed and bit speed at time zero (rad/s), lowest and highest
  weight of the friction table (N), top speed at time zero in the frame (rad/s).
- `start`, shape (states, lanes): the string at time zero.
- `clock`: `Clock`.
- `measures`, shape (MEASURES, lanes): written; the rows from `rows.FIRST_MEASURE` on.
- `traces`, shape (samples, lanes, len(TRACED)): written if `clock.every` > 0.

`lanes` must be a multiple of `WIDTH`. Returns the fingerprint of the sources.
"""
