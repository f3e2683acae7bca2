"""The exact step of modes without damping, in the coordinates that take the fewest operations.

A mode with frequency w turns by theta = w h in a step h, and its free motion obeys

    x(t + h) = x + y(t + h),    y(t + h) = y - kappa x,    kappa = 4 sin(theta/2)^2,

exactly, with x its part of the top angle and y(t) = x(t) - x(t - h) in free motion. That is a
multiply-add and an addition, where a turning vector takes two multiply-adds and two products; and
no number in it is the small difference of large ones, however slow the mode. The torques act on
both through one sum, T_top - ratio T_bit, as x has the top's amplitude for its unit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WEAKEST_TOP = 1e-6
"""Smallest share of the largest amplitude at the top that a mode can be told by."""
LARGEST_TURN = 2.5
"""Turn in a step (rad) up to which the two coordinates tell angle and speed of a mode apart."""


def undamped_step(
    frequency: Array, top: Array, bit: Array, below: Array, stiffness: float, step: float
) -> tuple[dict[str, Any], Array] | None:
    """Fields of an `UndampedString` and the matrix from modal to block states; None if unfit."""
    turn = frequency * step
    if turn.max() > LARGEST_TURN or np.abs(top).min() < WEAKEST_TOP * np.abs(top).max():
        return None
    kappa = 4.0 * np.sin(0.5 * turn) ** 2
    glide = step * np.sinc(turn / np.pi)  # sin(w h) / w
    ratio = bit / top
    angle = top**2 * 0.5 * step**2 * np.sinc(0.5 * turn / np.pi) ** 2  # (1 - cos w h) / w^2
    speed = top**2 * glide
    # v = (y - kappa/2 x) / glide is the mode's part of the top speed.
    by_x, by_y = -0.5 * kappa / glide, 1.0 / glide
    fields = {
        "kappa": kappa,
        "ratio": ratio,
        "push": np.stack([angle, 0.5 * kappa * angle + glide * speed], axis=1),
        "bit_speed": np.stack([ratio * by_x, ratio * by_y], axis=1),
        "pipe": stiffness * (top - below) / top,
        "top_speed": np.stack([by_x, by_y], axis=1),
        "angle_by_top": float(angle.sum()),
        "angle_by_bit": float(angle @ ratio),
        "speed_by_top": float(speed @ ratio),
        "speed_by_bit": float(speed @ ratio**2),
        "top_speed_by_top": float(speed.sum()),
        "top_speed_by_bit": float(speed @ ratio),
    }
    modes = len(frequency)
    basis = np.zeros((modes, 2, 2 * modes))
    at = np.arange(modes)
    basis[at, 0, at] = top
    basis[at, 1, at] = 0.5 * kappa * top
    basis[at, 1, modes + at] = glide * top
    return fields, basis.reshape(2 * modes, 2 * modes)
