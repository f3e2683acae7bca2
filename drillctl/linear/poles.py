"""Poles of a string and the shapes that go with them, in coordinates of its undamped modes.

In modal coordinates q the string is q'' + D q' + w^2 q = 0 with D = Phi^T C Phi. Where D is
diagonal each mode is a quadratic with roots in closed form; else the first-order matrix in
(w q, q') is solved, in which all entries are of the size of frequencies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from drillctl.rig.drillstring import Drillstring

Array = NDArray[np.float64]
Shape = NDArray[np.complex128]

DIAGONAL = 1e-10
"""Largest off-diagonal entry of a modal damping matrix taken as rounding, over the largest."""


class Pole(NamedTuple):
    """One pole in the upper half plane, the real axis included."""

    value: complex  # of the pole (rad/s)
    shape: Shape  # shape (nodes,): Angles of the nodes, to a complex factor


def free_free_poles(string: Drillstring) -> list[Pole]:
    """Poles of the string with both ends free, by magnitude; the rigid body is the first."""
    frequency, shapes = string.undamped_modes
    damping = shapes.T @ (string.damping @ shapes)
    rigid = Pole(0.0, shapes[:, 0].astype(complex))
    braked = bool(string.ground_damping.any())
    kept = slice(0 if braked else 1, None)
    result = _poles(frequency[kept], damping[kept, kept], shapes[:, kept])
    return [rigid, *sorted(result, key=_size)]


def fixed_top_poles(string: Drillstring) -> list[Pole]:
    """Poles of the string with the top drive held, by magnitude."""
    from threadpoolctl import threadpool_limits

    # One BLAS thread, since another count gives other bits.
    with threadpool_limits(limits=1, user_api="blas"):
        squares, below = scipy.linalg.eigh(
            string.stiffness.toarray()[1:, 1:], string.mass.toarray()[1:, 1:]
        )
    shapes = np.vstack([np.zeros(len(squares)), below])
    damping = shapes.T @ (string.damping @ shapes)
    return sorted(_poles(np.sqrt(squares), damping, shapes), key=_size)


def _size(pole: Pole) -> float:
    return abs(pole.value)


def _poles(frequency: Array, damping: Array, shapes: Array) -> list[Pole]:
    """Poles of q'' + D q' + w^2 q = 0; of a mode with w = 0 that of its speed alone."""
    # Which modes a damping matrix couples depends on the boundary: it is asked here for each.
    off_diagonal = damping - np.diag(np.diagonal(damping))
    if np.all(np.abs(off_diagonal) <= DIAGONAL * np.abs(damping).max(initial=0.0)):
        return [
            Pole(value, shapes[:, i].astype(complex))
            for i, w in enumerate(frequency)
            for value in quadratic_poles(float(w), float(damping[i, i]))
        ]
    return _coupled_poles(frequency, damping, shapes)


def quadratic_poles(frequency: float, damping: float) -> list[complex]:
    """Roots of s^2 + damping s + frequency^2, of a conjugate pair the upper one."""
    half = damping / 2.0
    if half < frequency:
        return [complex(-half, math.sqrt((frequency - half) * (frequency + half)))]
    # The smaller root from the product of both: their difference would cancel.
    fast = half + math.sqrt((half - frequency) * (half + frequency))
    return (
        [complex(-fast)] if frequency == 0.0 else [complex(-fast), complex(-(frequency**2) / fast)]
    )


def _coupled_poles(frequency: Array, damping: Array, shapes: Array) -> list[Pole]:
    modes = len(frequency)
    elastic = np.flatnonzero(frequency)
    stiffness = np.zeros((len(elastic), modes))
    stiffness[np.arange(len(elastic)), elastic] = frequency[elastic]
    matrix = np.block(
        [[np.zeros((len(elastic), len(elastic))), stiffness], [-stiffness.T, -damping]]
    )
    values, vectors = scipy.linalg.eig(matrix)
    # The speeds of a pole, q' = s q, have the shape of its angles.
    return [
        Pole(complex(value), shapes @ vectors[len(elastic) :, i])
        for i, value in enumerate(values)
        if value.imag >= 0.0
    ]
