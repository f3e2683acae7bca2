"""python-control: drillctl's plant as a `StateSpace`, a PI law and a rock as nonlinear blocks.

`control.input_output_response` integrates the interconnection by SciPy and knows no events: the
rock is regularised as in the diffrax row, and J1 is a state of the rock's block.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.job import Array, Job, Rig
from benchmarks.peers.diffrax_lanes import WIDTH

TITLE = "python-control"
RTOL, ATOL = 1e-4, 1e-6


@dataclass(frozen=True, eq=False)
class PythonControl:
    """Interconnected systems, one cell at a time."""

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]
    loops: dict[int, tuple[Any, Array, float]]

    def run(self, cells: tuple[int, ...]) -> Array:
        return np.array([self._j1(*self.loops[cell]) for cell in cells])

    def _j1(self, loop: Any, start: Array, duration: float) -> float:
        import control

        found = control.input_output_response(
            loop, np.array([0.0, duration]), 0.0, start, solve_ivp_method="LSODA",
            solve_ivp_kwargs={"rtol": RTOL, "atol": ATOL},
        )  # fmt: skip
        return float(np.ravel(found.outputs)[-1])


def loop_of(rig: Rig) -> tuple[Any, Array]:
    """The closed loop with J1 as its output, and its initial state."""
    import control

    n = len(rig.mass)
    inverse = np.linalg.inv(rig.mass)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ rig.stiffness, np.zeros((n, n))]])
    b = np.zeros((2 * n, 2))
    b[n:, 0], b[n:, 1] = inverse[:, 0], -inverse[:, -1]
    c = np.zeros((2, 2 * n))
    c[0, n], c[1, 2 * n - 1] = 1.0, 1.0
    plant = control.ss(
        a, b, c, np.zeros((2, 2)), name="string", inputs=["top_torque", "bit_torque"],
        outputs=["top_speed", "bit_speed"],
    )  # fmt: skip
    drive = control.ss(
        0.0, 1.0, -rig.ki, -rig.kp, name="drive", inputs=["top_speed"], outputs=["top_torque"]
    )
    rock = control.nlsys(
        _deviates, _brakes, name="rock", inputs=["bit_speed"], outputs=["bit_torque", "j1"],
        states=1, params={"rig": rig},
    )  # fmt: skip
    loop = control.interconnect([plant, drive, rock], inputs=[], outputs=["j1"])
    start = np.zeros(2 * n + 2)
    start[n : 2 * n] = rig.start_speed - rig.set_speed
    return loop, start


def _deviates(time: float, x: Array, u: Array, params: dict[str, Any]) -> Array:
    return np.abs(u[:1]) / params["rig"].set_speed


def _brakes(time: float, x: Array, u: Array, params: dict[str, Any]) -> Array:
    rig: Rig = params["rig"]
    speed = u[0] + rig.set_speed
    size = rig.a1 + (rig.a2 - rig.a1) * np.exp(-rig.beta * abs(speed))
    return np.array([rig.weight * size * np.tanh(speed / WIDTH), x[0]])


def make(job: Job) -> list[PythonControl]:
    loops = {}
    for cell in job.cells:
        rig = job.rig(cell)
        loops[cell] = (*loop_of(rig), rig.duration)
    jobs = tuple((cell,) for cell in job.cells)
    solves = f"regularised friction, tanh(w / {WIDTH:g} rad/s); input_output_response, LSODA"
    return [PythonControl(f"python-control, rtol {RTOL:.0e}, tanh", solves, 1, jobs, loops)]
