"""The audit of a map: which cells, and what is said of them."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.ensemble import audit as auditing
from drillctl.ensemble.audit import Audit, audit, choose_cells, reference_j1
from drillctl.ensemble.grid import axes_of
from drillctl.errors import SimulationError

LEVELS = (10.0, 20.0, 30.0)


@pytest.fixture(scope="module")
def design():
    return drillctl.load(
        "navarro-lopez-2dof-bistable",
        **{
            "simulation.duration": "10 s",
            "map.axes": [
                {"path": "start.speed", "min": "9 rad/s", "max": "14 rad/s", "points": 3},
                {"path": "controller.torque", "min": "9 kN*m", "max": "12 kN*m", "points": 2},
            ],
        },
    )


def field(points=400):
    return np.random.default_rng(3).uniform(0.0, 120.0, (points // 20, 20))


def test_choice_is_seeded():
    values = field()
    np.testing.assert_array_equal(
        choose_cells(values, LEVELS, 12), choose_cells(values, LEVELS, 12)
    )


def test_choice_is_spread_over_the_bands():
    values = field()
    cells = choose_cells(values, LEVELS, 12)
    assert len(cells) == len(set(cells)) == 12
    assert (np.diff(cells) > 0).all()
    counts, _ = np.histogram(values.ravel()[cells], bins=[-np.inf, 10, 20, 30, 60])
    assert counts.tolist() == [3, 3, 3, 3]


def test_choice_is_never_beyond_twice_the_highest_level():
    cells = choose_cells(field(), LEVELS, 10_000)
    assert field().ravel()[cells].max() <= 60.0
    assert len(cells) == (field() <= 60.0).sum()


def test_a_full_band_does_not_stop_the_others():
    values = np.full(50, 15.0)
    values[7] = 5.0
    cells = choose_cells(values, LEVELS, 6)
    assert len(cells) == 6
    assert 7 in cells


def test_choice_leaves_failed_cells_out():
    values = np.array([np.nan, 5.0, np.inf, 15.0])
    assert choose_cells(values, LEVELS, 9).tolist() == [1, 3]
    assert choose_cells(np.full(4, np.nan), LEVELS, 9).size == 0
    assert choose_cells(values, LEVELS, 0).size == 0


@pytest.mark.parametrize(
    ("batch", "reference", "verdict", "worst"),
    [
        ([], [], "none", None),
        ([10.0, 20.0], [10.0, 20.1], "ok", 0.1 / 20.1),
        ([10.0, 20.0], [10.0, 20.3], "check", 0.3 / 20.3),
        ([10.0, 20.0], [10.05, np.nan], "check", 0.05 / 10.05),
        ([10.0], [np.nan], "check", None),
        ([0.0, 1.0], [0.0, 1.0], "ok", 0.0),
        ([1e-3], [0.0], "check", 1e4),
        ([1e-12], [0.0], "ok", 1e-5),
    ],
)
def test_verdict(batch, reference, verdict, worst):
    found = Audit(np.arange(len(batch)), np.array(batch), np.array(reference))
    assert found.verdict == verdict
    assert found.worst == (None if worst is None else pytest.approx(worst))
    assert found.summary() == {
        "cells": len(batch), "worst_relative_difference": found.worst, "verdict": verdict,
    }  # fmt: skip


@pytest.mark.parametrize("error", [SimulationError("no"), OverflowError("math range error")])
def test_a_reference_that_fails_is_a_verdict_not_an_exception(design, monkeypatch, error):
    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr("drillctl.simulation.reference.solve", fail)
    assert np.isnan(reference_j1(design))
    axes = axes_of(design, design.tables.map.axes)
    values = np.full((3, 2), 5.0)
    found = audit(design, axes, values, LEVELS, 1)  # one cell is run in this process
    assert found.verdict == "check"
    assert found.worst is None
    assert found.batch.tolist() == [5.0]


def test_a_rig_that_grows_without_bound_is_told_quietly(recwarn):
    wild = drillctl.load(
        "monteiro-trindade-140kn", **{"controller.kp": -1e12, "simulation.duration": "5 s"}
    )
    assert np.isnan(reference_j1(wild))
    assert not recwarn.list


class Told:
    def __init__(self):
        self.tasks = []

    def begin(self, task, total):
        self.tasks.append([task, total, 0])

    def advance(self, done):
        self.tasks[-1][2] += done


def test_real_audit_of_two_cells(design):
    told = Told()
    found = drillctl.sweep(design, audit_cells=2, progress=told)
    assert len(found.audit.cells) == 2
    np.testing.assert_array_equal(found.audit.batch, found.j1.ravel()[found.audit.cells])
    assert found.audit.verdict == "ok"
    assert 0.0 < found.audit.worst < auditing.WORST_ALLOWED
    alone = [
        drillctl.simulate(drillctl.ensemble.grid.cell_design(design, found.axes, int(cell)))
        for cell in found.audit.cells
    ]
    np.testing.assert_allclose(found.audit.reference, [run.measures.j1 for run in alone], rtol=1e-4)
    assert told.tasks[-1] == ["auditing cells", 2, 2]
    assert ["simulating lanes", 6, 6] in told.tasks


def test_no_audit_is_silent(design):
    told = Told()
    assert drillctl.sweep(design, audit_cells=0, progress=told).audit.verdict == "none"
    assert [task for task, *_ in told.tasks] == ["loading kernels", "simulating lanes"]
