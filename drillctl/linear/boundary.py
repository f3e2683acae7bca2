r"""Boundary of the stable gains in closed form (D-decomposition, Neimark 1948).

A pole at :math:`i\omega` needs :math:`K_p + K_i / (i\omega) + Z(i\omega) = 0`, with Z the
impedance of the string at the top, drive inertia and slope of the rock included. Real and
imaginary part give the gains:

.. math:: K_p(\omega) = -\mathrm{Re}\, Z(i\omega), \qquad
          K_i(\omega) = \omega\, \mathrm{Im}\, Z(i\omega).

The curve, and the line Ki = 0 of a pole at zero, cut the plane into faces with one number of
unstable poles each; those with a sufficient slope margin are the region. Every mode
brings a branch: those of high modes of an undamped string are all but one vertical line.

Poles of the loop against any one parameter of the design.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from drillctl import units
from drillctl.arrays import Array, ComplexArray, Mask, runs
from drillctl.design import Design, parameter
from drillctl.errors import InputError
from drillctl.linear.ends import Ends, Route, bit_side, ends_of, telling_grid
from drillctl.linear.loop_model import poles_of
from drillctl.linear.operating_point import at_speed, operating_point
from drillctl.linear.slope_margin import slope_margins
from drillctl.store.codec import documented, label

if TYPE_CHECKING:
    import shapely
    import xarray


FINEST = 1.0 / 800.0  # longest piece of a curve, over the window
CLOSE = 1e-3
"""Faces whose slope margin is as near to the slope as this are computed again, to all digits."""
HALVINGS = 60  # most halvings of an interval of frequency

Window = tuple[tuple[float, float], tuple[float, float]]
WINDOW: Window = ((0.0, 1000.0), (0.0, 500.0))
"""Window of gains by default: Kp (N m s/rad), Ki (N m/rad)."""


@dataclass(frozen=True, eq=False)
class Branch:
    """One piece of the curve within the window."""

    omega: Array  # shape (points,): Angular frequency of the poles on the axis (rad/s), increasing
    # shape (points,): Gains (N m s/rad, N m/rad)
    kp: Array
    ki: Array


@dataclass(frozen=True, eq=False)
@documented
class GainBoundary:
    """The curve in the plane of the gains and the region that it bounds."""

    design: Design = label(means="the rig")
    model: Route = label(means="whether of its elements or of the continuum")
    slope: float = label(unit="N*m*s/rad", means="falling slope of the rock")
    window: Window = label(
        unit="N*m*s/rad, N*m/rad", means="lowest and highest Kp, lowest and highest Ki"
    )
    branches: tuple[Branch, ...] = label(means="by rising frequency")
    region: shapely.MultiPolygon = label(means="locally stable gains within the window")

    def contains(self, kp: float, ki: float) -> bool:
        """Whether gains (N m s/rad, N m/rad) are inside the region."""
        import shapely

        return bool(self.region.contains(shapely.Point(kp, ki)))

    @property
    def rings(self) -> list[Array]:
        """Outer and inner rings of the region, Kp and Ki by rows."""
        return [
            np.asarray(ring.coords)
            for part in self.region.geoms
            for ring in (part.exterior, *part.interiors)
        ]

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
    ends = ends_of(design.sliding_string, model)
    if slope <= 0.0:  # a torque that does not fall with speed only takes energy
        import shapely

        (p0, p1), (i0, i1) = window
        everywhere = shapely.MultiPolygon([shapely.box(p0, i0, p1, i1)])
        return GainBoundary(design, model, slope, window, (), everywhere)
    branches = _branches(ends, slope, window)
    return GainBoundary(
        design, model, slope, window, branches, _region(ends, slope, window, branches)
    )


def boundary_over(
    design: Design, paths: Iterable[str], spans: Iterable[Array]
) -> GainBoundary | None:
    """The boundary within a map, if that runs over both gains of a drive that has no others."""
    if [*paths] != ["controller.kp", "controller.ki"] or not design.simple_drive:
        return None
    kp, ki = ((float(values[0]), float(values[-1])) for values in spans)
    return gain_boundary(design, (kp, ki))


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
    pieces = (slice(first, end + 1) for first, end in runs(short))  # of points linked to their next
    return tuple(Branch(omega[piece], kp[piece], ki[piece]) for piece in pieces)


def _touches(x: Array) -> Mask:
    """Whether the span of neighbouring values meets 0 to 1; never where one is not finite."""
    low, high = np.minimum(x[:-1], x[1:]), np.maximum(x[:-1], x[1:])
    return np.asarray((low <= 1.0) & (high >= 0.0))


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


@dataclass(frozen=True, eq=False)
@documented
class RootLocus:
    """Poles of a loop as one parameter changes."""

    design: Design = label(means="the rig")
    path: str = label(means="the parameter")
    unit: str = label(means="its SI unit")
    values: Array = label("values", means="its values (SI)")
    # the lowest by magnitude first, as they stand at the first value
    poles: ComplexArray = label(
        "values",
        "tracks",
        unit="1/s",
        means="each column one pole followed from value to value, NaN where there are fewer",
    )

    @property
    def data(self) -> xarray.Dataset:
        """The poles by value of the parameter and track."""
        import xarray

        coords = {self.path: (self.path, self.values, {"units": self.unit})}
        return xarray.Dataset(
            {"pole": ((self.path, "track"), self.poles, {"units": "1/s"})}, coords
        )


def root_locus(
    design: Design, path: str, values: ArrayLike, count: int = 12, threads: int = 1
) -> RootLocus:
    """Closed-loop poles, slope of the rock included, over values of a parameter.

    Parameters
    ----------
    design : Design
        The rig.
    path : str
        Dotted path of the parameter: a gain, the weight on bit, a length, any number.
    values : array_like, shape (values,)
        SI values; close enough for poles to be followed.
    count : int
        How many poles, the lowest first.
    threads : int
        How many values are worked on at a time.

    Raises
    ------
    InputError
        Unknown path, a value that is impossible or has no operating point, no values.
    """
    result = parameter(design, path)
    points = np.atleast_1d(np.asarray(values, dtype=float))
    if points.ndim != 1 or points.size == 0:
        raise InputError("needs a list of one value or more", path)
    with ThreadPoolExecutor(threads) as pool:
        rows = list(pool.map(
            lambda v: _lowest(design.replace({path: units.SI(float(v))}), 2 * count), points
        ))  # fmt: skip
    width = max(len(row) for row in rows)
    table = np.full((len(rows), width), np.nan, dtype=complex)
    table[0, : len(rows[0])] = rows[0]
    for i in range(1, len(rows)):
        table[i] = _followed(table[i - 1], rows[i], width)
    return RootLocus(design, path, result.si_unit, points, table[:, : min(count, width)])


def _lowest(design: Design, count: int) -> ComplexArray:
    point = operating_point(design)
    return poles_of(design, bit_side(design, point.slope, point.speed))[:count]


def _followed(before: ComplexArray, now: ComplexArray, width: int) -> ComplexArray:
    """The poles in the order of those before: the pairing of least total distance."""
    from scipy.optimize import linear_sum_assignment

    far = 1e6 * (1.0 + np.abs(now).max())
    distance = np.abs(before[:, None] - now[None, :])
    rows, columns = linear_sum_assignment(np.where(np.isnan(distance), far, distance))
    placed = np.full(width, np.nan, dtype=complex)
    placed[rows] = now[columns]
    return placed
