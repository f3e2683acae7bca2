"""The boundary of the stable gains against eigenvalues and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

import drillctl
from drillctl.errors import InputError
from drillctl.linear import ends_of, gain_boundary, slope_margin, slope_margins
from drillctl.linear.loop_model import loop_poles, many_loop_poles

HOLDS = {
    "boundary of the stable gains": "eigenvalue mask of 200 x 200 gains; D* on the curve to 1e-8; "
    "Routh",
}

DESIGN = "monteiro-trindade-140kn"


@pytest.fixture(scope="module")
def boundary(design):
    return gain_boundary(design)


def eigenvalue_mask(design, slope, kp, ki):
    poles = many_loop_poles(design.string, kp.ravel(), ki.ravel(), slope, threads=2)
    return (np.nanmax(poles.real, axis=1) < 0.0).reshape(kp.shape)


@pytest.mark.parametrize(
    ("name", "values", "points"),
    [
        (DESIGN, {}, 80),
        pytest.param(DESIGN, {}, 200, marks=pytest.mark.slow),
        (DESIGN, {"drillstring.sections.pipe.stiffness_damping": "1 ms"}, 40),
        (DESIGN, {"operating_point.speed": "80 rpm"}, 40),
        ("monteiro-trindade-120kn", {"drillstring.sections.pipe.elements": 10}, 80),
    ],
)
def test_no_cell_is_on_the_wrong_side(name, values, points):
    design = drillctl.load(name, **values)
    found = gain_boundary(design)
    kp, ki = np.meshgrid(np.linspace(0, 1000, points), np.linspace(0, 500, points), indexing="ij")
    mask = eigenvalue_mask(design, found.slope, kp, ki)
    inside = shapely.intersects_xy(found.region, kp, ki)
    wrong = mask != inside
    cell = np.array([1000.0, 500.0]) / (points - 1)
    edge = shapely.transform(found.region.boundary, lambda xy: xy / cell)
    distance = shapely.distance(
        edge, shapely.points(np.column_stack([kp[wrong] / cell[0], ki[wrong] / cell[1]]))
    )
    assert np.all(distance <= 1.0)
    assert wrong.sum() <= 1e-3 * wrong.size


def test_every_branch_has_a_pole_on_the_axis(design, boundary):
    for branch in boundary.branches[:4]:
        for point in np.linspace(0, len(branch.omega) - 1, 5).astype(int):
            kp, ki, omega = branch.kp[point], branch.ki[point], branch.omega[point]
            poles = loop_poles(design.string, kp, ki, boundary.slope)
            assert np.abs(poles - 1j * omega).min() < 1e-9 * np.abs(poles).max()


def test_bounds_of_the_region(boundary):
    summary = boundary.summary()
    (kp_low, kp_high), (ki_low, ki_high) = summary["bounds"].values()
    # The left edge is that of the high modes, D (J_m/J_b)^2 = 467.15.
    assert kp_low == pytest.approx(467.15, abs=0.1)
    assert 700.0 < kp_high < 725.0
    assert 25.0 < ki_low < 50.0
    assert 200.0 < ki_high < 225.0
    assert summary["area_fraction"] == pytest.approx(0.0686, abs=1e-4)
    assert boundary.contains(600.0, 112.0)
    assert not boundary.contains(400.0, 100.0)


def test_on_the_boundary_the_slope_margin_is_the_slope(design, boundary):
    ends = ends_of(design.string)
    edge = shapely.get_coordinates(boundary.region.boundary)[::97]
    for kp, ki in edge:
        assert slope_margin(ends, kp, ki)[0] == pytest.approx(boundary.slope, rel=1e-8)


def test_the_continuum_has_nearly_the_same_region(design, boundary):
    wave = gain_boundary(design, model="wave")
    share = wave.region.symmetric_difference(boundary.region).area / boundary.region.area
    assert 0.0 < share < 0.01


def test_two_lumped_inertias_by_routh(design):
    # J_m and J_b on one spring: the region from the Routh array of the quartic.
    string = drillctl.load(
        "navarro-lopez-2dof",
        **{"controller": {"law": "pi", "kp": 200.0, "ki": 100.0}},
    )
    slope = 450.0
    found = gain_boundary(string, window=((0.0, 2000.0), (0.0, 2000.0)), slope=slope)
    j, jb, k, c, cr, cb = 2122.0, 471.9698, 861.5336, 172.3067, 425.0, 50.0
    kp, ki = np.meshgrid(np.linspace(5, 1995, 60), np.linspace(5, 1995, 60), indexing="ij")
    link = np.poly1d([c, k])
    bit = np.poly1d([jb, cb - slope, 0.0]) + link
    stable = np.empty(kp.shape, dtype=bool)
    for at in np.ndindex(kp.shape):
        top = np.poly1d([j, cr + kp[at], ki[at]]) + link
        stable[at] = np.roots(top * bit - link * link).real.max() < 0.0
    inside = shapely.intersects_xy(found.region, kp, ki)
    assert 0 < stable.sum() < stable.size
    assert (stable != inside).sum() <= 0.005 * stable.size


def test_rising_friction_is_stable_everywhere(design):
    found = gain_boundary(design, slope=-10.0)
    assert found.summary()["area_fraction"] == 1.0


def test_slope_too_steep_for_any_gains(design):
    found = gain_boundary(design, slope=400.0)
    assert found.region.is_empty
    assert found.summary()["bounds"] is None


@pytest.mark.parametrize(
    "window", [((500.0, 100.0), (0.0, 1.0)), ((-1.0, 100.0), (0.0, 1.0)), ((0.0, 1.0), (2.0, 2.0))]
)
def test_impossible_windows_are_refused(design, window):
    with pytest.raises(InputError, match="no range of gains"):
        gain_boundary(design, window=window)


@pytest.mark.parametrize("top", [5.0, 150.0, 500.0])
@pytest.mark.parametrize("bit", [300.0, 600.0, 2000.0])
def test_light_drives_and_heavy_bits(top, bit):
    # There the lowest branch begins at Ki = 0 inside the region's edge, and must cut it.
    design = drillctl.load(
        DESIGN, **{"top_drive.inertia": f"{top} kg*m^2", "bha.inertia": f"{bit} kg*m^2"}
    )
    found = gain_boundary(design)
    kp, ki = np.meshgrid(np.linspace(5, 995, 34), np.linspace(2.5, 497.5, 34), indexing="ij")
    mask = slope_margins(ends_of(design.string), kp, ki).slope > found.slope
    inside = shapely.intersects_xy(found.region, kp, ki)
    assert (mask != inside).sum() <= 2


def test_a_slope_that_is_no_number_is_refused(design):
    with pytest.raises(InputError, match="must be a number"):
        gain_boundary(design, slope=float("nan"))
