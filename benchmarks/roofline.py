"""The modal pass beside the machine's peak: operations and bytes by formula, time by measurement.

A step of a lane is a pass over the modes and a step of the laws. The same run with more modes
takes longer by the pass alone, so that the slope of time against modes is what a mode costs in
place, in the very kernel that makes maps. Nothing of the engine's inside is called.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.cost import Count, count
from benchmarks.job import Job
from benchmarks.peaks import Machine
from benchmarks.peers.engine import map_lanes, on_cores
from benchmarks.timing import in_turn
from drillctl.simulation.batch import run_batch, warm_up

MODES = (4, 8, 12, 16, 20, 24, 28)
STEP, DURATION = 0.02, 10.0


def measure(job: Job, machine: Machine, rounds: int) -> dict[str, Any]:
    """Cost of a mode on one core, and what it is of the peaks."""
    runs: dict[int, Callable[[], Any]] = {}
    table = {"simulation.step": f"{STEP} s", "simulation.duration": f"{DURATION} s"}
    for modes in MODES:
        lanes, prepared = map_lanes(job, table | {"simulation.modes": modes})
        warm_up(lanes, prepared)
        runs[modes] = lambda lanes=lanes, prepared=prepared: run_batch(lanes, prepared)
    with on_cores(1):
        calls = in_turn(runs, dict.fromkeys(runs, rounds))
    per = 1.0 / (job.size * round(DURATION / STEP))
    # The best of several, as the peaks are: what others take of the machine is not the pass.
    step = {modes: min(c.core_seconds for c in made) * per for modes, made in calls.items()}
    slope, rest = np.polyfit(list(step), list(step.values()), 1)
    fitted = np.array([slope * modes + rest for modes in step])
    counted = count(prepared.stepper.string)
    flops = counted.flops / slope
    return {
        "lane_step_s": {str(modes): value for modes, value in step.items()},
        "mode_s": float(slope),
        "laws_s": float(rest),
        "worst_fit": float(np.abs(fitted / list(step.values()) - 1.0).max()),
        "flops_a_mode": counted.flops,
        "bytes_a_mode": counted.bytes,
        "intensity": counted.intensity,
        "flops": float(flops),
        "share_of_peak": float(flops / machine.flops),
        "share_of_first_cache": float(counted.bytes / slope / machine.updates),
        "standard": _of_standard(job, slope, rest, counted, machine),
    }


def _of_standard(
    job: Job, slope: float, rest: float, counted: Count, machine: Machine
) -> dict[str, float]:
    """The standard accuracy's modes: share of a step that is the pass, operations in all."""
    _, prepared = map_lanes(job, {"simulation.accuracy": "standard"})
    modes = prepared.scheme.modes
    whole = slope * modes + rest
    return {
        "modes": modes,
        "pass_share_of_step": float(slope * modes / whole),
        "pass_flops_over_whole_step": float(counted.flops * modes / whole),
        "pass_flops_over_whole_step_share_of_peak": float(
            counted.flops * modes / whole / machine.flops
        ),
    }
