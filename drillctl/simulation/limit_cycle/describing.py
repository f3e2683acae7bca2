r"""Cycles of one harmonic: the describing function of set-valued friction in a linear loop.

Let the bit turn at :math:`\omega = m + A \cos\theta`. Of the rock's torque
:math:`T(|\omega|)\,\mathrm{sign}\,\omega` the string feels the mean and the first harmonic,

.. math:: T_0 = \frac{1}{2\pi} \int T \, d\theta, \qquad
          D(A) = -\frac{1}{\pi A} \int T \cos\theta \, d\theta,

so that the rock is a falling slope that depends on the amplitude. For small A it is -dT/dw; it
rises while the bit gets slower and slower at its slowest, and falls when it turns backwards
(:math:`A > m`), where the torque pushes. A cycle is where the loop has poles on the imaginary
axis under that slope, :math:`1/H(i\omega) = D(A)` with H the mobility of the bit, the drive
closed (`drillctl.linear.slope_margin`).

Which of the loop's crossings are cycles. With Z = 1/H a pole moves with the slope as
:math:`ds/dD = 1/Z'(s)`, to the right where the reactance Im Z rises with frequency and to the
left where it falls. The rising ones are modes that the rock drives. The falling ones, at the
frequencies of a string whose bit is held, are poles that come back from the right at slopes far
beyond any rock's, when another pole has long left for the right; they are no motion that would
be seen, and are left out. At a rising crossing growth has the sign of D(A) less the crossing's
slope, whence a cycle is stable in amplitude where D falls with A. The higher crossings are cycles
of the higher modes: each is taken alone, as if no other mode moved. An undamped string of 30
elements has thirty; the slow stick-slip of a rig is the lowest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, root

from drillctl.arrays import Array, Mask
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import Ends, ends_of
from drillctl.linear.operating_point import equilibria
from drillctl.linear.slope_margin import crossings
from drillctl.store.codec import documented, label
from drillctl.store.json_files import picked

MODES = 3  # lowest crossings that are looked at, unless asked for more
NODES = 64
"""Gauss-Legendre nodes on each side of the change of sign: enough for friction that decays by
e^50 within the amplitude."""
AMPLITUDES = np.concatenate([np.linspace(0.01, 1.0, 100), np.geomspace(1.0, 40.0, 80)[1:]])
"""Amplitudes over the mean speed at which the balance is looked at before it is solved."""
MEANS = 80  # mean speeds that are looked at where the drive does not fix the mean


@dataclass(frozen=True)
@documented
class HarmonicCycle:
    """A periodic motion as its first harmonic tells it."""

    amplitude: float = label(unit="rad/s", means="of the bit speed")
    frequency_hz: float = label(unit="Hz", means="cycles per second")
    mean_speed: float = label(unit="rad/s", means="mean bit speed")
    slope: float = label(unit="N*m*s/rad", means="falling slope to which rock and loop agree")
    # one that is not divides what settles from what sticks and slips
    stable: bool = label(means="whether a change of amplitude dies out")

    @property
    def period(self) -> float:
        """Duration of a cycle (s)."""
        return 1.0 / self.frequency_hz

    @property
    def peak_speed(self) -> float:
        """Highest bit speed (rad/s)."""
        return self.mean_speed + self.amplitude

    @property
    def least_speed(self) -> float:
        """Lowest bit speed (rad/s); negative past the stick limit."""
        return self.mean_speed - self.amplitude

    def bit_speed(self, time: Array) -> Array:
        """Bit speed (rad/s) at times (s) from the moment it speeds up through its mean."""
        angle = 2.0 * np.pi * self.frequency_hz * time
        return np.asarray(self.mean_speed + self.amplitude * np.sin(angle))

    def summary(self) -> dict[str, Any]:
        """The numbers by name, SI units."""
        return picked(
            self, "amplitude", "period", "frequency_hz", "mean_speed", "peak_speed", "slope",
            "stable",
        )  # fmt: skip


def mean_torque_and_slope(
    design: Design, mean: ArrayLike, amplitude: ArrayLike
) -> tuple[Array, Array]:
    """What the rock gives to a bit that turns at mean + amplitude cos."""
    mean, amplitude = np.broadcast_arrays(
        np.asarray(mean, dtype=float), np.asarray(amplitude, dtype=float)
    )
    nodes, weights = _gauss()
    # The bit turns forward up to the angle `turn` and backwards from there to half a period.
    law: Any = design.weight_on_bit
    turn = np.arccos(-np.clip(mean / amplitude, -1.0, 1.0))[..., None]
    total, harmonic = np.zeros(mean.shape), np.zeros(mean.shape)
    for low, high, sign in ((0.0 * turn, turn, 1.0), (turn, np.pi + 0.0 * turn, -1.0)):
        half = 0.5 * (high - low)
        cosine = np.cos(low + half * (nodes + 1.0))
        speed = mean[..., None] + amplitude[..., None] * cosine
        weight = law.weight(np.abs(speed))
        torque, _ = design.bit_rock.torque_and_slope(weight, np.abs(speed), np.exp)
        part = sign * half * weights * torque
        total += part.sum(axis=-1)
        harmonic += (part * cosine).sum(axis=-1)
    return total / np.pi, -2.0 * harmonic / (np.pi * amplitude)


@cache
def _gauss() -> tuple[Array, Array]:
    """Nodes and weights: an eigenproblem that costs as much as the rest of a balance, once."""
    return np.polynomial.legendre.leggauss(NODES)


def harmonic_cycles(design: Design, modes: int = MODES) -> tuple[HarmonicCycle, ...]:
    """Cycles of a design by harmonic balance.

    Parameters
    ----------
    design : Design
        With integral action the bit's mean speed is the set speed; without, it follows from
        the balance of mean torques, solved together with the harmonic one.
    modes : int
        Crossings of rising reactance that are looked at, from the lowest frequency on.

    Returns
    -------
    tuple of HarmonicCycle
        Lowest frequency first, and of one frequency the smallest amplitude first. Empty where
        the loop takes more than the rock can give at any amplitude.

    Raises
    ------
    InputError
        Fewer than one mode.
    """
    if modes < 1:
        raise InputError(f"at least one mode, not {modes}", "modes")
    _, ki = design.top_drive.gains()
    balance = _FixedMean(design) if ki != 0.0 else _FreeMean(design)
    return tuple(
        HarmonicCycle(amplitude, omega / (2.0 * np.pi), mean, slope, stable)
        for omega, slope in rising_crossings(design)[:modes]
        for mean, amplitude, stable in balance.cycles(slope)
    )


def rising_crossings(design: Design) -> tuple[tuple[float, float], ...]:
    """Crossings at which the reactance of the bit rises, by rising frequency."""
    ends = ends_of(design.string)
    result = crossings(ends, *design.top_drive.gains())
    order = np.argsort(result.omega)
    return tuple(
        (float(result.omega[i]), float(result.slope[i]))
        for i in order
        if result.omega[i] > 0.0 and _reactance_rises(design, ends, float(result.omega[i]))
    )


def _reactance_rises(design: Design, ends: Ends, omega: float) -> bool:
    s = 1j * omega * np.array([1.0 - 1e-7, 1.0 + 1e-7])
    reactance = ends.bit_impedance(s, design.top_drive.impedance(s)).imag
    return bool(reactance[1] > reactance[0])


class _FixedMean:
    """Balance of a bit whose mean speed is the set speed."""

    def __init__(self, design: Design) -> None:
        self.design = design
        self.grid = design.speed * AMPLITUDES
        self.slopes = self.slope(self.grid)

    def slope(self, amplitude: ArrayLike) -> Any:
        return mean_torque_and_slope(self.design, self.design.speed, amplitude)[1]

    def cycles(self, level: float) -> list[tuple[float, float, bool]]:
        """Mean, amplitude and stability of the cycles at a slope of `level`."""
        above = self.slopes > level
        results = []
        for i in np.flatnonzero(above[1:] != above[:-1]):
            amplitude = brentq(
                lambda a: float(self.slope(a)) - level, *self.grid[i : i + 2], xtol=1e-13
            )
            results.append((self.design.speed, float(amplitude), bool(above[i])))
        return results


class _FreeMean:
    """Balance of a bit whose mean speed follows from the mean torques."""

    def __init__(self, design: Design) -> None:
        self.design = design
        self.drag = float(design.string.ground_damping.sum())
        steady = [point.speed for point in equilibria(design)]
        shares = np.concatenate(
            [np.geomspace(1e-3, 0.05, MEANS // 2, endpoint=False), np.linspace(0.05, 1.0, MEANS)]
        )
        self.means = 3.0 * max([design.speed, *steady]) * shares
        mean = self.means[:, None]
        self.surpluses, self.slopes = self.both(mean, mean * AMPLITUDES)

    def both(self, mean: Any, amplitude: Any) -> tuple[Any, Any]:
        """Mean torque of the drive beyond what drag and rock take, and slope."""
        torque, slope = mean_torque_and_slope(self.design, mean, amplitude)
        drive = self.design.top_drive.torque(0.0, mean - self.design.speed)
        return drive - self.drag * mean - torque, slope

    def cycles(self, level: float) -> list[tuple[float, float, bool]]:
        """Mean, amplitude and stability of the cycles at a slope of `level`."""

        def excess(x: Array) -> Array:
            surplus, slope = self.both(x[0], x[0] * x[1])
            return np.array([surplus, slope - level])

        results: list[tuple[float, float, bool]] = []
        cells = _changes(self.surpluses) & _changes(self.slopes - level)
        for i, j in zip(*np.nonzero(cells), strict=True):
            middle = [self.means[i : i + 2].mean(), AMPLITUDES[j : j + 2].mean()]
            solved = root(excess, middle, tol=1e-13)
            mean, share = (float(x) for x in solved.x)
            if np.abs(solved.fun).max() > 1e-6 or mean <= 0.0 or share <= 0.0:
                continue
            amplitude = mean * share
            if all(abs(mean - m) + abs(amplitude - a) > 1e-6 * mean for m, a, _ in results):
                results.append((mean, amplitude, self.holds(mean, amplitude)))
        return sorted(results, key=lambda cycle: cycle[1])

    def holds(self, mean: float, amplitude: float) -> bool:
        """Whether mean and amplitude come back, the mean being the quicker of the two."""
        both, step = self.both, 1e-5 * mean
        by_mean = np.subtract(both(mean + step, amplitude), both(mean - step, amplitude))
        by_amplitude = np.subtract(both(mean, amplitude + step), both(mean, amplitude - step))
        total = by_amplitude[1] - by_mean[1] * by_amplitude[0] / by_mean[0]
        return bool(by_mean[0] < 0.0 and total < 0.0)


def _changes(values: Array) -> Mask:
    """Cells of a grid over whose corners a function changes its sign."""
    corners = np.stack([values[:-1, :-1], values[1:, :-1], values[:-1, 1:], values[1:, 1:]]) > 0.0
    return np.asarray(corners.any(axis=0) & ~corners.all(axis=0))
