"""The loop over blocks of lanes and over steps.

A step, for all lanes of a block at once:

    swing   = A z              string, free of this step's torques        string_step
    reduced = swing + drive    free bit speed, and its fall per torque    drive_step
    outcome: u + (gain/2) T(u) contains right                             rock_step
    z       = swing + B [T_top, T_bit]                                    with the next swing
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, NamedTuple

from drillctl.rig.bit_rock import contact
from drillctl.simulation.kernel_cache import njit
from drillctl.simulation.kernels import rows as r
from drillctl.simulation.kernels.arithmetic import (
    OPTIONS,
    aligned_stack,
    any_of,
    exp,
    fma,
    law_at,
    least,
    load_block,
)
from drillctl.simulation.kernels.cutting_step import (
    FORCE,
    begin_cutting,
    conclude_cutting,
    cut_rock,
    cuts,
    numbers_of,
    sample_cutting,
)
from drillctl.simulation.kernels.drive_step import (
    begin_drive,
    eliminate,
    follow_drive,
    move_top,
    sample_drive,
    top_torque_now,
)
from drillctl.simulation.kernels.measure_step import (
    Before,
    Window,
    begin_measures,
    conclude,
    conclude_bands,
    conclude_load,
    measure,
    measure_load,
    note,
)
from drillctl.simulation.kernels.program_step import advance_program, begin_program
from drillctl.simulation.kernels.rock_step import foresee, hold_rock, meet_rock, rock
from drillctl.simulation.kernels.rows import CHUNK, PASS, WIDTH
from drillctl.simulation.kernels.string_step import complete_and_propagate, load_string, look
from drillctl.simulation.kernels.variation_step import (
    advance_variation,
    begin_variation,
    turn_variation,
    varied,
)
from drillctl.simulation.kernels.vectors import (
    Variable,
    at,
    emitted,
    loop,
    pick,
    put,
    rows_of,
    when,
)
from drillctl.simulation.kernels.wall_step import (
    begin_wall,
    conclude_wall,
    follow_wall,
    has_wall,
    load_wall,
    pass_with_wall,
    rub,
    sample_wall,
    see_with_wall,
    walled,
)
from drillctl.simulation.kernels.weight_step import (
    Memory,
    acting,
    begin_weight,
    follow_weight,
    move_load,
    raise_weight,
)

TRACED = (
    "top_speed", "bit_speed", "top_angle", "bit_angle", "pipe_torque", "bit_torque", "stuck",
    "top_torque", "weight_on_bit",
)  # fmt: skip
"""Signals of a trace, in the order in which they leave the kernel."""

LOOK = 4  # chunks from one look at whether to stop, or lanes may be given up, to the next


class Clock(NamedTuple):
    """Time of a run."""

    step: float  # length of a step (s)
    steps: int  # number of steps
    # where the J1 window and the window at the end of the run begin (s)
    j1_from: float
    window_from: float
    every: int  # steps from one sample of a trace to the next; 0 for no traces
    sampling: int  # steps from one sample of the controller to the next; 0 for a continuous one
    remembered: int  # steps whose signals a weight law may ask for; 0 if none does
    estimated: int  # states of the observer; 0 without one
    # of a bit that cuts its own wake: rows of its memory, points of the surface behind it; else 0
    cutting: int
    surface: int
    give_up: float  # J1 (s) over which nothing more is asked of a lane; infinite for none


def _load(
    string: Any, friction: Any, drive: Any, weight: Any, speed: Any, work: Any, first: Any
) -> None:
    """Numbers of the laws and of the lanes."""
    load_block(numbers_of(friction), work, r.FRICTION, first)
    load_block(drive, work, r.DRIVE, first)
    load_block(weight, work, r.WEIGHT, first)
    set_speed = at(speed[0], first)
    put(work, r.SET_SPEED, set_speed)
    put(work, r.BIT_SPEED, at(speed[1], first))
    put(work, r.TABLE_LOW, at(speed[2], first))
    put(work, r.TABLE_HIGH, at(speed[3], first))
    put(work, r.TOP_SPEED, at(speed[4], first))
    put(work, r.DRAG, string.drag * set_speed)
    put(work, r.PIPE_OFFSET, string.pipe_offset * set_speed)


def _begin_rock(friction: Any, weight: Any, program: Any, variation: Any, work: Any) -> None:
    """What bit and rock are to each other at time zero."""
    speed = at(work, r.BIT_SPEED)
    put(work, r.SPEED_BEFORE, speed)
    put(work, r.SPEED_BEFORE_THAT, speed)
    load = acting(weight, work)
    at_rest = load.weight(0.0 * speed)
    put(work, r.REST_LOAD, at_rest)
    put(work, r.REST_END, at_rest)
    put(work, r.LOAD, load.weight(abs(speed)))
    law = varied(law_at(friction, work, r.FRICTION), variation, work)
    torque, slope = contact(law, load, abs(speed), exp)
    direction = pick(speed > 0.0, 1.0, pick(speed < 0.0, -1.0, 0.0))
    put(work, r.SLOPE, slope)
    put(work, r.DIRECTION, direction)
    put(work, r.KINETIC, pick(direction == 0.0, 0.0, torque))
    hold_rock(friction, weight, program, work, begins=True)


def _begin(
    string: Any, friction: Any, before: Any, drive: Any, weight: Any, program: Any,
    variation: Any, observer: Any, speed: Any, start: Any, clock: Any, state: Any, work: Any,
    memory: Any, room: Any, first: Any,
) -> None:  # fmt: skip
    """A block at time zero; its memory holds zeros."""
    _load(string, friction, drive, weight, speed, work, first)
    load_wall(string, speed, room, work, first)
    with loop(start.shape[0]) as states:
        put(state, states.index * WIDTH, at(start[states.index], first))
    begin_program(program, before, work, first)
    begin_drive(drive, string, work, 1.0 / clock.step)
    begin_weight(weight, observer, work, memory, first)
    begin_variation(variation, work, first)
    if cuts(friction):
        begin_cutting(friction, drive, weight, variation, work, memory, first)
    else:
        _begin_rock(friction, weight, program, variation, work)
    begin_wall(string, room, work)
    begin_measures(work, top_torque_now(drive, work, at(work, r.TOP_SPEED)))


def _look_around(string: Any, room: Any, state: Any, work: Any) -> None:
    if has_wall(string):
        speed, angle = see_with_wall(string, room, state, work)
    else:
        speed, angle = look(string, state, work)
    put(work, r.SEEN_TOP, speed)
    put(work, r.SEEN_TWIST, angle)


def _sample(
    string: Any, friction: Any, drive: Any, work: Any, memory: Memory, room: Any, pipe: Any,
    traces: Any, sample: int, first: Any,
) -> None:  # fmt: skip
    """Store one sample of every lane; speeds and angles were seen before the pass."""
    set_speed, top_speed = at(work, r.SET_SPEED), at(work, r.SEEN_TOP)
    stuck = at(work, r.DIRECTION) == 0.0
    signals = traces[sample]
    put(signals[0], first, top_speed + set_speed)
    put(signals[1], first, at(work, r.BIT_SPEED))
    put(signals[2], first, at(work, r.ANGLE))
    put(signals[3], first, at(work, r.SEEN_TWIST) - string.twist_offset * set_speed)
    put(signals[4], first, pipe + at(work, r.PIPE_OFFSET))
    sliding = at(work, r.DIRECTION) * at(work, r.KINETIC)
    put(signals[5], first, pick(stuck, at(work, r.BIT_TORQUE), sliding))
    put(signals[6], first, pick(stuck, 1.0, 0.0))
    put(signals[7], first, top_torque_now(drive, work, top_speed))
    put(signals[8], first, at(memory.cutting, FORCE) if cuts(friction) else at(work, r.LOAD))
    if cuts(friction):
        sample_cutting(work, signals, len(TRACED), first)
    sample_wall(string, room, signals, len(TRACED), first)


def _conclude(string: Any, drive: Any, observer: Any, swing: Any, reduced: Any, outcome: Any,
              work: Any) -> None:  # fmt: skip
    """Top torque of the step, and the state at its end."""
    net_torque = fma(reduced.share, outcome.torque, reduced.alone)
    put(work, r.TOP_TORQUE, net_torque)
    put(work, r.BIT_TORQUE, outcome.torque)
    angle = fma(string.angle_by_top, net_torque, swing.top_angle)
    put(work, r.ANGLE, fma(-string.angle_by_bit, outcome.torque, angle))
    move_top(drive, observer, string, swing, work)
    put(work, r.SPEED_BEFORE_THAT, at(work, r.SPEED_BEFORE))
    put(work, r.SPEED_BEFORE, at(work, r.BIT_SPEED))
    put(work, r.BIT_SPEED, outcome.speed)
    put(work, r.DIRECTION, outcome.direction)
    put(work, r.KINETIC, outcome.kinetic)
    put(work, r.SLOPE, outcome.slope)


def _all_given_up(work: Any, level: Any) -> Any:
    """Note the lanes whose J1 has passed the level; whether these are all.

    J1 only grows. Each lane is judged by itself, at the same steps whatever its company.
    """
    j1, bound = at(work, r.J1), at(work, r.BOUND)
    over = (j1 > level * at(work, r.SET_SPEED)) & (bound == 0.0)
    put(work, r.BOUND, pick(over, j1, bound))
    return ~any_of(at(work, r.BOUND) == 0.0)


class Now(NamedTuple):
    """A step that is being taken."""

    n: Any  # its number
    slot: Any  # its place among those whose measures are added up together
    traced: Any  # whether it begins with a sample of a trace
    sample: Any  # number of that
    sampled: Any  # whether a sampled controller works


def _step(
    string: Any, friction: Any, drive: Any, weight: Any, program: Any, variation: Any,
    observer: Any, clock: Any, now: Now, room: Any, work: Any, state: Any, memory: Memory,
    traces: Any, first: Any,
) -> None:  # fmt: skip
    """One step of some lanes of a block; of the one after the last only what it begins with."""
    n, step, rate = now.n, clock.step, 1.0 / clock.step
    advance_program(program, numbers_of(friction), weight, variation, work, first, n * step, step)
    with when(now.traced):
        _look_around(string, room, state, work)
    if has_wall(string):
        foreseen = None
        swing = pass_with_wall(string, drive, observer, room, state, work)
    else:
        foreseen = None if cuts(friction) else foresee(friction, weight, program, variation, work)
        swing = complete_and_propagate(string, drive, observer, room, state, work)
    put(work, r.PIPE, swing.pipe)
    with when(now.traced):
        _sample(string, friction, drive, work, memory, room, swing.pipe, traces, now.sample, first)
    with when(n < clock.steps):
        sample_drive(drive, work, now.sampled)
        raise_weight(weight, program, work, memory, n, step)
        hold_rock(friction, weight, program, work)
        advance_variation(variation, work, first, n * step, step)
        was = Before(at(work, r.BIT_SPEED), at(work, r.TOP_SPEED), at(work, r.LOAD))
        if cuts(friction):
            reduced = eliminate(drive, program, string, swing, work, rate)
            outcome = cut_rock(friction, weight, program, variation, reduced, work, memory, step)
        else:
            law = varied(rock(friction, weight, program, work), variation, work)
            swing = rub(string, drive, program, weight, law, swing, room, work, rate)
            reduced = eliminate(drive, program, string, swing, work, rate)
            law = walled(string, law, room)
            outcome = meet_rock(law, weight, reduced, foreseen, work, now.slot)
        _conclude(string, drive, observer, swing, reduced, outcome, work)
        follow_wall(string, room, work, step)
        if not cuts(friction):
            turn_variation(variation, work, was.bit_speed, step)
        move_load(weight, program, work)
        follow_drive(drive, work, was.top_speed, rate)
        follow_weight(weight, observer, work, memory, was, n, step)
        if not cuts(friction):
            measure_load(weight, program, work, was, outcome, step)
        note(work, now.slot, outcome, swing.pipe)


@emitted
def _advance_block(
    string: Any, friction: Any, before: Any, drive: Any, weight: Any, program: Any,
    variation: Any, observer: Any, speed: Any, start: Any, clock: Any, kept: Any, measures: Any,
    traces: Any, watch: Any, first: Any,
) -> None:  # fmt: skip
    """Advance the lanes from `first` on, one block, from time zero to the end."""
    aligned_stack()
    ring = r.ROWS * WIDTH + 2 * WIDTH * start.shape[0]
    estimate = ring + clock.remembered * WIDTH
    moved = estimate + clock.estimated * WIDTH
    cutting = moved + clock.estimated * WIDTH
    surface = cutting + clock.cutting * WIDTH
    read = surface + 2 * clock.surface * WIDTH
    work, state = kept[: r.ROWS * WIDTH], kept[r.ROWS * WIDTH : ring]
    memory = Memory(
        kept[ring:estimate], kept[estimate:moved], kept[moved:cutting], kept[cutting:surface],
        kept[surface:read],
    )  # fmt: skip
    room = kept[read:]
    with loop(kept.shape[0] // WIDTH) as rows:
        put(kept, rows.index * WIDTH, 0.0)
    _begin(
        string, friction, before, drive, weight, program, variation, observer,
        speed, start, clock, state, work, memory, room, first,
    )  # fmt: skip
    load_string(string, room)
    of_j1, late = Window(clock.step, clock.j1_from), Window(clock.step, clock.window_from)
    # Steps at which the next sample is due: of a trace, of the controller.
    traced = Variable(pick(clock.every > 0, 0, clock.steps + 1))
    sampled = Variable(pick(clock.sampling > 0, 0, clock.steps + 1))
    samples = Variable(0 * clock.every)
    with loop(clock.steps // CHUNK + 1) as chunks:
        first_step = chunks.index * CHUNK
        count = least(clock.steps - first_step, CHUNK)
        with loop(least(count + 1, CHUNK)) as steps:
            n = first_step + steps.index
            now = Now(n, steps.index, n == traced.get(), samples.get(), n == sampled.get())
            with rows_of(PASS), loop(WIDTH // PASS) as parts:
                at_lane = parts.index * PASS
                _step(
                    string, friction, drive, weight, program, variation, observer, clock, now,
                    room[at_lane:] if has_wall(string) else room,
                    work[at_lane:], state[at_lane:], memory.part(at_lane), traces,
                    first + at_lane,
                )  # fmt: skip
            with when(now.traced):
                samples.set(samples.get() + 1)
                traced.set(n + clock.every)
            with when(now.sampled):
                sampled.set(n + clock.sampling)
        with when(count > 0):
            measure(work, clock.step, of_j1, late, first_step, count)
        with (
            when((chunks.index & (LOOK - 1)) == LOOK - 1),
            when((watch[0] != 0) | _all_given_up(work, clock.give_up)),
        ):
            chunks.leave()
    conclude(work, clock.step)
    conclude_bands(work, clock.steps * clock.step)
    if cuts(friction):
        conclude_cutting(work)
    else:
        conclude_load(weight, program, work, clock.steps * clock.step)
    conclude_wall(string, room, work)
    for measured in range(r.MEASURES):
        put(measures[measured], first, at(work, r.FIRST_MEASURE + measured * WIDTH))


def _compile(on_disk: bool) -> Any:
    version = fingerprint(sources())

    def run(
        begin: Any, end: Any,
        string: Any, friction: Any, before: Any, drive: Any, weight: Any, program: Any,
        variation: Any, observer: Any, speed: Any, start: Any, clock: Any, kept: Any,
        measures: Any, traces: Any, watch: Any,
    ) -> str:  # fmt: skip
        """Advance blocks of lanes from time zero to the end."""
        for block in range(begin, end):
            if watch[0] != 0:
                break
            _advance_block(
                string, friction, before, drive, weight, program, variation, observer,
                speed, start, clock, kept, measures, traces, watch, block * WIDTH,
            )  # fmt: skip
        return version

    # numba's disk cache looks at the date of one file only, and reads the list of kernels by the
    # name of the function: with the version in it a change in any law or kernel is noticed, and
    # no list is read that names modules which are no more.
    run.__name__ = run.__qualname__ = f"run_{version}"
    # Threads are the caller's: numba's own loop in parallel compiles everything twice.
    return njit(run, cache=on_disk, nogil=True, **OPTIONS)


def sources() -> list[Path]:
    """Every source that is compiled into the kernels."""
    package = Path(__file__).resolve().parents[2]
    folders = ("simulation/kernels", "rig/bit_rock", "rig/top_drive", "rig/weight_on_bit")
    return [path for folder in folders for path in sorted((package / folder).glob("*.py"))]


def fingerprint(paths: list[Path]) -> str:
    """Hash of the block width and of these sources."""
    digest = hashlib.sha256(str(WIDTH).encode())
    for path in paths:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def kernel(*laws: Any) -> Any:
    """The kernel for these laws: `run`, or one that is never kept on disk.

    numba keeps kernels by the names of the classes that they take. A law from outside this package
    is not in the fingerprint, so that its kernel would be stale once it is edited, and a process
    that cannot import it could not even read the list of those kept.
    """
    return run if all(_is_ours(law) for law in laws) else run_unkept


def _is_ours(law: Any) -> bool:
    """Whether a law, and whatever laws it holds, are of this package."""
    if not isinstance(law, tuple):
        return True
    return type(law).__module__.startswith("drillctl.") and all(_is_ours(part) for part in law)


run_unkept = _compile(on_disk=False)  # `run`, compiled anew in every process

run = _compile(on_disk=True)
"""Advance lanes from time zero to the end: `run(begin, end, string, friction, before,
drive, weight, program, variation, observer, speed, start, clock, kept, measures, traces,
watch)`.

- `begin`, `end`: blocks of `WIDTH` lanes to advance, of all those there are. Blocks do not see each
  other: threads may take some each, the interpreter's lock is not held.
- `string`: `BlockString` or `DenseString`.
- `friction`, `before`, `drive`, `weight`, `program`: laws with an array, shape (lanes,), for each
  number, those with a memory as prepared by `simulation.step_laws`; `before` is the rock before
  the program changes it.
- `variation`: `SameRock` or `VariationStep`.
- `observer`: `NoObserver` or `ObserverStep`.
- `speed`, shape (5, lanes): set speed and bit speed at time zero (rad/s), lowest and highest
  weight of the friction table (N), top speed at time zero in the frame (rad/s).
- `start`, shape (states, lanes): the string at time zero.
- `clock`: `Clock`.
- `kept`, shape (rows x WIDTH,): memory of one block, `rows.py`; each thread brings its own.
- `measures`, shape (MEASURES, lanes): written; the rows from `rows.FIRST_MEASURE` on.
- `traces`, shape (samples, len(TRACED), lanes): written if `clock.every` > 0.
- `watch`, shape (1,), whole numbers: looked at every `LOOK` chunks of steps; another thread makes
  it other than zero to stop the run.

`lanes` must be a multiple of `WIDTH`. Returns the fingerprint of the sources.
"""
