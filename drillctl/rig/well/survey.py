"""The path of a well by minimum curvature: between two stations an arc of a circle.

Of two stations with inclinations i1, i2 and azimuths a1, a2 the angle between the tangents is b,

    cos b = cos(i2 - i1) - sin i1 sin i2 (1 - cos(a2 - a1)),

and the arc has the curvature b over the difference of depth; the factor (2/b) tan(b/2) of the
balanced tangential method follows. Above the first station the well is straight down from the
rig, or from a first station at the surface on; below the last it is straight on.

Own code: libraries of the trade (welleng, wellpathpy) give positions alone where the soft string
needs tangent and curvature between stations, and the former brings pandas and pyproj with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from drillctl.arrays import Array
from drillctl.errors import InputError

Station = tuple[float, float, float]  # measured depth (m), inclination and azimuth (rad)

SHARP = math.radians(15.0) / 30.0  # curvature (rad/m) that few strings pass


@dataclass(frozen=True, eq=False)
class Path:
    """A well, arc by arc; axes are north, east and down."""

    depth: Array  # shape (stations,): measured depth (m)
    tangent: Array  # shape (stations, 3): direction downwards along the well
    place: Array  # shape (stations, 3): north, east and vertical depth (m)
    curvature: Array  # shape (stations,): of the arc below each (rad/m)
    normal: Array  # shape (stations, 3): where the arc below each turns to, square to its tangent

    def at(self, depth: Any) -> tuple[Array, Array, Array]:
        """Place (m), tangent and bend (change of the tangent per length, 1/m) at measured depths.

        Each of shape (depths, 3). At a station the bend is that of the arc below.
        """
        depth = np.atleast_1d(np.asarray(depth, dtype=float))
        above = np.clip(np.searchsorted(self.depth, depth, side="right") - 1, 0, None)
        along = depth - self.depth[above]
        t, n, k = self.tangent[above], self.normal[above], self.curvature[above]
        turned = k * along
        cos, sin = np.cos(turned)[:, None], np.sin(turned)[:, None]
        # sin(kx)/k and (1 - cos(kx))/k, which a straight well has too
        ahead = along * np.sinc(turned / np.pi)
        aside = along * np.sin(0.5 * turned) * np.sinc(0.5 * turned / np.pi)
        place = self.place[above] + ahead[:, None] * t + aside[:, None] * n
        return place, cos * t + sin * n, k[:, None] * (cos * n - sin * t)


@lru_cache(maxsize=16)
def path_of(stations: tuple[Station, ...]) -> Path:
    """The path through stations; `InputError` where they are no well."""
    refuse_disorder(stations)
    if stations[0][0] > 0.0:  # a well begins straight down from the rig
        stations = ((0.0, 0.0, stations[0][2]), *stations)
    depth, inclination, azimuth = np.array(stations, dtype=float).T
    tangent = np.stack([
        np.sin(inclination) * np.cos(azimuth), np.sin(inclination) * np.sin(azimuth),
        np.cos(inclination),
    ], axis=1)  # fmt: skip
    count = len(depth)
    place, normal, curvature = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    for i in range(count - 1):
        t, u, length = tangent[i], tangent[i + 1], depth[i + 1] - depth[i]
        square = u - (u @ t) * t
        size = float(np.linalg.norm(square))
        angle = math.atan2(size, float(u @ t))
        if angle > 0.99 * math.pi:
            raise InputError(f"the well turns back on itself at {depth[i]:g} m", "well.survey")
        factor = 1.0 if angle < 1e-9 else 2.0 / angle * math.tan(0.5 * angle)
        place[i + 1] = place[i] + 0.5 * length * factor * (t + u)
        if size > 0.0:
            normal[i], curvature[i] = square / size, angle / length
    return Path(depth, tangent, place, curvature, normal)


def refuse_disorder(stations: tuple[Station, ...]) -> None:
    """Refuse stations that do not go down, or whose angles are out of range."""
    where = "well.survey"
    if not stations:
        raise InputError("a survey needs at least one station", where)
    depths = [one[0] for one in stations]
    for above, below in pairwise(depths):
        if below <= above:
            raise InputError(f"measured depth {below:g} m comes after {above:g} m", where)
    if depths[0] < 0.0:
        raise InputError(f"measured depth {depths[0]:g} m is above the rig", where)
    if stations[0][0] == 0.0 and stations[0][1] > math.radians(90.0):
        raise InputError("the well goes upwards from the rig", where)
    for depth, inclination, azimuth in stations:
        if not 0.0 <= inclination <= math.radians(180.0):
            raise InputError(
                f"inclination {math.degrees(inclination):g} deg at {depth:g} m: allowed are 0 to "
                "180 deg", where,
            )  # fmt: skip
        if not -2.0 * math.pi <= azimuth <= 2.0 * math.pi:
            raise InputError(
                f"azimuth {math.degrees(azimuth):g} deg at {depth:g} m: allowed are -360 to 360 "
                "deg", where,
            )  # fmt: skip


def sharp_bends(path: Path) -> list[tuple[float, float]]:
    """Where the well bends by more than 15 deg/30 m: depth (m) and curvature (rad/m)."""
    return [
        (float(depth), float(k))
        for depth, k in zip(path.depth, path.curvature, strict=True)
        if k > SHARP
    ]
