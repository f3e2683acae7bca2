r"""Slope margin and delay margin of any loop: any drive, and a weight on bit that moves.

With F the impedance of the bit, drive and moving weight closed, poles lie where F = D. Along the
axis :math:`s = i\omega` a real F is a slope at which a pair of poles crosses; the least of them is
the slope margin, provided that the loop without slope is stable. Unlike a PI a drive with filters,
and a weight that comes late, may give energy; whether that proviso holds is asked of the poles.

With the feedback of the moving weight apart, F = F_0 + P, a further delay tau of the weight leads
to poles on the axis where :math:`F_0 - D = -P e^{-i\omega\tau}`: at frequencies where both have
one magnitude.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drillctl.linear.ends import Ends, telling_grid
from drillctl.linear.slope_margin import Crossings
from drillctl.linear.weight_path import BitSide
from drillctl.top_drive import TopDriveLaw

Array = NDArray[np.float64]

TURNS = 16
"""Frequencies per turn of a delay's phase."""
REAL = 1e-6
"""Imaginary part over magnitude at which an impedance counts as real; more is a pole of it."""


def whole_crossings(ends: Ends, drive: TopDriveLaw, bit: BitSide) -> Crossings:
    """All slopes at which poles reach the imaginary axis."""

    def impedance(omega: Array) -> NDArray[np.complex128]:
        s = 1j * omega
        return np.asarray(bit.bit_impedance(ends, s, drive.impedance(s)))

    grid = _grid(ends, bit)
    omega = _zeros(lambda w: impedance(w).imag, grid)
    found = impedance(omega)
    real = np.abs(found.imag) <= REAL * np.maximum(np.abs(found), 1.0)
    slope, omega = found.real[real], omega[real]
    _, ki = drive.gains()
    if ki == 0.0:  # a real pole, at rest of everything
        slope = np.append(slope, impedance(grid[:1]).real)
        omega = np.append(omega, 0.0)
    order = np.lexsort([omega, slope])
    return Crossings(slope[order], omega[order])


def weight_delay_margin(ends: Ends, drive: TopDriveLaw, bit: BitSide) -> tuple[float, float | None]:
    """Longest further delay of a moving weight that a stable loop bears."""

    def both(omega: Array) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        s = 1j * omega
        given = drive.impedance(s)
        return (
            np.asarray(ends.bit_impedance(s, given) - bit.slope),
            np.asarray(bit.by_weight(ends, s, given)),
        )

    def excess(omega: Array) -> Array:
        rest, weight = both(omega)
        return np.log(np.abs(weight)) - np.log(np.abs(rest))

    omega = _zeros(excess, _grid(ends, bit))
    if len(omega) == 0:
        return math.inf, None
    rest, weight = both(omega)
    delay = np.mod(-np.angle(-rest / weight), 2.0 * math.pi) / omega
    first = int(np.argmin(delay))
    return float(delay[first]), float(omega[first])


def _grid(ends: Ends, bit: BitSide) -> Array:
    """Angular frequencies (rad/s) that show the string and every turn of the delay."""
    grid = telling_grid(ends)
    if bit.path is None or bit.path.delay == 0.0:
        return grid
    apart = 2.0 * math.pi / (TURNS * bit.path.delay)
    return np.union1d(grid, np.arange(apart, grid[-1], apart))


def _zeros(function: Callable[[Array], Array], grid: Array) -> Array:
    """Where a function of frequency changes sign."""
    from scipy.optimize import elementwise

    signs = function(grid) > 0.0
    place = np.flatnonzero(signs[1:] != signs[:-1])
    if len(place) == 0:
        return np.empty(0)
    return np.asarray(elementwise.find_root(function, (grid[place], grid[place + 1])).x)
