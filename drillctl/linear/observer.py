"""An observer of the bit: its speed estimated from top speed and top torque alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.linalg

from drillctl.arrays import Array, ComplexArray
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.rig.drillstring import Drillstring

MODES = 4
"""Elastic modes that the observer follows, or all there are: the travel of a wave through the
pipe, which no observer can beat, is in them."""
TORQUE_WANDERS = 2e3
"""How far the unknown bit torque is taken to wander in a second (N m): the torque of a bit that
breaks loose falls by some kilonewton metres within one."""
SPEED_NOISE = 0.02
"""Noise of the top speed over a second's mean (rad/s): a fifth of a revolution a minute."""


@dataclass(frozen=True, eq=False)
class Observer:
    """x' = free x + by_torque T + by_speed w; bit speed = read x; all in the turning frame."""

    free: Array  # shape (states, states): State matrix (1/s)
    # shape (states,): Input of the drive's torque, less all damping to ground at the set speed,
    # and of the top speed
    by_torque: Array
    by_speed: Array
    read: Array  # shape (states,): Bit speed per state
    # shape (states, nodes): State of a string under no bit torque, per nodal angle and speed
    from_angle: Array
    from_speed: Array

    @property
    def states(self) -> int:
        """Number of states."""
        return len(self.read)

    def state(self, angle: Array, speed: Array) -> Array:
        """State that a string in this motion leaves the observer with.

        `angle`, `speed`, shape (nodes,), in the frame (rad, rad/s).
        """
        return np.asarray(self.from_angle @ angle + self.from_speed @ speed)

    def transfer(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Estimated bit speed per torque (rad/s per N m) and per top speed, at `s` (1/s)."""
        s = np.asarray(s, dtype=complex)
        matrices = s[..., None, None] * np.eye(self.states) - self.free
        both = np.linalg.solve(matrices, np.column_stack([self.by_torque, self.by_speed]) + 0j)
        seen = self.read @ both
        return seen[..., 0], seen[..., 1]


def observer_of(design: Design) -> Observer | None:
    """Observer of the bit, where the weight law of a design has one."""
    modes = getattr(design.tables.weight_on_bit, "observer_modes", None)
    return None if modes is None else observer(design.string, modes)


@lru_cache(maxsize=4)  # of a string and of no copy of it: thousands of draws of a rock share one
def observer(string: Drillstring, modes: int = MODES) -> Observer:
    """A steady-state Kalman filter on the lowest modes of a string."""
    frequency, shapes = string.undamped_modes
    kept = min(modes, string.nodes - 1)
    frequency, shapes = frequency[1 : kept + 1], shapes[:, : kept + 1]
    damping = shapes.T @ (string.damping @ shapes)
    n = 2 * kept + 2
    rigid, speeds, torque = 0, slice(kept + 1, n - 1), n - 1
    modal = [rigid, *range(kept + 1, n - 1)]
    a = np.zeros((n, n))
    a[1 : kept + 1, speeds] = np.eye(kept)
    a[speeds, 1 : kept + 1] = -np.diag(frequency**2)
    a[np.ix_(modal, modal)] -= damping
    a[modal, torque] = -shapes[-1]
    push = np.zeros(n)
    push[modal] = shapes[0]
    top, bit = np.zeros(n), np.zeros(n)
    top[modal], bit[modal] = shapes[0], shapes[-1]
    gain = _kalman(a, top, torque)
    mass = shapes.T @ string.mass.toarray()
    from_angle, from_speed = np.zeros((2, n, string.nodes))
    from_angle[1 : kept + 1] = mass[1:]
    from_speed[modal] = mass
    return Observer(a - np.outer(gain, top), push, gain, bit, from_angle, from_speed)


def _kalman(a: Array, top: Array, torque: int) -> Array:
    """Gain of the stationary filter; the bit torque is scaled for the sake of the solver."""
    scale = np.ones(len(a))
    scale[torque] = TORQUE_WANDERS
    scaled = a * scale / scale[:, None]
    wander = np.zeros((len(a), len(a)))
    wander[torque, torque] = 1.0
    try:
        covariance = scipy.linalg.solve_continuous_are(
            scaled.T, top[:, None] * scale[:, None], wander + 1e-9 * np.eye(len(a)),
            np.array([[SPEED_NOISE**2]]),
        )  # fmt: skip
    except (ValueError, np.linalg.LinAlgError):
        raise InputError(
            "no observer can be computed for this string: its inertias or frequencies are too "
            "far apart",
            "weight_on_bit.observer_modes",
        ) from None
    return np.asarray(scale * (covariance @ top) / SPEED_NOISE**2)
