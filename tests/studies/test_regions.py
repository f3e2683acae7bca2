"""Regions of fields whose areas and bounds are known."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from drillctl.studies import Axis, region


def axes(*values):
    return tuple(Axis(f"p{i}", "", np.asarray(v, dtype=float)) for i, v in enumerate(values))


def bowl(points, centre=(0.03, -0.02)):
    """(x - a)^2 + (y - b)^2 over the square from -2 to 2."""
    line = np.linspace(-2.0, 2.0, points)
    x, y = np.meshgrid(line - centre[0], line - centre[1], indexing="ij")
    return x**2 + y**2, axes(line, line)


def test_cells_mask_share_and_bounds():
    values = np.array([[1.0, 2.0, 3.0], [2.0, 9.0, 9.0]])
    found = region(values, axes([10, 20], [5, 6, 7]), 2.0)
    np.testing.assert_array_equal(found.mask, [[True, True, False], [True, False, False]])
    assert found.cells == 3
    assert found.area_fraction == 0.5
    assert found.bounds == {"p0": (10.0, 20.0), "p1": (5.0, 6.0)}
    assert found.summary() == {
        "cells": 3, "area_fraction": 0.5, "bounds": {"p0": [10.0, 20.0], "p1": [5.0, 6.0]},
    }  # fmt: skip


def test_one_and_three_parameters():
    found = region(np.array([3.0, 1.0, 1.0, 3.0]), axes([0, 1, 2, 3]), 2.0)
    assert found.bounds == {"p0": (1.0, 2.0)}
    assert found.polygons is None
    cube = np.full((2, 3, 4), 5.0)
    cube[1, 2, 1:3] = 0.0
    found = region(cube, axes([0, 1], [0, 1, 2], [0, 1, 2, 3]), 2.0)
    assert found.bounds == {"p0": (1.0, 1.0), "p1": (2.0, 2.0), "p2": (1.0, 2.0)}
    assert found.area_fraction == 2 / 24
    assert found.polygons is None


def test_area_of_a_circle_converges_with_order_two():
    exact = math.pi * 1.3**2
    errors = []
    for points in (21, 321):
        values, square = bowl(points)
        errors.append(abs(region(values, square, 1.3**2).polygons.area - exact))
    order = math.log(errors[0] / errors[1]) / math.log(16.0)
    assert order == pytest.approx(2.0, abs=0.15)


def test_outline_lies_where_the_field_says():
    values, square = bowl(201)
    outline = region(values, square, 1.0).polygons
    assert len(outline.geoms) == 1
    edge = np.array(outline.geoms[0].exterior.coords)
    np.testing.assert_allclose(np.hypot(edge[:, 0] - 0.03, edge[:, 1] + 0.02), 1.0, atol=2e-4)


def test_a_ring_has_a_hole():
    values, square = bowl(201)
    ring = region(np.abs(np.sqrt(values) - 1.0), square, 0.25).polygons
    assert len(ring.geoms) == 1
    assert len(ring.geoms[0].interiors) == 1
    assert ring.area == pytest.approx(math.pi * (1.25**2 - 0.75**2), rel=2e-3)


def test_two_islands():
    x = np.linspace(0.0, 4.0, 81)
    values = np.cos(np.pi * x)[:, None] + np.zeros(11)  # below zero twice
    found = region(values, axes(x, np.linspace(0.0, 1.0, 11)), 0.0).polygons
    assert len(found.geoms) == 2
    assert found.area == pytest.approx(2.0, rel=1e-3)


def test_regions_grow_with_the_level():
    values, square = bowl(41)
    found = [region(values, square, level) for level in (0.5, 1.0, 2.0)]
    for small, large in pairwise(found):
        assert (small.mask <= large.mask).all()
        assert large.polygons.buffer(1e-9).contains(small.polygons)


def test_failed_cells_are_never_inside():
    values, square = bowl(41)
    inner = values.copy()
    inner[20, 20] = np.nan
    whole, holed = (region(v, square, 1.0) for v in (values, inner))
    assert not holed.mask[20, 20]
    assert holed.cells == whole.cells - 1
    import shapely

    assert not holed.polygons.contains(shapely.Point(square[0].values[20], square[1].values[20]))
    assert holed.polygons.area < whole.polygons.area
    nothing = region(np.full_like(values, np.nan), square, 1e9)
    assert (nothing.cells, nothing.bounds, nothing.polygons.area) == (0, {}, 0.0)


def test_infinite_values_are_outside():
    values, square = bowl(11)
    values[5, 5] = np.inf
    assert not region(values, square, 1e9).mask[5, 5]


def test_empty_and_full():
    values, square = bowl(21)
    empty = region(values, square, -1.0)
    assert empty.cells == 0
    assert empty.area_fraction == 0.0
    assert empty.bounds == {}
    assert empty.polygons.is_empty
    full = region(values, square, 1e9)
    assert full.area_fraction == 1.0
    assert full.polygons.area == pytest.approx(16.0)


def test_a_level_touched_in_one_cell():
    values, square = bowl(21, centre=(0.0, 0.0))
    found = region(values, square, 0.0)
    assert found.cells == 1
    assert found.polygons.area == 0.0


def test_values_need_not_be_even():
    x, y = np.geomspace(0.1, 10.0, 9), np.array([0.0, 1.0, 5.0, 6.0])
    values = np.add.outer(x, 0.0 * y)  # x itself: linear, so the outline is exact
    found = region(values, axes(x, y), 2.0)
    assert found.polygons.area == pytest.approx((2.0 - 0.1) * 6.0, rel=1e-12)
    assert found.bounds["p0"] == (0.1, x[x <= 2.0][-1])
    assert found.bounds["p1"] == (0.0, 6.0)
