"""Stability regions: the cells of a map at or under a level, and their outline."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.grid import Axis

if TYPE_CHECKING:
    import shapely

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Region:
    """The part of a map at or under one level.

    Attributes
    ----------
    level : float
        Level of J1 (s).
    mask : ndarray of bool, shape of the map
        Cells in the region; a cell that failed is not.
    cells : int
        Number of them.
    area_fraction : float
        Their share of all cells.
    bounds : dict
        Path to (lowest, highest) cell centre in the region (SI); empty for an empty region.
    polygons : shapely.MultiPolygon or None
        Outline by linear interpolation, in SI; only for maps over two parameters.
    """

    level: float
    mask: NDArray[np.bool_]
    cells: int
    area_fraction: float
    bounds: dict[str, tuple[float, float]]
    polygons: shapely.MultiPolygon | None

    def summary(self) -> dict[str, Any]:
        """Cells, share and bounds."""
        return {
            "cells": self.cells,
            "area_fraction": self.area_fraction,
            "bounds": {path: list(pair) for path, pair in self.bounds.items()},
        }


def region(values: Array, axes: tuple[Axis, ...], level: float) -> Region:
    """The region of a map at or under a level.

    Parameters
    ----------
    values : ndarray, shape of the map
        J1 (s); NaN where a cell failed.
    axes : tuple of Axis
        Of the map.
    level : float
        Level (s).
    """
    mask = np.nan_to_num(values, nan=np.inf) <= level
    bounds = {}
    for dimension, axis in enumerate(axes):
        others = tuple(d for d in range(mask.ndim) if d != dimension)
        inside = axis.values[mask.any(axis=others)]
        if inside.size:
            bounds[axis.path] = (float(inside[0]), float(inside[-1]))
    cells = int(mask.sum())
    polygons = outline(values, axes, level) if len(axes) == 2 else None
    return Region(level, mask, cells, cells / mask.size, bounds, polygons)


def outline(values: Array, axes: tuple[Axis, ...], level: float) -> shapely.MultiPolygon:
    """Outline of {J1 <= level} of a two-parameter map, interpolated linearly between cells."""
    import contourpy
    import shapely

    first, second = axes
    # contourpy masks NaN: a failed cell is left out of the region, and so are its neighbours'
    # shares of the quads around it.
    generator = contourpy.contour_generator(
        first.values, second.values, np.ma.masked_invalid(values.T),
        fill_type=contourpy.FillType.OuterOffset,
    )  # fmt: skip
    points, offsets = generator.filled(-np.inf, level)
    polygons = [
        shapely.Polygon(p[o[0] : o[1]], [p[a:b] for a, b in pairwise(o[1:])])
        for p, o in zip(points, offsets, strict=True)
    ]
    valid = [part for polygon in polygons for part in _parts(shapely.make_valid(polygon))]
    return shapely.MultiPolygon(valid)


def _parts(geometry: Any) -> list[Any]:
    """The polygons in a geometry; a cell that touches the level in a point alone has none."""
    if geometry.geom_type == "Polygon":
        return [geometry] if geometry.area > 0.0 else []
    return [p for g in getattr(geometry, "geoms", []) for p in _parts(g)]
