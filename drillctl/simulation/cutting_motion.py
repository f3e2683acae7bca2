"""A run of the reference solver under a bit that cuts its own wake, as `run.py` sees it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from drillctl.arrays import Array
from drillctl.rig.top_drive import RealDrive
from drillctl.simulation import cutting
from drillctl.simulation import cutting_events as e
from drillctl.simulation import cutting_tape as tape
from drillctl.simulation.cutting_tape import FIRST, LAST
from drillctl.simulation.measures import EnergyAudit, Event

if TYPE_CHECKING:
    from drillctl.design import Design

ANGLE, DEPTH, TOP, BELOW = range(4)  # what the tape holds of each step
INSIDE = np.linspace(0.0, 1.0, 9)  # shares of a step at which extremes are looked for


@dataclass(frozen=True, eq=False)
class CuttingMotion:
    """A whole run; what `Motion` has for `run.py`, and the axial side."""

    design: Design  # what was simulated
    located: cutting.Located
    method: str = "Dormand-Prince 5(4)"

    @cached_property
    def _tape(self) -> Array:
        memory = self.located.memory
        return np.asarray(memory.tape[: memory.count[2]])

    @cached_property
    def begins(self) -> Array:
        """When each step begins (s)."""
        return self._tape[:, 0]

    @cached_property
    def ends(self) -> Array:
        """When each step ends (s)."""
        return self._tape[:, 0] + self._tape[:, 1]

    @cached_property
    def directions(self) -> Array:
        """1 in each step that the bit turns in, 0 where it stands still."""
        return (self._tape[:, LAST + 4] > 5.0).astype(float)

    @cached_property
    def axial(self) -> Array:
        """Axial phase of each step."""
        return self._tape[:, LAST + 4] - 10.0 * self.directions

    @property
    def events(self) -> tuple[Event, ...]:
        """Sticks, releases, axial sticks and slips, contact lost and found again."""
        memory = self.located.memory
        return tuple(
            Event(float(time), e.EVENTS[int(kind)], int(kind == e.RELEASE))
            for time, kind in memory.events[: memory.count[3]]
        )

    def _values(self, which: int, time: Array, slope: bool = False) -> Array:
        step = np.minimum(np.searchsorted(self.ends, time), len(self.ends) - 1)
        row, h = self._tape[step], self._tape[step, 1]
        share = np.clip((time - row[:, 0]) / h, 0.0, 1.0)
        k = FIRST + 6 * which
        numbers = (row[:, k + i] for i in range(6))
        made = (tape.hermite_slope if slope else tape.hermite).py_func(share, h, *numbers)
        return np.asarray(made / h if slope else made)

    def _between(self, column: int, time: Array) -> Array:
        step = np.minimum(np.searchsorted(self.ends, time), len(self.ends) - 1)
        row = self._tape[step]
        share = np.clip((time - row[:, 0]) / row[:, 1], 0.0, 1.0)
        return np.asarray(row[:, column] + share * (row[:, column + 1] - row[:, column]))

    def bit_angle(self, time: Array) -> Array:
        """Angle of the bit in the frame (rad) at times (s)."""
        return self._values(ANGLE, time) - self.design.speed * time

    def mean_speed(self, begin: float, end: float) -> float:
        """Mean bit speed between two times (rad/s)."""
        first, last = self._values(ANGLE, np.array([begin, end]))
        return float(last - first) / (end - begin)

    @cached_property
    def _speeds(self) -> tuple[Array, Array]:
        """Times inside each step, and bit speeds there in the frame, shape (steps, shares)."""
        time = self.begins[:, None] + self._tape[:, 1, None] * INSIDE
        flat = self._values(ANGLE, time.ravel(), slope=True).reshape(time.shape)
        return time, np.maximum(flat, 0.0) - self.design.speed

    @property
    def extremes(self) -> Array:
        """Bit speeds in the frame at many times: shape (times, 2)."""
        time, speed = self._speeds
        return np.stack([time.ravel(), speed.ravel()], axis=1)

    @property
    def crossings(self) -> Array:
        """When the bit turns at the set speed (s), in a first column."""
        time, speed = self._speeds
        a, b = speed[:, :-1], speed[:, 1:]
        at = np.nonzero(a * b < 0.0)
        share = a[at] / (a[at] - b[at])
        return (time[:, :-1][at] + share * (time[:, 1:] - time[:, :-1])[at])[:, None]

    @cached_property
    def energy(self) -> EnergyAudit:
        """Energy balance: drive and hook against rock, dampers and what is stored."""
        memory = self.located.memory
        first = len(memory.state) - e.WORKS
        works = memory.state[first:]
        change = self._stored(memory.state) - self._stored(self.located.before)
        rock = works[2] + works[3] + memory.now[4]
        return EnergyAudit(float(works[0]), float(rock), float(works[4]), change, float(works[1]))

    def _stored(self, state: Array) -> float:
        task, total = self.located.task, 0.0
        n = len(task.torsion.by_bit)
        ones = cutting.torsional(self.design.string, n // 2).modal.sum(axis=1)
        begin = 0
        for side, more in ((task.torsion, ones * self.design.speed), (task.axial, 0.0)):
            half = len(side.by_bit) // 2
            place, speed = state[begin : begin + half], state[begin + half : begin + 2 * half]
            squares = -np.diag(side.a[half:, :half])
            total += 0.5 * float(np.sum((speed + more) ** 2) + np.sum(squares * place**2))
            begin += 2 * half
        return total

    def signals(self, time: Array) -> dict[str, Array]:
        """Every signal at times (s), by the names of `run.SIGNALS`."""
        design, speed = self.design, self.design.speed
        step = np.minimum(np.searchsorted(self.ends, time), len(self.ends) - 1)
        still = self.directions[step] == 0.0
        frame = speed * time
        top, below = self._values(TOP, time) - frame, self._values(BELOW, time) - frame
        top_speed = self._values(TOP, time, slope=True)
        bit = self.bit_angle(time)
        spring, damper = design.string.element_stiffness[0], design.string.element_damping[0]
        if isinstance(design.top_drive, RealDrive):
            drive = self._between(LAST + 7, time)
        else:
            program = design.program.speed
            led = np.array([[program.at(t), program.integral(t)] for t in time]).T
            drive = design.top_drive.torque(top - led[1], top_speed - speed - led[0]) + 0.0 * time
        return {
            "top_speed": top_speed,
            "bit_speed": np.where(still, 0.0, self._values(ANGLE, time, slope=True)),
            "twist": top - bit,
            "top_angle": top,
            "bit_angle": bit,
            "top_torque": drive,
            "pipe_torque": spring * (top - below)
            + damper * (top_speed - self._values(BELOW, time, slope=True)),
            "bit_torque": self._between(LAST + 2, time),
            "weight_on_bit": self._between(LAST, time),
            "stuck": still.astype(float),
            "bit_depth": self._values(DEPTH, time),
            "penetration": self._values(DEPTH, time, slope=True),
        }

    def axial_measures(self) -> dict[str, float]:
        """What the axial motion adds to the measures."""
        lengths, duration = self._tape[:, 1], self.design.tables.simulation.duration
        cut = 0.5 * (self._tape[:, LAST + 5] + self._tape[:, LAST + 6])
        drilled = float(self._tape[-1, FIRST + 9] - self._tape[0, FIRST + 6])
        return cutting.axial_measures(
            self.design.bit_rock, duration, drilled,
            float(cut @ lengths) / duration, float(lengths[self.axial == e.STUCK].sum()),
            float(lengths[self.axial == e.OFF].sum()), self.energy.bit,
        )  # fmt: skip
