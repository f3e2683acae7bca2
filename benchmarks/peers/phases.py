"""Slip and stick as separate smooth systems, as a user of an integrator with events writes them.

The state is y = [angles, speeds, J1] in the frame that turns at the set speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.job import Array, Rig

Integrate = Callable[[float, Array, int], tuple[float, Array, bool]]
"""Time, state and direction of turning (0: stuck) to the time and state where the phase ends, and
whether it ended by its event rather than at the end of the run."""


@dataclass(frozen=True, eq=False)
class Phases:
    """A rig's equations by phase.

    Attributes
    ----------
    rig : Rig
        In plain numbers.
    turning, stuck : ndarray, shape (n, n)
        Accelerations by forces while the bit turns, and while it is held.
    reaction : ndarray, shape (2 n,)
        Torque that holds a bit at rest, by angles and speeds.
    """

    rig: Rig
    turning: Array
    stuck: Array
    reaction: Array

    @property
    def nodes(self) -> int:
        return len(self.turning)

    @property
    def static(self) -> float:
        """Static torque (N m)."""
        return self.rig.a2 * self.rig.weight

    def start(self) -> Array:
        """State at time zero: untwisted, all nodes at the start's speed."""
        y = np.zeros(2 * self.nodes + 1)
        y[self.nodes : -1] = self.rig.start_speed - self.rig.set_speed
        return y

    def next_direction(self, y: Array, direction: int) -> int:
        """Direction after an event; the bit is at rest at this moment."""
        held = float(self.reaction @ y[:-1])
        if direction and abs(held) <= self.static:
            return 0
        return 1 if held > 0 else -1


def phases(rig: Rig) -> Phases:
    """Prepare a rig."""
    n = len(rig.mass)
    stuck = np.zeros((n, n))
    stuck[:-1, :-1] = np.linalg.inv(rig.mass[:-1, :-1])
    force = np.zeros((n, 2 * n))
    force[:, :n] = -rig.stiffness
    force[0, 0] -= rig.ki
    force[0, n] -= rig.kp
    reaction = force[-1] - rig.mass[-1] @ stuck @ force
    return Phases(rig, np.linalg.inv(rig.mass), stuck, reaction)


def march(system: Phases, integrate: Integrate) -> float:
    """J1 of a whole run, phase after phase."""
    time, y, direction = 0.0, system.start(), 1
    while time < system.rig.duration:
        time, y, by_event = integrate(time, y, direction)
        if by_event:
            y[-2] = -system.rig.set_speed
            direction = system.next_direction(y, direction)
    return float(y[-1])
