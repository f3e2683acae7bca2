r"""Friction-slope margin: the falling slope at the bit that a loop tolerates.

With the rock's torque falling by D per speed at the operating point the loop is
:math:`D\,H(s) = 1`, where H is the mobility of the bit (speed per forward torque) with the
drive closed. Without slope the loop only loses energy. As D grows its poles reach the
imaginary axis where H, and with it the impedance 1/H, is real; the least such impedance is

.. math:: D^*(K_p, K_i) = \min_\omega \{ \mathrm{Re}\, 1/H(i\omega) :
          \mathrm{Im}\, 1/H(i\omega) = 0 \},

and the equilibrium is stable while D < D*. No eigenvalue is computed: D* keeps its digits where
the damping of high modes is below the rounding of a pole, and costs the same for any number of
elements and for the continuum.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from drillctl.arrays import Array, ComplexArray, Index
from drillctl.errors import InputError
from drillctl.linear.ends import Ends, telling_grid

CHUNK = 256  # gain pairs computed together: their signs on the grid fit the second-level cache
CANDIDATES = 5
"""Crossings of a gain pair that are refined in a map: those that look lowest on the grid, and
the one of lowest frequency."""


class Crossings(NamedTuple):
    """Slopes at which a pair of poles, or a real one, lies on the imaginary axis."""

    slope: Array  # falling slope (N m s/rad)
    omega: Array  # angular frequency of the poles (rad/s); 0 for a real pole


def crossings(ends: Ends, kp: float, ki: float) -> Crossings:
    """All slopes at which poles reach the imaginary axis under PI control, lowest first."""
    search = _Search(ends)
    gains = np.array([[kp, ki]], dtype=float)
    refuse_gains(gains)
    _, place = search.brackets(gains)
    omega = search.refined(place, np.broadcast_to(gains[0], (len(place), 2)))
    slope = np.asarray(search.impedance(omega, kp, ki).real, dtype=float)
    if ki == 0.0:
        slope, omega = np.append(slope, kp + search.rigid), np.append(omega, 0.0)
    slope = np.maximum(slope, 0.0)
    if kp == 0.0 and not search.lossy:  # exactly, not to rounding
        slope[:] = ends.parts.bit_damping
    order = np.lexsort([omega, slope])
    return Crossings(slope[order], omega[order])


def slope_margin(ends: Ends, kp: float, ki: float) -> tuple[float, float]:
    """D* (N m s/rad) and the angular frequency that decides (rad/s); see `crossings`.

    A loop that tolerates any slope has an infinite D*, at no frequency (NaN).
    """
    result = crossings(ends, kp, ki)
    if len(result.slope) == 0:
        return math.inf, math.nan
    return float(result.slope[0]), float(result.omega[0])


def slope_margins(
    ends: Ends, kp: ArrayLike, ki: ArrayLike, candidates: int = CANDIDATES
) -> Crossings:
    """D* over many gain pairs at once.

    Parameters
    ----------
    ends : Ends
        The string.
    kp, ki : array_like
        Gains (N m s/rad, N m/rad), not negative; broadcast against each other.
    candidates : int
        Crossings of each pair that are refined.

    Returns
    -------
    Crossings
        Those that decide, in the common shape of the gains. Of each pair the few that look lowest
        on the grid are refined, so that among high modes of nearly one margin the wrong one may
        decide: that changes D* by 1e-4 of itself at most, see `docs/linear.md`.
    """
    kp, ki = np.broadcast_arrays(np.asarray(kp, dtype=float), np.asarray(ki, dtype=float))
    gains = np.column_stack([kp.ravel(), ki.ravel()])
    refuse_gains(gains)
    search = _Search(ends, candidates)
    slope, omega = np.full(len(gains), np.inf), np.zeros(len(gains))
    for first in range(0, len(gains), CHUNK):
        part = gains[first : first + CHUNK]
        pair, place = search.brackets(part)
        pair, place = search.lowest(part, pair, place)
        result = search.refined(place, part[pair])
        level = np.maximum(search.impedance(result, part[pair, 0], part[pair, 1]).real, 0.0)
        level[(part[pair, 0] == 0.0) & (not search.lossy)] = ends.parts.bit_damping
        # The last write wins: written from the highest to the lowest.
        order = np.lexsort([-result, -level])
        slope[first + pair[order]] = level[order]
        omega[first + pair[order]] = result[order]
    at_rest = np.where(gains[:, 1] == 0.0, gains[:, 0] + search.rigid, np.inf)
    real = at_rest < slope
    slope, omega = np.where(real, at_rest, slope), np.where(real, 0.0, omega)
    return Crossings(slope.reshape(kp.shape), omega.reshape(kp.shape))


def refuse_gains(gains: Array) -> None:
    """Refuse (`InputError`) gains that are negative or no numbers: such a drive feeds energy."""
    wrong = gains[~(np.isfinite(gains) & (gains >= 0.0))]
    if wrong.size:
        raise InputError(f"a slope margin needs gains of 0 or more, got {wrong[0]:g}", "controller")


class _Search:
    """Crossings of many gain pairs on one string.

    With the drive's impedance c added to a resistor r that stands at the top for reference,
    H = (h + (c - r) d) / (1 + (c - r) t) with t, h the mobilities of top and bit so terminated
    and d their determinant. The sign of Im 1/H is then that of a quadratic in the gains whose
    coefficients depend on frequency alone: all pairs times all frequencies are one product of
    matrices.
    """

    def __init__(self, ends: Ends, candidates: int = CANDIDATES) -> None:
        self.ends = ends
        self.grid = telling_grid(ends)
        parts = ends.parts
        self.rigid = parts.top_damping + parts.bit_damping + sum(
            x.drag + x.end_drag + x.mass_damping * (x.inertia + x.end_inertia)
            for x in parts.sections
        )  # fmt: skip
        s = 1j * self.grid
        # The bit's own damper apart: it adds to D* and leaves the reactance lossless.
        self.lossy = self.rigid > parts.bit_damping or parts.modal_damping > 0.0 or any(
            x.coupling_damping > 0.0 or x.stiffness_damping > 0.0 for x in parts.sections
        )  # fmt: skip
        # Without inertia at the bit resonances are so sharp that the grid does not resolve them.
        self.candidates = candidates if parts.bit_inertia > 0.0 else len(self.grid)
        resistor = max(x.impedance for x in parts.sections) or np.sqrt(
            parts.sections[0].stiffness * (parts.top_inertia + parts.bit_inertia)
        )
        seen = ends.mobility(s, top=resistor)
        determinant = seen.top * seen.bit - seen.transfer**2
        n0, n1 = seen.bit - resistor * determinant, determinant
        d0, d1 = 1.0 - resistor * seen.top, seen.top
        # den * conj(num) over [1, kp, ki, kp^2, ki^2], with c = kp - i ki / w.
        both = d1 * n0.conj() + d0 * n1.conj()
        turned = -1j * d1 * n0.conj() + 1j * d0 * n1.conj()
        square = d1 * n1.conj()
        self.product = np.stack(
            [d0 * n0.conj(), both, turned / self.grid, square, square / self.grid**2]
        )
        norm = 2.0 * (n1 * n0.conj())
        self.norm = np.stack(
            [
                np.abs(n0) ** 2,
                norm.real,
                norm.imag / self.grid,
                np.abs(n1) ** 2,
                np.abs(n1) ** 2 / self.grid**2,
            ]
        )

    def impedance(self, omega: Array, kp: ArrayLike, ki: ArrayLike) -> ComplexArray:
        """Impedance of the bit with the drive closed (N m s/rad)."""
        drive = np.asarray(kp) - 1j * np.asarray(ki) / omega
        return self.ends.bit_impedance(1j * omega, drive)

    def brackets(self, gains: Array) -> tuple[Index, Index]:
        """Pairs of gains and places on the grid after which the reactance changes sign."""
        signs = _features(gains) @ self.product.imag > 0.0
        pair, place = np.nonzero(signs[:, 1:] != signs[:, :-1])
        # Where nothing takes energy the reactance falls through infinity, not through zero.
        zero = signs[pair, place + 1] | (gains[pair, 0] > 0.0) | self.lossy
        return pair[zero], place[zero]

    def lowest(self, gains: Array, pair: Index, place: Index) -> tuple[Index, Index]:
        """Of each pair's brackets the `CANDIDATES` of least resistance, as seen on the grid."""
        features = _features(gains)[pair]
        left, right = self._at(features, place), self._at(features, place + 1)
        share = left.imag / (left.imag - right.imag)
        resistance = left.real + np.clip(share, 0.0, 1.0) * (right.real - left.real)
        order = np.lexsort([place, resistance, pair])
        pair, place = pair[order], place[order]
        rank = np.arange(len(pair)) - np.searchsorted(pair, pair)
        # High modes of nearly one margin would crowd out the lowest crossing of all.
        lowest = np.full(len(gains), len(self.grid))
        np.minimum.at(lowest, pair, place)
        kept = (rank < self.candidates) | (place == lowest[pair])
        return pair[kept], place[kept]

    def _at(self, features: Array, place: Index) -> ComplexArray:
        product = np.einsum("pf,fp->p", features, self.product[:, place])
        return np.asarray(product / np.einsum("pf,fp->p", features, self.norm[:, place]))

    def refined(self, place: Index, gains: Array) -> Array:
        """Frequencies (rad/s) within brackets at which the reactance is zero."""
        from scipy.optimize import elementwise

        low, high = self.grid[place], self.grid[place + 1]

        def reactance(omega: Array, kp: Array, ki: Array) -> Array:
            return np.asarray(self.impedance(omega, kp, ki).imag)

        drive = (gains[:, 0], gains[:, 1])
        result = elementwise.find_root(reactance, (low, high), args=drive)
        # A crossing within rounding of a grid point may not be bracketed: it is that point.
        nearer_low = np.abs(reactance(low, *drive)) < np.abs(reactance(high, *drive))
        return np.where(result.success, result.x, np.where(nearer_low, low, high))


def _features(gains: Array) -> Array:
    kp, ki = gains[:, 0], gains[:, 1]
    return np.column_stack([np.ones(len(gains)), kp, ki, kp**2, ki**2])
