"""A string seen from its ends by solving M, C and K at each frequency.

The slowest of the three ways and the most direct: it takes any viscous damping, knows nothing
of sections, and checks the other two.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from drillctl.drillstring import Drillstring, Parts
from drillctl.linear.transmission import EndMobility

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]


class Banded:
    """Mobility of a finite-element string from its matrices."""

    def __init__(self, string: Drillstring) -> None:
        self.string = string
        # Only neighbours are coupled, unless damping is given mode by mode.
        self.tridiagonal = string.parts.modal_damping == 0.0
        self._forces = np.zeros((string.nodes, 2))
        self._forces[0, 0] = self._forces[-1, 1] = 1.0
        matrices = (string.mass, string.damping, string.stiffness)
        shape = _bands if self.tridiagonal else _dense
        self._m, self._c, self._k = (shape(x) for x in matrices)

    @property
    def parts(self) -> Parts:
        """Sections and ends."""
        return self.string.parts

    def mobility(
        self, s: ComplexArray, top: ComplexArray | complex = 0.0, bit: ComplexArray | complex = 0.0
    ) -> EndMobility:
        """Response to torques on the two ends; see `transmission.Lines.mobility`."""
        s = np.asarray(s, dtype=complex)
        at = s.ravel()
        ends = np.broadcast_arrays(at, np.ravel(top), np.ravel(bit))[1:]
        solve = self._tridiagonal if self.tridiagonal else self._dense
        angle = np.array([solve(x, a, b) for x, a, b in zip(at, *ends, strict=True)])
        speed = (at[:, None, None] * angle).reshape(*s.shape, 3, 2)
        first = self.string.element_stiffness[0] + s * self.string.element_damping[0]
        pipe = (first / s)[..., None] * (speed[..., 0, :] - speed[..., 1, :])
        return EndMobility(
            top=speed[..., 0, 0],
            bit=speed[..., 2, 1],
            transfer=speed[..., 2, 0],
            pipe_from_top=pipe[..., 0],
            pipe_from_bit=pipe[..., 1],
        )

    def bit_impedance(self, s: ComplexArray, top: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the bit (N m s/rad), with `top` added at the drive."""
        return 1.0 / self.mobility(s, top=top).bit

    def top_impedance(self, s: ComplexArray, bit: ComplexArray | complex = 0.0) -> ComplexArray:
        """Torque per speed at the top (N m s/rad), with `bit` added at the rock."""
        return 1.0 / self.mobility(s, bit=bit).top

    def _tridiagonal(self, s: complex, top: complex, bit: complex) -> ComplexArray:
        """Angles of nodes 0, 1 and last (rad) per torque on first and last (N m)."""
        bands = self._k + s * (self._c + s * self._m)
        bands[1, 0] += s * top
        bands[1, -1] += s * bit
        angles = scipy.linalg.solve_banded((1, 1), bands, self._forces, overwrite_ab=True)
        return np.asarray(angles[[0, 1, -1]])

    def _dense(self, s: complex, top: complex, bit: complex) -> ComplexArray:
        matrix = self._k + s * (self._c + s * self._m)
        matrix[0, 0] += s * top
        matrix[-1, -1] += s * bit
        return np.asarray(np.linalg.solve(matrix, self._forces)[[0, 1, -1]])


def _dense(matrix: Any) -> Array:
    return np.asarray(matrix.toarray())


def _bands(matrix: Any) -> Array:
    """A tridiagonal matrix in the storage of `scipy.linalg.solve_banded`."""
    bands = np.zeros((3, matrix.shape[0]))
    bands[0, 1:] = matrix.diagonal(1)
    bands[1] = matrix.diagonal()
    bands[2, :-1] = matrix.diagonal(-1)
    return bands
