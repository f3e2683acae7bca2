"""The exact step of a string as matrices, whatever form the kernels take it in."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from drillctl.simulation.kernels.string_step import BlockString, DenseString, UndampedString

Array = NDArray[np.float64]


class StringMatrices(NamedTuple):
    """z(t + h) = free z(t) + push [T_top, T_bit], and what is read off z."""

    free: Array  # shape (states, states): Sparse but for a dense string: blocks of two states
    push: Array  # shape (states, 2): Per torque on the top, and per braking torque on the bit
    # shape (states,): Rows that read angle (rad) and speeds (rad/s) in the frame
    top_angle: Array
    bit_speed: Array
    top_speed: Array
    pipe: Array  # shape (states,): Row that reads the pipe torque (N m)


def string_matrices(string: Any) -> StringMatrices:
    """Matrices of a string as the kernels have it (`StringStep.string`)."""
    if isinstance(string, UndampedString):
        return _undamped(string)
    if isinstance(string, BlockString):
        return _blocks(string)
    assert isinstance(string, DenseString)
    return StringMatrices(
        string.free, string.push, string.top_angle, string.bit_speed, string.top_speed, string.pipe
    )


def _undamped(string: UndampedString) -> StringMatrices:
    """X' = x + y', y' = y - kappa x, pushed before it by the torques of the last step."""
    kappa = string.kappa
    one, zero = np.ones_like(kappa), np.zeros_like(kappa)
    blocks = np.moveaxis(np.array([[one - kappa, one], [-kappa, one]]), -1, 0)
    push = np.stack([string.push, -string.ratio[:, None] * string.push], axis=-1)
    return StringMatrices(
        scipy.linalg.block_diag(*blocks),
        push.reshape(-1, 2),
        np.stack([one, zero], axis=1).ravel(),
        string.bit_speed.ravel(),
        string.top_speed.ravel(),
        np.stack([string.pipe, zero], axis=1).ravel(),
    )


def _blocks(string: BlockString) -> StringMatrices:
    """Of each block the states are its parts of the top angle and of the bit speed."""
    count = len(string.free)
    return StringMatrices(
        scipy.linalg.block_diag(*string.free.reshape(count, 2, 2)),
        string.push.reshape(2 * count, 2),
        np.tile([1.0, 0.0], count),
        np.tile([0.0, 1.0], count),
        string.top_speed.ravel(),
        string.pipe.ravel(),
    )
