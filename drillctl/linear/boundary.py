r"""Boundary of the stable gains in closed form (D-decomposition, Neimark 1948).

A pole at :math:`i\omega` needs :math:`K_p + K_i / (i\omega) + Z(i\omega) = 0`, with Z the
impedance of the string at the top, drive inertia and slope of the rock included. Real and
imaginary part give the gains:

.. math:: K_p(\omega) = -\mathrm{Re}\, Z(i\omega), \qquad
          K_i(\omega) = \omega\, \mathrm{Im}\, Z(i\omega).

The curve, and the line Ki = 0 of a pole at zero, cut the plane into faces with one number of
unstable poles each; the stable ones, asked for their slope margin, are the region. Every mode
brings a branch: those of high modes of an undamped string are all but one vertical line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import Ends, Route, ends_of, telling_grid
from drillctl.linear.operating_point import at_speed
from drillctl.linear.slope_margin import slope_margins

if TYPE_CHECKING:
    import shapely

Array = NDArray[np.float64]

FINEST = 1.0 / 800.0
"""Longest piece of a curve, over the window."""
CLOSE = 1e-3
"""Faces whose slope margin is as near to the slope as this are asked again, to all digits."""
HALVINGS = 60
"""Most halvings of an interval of frequency."""

Window = tuple[tuple[float, float], tuple[float, float]]
WINDOW: Window = ((0.0, 1000.0), (0.0, 500.0))
"""Gains looked at by default: Kp (N m s/rad), Ki (N m/rad)."""


@dataclass(frozen=True, eq=False)
class Branch:
    """One piece of the curve within the window."""

    omega: Array  # shape (points,): Angular frequency of the poles on the axis (rad/s), increasing
    # shape (points,): Gains (N m s/rad, N m/rad)
    kp: Array
    ki: Array


@dataclass(frozen=True, eq=False)
class GainBoundary:
    """The curve in the plane of the gains and the region that it bounds.

    Attributes
    ----------
    design : Design
        The rig.
    model : str
        Whether of its elements or of the continuum.
    slope : float
        Falling slope of the rock (N m s/rad).
    window : tuple
        Lowest and highest Kp (N m s/rad), lowest and highest Ki (N m/rad).
    branches : tuple of Branch
        By rising frequency.
    region : shapely.MultiPolygon
        Locally stable gains within the window.
    """

    design: Design
    model: Route
    slope: float
    window: Window
    branches: tuple[Branch, ...]
    region: shapely.MultiPolygon

    def contains(self, kp: float, ki: float) -> bool:
        """Whether gains (N m s/rad, N m/rad) are inside the region."""
        import shapely

        return bool(self.region.contains(shapely.Point(kp, ki)))

    def summary(self) -> dict[str, Any]:
        """Bounds of the region, its share of the window, frequencies of the curve."""
        (p0, p1), (i0, i1) = self.window
        bounds = None
        if not self.region.is_empty:
            left, low, right, high = self.region.bounds
            bounds = {"controller.kp": [left, right], "controller.ki": [low, high]}
        return {
            "slope": self.slope,
            "area_fraction": self.region.area / ((p1 - p0) * (i1 - i0)),
            "bounds": bounds,
            "branches": len(self.branches),
        }


def gain_boundary(
    design: Design,
    window: Window = WINDOW,
    slope: float | None = None,
    model: Route = "finite-elements",
) -> GainBoundary:
    """Boundary of local stability over the gains of the top drive.

    Parameters
    ----------
    design : Design
        The rig; its own gains do not matter.
    window : tuple
        Lowest and highest Kp (N m s/rad), lowest and highest Ki (N m/rad); none negative.
    slope : float, optional
        Falling slope of the rock (N m s/rad) instead of that at the set speed.
    model : {'finite-elements', 'wave', 'matrices'}
        Elements or continuum; of the latter the lowest `ends.WAVE_MODES` modes.

    Raises
    ------
    InputError
        An empty window, or one with negative gains.
    """
    for name, (low, high) in zip(("kp", "ki"), window, strict=True):
        if not 0.0 <= low < high < math.inf:
            raise InputError(
                f"{low:g} to {high:g} is no range of gains from 0 up", f"window {name}"
            )
    if slope is None:  # of gains that hold the set speed, whatever the design's own drive does
        slope = at_speed(design, design.speed).slope
    if not math.isfinite(slope):
        raise InputError(f"must be a number, got {slope:g}", "slope")
    ends = ends_of(design.string, model)
    if slope <= 0.0:  # a torque that does not fall with speed only takes energy
        import shapely

        (p0, p1), (i0, i1) = window
        everywhere = shapely.MultiPolygon([shapely.box(p0, i0, p1, i1)])
        return GainBoundary(design, model, slope, window, (), everywhere)
    branches = _branches(ends, slope, window)
    return GainBoundary(
        design, model, slope, window, branches, _region(ends, slope, window, branches)
    )


def _gains(ends: Ends, slope: float, omega: Array) -> tuple[Array, Array]:
    with np.errstate(all="ignore"):  # the curve runs to infinity between modes
        seen = ends.top_impedance(1j * omega, -slope)
    return np.asarray(-seen.real, dtype=float), omega * seen.imag


def _branches(ends: Ends, slope: float, window: Window) -> tuple[Branch, ...]:
    """The curve by halving: intervals that may touch the window, until its pieces are short."""
    (p0, p1), (i0, i1) = window
    omega = telling_grid(ends)
    kp, ki = _gains(ends, slope, omega)
    for _ in range(HALVINGS):
        x, y = (kp - p0) / (p1 - p0), (ki - i0) / (i1 - i0)
        coarse = _touches(x) & _touches(y)
        coarse &= np.hypot(np.diff(x), np.diff(y)) > FINEST
        coarse &= np.diff(omega) > 4e-16 * omega[1:]
        place = np.flatnonzero(coarse)
        if len(place) == 0:
            break
        middle = 0.5 * (omega[place] + omega[place + 1])
        more = _gains(ends, slope, middle)
        omega = np.insert(omega, place + 1, middle)
        kp, ki = np.insert(kp, place + 1, more[0]), np.insert(ki, place + 1, more[1])
    x, y = (kp - p0) / (p1 - p0), (ki - i0) / (i1 - i0)
    short = _touches(x) & _touches(y) & (np.hypot(np.diff(x), np.diff(y)) <= 2.0 * FINEST)
    return tuple(Branch(omega[run], kp[run], ki[run]) for run in _runs(short))


def _touches(x: Array) -> NDArray[np.bool_]:
    """Whether the span of neighbouring values meets 0 to 1; never where one is not finite."""
    low, high = np.minimum(x[:-1], x[1:]), np.maximum(x[:-1], x[1:])
    return np.asarray((low <= 1.0) & (high >= 0.0))


def _runs(linked: NDArray[np.bool_]) -> list[slice]:
    """Slices of the points that are linked to their next one after another."""
    edges = np.diff(np.concatenate([[False], linked, [False]]).astype(int))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return [slice(begin, end + 1) for begin, end in zip(begins, ends, strict=True)]


def _to_the_edge(branch: Branch, window: Window) -> tuple[Array, Array]:
    """Gains of a branch, the one that begins at Ki = 0 led across that edge of the window.

    The lowest frequency is not zero: its gain is, to rounding, and a line that ends next to an
    edge does not cut what lies beside it.
    """
    low, high = window[1]
    if low > 0.0 or abs(branch.ki[0]) > 1e-6 * (high - low):
        return branch.kp, branch.ki
    beyond = -1e-3 * (high - low)
    return np.append(branch.kp[0], branch.kp), np.append(beyond, branch.ki)


def _region(
    ends: Ends, slope: float, window: Window, branches: tuple[Branch, ...]
) -> shapely.MultiPolygon:
    import shapely

    (p0, p1), (i0, i1) = window
    box = shapely.box(p0, i0, p1, i1)
    lines = [shapely.LineString(np.column_stack(_to_the_edge(b, window))) for b in branches]
    cuts = shapely.unary_union([box.boundary, *(line.intersection(box) for line in lines)])
    faces = [face for face in shapely.get_parts(shapely.polygonize([cuts])) if face.area > 0.0]
    inside = np.array([[p.x, p.y] for p in (face.representative_point() for face in faces)])
    margin = slope_margins(ends, inside[:, 0], inside[:, 1]).slope
    # Between the lines of high modes faces are slivers, and the quick margin not sharp enough.
    near = np.flatnonzero(np.abs(margin - slope) < CLOSE * slope)
    if len(near):
        every = slope_margins(ends, inside[near, 0], inside[near, 1], candidates=10**9)
        margin[near] = every.slope
    stable = margin > slope
    whole = shapely.unary_union([face for face, kept in zip(faces, stable, strict=True) if kept])
    return shapely.MultiPolygon([p for p in shapely.get_parts(whole) if p.area > 0.0])
