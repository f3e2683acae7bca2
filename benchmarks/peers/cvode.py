"""CVODE as scikit-sundae offers it: compiled right-hand side, called through Python."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.job import Array, Job
from benchmarks.peers.compiled import compile_for, event, packed, rates
from benchmarks.peers.phases import Phases, march, phases

TITLE = "CVODE (scikit-sundae)"
RTOL, ATOL = 1e-6, 1e-8


@dataclass(frozen=True, eq=False)
class Cvode:
    """Adams methods of CVODE, one cell at a time."""

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]
    systems: dict[int, Phases]

    def run(self, cells: tuple[int, ...]) -> Array:
        return np.array([self._j1(self.systems[cell]) for cell in cells])

    def _j1(self, system: Phases) -> float:
        solvers = {direction: _solver(system, direction) for direction in (-1, 0, 1)}
        end = system.rig.duration

        def integrate(time: float, y: Array, direction: int) -> tuple[float, Array, bool]:
            solvers[direction].init_step(time, y)
            found = solvers[direction].step(end)
            if not found.success:
                raise ArithmeticError(found.message)
            by_event = found.t_events is not None and len(found.t_events) > 0
            return float(np.ravel(found.t)[-1]), np.atleast_2d(found.y)[-1].copy(), by_event

        return march(system, integrate)


def _solver(system: Phases, direction: int) -> Any:
    from sksundae.cvode import CVODE

    numbers = packed(system, direction)

    def rhs(time: float, y: Array, out: Array) -> None:
        rates(y, out, numbers)

    def found(time: float, y: Array, out: Array) -> None:
        out[0] = event(y, numbers)

    found.terminal, found.direction = [True], [-1]  # type: ignore[attr-defined]
    return CVODE(
        rhs, method="Adams", rtol=RTOL, atol=ATOL, eventsfn=found, num_events=1,
        max_num_steps=1_000_000,
    )  # fmt: skip


def make(job: Job) -> list[Cvode]:
    import sksundae  # noqa: F401

    systems = {cell: phases(job.rig(cell)) for cell in job.cells}
    compile_for(systems[job.cells[0]])
    solves = "set-valued friction; stick and slip as phases, changes located; Adams"
    jobs = tuple((cell,) for cell in job.cells)
    return [Cvode(f"{TITLE}, rtol {RTOL:.0e}", solves, 1, jobs, systems)]
