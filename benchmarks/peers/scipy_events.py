"""SciPy's `solve_ivp`: LSODA and RK45 with located events, one cell at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.job import Array, Job
from benchmarks.peers.phases import Phases, march, phases

TITLE = "SciPy"
LSODA = "SciPy LSODA, rtol 1e-6"


@dataclass(frozen=True, eq=False)
class SciPy:
    """One integrator of SciPy."""

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]
    systems: dict[int, Phases]
    options: dict[str, Any]

    def run(self, cells: tuple[int, ...]) -> Array:
        return np.array([self._j1(self.systems[cell]) for cell in cells])

    def _j1(self, system: Phases) -> float:
        end = system.rig.duration

        def integrate(time: float, y: Array, direction: int) -> tuple[float, Array, bool]:
            found = solve_ivp(
                _rates(system, direction), (time, end), y,
                events=_event(system, direction), **self.options,
            )  # fmt: skip
            return found.t[-1], found.y[:, -1].copy(), found.status == 1

        return march(system, integrate)


def _rates(system: Phases, direction: int) -> Callable[[float, Array], Array]:
    rig, n, s = system.rig, system.nodes, direction
    stiffness, speed, kp, ki = rig.stiffness, rig.set_speed, rig.kp, rig.ki
    inverse = system.turning if s else system.stuck
    high, fall, beta = rig.a1 * rig.weight, (rig.a2 - rig.a1) * rig.weight, rig.beta

    def rates(time: float, y: Array) -> Array:
        force = -(stiffness @ y[:n])
        force[0] -= kp * y[n] + ki * y[0]
        bit = y[2 * n - 1]
        if s:
            # A trial step may overshoot zero speed by far before its event is located.
            force[-1] -= s * (high + fall * math.exp(min(-beta * s * (bit + speed), 50.0)))
        return np.concatenate([y[n : 2 * n], inverse @ force, [abs(bit) / speed]])

    return rates


def _event(system: Phases, direction: int) -> Callable[[float, Array], float]:
    speed, reaction, static = system.rig.set_speed, system.reaction, system.static
    if direction:

        def event(time: float, y: Array) -> float:
            # A phase begins at exactly zero speed: that is no event.
            return direction * (y[-2] + speed) or 1e-300
    else:

        def event(time: float, y: Array) -> float:
            return static - abs(reaction @ y[:-1])

    event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
    return event


def make(job: Job) -> list[SciPy]:
    systems = {cell: phases(job.rig(cell)) for cell in job.cells}
    jobs = tuple((cell,) for cell in job.cells)
    solves = "set-valued friction; stick and slip as phases, changes located"
    return [
        SciPy(name, solves, 1, jobs, systems, {"method": method, "rtol": 1e-6, "atol": 1e-8})
        for name, method in ((LSODA, "LSODA"), ("SciPy RK45, rtol 1e-6", "RK45"))
    ]
