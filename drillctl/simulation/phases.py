"""Slip and stick as two smooth systems of the same state.

In the frame that turns at the set speed, with u the angles and v the speeds,

    M v' = -K u - C v - g Omega + e_top T_m - e_bit T_b,

where g Omega is what damping to ground takes at the set speed. In slip T_b is the friction
torque; in stick v_bit = -Omega is held and T_b is the reaction that holds it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drillctl.arrays import Array
from drillctl.rig.drillstring import Drillstring


@dataclass(frozen=True, eq=False)
class Phase:
    """Accelerations as a linear function of the motion and of the two end torques."""

    motion: Array  # shape (nodes, 2 nodes): Acceleration per angle (1/s2) and per speed (1/s)
    load: Array  # shape (nodes,): Acceleration due to damping to ground at the set speed (rad/s2)
    # shape (nodes,): Acceleration per torque at the top and per braking torque at the bit (1/(kg
    # m2))
    top: Array
    bit: Array

    @cached_property
    def first_order(self) -> Array:
        """Rates of [angles, speeds] per [angles, speeds, top torque, bit torque, 1].

        Shape (2 nodes, 2 nodes + 3): one product gives all rates of the motion, which is what
        an integrator spends its time on.
        """
        nodes = len(self.load)
        matrix = np.zeros((2 * nodes, 2 * nodes + 3))
        matrix[:nodes, nodes : 2 * nodes] = np.eye(nodes)
        matrix[nodes:, : 2 * nodes] = self.motion
        matrix[nodes:, 2 * nodes :] = np.column_stack([self.top, -self.bit, self.load])
        return matrix


@dataclass(frozen=True, eq=False)
class Reaction:
    """Torque that holds a stuck bit, as a linear function of motion and top torque."""

    motion: Array  # shape (2 nodes,): Torque per angle (N m/rad) and per speed (N m s/rad)
    load: float  # torque of damping to ground (N m)
    top: float  # torque per top torque

    def torque(self, motion: Array, top_torque: float) -> float:
        """Reaction (N m); positive when the string pushes the bit forward."""
        return float(self.motion @ motion) + self.load + self.top * top_torque


def slip_phase(string: Drillstring, set_speed: float) -> Phase:
    """The string with a bit that turns; `set_speed` in rad/s."""
    inverse = np.linalg.inv(string.mass.toarray())
    return _phase(string, set_speed, inverse)


def stick_phase(string: Drillstring, set_speed: float) -> tuple[Phase, Reaction]:
    """The string with a bit at rest, and the torque that keeps it there."""
    mass = string.mass.toarray()
    inverse = np.zeros_like(mass)
    inverse[:-1, :-1] = np.linalg.inv(mass[:-1, :-1])
    phase = _phase(string, set_speed, inverse)
    coupling = mass[-1]
    own = np.concatenate([string.stiffness.toarray()[-1], string.damping.toarray()[-1]])
    reaction = Reaction(
        motion=-(coupling @ phase.motion + own),
        load=float(-(coupling @ phase.load) - string.ground_damping[-1] * set_speed),
        top=float(-(coupling @ phase.top)),
    )
    return phase, reaction


def _phase(string: Drillstring, set_speed: float, inverse: Array) -> Phase:
    stiffness, damping = string.stiffness.toarray(), string.damping.toarray()
    return Phase(
        motion=-inverse @ np.hstack([stiffness, damping]),
        load=-inverse @ string.ground_damping * set_speed,
        top=inverse[:, 0].copy(),
        bit=inverse[:, -1].copy(),
    )
