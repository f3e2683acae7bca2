"""A string seen from its ends by summing over its modes, for damping given mode by mode.

Damping that is given mode by mode couples all nodes and has no place in a transmission line.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.drillstring import Drillstring, Parts
from drillctl.linear.poles import DIAGONAL
from drillctl.linear.transmission import EndMobility

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]

CHUNK = 256
"""Frequencies solved at a time where the modes are coupled."""


class Expansion:
    """Mobility of a finite-element string from its undamped free-free modes."""

    def __init__(self, string: Drillstring) -> None:
        self.string = string

    @property
    def parts(self) -> Parts:
        """Sections and ends."""
        return self.string.parts

    @cached_property
    def _internal_damping(self) -> Array:
        """Damping between the modes (1/s), without the dampers at the two ends."""
        _, shapes = self.string.undamped_modes
        top, bit = shapes[0], shapes[-1]
        whole = shapes.T @ (self.string.damping @ shapes)
        ends = self.parts.top_damping * np.outer(top, top)
        ends += self.parts.bit_damping * np.outer(bit, bit)
        return np.asarray(whole - ends)

    def mobility(
        self, s: ComplexArray, top: ComplexArray | complex = 0.0, bit: ComplexArray | complex = 0.0
    ) -> EndMobility:
        """Response to torques on the two ends; see `transmission.Lines.mobility`."""
        s = np.asarray(s, dtype=complex)
        free, determinant = self._free(s)
        up, down = self.parts.top_damping + top, self.parts.bit_damping + bit
        own_top, own_bit, across = free[..., 0, 0], free[..., 2, 1], free[..., 2, 0]
        closed = 1.0 / (1.0 + up * own_top + down * own_bit + up * down * determinant)
        # The node under the drive: what the two ends leave of a torque on either of them.
        below_top = free[..., 1, 0] * (1.0 + down * own_bit) - free[..., 1, 1] * down * across
        below_bit = free[..., 1, 1] * (1.0 + up * own_top) - free[..., 1, 0] * up * across
        first = self.string.element_stiffness[0] + s * self.string.element_damping[0]
        top_mobility = (own_top + down * determinant) * closed
        return EndMobility(
            top=top_mobility,
            bit=(own_bit + up * determinant) * closed,
            transfer=across * closed,
            pipe_from_top=first / s * (top_mobility - below_top * closed),
            pipe_from_bit=first / s * (across - below_bit) * closed,
        )

    def bit_impedance(self, s: ComplexArray, top: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the bit (N m s/rad), with `top` added at the drive."""
        return 1.0 / self.mobility(s, top=top).bit

    def top_impedance(self, s: ComplexArray, bit: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the top (N m s/rad), with `bit` added at the rock."""
        return 1.0 / self.mobility(s, bit=bit).top

    def _free(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Speeds of nodes 0, 1 and last per torque on first and last, with both ends free.

        Shape (..., 3, 2); and the determinant of what the ends feel of each other.
        """
        frequency, shapes = self.string.undamped_modes
        seen, driven = shapes[[0, 1, -1]], shapes[[0, -1]]
        damping = self._internal_damping
        off = damping - np.diag(np.diagonal(damping))
        flat = s.ravel()
        if np.abs(off).max() <= DIAGONAL * np.abs(damping).max():
            # The rigid body apart: of slow motion it is nearly all, and the determinant lives
            # on the rest.
            rigid = 1.0 / (flat + damping[0, 0])
            column = flat[:, None]
            each = column / (column**2 + column * np.diagonal(damping)[1:] + frequency[1:] ** 2)
            elastic = np.einsum("am,fm,bm->fab", seen[:, 1:], each, driven[:, 1:], optimize=True)
            found = elastic + rigid[:, None, None] * np.outer(seen[:, 0], driven[:, 0])
            t, b = driven[:, 0]
            ends = elastic[:, [0, 2]]
            mixed = t * t * ends[:, 1, 1] + b * b * ends[:, 0, 0] - 2.0 * t * b * ends[:, 1, 0]
            determinant = rigid * mixed + np.linalg.det(ends)
        else:
            found = np.concatenate(
                [self._solved(flat[i : i + CHUNK]) for i in range(0, len(flat), CHUNK)]
            )
            determinant = np.linalg.det(found[:, [0, 2]])
        return np.asarray(found).reshape(*s.shape, 3, 2), np.reshape(determinant, s.shape)

    def _solved(self, s: ComplexArray) -> ComplexArray:
        frequency, shapes = self.string.undamped_modes
        matrix = s[:, None, None] * self._internal_damping
        matrix = matrix + np.eye(len(frequency)) * (s[:, None] ** 2 + frequency**2)[:, None, :]
        driven = np.broadcast_to(shapes[[0, -1]].T, (len(s), len(frequency), 2))
        angles = shapes[[0, 1, -1]] @ np.linalg.solve(matrix, driven)
        return np.asarray(s[:, None, None] * angles)
