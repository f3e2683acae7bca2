"""How fast the batch engine runs lanes of a design on this machine, and what takes the time."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

import numba
import numpy as np

from drillctl.machine import multiply_adds
from drillctl.rig.drillstring import Drillstring
from drillctl.simulation.batch import Prepared, run_batch, warm_up
from drillctl.simulation.cost import count
from drillctl.simulation.kernels.string_step import DenseString
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.propagator import LARGEST_TURN, string_step

SECONDS = 0.3
"""Least length of a timed run (s)."""
MOST_LANES = 65_536
REPEATS = 3
"""Runs of which the fastest counts: what others take of the machine is not the engine."""
SHORT = 0.05
"""Length of a run for the cost of a mode (s), at the scheme's own modes."""


@dataclass(frozen=True)
class Speed:
    """Speed of the engine on lanes of a design, the kernel warm."""

    threads: int  # used
    lanes: int  # in a timed run
    seconds: float  # it took (s)
    lanes_per_second: float  # whole lanes, from their start to the end of their horizon
    lane_step_ns: float  # processor time of a step of a lane (ns)
    # of which a mode, and all but the modes: laws, inclusion and measures; None where the cost
    # cannot be told apart
    mode_ns: float | None
    laws_ns: float | None
    flops_per_step: float  # operations of the modal pass in a step of a lane
    peak_flops: float  # of one core, measured (1/s)
    share_of_peak: float  # operations of the modal pass over the time of whole steps, of that peak
    pass_share_of_peak: float | None  # the same over the time of the modal pass

    def summary(self) -> dict[str, Any]:
        """By name."""
        return asdict(self)


def engine_speed(lanes: Lanes, prepared: Prepared) -> Speed:
    """Measure for about two seconds."""
    warm_up(lanes, prepared)
    many = lanes
    while (seconds := _best(many, prepared, 1)[0]) < SECONDS and len(many) < MOST_LANES:
        # The first runs are slow for other reasons than their lanes: not too much at once.
        wanted = len(many) * min(10.0, max(1.5, 1.3 * SECONDS / seconds))
        many = lanes[np.arange(min(MOST_LANES, int(wanted) + 1)) % len(lanes)]
    seconds, used = _best(many, prepared, REPEATS)
    lane_step = used / (len(many) * prepared.scheme.steps)
    mode = _cost_of_a_mode(many, prepared, lane_step)
    modes, counted = prepared.scheme.modes, count(prepared.stepper.string)
    flops, peak = counted.flops * modes, _peak()
    return Speed(
        threads=numba.get_num_threads(),
        lanes=len(many),
        seconds=seconds,
        lanes_per_second=len(many) / seconds,
        lane_step_ns=1e9 * lane_step,
        mode_ns=None if mode is None else 1e9 * mode,
        laws_ns=None if mode is None else 1e9 * (lane_step - modes * mode),
        flops_per_step=flops,
        peak_flops=peak,
        share_of_peak=flops / lane_step / peak,
        pass_share_of_peak=None if mode is None else counted.flops / mode / peak,
    )


@cache
def _peak() -> float:
    return multiply_adds()


def _best(lanes: Lanes, prepared: Prepared, repeats: int) -> tuple[float, float]:
    """Least time on the clock and of all threads (s)."""
    found = []
    for _ in range(repeats):
        begin, used = time.perf_counter(), time.process_time()
        run_batch(lanes, prepared)
        found.append((time.perf_counter() - begin, time.process_time() - used))
    clock, busy = zip(*found, strict=True)
    return min(clock), min(busy)


def _cost_of_a_mode(lanes: Lanes, prepared: Prepared, lane_step: float) -> float | None:
    """Slope of the time of a step against the number of modes (s); None where there is none."""
    string, old = lanes.string, prepared.scheme
    if isinstance(prepared.stepper.string, DenseString):
        return None
    runs = []
    for modes in _numbers_of_modes(string, old.step, old.modes):
        stepper = string_step(string, old.step, modes)
        if type(stepper.string) is not type(prepared.stepper.string):
            continue
        rounds = max(1, old.sampling)
        steps = max(1, round(SHORT / (lane_step * len(lanes)) / rounds)) * rounds
        scheme = replace(old, modes=modes, steps=min(old.steps, steps))
        duration = scheme.steps * old.step
        runs.append((modes, scheme.steps, Prepared(stepper, scheme, duration, 0.0)))
    if len(runs) < 3:
        return None
    counts = [modes for modes, _, _ in runs]
    times = [_best(lanes, made, REPEATS)[1] / (steps * len(lanes)) for _, steps, made in runs]
    slope = float(np.polyfit(counts, times, 1)[0])
    return slope if 0.0 < slope * old.modes < lane_step else None


def _numbers_of_modes(string: Drillstring, step: float, modes: int) -> list[int]:
    """Some numbers from 2 up to twice those of the scheme, as far as the step can follow."""
    frequency, _ = string.undamped_modes
    followed = int((frequency * step <= LARGEST_TURN).sum())
    most = min(string.nodes, followed, 2 * modes)
    return sorted({int(n) for n in np.linspace(2, most, 5)}) if most >= 2 else []
