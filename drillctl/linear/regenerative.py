r"""The linear loop of a bit that cuts its own wake: roots, their number, stability over speed.

About steady drilling with the wear flat in contact, after Richard, Germay & Detournay (2007), for
any string,

.. math:: \chi(s) = 1 + n \frac{1 - e^{-s \tau}}{s} (K_a Y_a(s) - r K_t Y_t(s)) = 0,
          \qquad \tau = \frac{2 \pi}{n \Omega},

where the hook holds its force; one that follows the bit speed, by H(s) per speed, adds
H K_t Y_a Y_t to the bracket. Y is the velocity at the bit per force on it, along the axis and in
torsion with the drive, r the rate of penetration over the speed. The mobilities are passive: all
their poles are in the left half-plane or on the axis, so that roots on the right are counted by the
turns of chi about zero along a contour.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from drillctl.arrays import Array, ComplexArray, own_errstate
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import WeightPath, ends_of
from drillctl.linear.loop_model import loop_poles
from drillctl.rig.axial import AxialString
from drillctl.rig.bit_rock.richard_detournay import RichardDetournay
from drillctl.rig.weight_on_bit import ConstantWeight, FollowingSpeed, RealWeight
from drillctl.store.codec import label
from drillctl.store.json_files import picked

FAR = 0.5  # |chi - 1| beyond which there may be roots
AXIS = 1e-9  # real part of the contour beside the axis, over the cutting frequency
TURN = 0.4  # largest turn of chi between two points of a contour (rad)
POINTS = 1200  # of the grid over frequency on which roots are looked for
MOST = 400_000  # points of a contour


@dataclass(frozen=True, eq=False)
class CuttingLoop:
    """Roots of the characteristic equation, and where the axial motion alone is stable."""

    unstable_roots: int = label(means="roots in the right half-plane, up to the frequency limit")
    roots: ComplexArray = label("root", unit="1/s", means="those found, rightmost first")
    limit_hz: float = label(unit="Hz", means="frequency limit of count and roots")
    whole: bool = label(means="whether there can be none beyond that limit")
    boundary_speed: float | None = label(
        unit="rad/s", means="speed above which the axial motion alone is stable, if there is one"
    )
    depth_of_cut: float = label(unit="m", means="of steady drilling, in a turn")
    rate_of_penetration: float = label(unit="m/s", means="of steady drilling")

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        return {
            "unstable_roots": self.unstable_roots,
            "roots": [[float(s.real), float(s.imag)] for s in self.roots],
            "frequency_limit_hz": self.limit_hz,
            **picked(self, "whole", "boundary_speed", "depth_of_cut", "rate_of_penetration"),
        }


class Characteristic:
    """The function chi of a design; `coupled` False leaves torsion out (r = 0)."""

    def __init__(self, design: Design, coupled: bool = True) -> None:
        rock, axial = design.bit_rock, design.axial
        if axial is None or not isinstance(rock, RichardDetournay):
            raise InputError("this needs 'richard-detournay'", "bit_rock.law")
        weight = design.tables.operating_point.weight_on_bit
        self.blades, self.axial, self.coupled = float(rock.blades), axial, coupled
        self.depth_of_cut = float(rock.depth_of_cut(weight))
        self.ratio = self.depth_of_cut / (2.0 * math.pi) if coupled else 0.0
        self.force, self.torque = float(rock.force_per_depth), float(rock.torque_per_depth)
        self.speed = design.speed
        self._weight = weight_transfer(design)
        self._ends, self._drive = ends_of(design.string), design.linear_drive
        self._poles = loop_poles(design.string, *design.linear_drive.gains(), 0.0)

    @cached_property
    def resonances(self) -> Array:
        """Frequencies beside which the mobilities have their poles (rad/s)."""
        axial = np.array([0.0, *self.axial.modes[0]])
        return np.concatenate([axial, np.abs(self._poles.imag)]) if self.coupled else axial

    @property
    def delay(self) -> float:
        """Time from blade to blade (s)."""
        return 2.0 * math.pi / (self.blades * self.speed)

    @property
    def scale(self) -> float:
        """Frequency at which the mass of the string swings on the rock (rad/s)."""
        return math.sqrt(self.blades * self.force / self.axial.total)

    def stiffness(self, s: ComplexArray) -> ComplexArray:
        """Force at the bit per cut, n K Y / s: the open loop without its delay."""
        result = self.force * axial_mobility(self.axial, s)
        if self.coupled:
            turning = self.torque / self._ends.bit_impedance(s, self._drive.impedance(s))
            along = self._weight(s) * result / self.force
            result = result + (along - self.ratio) * turning
        return np.asarray(self.blades * result / s)

    def __call__(self, s: ComplexArray) -> ComplexArray:
        """Chi at complex frequencies (1/s)."""
        s = np.asarray(s, dtype=complex)
        return np.asarray(1.0 - np.expm1(-s * self.delay) * self.stiffness(s))


def weight_transfer(design: Design) -> Any:
    """Force of the hook per bit speed (N s/rad) as a function of s (1/s)."""
    law: Any = design.weight_on_bit
    if isinstance(law, ConstantWeight):
        return lambda s: 0.0
    if type(law) not in (FollowingSpeed, RealWeight) or getattr(law, "period", 0.0) > 0.0:
        raise InputError(
            "the roots of a cutting bit are found under a hook that holds its force or follows the "
            "bit speed, at once or behind delay and lags: not under one that reads it at "
            "intervals, by an observer or an alarm",
            "weight_on_bit",
        )
    free = law.nominal + law.gain * (design.speed - law.set_speed)
    gain = float(law.gain) if law.least < free < law.most else 0.0
    if isinstance(law, FollowingSpeed):
        return lambda s: gain
    path = WeightPath(gain, law.delay, law.sensor, law.hoist, None)
    return lambda s: path.feedback(s).bit


def axial_mobility(string: AxialString, s: ComplexArray) -> ComplexArray:
    """Velocity per force at the bit of an axial string."""
    frequency, shapes = string.modes
    s = np.asarray(s, dtype=complex)
    damping = shapes.T @ string.damping @ shapes
    if np.abs(damping - np.diag(np.diag(damping))).max() <= 1e-12 * max(np.abs(damping).max(), 1.0):
        each = s.reshape(-1, 1)
        modes = each / (each**2 + each * np.diag(damping) + frequency**2)
        return np.asarray((modes @ shapes[-1] ** 2).reshape(s.shape))
    # Else node by node from the top: what is above hangs on the node below by its impedance.
    m, c, k = string.mass, string.damping, string.stiffness
    above = s * m[0, 0] + c[0, 0] + k[0, 0] / s
    for i in range(1, string.nodes):
        link = s * m[i, i - 1] + c[i, i - 1] + k[i, i - 1] / s
        above = s * m[i, i] + c[i, i] + k[i, i] / s - link**2 / above
    return np.asarray(1.0 / above)


@own_errstate()
def cutting_loop(design: Design) -> CuttingLoop:
    """Roots of a design's characteristic equation, and its axial boundary.

    Parameters
    ----------
    design : Design
        With the law 'richard-detournay'.

    Returns
    -------
    CuttingLoop
        Counted to a frequency limit beyond which there are no roots, or to that of the mesh.

    Raises
    ------
    InputError
        Another law.
    """
    chi = Characteristic(design)
    limit, whole = frequency_limit(chi, design)
    count, found = _roots(chi, limit)
    return CuttingLoop(
        unstable_roots=count, roots=found, limit_hz=limit / (2.0 * math.pi), whole=whole,
        boundary_speed=axial_boundary(design), depth_of_cut=chi.depth_of_cut,
        rate_of_penetration=chi.depth_of_cut / (2.0 * math.pi) * chi.speed,
    )  # fmt: skip


def _roots(chi: Characteristic, limit: float) -> tuple[int, ComplexArray]:
    """Number of roots on the right, and those found, up to a frequency (rad/s)."""
    right = _right_edge(chi, limit)
    count = count_roots(chi, complex(AXIS * chi.scale, -limit), complex(right, limit))
    for points in (POINTS, 4 * POINTS):  # a root beside a pole hides between the points of a grid
        found = find_roots(chi, right, limit, points=points)
        positive = found[found.real > 0.0]
        if (2 * (positive.imag > 0.0) + (positive.imag == 0.0)).sum() >= count:
            break
    if not len(found):
        found = find_roots(chi, right, limit, left=-chi.scale)
    return count, found


def frequency_limit(chi: Characteristic, design: Design) -> tuple[float, bool]:
    """Frequency (rad/s) up to which roots are counted, and whether there are none beyond.

    Beyond it |1 - exp| <= 2 times the stiffness stays under one half, if the mesh goes so far.
    """
    assert design.axial is not None
    grid = chi.scale * np.geomspace(0.5, 400.0, 4000)
    large = np.flatnonzero(2.0 * np.abs(chi.stiffness(1e-6 * chi.scale + 1j * grid)) > FAR)
    last = grid[min(int(large[-1]) + 1, len(grid) - 1)] if large.size else grid[0]
    elements = design.tables.axial.model == "elements"
    mesh = float(design.axial.modes[0][-1]) if elements else math.inf
    return float(min(last, mesh)), bool(last < min(mesh, grid[-1]))


def _right_edge(chi: Characteristic, limit: float) -> float:
    """Real part (1/s) to the right of all roots."""
    right = chi.scale
    for _ in range(30):
        edge = chi(right + 1j * np.linspace(-limit, limit, 401))
        if np.abs(edge - 1.0).max() < FAR:
            return right
        right *= 1.5
    return right


def count_roots(chi: Any, low: complex, high: complex) -> int:
    """Roots inside a rectangle, by the turns of chi along it; points are added where it turns."""
    corners = [low, complex(high.real, low.imag), high, complex(low.real, high.imag), low]
    total = 0.0
    for a, b in pairwise(corners):
        share = np.linspace(0.0, 1.0, 257)
        if (b - a).real == 0.0:  # poles lie beside the axis, and roots beside them
            near = np.geomspace(1e-13, 0.1, 80)
            at = (np.concatenate([chi.resonances, -chi.resonances]) - a.imag) / (b - a).imag
            share = np.concatenate([share, *(at[:, None] + near).T, *(at[:, None] - near).T])
            share = np.unique(share[(share >= 0.0) & (share <= 1.0)])
        values = chi(a + share * (b - a))
        for _ in range(60):
            turn = np.abs(np.angle(values[1:] / values[:-1]))
            wide = np.flatnonzero((turn > TURN) & (np.diff(share) > 1e-13))
            if wide.size == 0 or len(share) > MOST:
                break
            middle = 0.5 * (share[wide] + share[wide + 1])
            share = np.insert(share, wide + 1, middle)
            values = np.insert(values, wide + 1, chi(a + middle * (b - a)))
        total += float(np.angle(values[1:] / values[:-1]).sum())
    return round(total / (2.0 * math.pi))


def find_roots(
    chi: Any, right: float, limit: float, left: float = -1.0, points: int = POINTS
) -> ComplexArray:
    """Roots right of `left` (1/s) with a positive or no imaginary part, rightmost first."""
    found: list[complex] = []
    real = np.concatenate([np.linspace(left, 0.0, 12), right * np.geomspace(1e-3, 1.0, 48)])
    imaginary = np.linspace(0.0, limit, points)
    grid = real[:, None] + 1j * imaginary
    size = np.abs(chi(grid.ravel() + 1e-9)).reshape(grid.shape)
    padded = np.pad(size, 1, constant_values=np.inf)
    around = [padded[1 + i : padded.shape[0] - 1 + i, 1 + j : padded.shape[1] - 1 + j]
              for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]  # fmt: skip
    starts = grid[np.all([size <= other for other in around], axis=0)]
    beside = 1j * chi.resonances[:, None] + (1.0 + 1.0j) * chi.scale * np.array([1e-4, 1e-3, 1e-2])
    starts = np.concatenate([starts, beside.ravel()])
    for root in map(complex, _polished(chi, starts, max(abs(right), 1.0))):
        if not (root.real >= left and -1e-9 <= root.imag <= limit):
            continue
        if abs(root) < 1e-6 * limit or any(abs(root - one) < 1e-7 * limit for one in found):
            continue  # zero is a root of the equation times s, and no motion
        found.append(root)
    return np.array(sorted(found, key=lambda s: -s.real), dtype=complex)


def _polished(chi: Any, starts: ComplexArray, scale: float) -> ComplexArray:
    """Roots by Newton's method, its slope a difference; NaN where a start leads to none."""
    step, left = 1e-7 * scale, np.arange(len(starts))
    at, found = starts.astype(complex), np.full(len(starts), complex(math.nan, math.nan))
    for _ in range(60):
        s = at[left]
        value, ahead, back = chi(np.concatenate([s, s + step, s - step])).reshape(3, -1)
        change = value * 2.0 * step / (ahead - back)
        at[left] = s = s - change
        near = np.abs(s - starts[left]) <= scale
        done = near & (np.abs(change) < 1e-13 * scale)
        found[left[done]] = s[done]
        left = left[near & ~done]
        if not left.size:
            break
    return found


def axial_boundary(design: Design) -> float | None:
    """Speed (rad/s) above which the axial motion alone is stable (r = 0); None if it always is.

    On the boundary chi(i w) = 0, that is exp(-i w tau) = 1 + 1/G with G the loop without its
    delay: |1 + 1/G| = 1 gives w, its angle the delay.
    """
    from scipy.optimize import brentq

    chi = Characteristic(design, coupled=False)

    def inverse(omega: Any) -> ComplexArray:
        with np.errstate(all="ignore"):  # nothing is left of 1/G at a resonance without dampers
            one = 1.0 / chi.stiffness(1j * np.asarray(omega, dtype=complex))
        return np.nan_to_num(one)

    def excess(omega: Any) -> Any:
        return np.abs(1.0 + inverse(omega)) - 1.0

    grid = chi.scale * np.geomspace(1e-2, 100.0, 20_001)
    values = excess(grid)
    speeds = []
    for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        omega = brentq(lambda w: float(excess(w)), grid[k], grid[k + 1], xtol=1e-14 * chi.scale)
        left = complex(inverse(np.array([omega]))[0])
        turn = -np.angle(1.0 + left)
        turn = turn % (2.0 * math.pi)
        if abs(left) < 1e-6:  # a resonance: a delay of whole turns changes nothing
            continue
        speeds.append(2.0 * math.pi * omega / (chi.blades * float(turn)))
    return max(speeds, default=None)


def rightmost(design: Design) -> tuple[float, float]:
    """Number of roots on the right up to the frequency limit, and the largest real part (1/s).

    NaN of a bit that does not drill.
    """
    chi = Characteristic(design)
    if chi.depth_of_cut == 0.0:
        return math.nan, math.nan
    limit, _ = frequency_limit(chi, design)
    count, found = _roots(chi, limit)
    return count, float(found[0].real) if len(found) else math.nan
