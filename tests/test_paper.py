"""The source paper's map and statements 1-3 on the shipped designs."""

import numpy as np
import pytest

import drillctl
from drillctl.simulation.measures import STATUSES
from drillctl.studies import Sweep

HOLDS = {
    "the paper's map": "cells and bounds per level, minimum, statements 1-3",
}

CELLS = {20: 10, 30: 49, 33: 59, 40: 78, 50: 94}
BOUNDS = {
    20: ((600, 650), (125, 175)),
    30: ((475, 675), (62.5, 175)),
    33: ((450, 675), (50, 175)),
    40: ((425, 700), (37.5, 175)),
    50: ((400, 700), (25, 187.5)),
}


def paper_map(**values: object) -> Sweep:
    levels = {"map.levels": [20.0, 30.0, 33.0, 40.0, 50.0]}
    design = drillctl.load("monteiro-trindade-140kn", **{**levels, **values})
    return drillctl.stability_map(design, audit_cells=0)


@pytest.fixture(scope="module")
def at_140() -> Sweep:
    return paper_map()


@pytest.fixture(scope="module")
def fine_at_140() -> Sweep:
    return paper_map(**{"simulation.accuracy": "fine"})


def test_minimum(at_140):
    value, at = at_140.minimum
    assert value == pytest.approx(15.83, abs=0.01)
    assert at == {"controller.kp": 650.0, "controller.ki": 162.5}


@pytest.mark.parametrize("level", CELLS)
def test_regions(at_140, level):
    region = at_140.regions[level]
    assert region.cells == pytest.approx(CELLS[level], abs=2)
    for axis, expected in zip(at_140.axes, BOUNDS[level], strict=True):
        cell = axis.values[1] - axis.values[0]
        assert region.bounds[axis.path] == pytest.approx(expected, abs=cell)


def test_every_cell_is_in_the_right_region(at_140, fine_at_140):
    exact = fine_at_140.j1
    for level in CELLS:
        wrong = (at_140.j1 <= level) != (exact <= level)
        assert np.abs(exact[wrong] / level - 1.0).max(initial=0.0) < 0.01


def test_at_120_kn():
    found = drillctl.stability_map(drillctl.load("monteiro-trindade-120kn"), audit_cells=0)
    value, at = found.minimum
    assert value == pytest.approx(10.62, abs=0.01)
    assert at == {"controller.kp": 675.0, "controller.ki": 175.0}
    assert found.regions[20].cells == pytest.approx(234, abs=3)
    assert found.regions[50].cells == pytest.approx(383, abs=3)


def test_statement_1_no_ten_and_nested_closed_contours(at_140):
    assert at_140.minimum[0] > 10.0
    outer = None
    for level in (50, 40, 30, 20):
        outline = at_140.regions[level].polygons
        assert len(outline.geoms) == 1, level
        assert not outline.geoms[0].interiors
        x0, y0, x1, y1 = outline.bounds
        assert x0 > 0 and x1 < 1000 and y0 > 0 and y1 < 500, "touches the edge of the map"  # noqa: PT018
        if outer is not None:
            assert outer.contains(outline)
        outer = outline


def test_statement_2_better_for_moderate_gains(at_140):
    kp, ki = (axis.values for axis in at_140.axes)
    inside = np.outer((kp >= 400) & (kp <= 700), (ki >= 50) & (ki <= 200))
    assert at_140.j1[inside].mean() < 0.7 * at_140.j1[~inside].mean()
    assert inside[at_140.j1 <= 30].all()


def test_statement_3_j1_tells_stick_slip(at_140):
    late = at_140.status == STATUSES.index("sticking")
    stalled = at_140.status == STATUSES.index("stalled")
    assert not (late | stalled)[at_140.j1 <= 33].any()
    assert (late | stalled)[at_140.j1 > 60].mean() >= 0.95
    pairs = [(625, 125), (475, 62.5), (400, 100), (200, 100)]
    runs = [
        drillctl.simulate(at_140.design, "batch", **{"controller.kp": kp, "controller.ki": ki})
        for kp, ki in pairs
    ]
    j1 = [run.measures.j1 for run in runs]
    stuck = [run.measures.stuck_time for run in runs]
    assert (np.diff(j1) > 5).all()
    assert (np.diff(stuck) > 0).all()


def test_audit_of_the_shipped_map():
    design = drillctl.load("monteiro-trindade-140kn")
    found = drillctl.stability_map(design, audit_cells=4)
    assert found.audit.verdict == "ok"
    assert found.audit.worst < 5e-3


@pytest.mark.parametrize("name", ["wob-rpm-chart", "navarro-lopez-2dof-bistable"])
def test_the_other_shipped_maps_run(name):
    found = drillctl.stability_map(drillctl.load(name), audit_cells=0)
    assert not (found.status == STATUSES.index("failed")).any()
    assert found.minimum is not None
