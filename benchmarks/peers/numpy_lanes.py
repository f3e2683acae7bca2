"""Plain NumPy over all lanes: modes propagated exactly, friction set-valued, no events located.

What a careful user would write without a compiler: the idea of the batch engine in its simplest
form. Modes that a step can follow, the mean torques of a step held over it, a few Newton
iterations for every lane, stick and slip decided at the ends of steps. J1 by the trapezoid.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg

from benchmarks.job import Array, Job, Rig

TITLE = "NumPy over lanes"
STEP = 0.02
"""Length of a step (s), for J1 errors of the engine's class."""
PHASE = 1.1
"""Modes that turn more than this in a step (rad) are left out."""
NEWTON = 3
LANES = 420
"""Lanes at a time: their modes stay in the second cache."""


class Modes(NamedTuple):
    """Modes of the string over one step, a row each; columns for lanes."""

    cosine: Array
    sine_over: Array  # sin(w h) / w, s
    minus_w_sine: Array  # -w sin(w h), 1/s
    angle_push: Array  # modal angle per held modal force, s^2
    speed_push: Array  # modal speed per the same, s
    top: Array
    bit: Array


class Lanes(NamedTuple):
    """The numbers that differ, or might, from lane to lane; shape (lanes,)."""

    kp: Array
    ki: Array
    high: Array  # a1 W, N m
    fall: Array  # (a2 - a1) W, N m
    beta: Array
    set_speed: Array
    start_speed: Array


@dataclass(frozen=True, eq=False)
class NumPyLanes:
    """The whole map in one call, block after block."""

    name: str
    solves: str
    cores: int
    jobs: tuple[tuple[int, ...], ...]
    modes: Modes
    lanes: Lanes
    steps: int

    def run(self, cells: tuple[int, ...]) -> Array:
        chosen = np.array(cells)
        parts = np.array_split(chosen, -(-len(chosen) // LANES))
        return np.concatenate(
            [self._block(Lanes(*(v[part] for v in self.lanes))) for part in parts]
        )

    def _block(self, lanes: Lanes) -> Array:
        block = Block(self.modes, lanes, STEP)
        for _ in range(self.steps):
            block.step()
        return block.deviation / lanes.set_speed


class Block:
    """Some lanes on their way."""

    def __init__(self, modes: Modes, lanes: Lanes, step: float) -> None:
        self.modes, self.lanes, self.h = modes, lanes, step
        # Untwisted: the rigid-body mode alone moves, the first.
        shape = (len(modes.top), len(lanes.kp))
        self.angle, self.speed = np.zeros(shape), np.zeros(shape)
        start = lanes.start_speed - lanes.set_speed
        self.speed[0] = start / modes.bit[0]
        self.top = np.zeros(shape[1])
        self.bit_speed = lanes.start_speed.copy()
        self.direction = np.sign(self.bit_speed)
        self.torque = self._friction(self.bit_speed)[0]
        self.deviation = np.zeros(shape[1])
        self.top_by_top = modes.top @ (modes.angle_push * modes.top)
        self.top_by_bit = modes.top @ (modes.angle_push * modes.bit)
        self.bit_by_top = modes.bit @ (modes.speed_push * modes.top)
        self.bit_by_bit = modes.bit @ (modes.speed_push * modes.bit)
        # The PI law on means over a step is affine in the top angle at its end.
        self.slope = lanes.kp / step + 0.5 * lanes.ki
        self.back = lanes.kp / step - 0.5 * lanes.ki
        self.shrink = 1.0 / (1.0 + self.slope * self.top_by_top)
        self.share = self.slope * self.top_by_bit * self.shrink
        self.gain = self.bit_by_bit - self.bit_by_top * self.share

    def _friction(self, speed: Array) -> tuple[Array, Array]:
        falling = self.lanes.fall * np.exp(-self.lanes.beta * np.abs(speed))
        return self.lanes.high + falling, -self.lanes.beta * falling

    def step(self) -> None:
        """Advance all lanes by one step."""
        modes, lanes = self.modes, self.lanes
        free_angle = modes.cosine * self.angle + modes.sine_over * self.speed
        free_speed = modes.minus_w_sine * self.angle + modes.cosine * self.speed
        top_free, bit_free = modes.top @ free_angle, modes.bit @ free_speed
        alone = (self.back * self.top - self.slope * top_free) * self.shrink
        free = lanes.set_speed + bit_free + self.bit_by_top * alone
        new, torque = self._meet_rock(free)
        top_torque = alone + self.share * torque
        push = np.outer(modes.top, top_torque) - np.outer(modes.bit, torque)
        self.angle = free_angle + modes.angle_push[:, None] * push
        self.speed = free_speed + modes.speed_push[:, None] * push
        self.top = top_free + self.top_by_top * top_torque - self.top_by_bit * torque
        before, after = np.abs(self.bit_speed - lanes.set_speed), np.abs(new - lanes.set_speed)
        self.deviation += 0.5 * self.h * (before + after)
        self.bit_speed = new

    def _meet_rock(self, free: Array) -> tuple[Array, Array]:
        """Bit speed at the end of the step and the mean bit torque: w + gain T = free."""
        static = self.lanes.high + self.lanes.fall
        half = 0.5 * self.gain
        own = self.direction * (free - half * self.direction * self.torque) > half * static
        sign = np.where(own, self.direction, np.sign(free))
        right = sign * free - half * np.where(own, self.torque, static)
        u = np.maximum(sign * self.bit_speed, 0.0)
        for _ in range(NEWTON):
            torque, slope = self._friction(u)
            u = np.maximum(u + (right - u - half * torque) / (1.0 + half * slope), 0.0)
        stuck = ~own & (np.abs(free) <= self.gain * static)
        new = np.where(stuck, 0.0, sign * u)
        self.direction = np.where(stuck, 0.0, sign)
        self.torque = np.where(stuck, static, 2.0 * (right - u) / self.gain)
        return new, (free - new) / self.gain


def modes_of(rig: Rig, step: float) -> Modes:
    """Modes of a rig's string over one step."""
    squares, shapes = scipy.linalg.eigh(rig.stiffness, rig.mass)
    w = np.sqrt(np.maximum(squares, 0.0))
    w[0] = 0.0
    kept = w * step <= PHASE
    w, shapes = w[kept][1:], shapes[:, kept]
    if shapes[-1, 0] < 0.0:
        shapes[:, 0] *= -1.0
    c, s = np.cos(w * step), np.sin(w * step)
    rows = [
        np.concatenate([[rigid], elastic])
        for rigid, elastic in (
            (1.0, c), (step, s / w), (0.0, -w * s), (0.5 * step**2, (1.0 - c) / w**2),
        )
    ]  # fmt: skip
    cosine, sine_over, minus_w_sine, angle_push = rows
    columns = cosine[:, None], sine_over[:, None], minus_w_sine[:, None]
    return Modes(*columns, angle_push, sine_over, shapes[0], shapes[-1])


def make(job: Job) -> list[NumPyLanes]:
    cells = range(job.size)
    rig = job.rig(job.cells[0])
    # Only the gains differ over the map.
    kp, ki = (np.asarray(a.values) for a in job.axes)
    full = np.ones(job.size)
    values = [
        rig.a1 * rig.weight, (rig.a2 - rig.a1) * rig.weight, rig.beta, rig.set_speed,
        rig.start_speed,
    ]  # fmt: skip
    grids = np.meshgrid(kp, ki, indexing="ij")
    lanes = Lanes(*(g.ravel() for g in grids), *(v * full for v in values))
    solves = "set-valued friction; modes propagated exactly, decisions at ends of steps"
    name = f"NumPy over lanes, step {1e3 * STEP:g} ms"
    steps = round(rig.duration / STEP)
    return [NumPyLanes(name, solves, 1, (tuple(cells),), modes_of(rig, STEP), lanes, steps)]
