"""drillctl's batch engine at each named accuracy: the whole map in one call."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from benchmarks.job import Array, Job
from drillctl.ensemble.grid import groups
from drillctl.simulation.batch import Prepared, prepare, run_batch, warm_up
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.measures import STATUSES

TITLE = "drillctl"
HEADLINE = "drillctl, standard"
"""The row that ratios are taken to."""
ONE_CORE = "drillctl, standard, one core"
"""The same held to one core."""


@dataclass(frozen=True, eq=False)
class Engine:
    """The engine on some cores."""

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]
    lanes: Lanes
    prepared: Prepared
    give_up: float

    def run(self, cells: tuple[int, ...]) -> Array:
        """J1 of all cells; NaN where the lane was given up."""
        with on_cores(self.cores):
            batch = run_batch(self.lanes, self.prepared, self.give_up)
        given_up = batch.status == STATUSES.index("censored")
        return np.where(given_up, np.nan, batch.measures["j1"])


@contextmanager
def on_cores(cores: int) -> Iterator[None]:
    """Hold the engine to so many cores."""
    before = numba.get_num_threads()
    numba.set_num_threads(cores)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def make(job: Job) -> list[Engine]:
    cores = numba.config.NUMBA_NUM_THREADS
    highest = max(job.design.tables.map.levels)
    rows = [
        ("drillctl, fast", cores, "fast", math.inf),
        (HEADLINE, cores, "standard", math.inf),
        (ONE_CORE, 1, "standard", math.inf),
        ("drillctl, fine", cores, "fine", math.inf),
        (f"drillctl, fast, given up over {highest:g}", cores, "fast", highest),
    ]
    return [engine(job, *row) for row in rows]


def engine(job: Job, name: str, cores: int, accuracy: str, give_up: float) -> Engine:
    """One row: the engine at an accuracy, lanes given up over a level of J1 or followed."""
    lanes, prepared = map_lanes(job, {"simulation.accuracy": accuracy})
    warm_up(lanes, prepared)
    scheme = prepared.scheme
    solves = f"set-valued friction; {scheme.modes} exact modes, steps of {1e3 * scheme.step:g} ms"
    return Engine(name, solves, cores, (tuple(range(job.size)),), lanes, prepared, give_up)


def map_lanes(job: Job, values: dict[str, Any]) -> tuple[Lanes, Prepared]:
    """All lanes of the map with these values in its design, and their scheme."""
    design = job.design.replace(values)
    (group,) = groups(design, job.axes)
    return group.lanes, prepare(group.lanes, design.tables.simulation)
