r"""Margins of the loop at the top torque, from impedances.

With C the impedance of the drive's controller and Z that of the string at the top, drive
inertia and slope of the rock included, the loop transfer is L = C/Z, the sensitivity
S = Z/(Z + C) and its complement T = C/(Z + C): where the string resonates L is without bound,
and S and T are not. Peaks of an undamped string are as narrow as its poles are near the axis;
frequencies cluster at each pole, down to a part of its distance.

The disk margin is :math:`\alpha = 1 / \max_\omega |S - T|/2`: gain and phase at the top may
change together within the disk it spans (Seiler, Packard & Gahinet, IEEE Control Systems 40
(2020) 78-95, balanced).

Slope margin and delay margin of any loop: any drive, and a weight on bit that moves.

With F the impedance of the bit, drive and moving weight closed, poles lie where F = D. Along the
axis :math:`s = i\omega` a real F is a slope at which a pair of poles crosses; the least of them is
the slope margin, provided that the loop without slope is stable. Unlike a PI a drive with filters,
and a weight that comes late, may supply energy; whether that proviso holds follows from the poles.

With the feedback of the moving weight apart, F = F_0 + P, a further delay tau of the weight leads
to poles on the axis where :math:`F_0 - D = -P e^{-i\omega\tau}`: at frequencies where both have
one magnitude.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array, ComplexArray
from drillctl.linear.ends import BitSide, Ends, telling_grid
from drillctl.linear.slope_margin import Crossings
from drillctl.rig.top_drive import TopDriveLaw
from drillctl.store.codec import documented, label

CLUSTER = np.geomspace(0.03, 1e7, 90)
"""Distances from a pole at which a response is computed, over that of the pole from the axis."""
COARSE = np.geomspace(0.1, 1e6, 29)  # the same for many loops
SLOWEST = 1e-3  # lowest frequency computed, over the magnitude of the smallest pole
NEAREST = 1e-13  # least distance from the axis that a pole is taken to have, over its frequency


@dataclass(frozen=True)
@documented
class Margins:
    """How far a stable loop is from instability, broken at the top torque."""

    peak_sensitivity: float = label(means="largest of abs(S)")
    peak_sensitivity_hz: float | None = label(
        unit="Hz", means="where; None where it is reached beyond all modes only"
    )
    disk: float = label(means="balanced disk margin alpha")
    gain_db: float = label(unit="dB", means="gain that may change with the phase in the disk")
    phase_deg: float = label(unit="degrees", means="phase that may change with the gain")
    disk_hz: float = label(unit="Hz", means="where the disk is touched")
    delay: float = label(
        unit="s", means="delay in the loop that makes it unstable, infinite if none does"
    )
    delay_hz: float | None = label(unit="Hz", means="frequency of that instability")

    @property
    def disk_ends(self) -> tuple[float, float] | None:
        """Ends on the real axis of the disk that L stays out of; of a margin of 2 it is no disk."""
        if self.disk >= 2.0:
            return None
        near = (2.0 - self.disk) / (2.0 + self.disk)
        return -1.0 / near, -near


def margins(
    ends: Ends, drive: TopDriveLaw, bit: BitSide, poles: ComplexArray, below: float = math.inf
) -> Margins:
    """Margins of a loop that is stable.

    Parameters
    ----------
    ends : Ends
        The string.
    drive : TopDriveLaw
        Linearised law of the drive.
    bit : BitSide
        Slope of the rock, under the slope margin, and the moving weight.
    poles : ndarray of complex
        Of the loop (1/s), so that no peak is stepped over.
    below : float
        Highest angular frequency (rad/s) that counts.
    """
    loop = _Loop(ends, drive, bit)
    grid = pole_grid(ends, poles)
    grid = grid[grid <= below]
    peak, peak_at = _largest(lambda w: np.abs(loop.sensitivity(w)), grid)
    balance, disk_at = _largest(lambda w: np.abs(loop.balance(w)), grid)
    # At no or at any frequency a loop without drive has S - T = 1: a disk that touches nothing.
    disk = 1.0 / max(balance, 0.5)
    gain, phase = disk_gain_and_phase(disk)
    delay, delay_at = _delay_margin(loop, grid)
    return Margins(
        # Far above all modes L vanishes and S tends to 1.
        peak_sensitivity=max(peak, 1.0),
        peak_sensitivity_hz=peak_at / (2.0 * math.pi) if peak > 1.0 else None,
        disk=disk,
        gain_db=gain,
        phase_deg=phase,
        disk_hz=disk_at / (2.0 * math.pi),
        delay=delay,
        delay_hz=None if delay_at is None else delay_at / (2.0 * math.pi),
    )


def disk_gain_and_phase(disk: float) -> tuple[float, float]:
    """Gain (dB) and phase (degrees) margin of a balanced disk; infinite and 180 from 2 on."""
    if disk >= 2.0:
        return math.inf, 180.0
    return 20.0 * math.log10((2.0 + disk) / (2.0 - disk)), math.degrees(2.0 * math.atan(disk / 2))


def pole_grid(ends: Ends, poles: ComplexArray) -> Array:
    """Angular frequencies (rad/s) that resolve every pole of a loop, however near the axis."""
    base = telling_grid(ends)
    size = np.abs(poles[np.isfinite(poles) & (poles != 0.0)])
    base = base[base > SLOWEST * size.min()]
    return np.unique(np.concatenate([base, _around(poles, CLUSTER, base)]))


def _around(poles: ComplexArray, sides: Array, within: Array) -> Array:
    """Frequencies (rad/s) at both sides of each pole, in units of its distance from the axis."""
    upper = poles[np.isfinite(poles) & (poles.imag > 0.0)]
    distance = np.maximum(np.abs(upper.real), NEAREST * upper.imag)
    both = np.concatenate([-sides[::-1], [0.0], sides])
    around = (upper.imag[:, None] + distance[:, None] * both).ravel()
    return np.asarray(around[(around > within[0]) & (around < within[-1])])


class _Loop:
    """Sensitivities of one loop at angular frequencies (rad/s)."""

    def __init__(self, ends: Ends, drive: TopDriveLaw, bit: BitSide) -> None:
        self.ends, self.drive, self.bit = ends, drive, bit

    def impedances(self, omega: Array) -> tuple[ComplexArray, ComplexArray]:
        s = 1j * omega
        return self.bit.top_impedance(self.ends, s), self.drive.impedance(s)

    def sensitivity(self, omega: Array) -> ComplexArray:
        string, drive = self.impedances(omega)
        return string / (string + drive)

    def balance(self, omega: Array) -> ComplexArray:
        string, drive = self.impedances(omega)
        return 0.5 * (string - drive) / (string + drive)

    def excess(self, omega: Array) -> Array:
        """Log abs(L): zero where the loop crosses over."""
        string, drive = self.impedances(omega)
        return np.asarray(np.log(np.abs(drive)) - np.log(np.abs(string)))


def _largest(function: Callable[[Array], Array], grid: Array) -> tuple[float, float]:
    """Largest value over frequency and where, refined between the points of a grid."""
    from scipy.optimize import elementwise

    values = function(grid)
    inner = values[1:-1]
    top = 1 + np.flatnonzero((inner > values[:-2]) & (inner >= values[2:]))
    best = int(np.argmax(values))
    # What cannot become the largest, within a factor, is not refined.
    top = top[values[top] > 0.5 * values[best]]
    if len(top) == 0:
        return float(values[best]), float(grid[best])
    result = elementwise.find_minimum(
        lambda w: -function(w), (grid[top - 1], grid[top], grid[top + 1])
    )
    peak = int(np.argmin(result.f_x))
    if -result.f_x[peak] < values[best]:
        return float(values[best]), float(grid[best])
    return float(-result.f_x[peak]), float(result.x[peak])


def peak_sensitivities(
    ends: Ends, kp: Array, ki: Array, slope: Array, poles: ComplexArray
) -> Array:
    """Largest sensitivity of many stable loops under PI control."""
    from scipy.optimize import elementwise

    def small(omega: Array, kp: Array, ki: Array, slope: Array) -> Array:
        string = ends.top_impedance(1j * omega, -slope + 0j)
        return np.asarray(-np.abs(string / (string + kp - 1j * ki / omega)))

    between = telling_grid(ends)
    between = between[between > SLOWEST * np.nanmin(np.abs(poles))][::4]
    bracket = np.empty((3, len(kp)))
    for i in range(len(kp)):
        grid = np.unique(np.concatenate([between, _around(poles[i], COARSE, between)]))
        best = 1 + int(np.argmin(small(grid, kp[i], ki[i], slope[i])[1:-1]))
        bracket[:, i] = grid[best - 1 : best + 2]
    result = elementwise.find_minimum(small, tuple(bracket), args=(kp, ki, slope))
    level = np.fmin(result.f_x, small(bracket[1], kp, ki, slope))
    # Far above all modes L vanishes and S tends to 1.
    return np.asarray(np.maximum(-level, 1.0))


def _delay_margin(loop: _Loop, grid: Array) -> tuple[float, float | None]:
    """Shortest delay (s) that turns L to -1 at a crossover, and its angular frequency."""
    with np.errstate(divide="ignore"):
        omega = _zeros(loop.excess, grid)
    if len(omega) == 0:
        return math.inf, None
    string, drive = loop.impedances(omega)
    turn = np.mod(np.angle(drive / string) + math.pi, 2.0 * math.pi) / omega
    first = int(np.argmin(turn))
    return float(turn[first]), float(omega[first])


TURNS = 16  # frequencies per turn of a delay's phase
REAL = 1e-6
"""Imaginary part over magnitude at which an impedance counts as real; more is a pole of it."""


def whole_crossings(ends: Ends, drive: TopDriveLaw, bit: BitSide) -> Crossings:
    """All slopes at which poles reach the imaginary axis."""

    def impedance(omega: Array) -> NDArray[np.complex128]:
        s = 1j * omega
        return np.asarray(bit.bit_impedance(ends, s, drive.impedance(s)))

    grid = _grid(ends, bit)
    omega = _zeros(lambda w: impedance(w).imag, grid)
    result = impedance(omega)
    real = np.abs(result.imag) <= REAL * np.maximum(np.abs(result), 1.0)
    slope, omega = result.real[real], omega[real]
    _, ki = drive.gains()
    if ki == 0.0:  # a real pole, at rest of everything
        slope = np.append(slope, impedance(grid[:1]).real)
        omega = np.append(omega, 0.0)
    order = np.lexsort([omega, slope])
    return Crossings(slope[order], omega[order])


def weight_delay_margin(
    ends: Ends, drive: TopDriveLaw, bit: BitSide, below: float = math.inf
) -> tuple[float, float | None]:
    """Longest further delay of a moving weight that a stable loop bears, and its frequency."""

    def both(omega: Array) -> tuple[ComplexArray, NDArray[np.complex128]]:
        s = 1j * omega
        given = drive.impedance(s)
        return (
            np.asarray(ends.bit_impedance(s, given) - bit.slope),
            np.asarray(bit.by_weight(ends, s, given)),
        )

    def excess(omega: Array) -> Array:
        rest, weight = both(omega)
        return np.log(np.abs(weight)) - np.log(np.abs(rest))

    grid = _grid(ends, bit)
    omega = _zeros(excess, grid[grid <= below])
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
