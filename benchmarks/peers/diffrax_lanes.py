"""diffrax on the CPU, vmapped over lanes: adaptive Tsit5 on a regularised law.

An integrator of smooth differential equations has no set-valued friction and no phases of its own
in a vmapped run. It is given sign(w) as tanh(w / width); what that costs is its J1 error. A
narrower width costs steps in proportion, since the bit then settles within width x inertia / static
torque.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.job import Array, Job

TITLE = "diffrax"
WIDTH = 0.02
"""Of the regularised law (rad/s)."""
RTOL, ATOL = 1e-4, 1e-6
LANES = 64
"""Lanes in a vmapped run: all cells that are compared, and others spread over the map."""
FLAGS = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"


@dataclass(frozen=True, eq=False)
class Diffrax:
    """One compiled function over some lanes."""

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]
    gains: Array
    compiled: Any

    def run(self, cells: tuple[int, ...]) -> Array:
        return np.asarray(self.compiled(self.gains[list(cells)]))


def make(job: Job) -> list[Diffrax]:
    # Read when jax starts: one core, as the other peers.
    os.environ.setdefault("XLA_FLAGS", FLAGS)
    import diffrax  # noqa: F401
    import jax

    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_platforms", "cpu")
    spread = np.linspace(0, job.size - 1, LANES).round().astype(int)
    others = [int(c) for c in spread if int(c) not in job.cells]
    cells = (*job.cells, *others[: LANES - len(job.cells)])
    kp, ki = np.meshgrid(*(np.asarray(a.values) for a in job.axes), indexing="ij")
    gains = np.stack([kp.ravel(), ki.ravel()], axis=1)
    solves = f"regularised friction, tanh(w / {WIDTH:g} rad/s); vmapped over {LANES} lanes"
    name = f"diffrax Tsit5, rtol {RTOL:.0e}, tanh"
    return [Diffrax(name, solves, 1, (cells,), gains, _compiled(job))]


def _compiled(job: Job) -> Any:
    import diffrax
    import jax
    import jax.numpy as jnp

    rig = job.rig(job.cells[0])
    n = len(rig.mass)
    inverse, stiffness = jnp.asarray(np.linalg.inv(rig.mass)), jnp.asarray(rig.stiffness)
    high, fall = rig.a1 * rig.weight, (rig.a2 - rig.a1) * rig.weight

    def rates(time: Any, y: Any, gains: Any) -> Any:
        angle, speed = y[:n], y[n : 2 * n]
        bit = speed[-1] + rig.set_speed
        torque = (high + fall * jnp.exp(-rig.beta * jnp.abs(bit))) * jnp.tanh(bit / WIDTH)
        force = -(stiffness @ angle)
        force = force.at[0].add(-gains[0] * speed[0] - gains[1] * angle[0])
        force = force.at[-1].add(-torque)
        j1 = jnp.abs(speed[-1:]) / rig.set_speed
        return jnp.concatenate([speed, inverse @ force, j1])

    start = np.zeros(2 * n + 1)
    start[n : 2 * n] = rig.start_speed - rig.set_speed
    y0 = jnp.asarray(start)
    controller = diffrax.PIDController(rtol=RTOL, atol=ATOL)

    def j1(gains: Any) -> Any:
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(rates), diffrax.Tsit5(), t0=0.0, t1=rig.duration, dt0=1e-3, y0=y0,
            args=gains, stepsize_controller=controller, max_steps=None,
            saveat=diffrax.SaveAt(t1=True),
        )  # fmt: skip
        return found.ys[0, -1]

    return jax.jit(jax.vmap(j1)).lower(np.zeros((LANES, 2))).compile()
