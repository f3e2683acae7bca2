"""Poles of the loop, the slope of the rock included."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drillctl.drillstring import Drillstring
from drillctl.linear.state_space import StateMatrices, closed_loop_matrices

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]

STACK = 2**22
"""Entries of the matrices that are solved together, 32 MB of them."""


def with_slope(matrices: StateMatrices, slope: float) -> StateMatrices:
    """State matrices with a rock torque that falls by `slope` (N m s/rad) closed at the bit."""
    a, b, c, d = matrices
    return StateMatrices(a - slope * np.outer(b[:, 1], c[1]), b, c, d)


def loop_poles(string: Drillstring, kp: float, ki: float, slope: float) -> ComplexArray:
    """Eigenvalues of the closed loop."""
    matrices = with_slope(closed_loop_matrices(string, kp, ki), slope)
    poles = np.linalg.eigvals(matrices.a)
    return np.asarray(poles[np.argsort(np.abs(poles), kind="stable")])


def many_loop_poles(
    string: Drillstring, kp: ArrayLike, ki: ArrayLike, slope: ArrayLike, threads: int = 1
) -> ComplexArray:
    """Eigenvalues for many gains at once."""
    kp, ki, slope = (np.ravel(x) for x in np.broadcast_arrays(kp, ki, slope))
    # The matrix is affine in the three numbers: two controllers and one slope give its parts.
    still = closed_loop_matrices(string, 0.0, 1.0).a
    per_kp = closed_loop_matrices(string, 1.0, 1.0).a - still
    two = closed_loop_matrices(string, 0.0, 2.0)
    per_ki = two.a - still
    per_slope = -np.outer(two.b[:, 1], two.c[1])
    base = still - per_ki

    def solve(part: NDArray[np.int64]) -> ComplexArray:
        k, i, d = (x[part, None, None] for x in (kp, ki, slope))
        poles = np.linalg.eigvals(base + k * per_kp + i * per_ki + d * per_slope)
        order = np.argsort(np.abs(poles), axis=1, kind="stable")
        return np.take_along_axis(poles, order, axis=1).astype(complex)

    states = len(base)
    length = max(1, STACK // states**2)
    parts = [np.arange(len(kp))[i : i + length] for i in range(0, len(kp), length)]
    with ThreadPoolExecutor(threads) as pool:
        poles = np.concatenate(list(pool.map(solve, parts)))
    # Without integral action nothing reads its state: a pole at zero that is not the loop's.
    poles[ki == 0.0, 0] = np.nan
    return poles
