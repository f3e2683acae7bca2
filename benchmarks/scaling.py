"""How the cost grows with lanes, with elements and with the horizon; whole machine, standard."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.job import Job
from benchmarks.peers.engine import map_lanes
from benchmarks.timing import Call, in_turn
from drillctl.design import Design, load
from drillctl.simulation.batch import prepare, run_batch, warm_up
from drillctl.simulation.lanes import Lanes, lane_numbers, lanes_of, single_lane

LANES = (1_000, 3_162, 10_000, 31_623, 100_000, 316_228, 1_000_000)
ELEMENTS = (30, 100, 300, 1_000)
HORIZONS = (10.0, 31.6, 100.0, 316.0, 1_000.0)
WALL_NODES = (1, 4, 12, 20)
WALL_LANES = 1_600
PLAIN_WALL: dict[str, Any] = {  # ideal drive, no program: what the wall alone costs is the largest
    "scenario.speed.lag": "0 s", "scenario.speed.start": None, "simulation.duration": "4 s",
    "simulation.step": "4 ms", "simulation.modes": 13,
}  # fmt: skip
WORK = 300_000
"""Lanes that are worth repeating: more of them are timed fewer times."""


def spread_lanes(design: Design, first: int, count: int) -> Lanes:
    """Lanes `first` to `first + count` of an endless sequence over the map's plane of gains.

    Any stretch of it covers the plane evenly (R2, an additive recurrence): every number of lanes
    has the same mixture of settling and sticking.
    """
    numbers = {key: np.full(count, value) for key, value in lane_numbers(design).items()}
    n = np.arange(first, first + count)
    root = 1.32471795724474602596  # real root of x^3 = x + 1
    numbers["drive.kp"] = 1000.0 * ((n / root) % 1.0)
    numbers["drive.ki"] = 500.0 * ((n / root**2) % 1.0)
    return lanes_of(design, numbers)


def over_lanes(job: Job, most: int, rounds: int) -> dict[str, Any]:
    """Seconds by number of lanes, and the slope of their logarithms."""
    lanes = spread_lanes(job.design, 0, min(most, max(LANES)))
    prepared = prepare(lanes[:16], job.design.tables.simulation)
    warm_up(lanes, prepared)
    counts = [n for n in LANES if n <= most]
    runs: dict[int, Callable[[], Any]] = {
        n: lambda part=lanes[:n]: run_batch(part, prepared) for n in counts
    }
    repeats = {n: max(1, min(rounds, WORK // n)) for n in counts}
    return _summary(in_turn(runs, repeats), None)


def over_elements(job: Job, rounds: int) -> dict[str, Any]:
    """Seconds by number of elements of the map, modes chosen automatically."""
    runs, chosen = {}, {}
    for elements in ELEMENTS:
        lanes, prepared = map_lanes(job, {"drillstring.sections.pipe.elements": elements})
        runs[elements] = lambda lanes=lanes, prepared=prepared: run_batch(lanes, prepared)
        chosen[str(elements)] = {"modes": prepared.scheme.modes, "step": prepared.scheme.step}
    return _summary(in_turn(runs, dict.fromkeys(runs, rounds)), chosen)


def over_horizons(job: Job, rounds: int) -> dict[str, Any]:
    """Seconds by length of the run of the map."""
    runs = {}
    for horizon in HORIZONS:
        lanes, prepared = map_lanes(job, {"simulation.duration": f"{horizon} s"})
        runs[horizon] = lambda lanes=lanes, prepared=prepared: run_batch(lanes, prepared)
    return _summary(in_turn(runs, dict.fromkeys(runs, rounds)), None)


def over_wall(rounds: int) -> dict[str, Any]:
    """Seconds by number of nodes at which the wall rubs, the bit among them, at equal modes.

    With one node there is the bit alone. Beside them a plain lane, on which no wall rubs:
    `of_plain` is what one with 12 nodes costs over that, `lane_step_s` its processor time a lane
    and step.
    """
    runs, chosen = {}, {}
    for nodes in (0, *WALL_NODES):
        friction = {"well.friction_nodes": nodes} if nodes else {"well.friction_factor": None}
        design = load("well-a-off-bottom", **PLAIN_WALL, **friction)
        lanes = single_lane(design)[np.zeros(WALL_LANES, dtype=np.int64)]
        prepared = prepare(lanes, design.tables.simulation)
        warm_up(lanes, prepared)
        runs[nodes] = lambda lanes=lanes, prepared=prepared: run_batch(lanes, prepared)
        chosen[str(nodes)] = {"modes": prepared.scheme.modes, "step": prepared.scheme.step}
    calls = in_turn(runs, dict.fromkeys(runs, rounds))
    plain, rubbed = (statistics.median(c.core_seconds for c in calls[n]) for n in (0, 12))
    del calls[0]
    lane_step = rubbed / WALL_LANES / prepared.scheme.steps
    return _summary(calls, chosen) | {"of_plain": rubbed / plain, "lane_step_s": lane_step}


def _summary(calls: dict[Any, list[Call]], chosen: dict[str, Any] | None) -> dict[str, Any]:
    """Medians and ranges by size, and slopes of logarithms, on the clock and of processor time."""
    sizes = list(calls)
    clock = {size: [call.seconds for call in calls[size]] for size in sizes}
    seconds = [statistics.median(clock[size]) for size in sizes]
    core = [statistics.median(call.core_seconds for call in calls[size]) for size in sizes]
    found: dict[str, Any] = {
        "sizes": sizes,
        "seconds": seconds,
        "core_seconds": core,
        "low": [min(clock[size]) for size in sizes],
        "high": [max(clock[size]) for size in sizes],
        "repeats": [len(clock[size]) for size in sizes],
        "slope": _slope(sizes, seconds),
        "core_slope": _slope(sizes, core),
        "largest_over_smallest": max(seconds) / min(seconds),
        "core_largest_over_smallest": max(core) / min(core),
    }
    return found if chosen is None else found | {"chosen": chosen}


def _slope(sizes: list[float], seconds: list[float]) -> float:
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])
