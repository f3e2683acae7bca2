"""drillctl's reference solver as the audit runs it, compiled, and its peer in plain Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.job import Array, Job
from benchmarks.peers.reference import solver
from drillctl.design import Design
from drillctl.ensemble.audit import TOLERANCE
from drillctl.simulation.reference import solve
from drillctl.simulation.run import deviation

TITLE = "reference solver"
COMPILED = "drillctl reference, 1e-7"
PLAIN = "the same in Python, 1e-7"


@dataclass(frozen=True, eq=False)
class Reference:
    """One of the two."""

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]
    designs: dict[int, Design]
    j1: Callable[[Design], float]

    def run(self, cells: tuple[int, ...]) -> Array:
        return np.array([self.j1(self.designs[cell]) for cell in cells])


def compiled_j1(design: Design) -> float:
    """J1 (s) by the compiled solver."""
    table = design.tables.simulation
    return deviation(solve(design, TOLERANCE), table.j1_from, table.duration) / design.speed


def plain_j1(design: Design) -> float:
    """J1 (s) by SciPy's DOP853 on dense matrices."""
    return solver.j1(solver.solve(design, TOLERANCE))


def make(job: Job) -> list[Reference]:
    designs = {cell: job.cell(cell) for cell in job.cells}
    jobs = tuple((cell,) for cell in job.cells)
    compiled_j1(designs[job.cells[0]])
    solves = "set-valued friction; stick and slip as phases, changes located, dense output"
    return [
        Reference(COMPILED, solves, 1, jobs, designs, compiled_j1),
        Reference(PLAIN, solves, 1, jobs, designs, plain_j1),
    ]
