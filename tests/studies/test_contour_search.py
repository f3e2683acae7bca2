"""Contours from few values: the same outlines as of the full grid, on functions that are known."""

from __future__ import annotations

from itertools import pairwise

import contourpy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from drillctl.studies.adaptive.checks import self_check
from drillctl.studies.adaptive.contour_search import ContourSearch, bands_of, search
from drillctl.studies.adaptive.lattices import around, in_quads, nested_lattices
from drillctl.studies.adaptive.study import banded
from drillctl.studies.grid import Axis
from drillctl.studies.regions import region

HOLDS = (
    (
        "adaptive maps",
        "outlines and bits of the full grid, to the last; known functions with islands, "
        "holes, jumps, saddles and failures; random ones: each contour whole or missed whole; "
        "samples of known mismatch",
    ),
)

LEVELS = (20.0, 30.0, 40.0, 50.0)


class Function:
    """Values on a grid, and which of them were asked for."""

    def __init__(self, values):
        self.values = np.asarray(values, dtype=float)
        self.asked = []

    def __call__(self, cells):
        self.asked.extend(cells.tolist())
        return self.values.ravel()[cells]


def searched(values, levels=LEVELS, intervals=40):
    function = Function(values)
    found = search(function, function.values.shape, levels, intervals)
    assert len(set(function.asked)) == len(function.asked)  # no cell is simulated twice
    np.testing.assert_array_equal(np.flatnonzero(found.seen.ravel()), sorted(function.asked))
    np.testing.assert_array_equal(np.concatenate(found.order), function.asked)
    return found


def outlines(found):
    """Outline of each level as the search has it; over the indices of the grid."""
    return full_outlines(stood_in(found), found.levels)


def stood_in(found):
    """Values where the search looked, any of the same band elsewhere."""
    cells = np.concatenate(found.order)
    return banded(found.bands, found.levels, cells, found.values.ravel()[cells])


def full_outlines(values, levels=LEVELS):
    return [region(values, indices(values.shape), level).polygons for level in levels]


def indices(shape):
    return tuple(Axis(str(n), "", np.arange(k, dtype=float)) for n, k in enumerate(shape))


def plane(shape=(401, 401)):
    """Coordinates from -1 to 1 along both axes."""
    return np.meshgrid(*(np.linspace(-1.0, 1.0, k) for k in shape), indexing="ij")


def dents(shape, *places):
    """120 nearly everywhere, with smooth dents: (x, y, radius, depth)."""
    x, y = plane(shape)
    values = np.full(shape, 120.0)
    for at_x, at_y, radius, depth in places:
        values -= depth * np.exp(-((x - at_x) ** 2 + (y - at_y) ** 2) / radius**2)
    return values


def spiral(shape):
    x, y = plane(shape)
    turn = np.arctan2(y, x) / (2.0 * np.pi)
    return 15.0 + 100.0 * np.abs((3.0 * np.hypot(x, y) - turn) % 1.0 - 0.5)


X, Y = plane()
RADIUS = np.hypot(X, Y)
KNOWN = {
    "a circle": 100.0 * RADIUS,
    "two islands and a hole": dents((401, 401), (-0.5, 0.3, 0.2, 110.0), (0.6, -0.5, 0.1, 90.0))
    + 70.0 * np.exp(-((X + 0.5) ** 2 + (Y - 0.3) ** 2) / 0.05**2),
    "a small island": dents((401, 401), (0.31, 0.17, 0.035, 105.0)),
    "leaves the window": 35.0 + 60.0 * X + 15.0 * np.sin(5.0 * Y),
    "a saddle at a level": 30.0 + 80.0 * X * Y,
    "a saddle of cells": 35.0 + 400.0 * (X - 0.0013) * (Y + 0.0021),
    "jumps": np.where(RADIUS < 0.4, 12.0, 90.0) + 10.0 * (X > 0.1),
    "a ragged edge": 100.0 * RADIUS + 8.0 * np.sin(97.0 * X + 40.0 * Y) * np.cos(83.0 * Y),
    "a thin ridge of high values": np.where(np.abs(X - Y) < 0.006, 80.0, 90.0 * RADIUS),
    "a spiral": spiral((401, 401)),
    "fails in a corner": np.where(X + Y > 0.3, np.nan, 100.0 * RADIUS),
    "under every level": np.full((401, 401), 3.0),
    "above every level": np.full((401, 401), 300.0),
    "fails everywhere": np.full((401, 401), np.nan),
    "touches a level": 20.0 + 100.0 * RADIUS,
}

LONG = {"a ragged edge": 0.33, "a spiral": 0.48}
"""Largest share of the cells where contours are long: they cross 7 % and 16 % of all quads."""


@pytest.mark.parametrize("name", KNOWN)
def test_outlines_are_those_of_the_full_grid(name):
    values = KNOWN[name]
    found = searched(values)
    np.testing.assert_array_equal(found.bands, bands_of(values, LEVELS))
    for mine, full in zip(outlines(found), full_outlines(values), strict=True):
        assert mine.equals_exact(full)
    assert found.seen.mean() < LONG.get(name, 0.12)


def test_a_share_that_shrinks_with_the_resolution():
    shares = []
    for points in (161, 321, 641):
        x, y = plane((points, points))
        shares.append(searched(100.0 * np.hypot(x, y), (30.0,)).seen.mean())
    assert shares[0] > 1.7 * shares[1] > 3.0 * shares[2]
    assert shares[2] < 0.02


@pytest.mark.parametrize("shape", [(2, 2), (2, 90), (5, 5), (41, 81), (97, 400), (163, 122)])
def test_any_shape(shape):
    x, y = plane(shape)
    values = 60.0 * np.hypot(x - 0.2, 0.7 * y)
    found = searched(values)
    np.testing.assert_array_equal(found.bands, bands_of(values, LEVELS))
    for mine, full in zip(outlines(found), full_outlines(values), strict=True):
        assert mine.equals_exact(full)
    assert found.seen.all() == (max(shape) < 81)


def test_the_minimum_is_one_of_the_grid():
    values = dents((401, 401), (0.313, -0.207, 0.5, 60.0))  # far above every level but near none
    found = searched(values)
    assert np.nanmin(found.values) == values.min()
    assert found.seen.mean() < 0.02


def lines(values, level):
    """Contours at a level, closed or from rim to rim, each as the set of its vertices."""
    rows, columns = (np.arange(k, dtype=float) for k in values.shape)
    made = contourpy.contour_generator(rows, columns, np.ma.masked_invalid(values.T))
    return {frozenset(map(tuple, line.tolist())) for line in made.lines(level)}


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    smooth=st.floats(0.6, 8.0),
    shape=st.tuples(st.integers(40, 140), st.integers(40, 140)),
    intervals=st.integers(1, 30),
)
def test_a_contour_is_found_whole_or_missed_whole(seed, smooth, shape, intervals):
    """Whatever the function: islands between the coarse points may be missed, nothing else."""
    noise = gaussian_filter(np.random.default_rng(seed).standard_normal(shape), smooth)
    values = 35.0 + 15.0 * noise / noise.std()
    found = searched(values, (25.0, 45.0), intervals)
    for level in found.levels:
        assert lines(stood_in(found), level) <= lines(values, level)
    # Every quad whose corners are in different bands was looked at as a whole.
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        corner = found.seen[i : shape[0] - 1 + i, j : shape[1] - 1 + j]
        assert corner[mixed(found.bands)].all()
    seen = found.seen
    np.testing.assert_array_equal(found.bands[seen], bands_of(values, (25.0, 45.0))[seen])


def mixed(bands):
    quads = np.stack([bands[:-1, :-1], bands[1:, :-1], bands[:-1, 1:], bands[1:, 1:]])
    return (quads != quads[0]).any(axis=0)


def with_a_pit(count, size=3):
    """Flat at 90, with pits far smaller than the coarsest spacing, where none is looked for."""
    values = np.full((401, 401), 90.0)
    random = np.random.default_rng(7)
    for row, column in 8 * random.integers(1, 49, (count, 2)) + 3:
        values[row : row + size, column : column + size] = 10.0
    return values


def test_a_pit_between_the_points_is_missed_and_a_sample_tells():
    values = with_a_pit(300)
    found = searched(values)
    assert (found.bands == len(LEVELS)).all()
    grid = nested_lattices((401, 401), 40)[-1]
    wrong = float((bands_of(values, LEVELS) != found.bands)[~found.seen].mean())
    check = self_check(found, grid, 300)
    assert len(check.mismatches) >= 1
    assert check.verdict == "look"
    low, high = check.interval
    assert low < wrong < high
    # Each pit that the sample hit is found whole now: 9 cells and the 16 around, less the hit.
    hit = 9 * len(check.mismatches)
    assert int((found.bands == 0).sum()) == hit
    assert check.followed == 24 * len(check.mismatches)
    for mine, full in zip(outlines(found), full_outlines(values), strict=True):
        assert len(mine.geoms) == len(check.mismatches)
        assert all(any(part.equals(other) for other in full.geoms) for part in mine.geoms)


def test_a_clean_sample():
    found = searched(KNOWN["a circle"])
    before = int(found.seen.sum())
    check = self_check(found, nested_lattices((401, 401), 40)[-1], 300)
    assert (len(check.cells), len(check.mismatches), check.followed) == (300, 0, 0)
    assert check.verdict == "ok"
    assert check.interval == (0.0, pytest.approx(1.0 - 0.025 ** (1 / 300)))
    assert int(found.seen.sum()) == before + 300
    again = searched(KNOWN["a circle"])
    np.testing.assert_array_equal(
        self_check(again, nested_lattices((401, 401), 40)[-1], 300).cells, check.cells
    )


@pytest.mark.parametrize("count", [0, 300])
def test_nothing_to_check(count):
    found = searched(np.full((5, 5), 90.0))
    check = self_check(found, nested_lattices((5, 5), 40)[-1], count)
    assert (len(check.cells), check.interval, check.verdict) == (0, None, "none")


def test_bands():
    values = np.array([3.0, 20.0, 20.001, 50.0, 51.0, np.inf, np.nan])
    assert bands_of(values, LEVELS).tolist() == [0, 0, 1, 3, 4, 4, 4]


@pytest.mark.parametrize("shape", [(401, 401), (97, 402), (80, 81), (3, 200), (2, 2)])
def test_lattices_are_nested(shape):
    made = nested_lattices(shape, 40)
    assert made[-1].shape == shape
    for coarse, fine in pairwise(made):
        assert set(coarse.rows) <= set(fine.rows)
        assert set(coarse.columns) <= set(fine.columns)
        assert coarse.steps != fine.steps
    for points, lattice in ((shape[0], made[0].rows), (shape[1], made[0].columns)):
        assert (lattice[0], lattice[-1]) == (0, points - 1)
        assert len(lattice) - 1 >= min(40, points - 1)


def beside(coarse, fine):
    """The coarse indices at or under a fine one, and at or over it."""
    return {max(k for k in coarse if k <= fine), min(k for k in coarse if k >= fine)}


def test_coarse_points_around_a_fine_one():
    coarse, fine = nested_lattices((12, 19), 2)[:2]
    assert (coarse.steps, fine.steps) == ((4, 8), (2, 4))
    assert coarse.rows.tolist() == [0, 4, 8, 11]
    at = np.arange(coarse.rows.size * coarse.columns.size).reshape(coarse.shape)
    near = np.stack([at[index] for index in around(coarse, fine)])
    quads = np.zeros((coarse.shape[0] - 1, coarse.shape[1] - 1), dtype=bool)
    quads[1, 0] = True
    inside = in_quads(quads, coarse, fine)
    for i, row in enumerate(fine.rows):
        for j, column in enumerate(fine.columns):
            rows = {
                max(r for r in coarse.rows if r <= row),
                min(r for r in coarse.rows if r >= row),
            }
            columns = {
                max(c for c in coarse.columns if c <= column),
                min(c for c in coarse.columns if c >= column),
            }
            expected = {
                at[list(coarse.rows).index(r), list(coarse.columns).index(c)]
                for r in rows
                for c in columns
            }
            assert set(near[:, i, j]) == expected
            assert inside[i, j] == (4 <= row <= 8 and 0 <= column <= 8)


def test_a_search_alone_knows_nothing():
    found = ContourSearch(Function(np.zeros((4, 4))), (4, 4), LEVELS)
    assert not found.seen.any()
    assert (found.bands == -1).all()
