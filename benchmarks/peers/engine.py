"""drillctl's batch engine at each named accuracy: the whole map in one call."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numba

from benchmarks.job import Array, Job
from drillctl.simulation.batch import prepare, run_batch, warm_up
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
    job: Job
    values: dict[str, Any]

    @cached_property
    def ready(self) -> tuple[Any, Any]:
        """All lanes of the map, and their scheme; the kernel compiled."""
        design = self.job.design.replace(self.values)
        (group,) = groups(design, self.job.axes)
        prepared = prepare(group.lanes, design.tables.simulation)
        warm_up(group.lanes, prepared)
        return group.lanes, prepared

    def run(self, cells: tuple[int, ...]) -> Array:
        lanes, prepared = self.ready
        before = numba.get_num_threads()
        numba.set_num_threads(self.cores)
        try:
            return run_batch(lanes, prepared).measures["j1"]
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
    solves = "set-valued friction; modes propagated exactly, a scalar inclusion a step"
    return Engine(name, solves, cores, (tuple(range(job.size)),), job, values)
