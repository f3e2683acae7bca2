"""drillctl's batch engine at each named accuracy: the whole map in one call."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numba

from benchmarks.job import Array, Job
from drillctl.simulation.batch import Prepared, prepare, run_batch, warm_up
from drillctl.simulation.lanes import Lanes
from drillctl.studies.grid import groups

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

    def run(self, cells: tuple[int, ...]) -> Array:
        with on_cores(self.cores):
            return run_batch(self.lanes, self.prepared).measures["j1"]


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
    rows = [
        ("drillctl, fast", cores, {"simulation.accuracy": "fast"}),
        (HEADLINE, cores, {"simulation.accuracy": "standard"}),
        (ONE_CORE, 1, {"simulation.accuracy": "standard"}),
        ("drillctl, fine", cores, {"simulation.accuracy": "fine"}),
    ]
    return [engine(job, name, used, values) for name, used, values in rows]


def engine(job: Job, name: str, cores: int, values: dict[str, Any]) -> Engine:
    """One row: the engine with these values of the design."""
    lanes, prepared = map_lanes(job, values)
    warm_up(lanes, prepared)
    scheme = prepared.scheme
    solves = f"set-valued friction; {scheme.modes} exact modes, steps of {1e3 * scheme.step:g} ms"
    return Engine(name, solves, cores, (tuple(range(job.size)),), lanes, prepared)


def map_lanes(job: Job, values: dict[str, Any]) -> tuple[Lanes, Prepared]:
    """All lanes of the map with these values in its design, and their scheme."""
    design = job.design.replace(values)
    (group,) = groups(design, job.axes)
    return group.lanes, prepare(group.lanes, design.tables.simulation)
