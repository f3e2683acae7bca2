"""The audit of a map: which cells, and what is said of them."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.ensemble.audit import Audit, audited, by_reference, choose_cells
from drillctl.ensemble.grid import axes_of, cell_design
from drillctl.errors import SimulationError
from drillctl.simulation.measures import BATCH_MEASURES, MEASURES
from drillctl.studies.base import audit_tables, doubted
from tests.alike import Told

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


def of_j1(batch, reference, finer=None, **others):
    """An audit of J1 and of other measures, each a triple of the same."""
    runs = [{"j1": np.array(values, float)} for values in (batch, reference, finer or [])]
    for name, values in others.items():
        for one, column in zip(runs, values, strict=False):
            one[name] = np.array(column, float)
    cells = np.arange(len(batch))
    speed = np.full(len(batch), 10.0)
    return Audit(cells, runs[0], runs[1], runs[2] if finer else {}, speed, 100.0)


def field(points=400):
    return np.random.default_rng(3).uniform(0.0, 120.0, (points // 20, 20))


def test_choice_is_seeded():
    values = field()
    np.testing.assert_array_equal(
        choose_cells(values, LEVELS, 12), choose_cells(values, LEVELS, 12)
    )


def test_choice_is_spread_over_the_bands_and_near_the_levels():
    values = field()
    cells = choose_cells(values, LEVELS, 16)
    assert len(cells) == len(set(cells)) == 16
    assert (np.diff(cells) > 0).all()
    counts, _ = np.histogram(values.ravel()[cells], bins=[-np.inf, 10, 20, 30, 60])
    assert counts.min() >= 3
    for level in LEVELS:
        assert int(np.argmin(np.abs(values - level))) in cells
    assert int(np.argmin(np.abs(values - LEVELS[-1]))) in choose_cells(values, LEVELS, 4)


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
    assert choose_cells(values, LEVELS, 40).tolist() == [1, 3]
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
        ([10.0] * 5, [10.0] * 4 + [np.nan], "check", 0.0),
        ([0.0, 1.0], [0.0, 1.0], "ok", 0.0),
        ([1e-3], [0.0], "check", 1e4),
        ([1e-12], [0.0], "ok", 1e-5),
    ],
)
def test_verdict(batch, reference, verdict, worst):
    found = of_j1(batch, reference)
    assert found.verdict == verdict
    assert found.worst == (None if worst is None else pytest.approx(worst))
    said = found.summary()
    assert (said["cells"], said["verdict"]) == (len(batch), verdict)
    assert said["worst_relative_difference"] == found.worst
    assert said["failed"] == np.isnan(reference).sum()
    assert said["estimated_error"] == {"median": None, "worst": None}


@pytest.mark.parametrize(
    ("name", "batch", "reference", "wrong"),
    [
        ("peak_top_torque", 25_190.0, 31_416.0, True),  # the first moment left out
        ("peak_top_torque", 31_400.0, 31_416.0, False),
        ("stuck_time", 3.0, 3.9, False),  # of a run of 100 s
        ("stuck_time", 3.0, 4.1, True),
        ("min_bit_speed", 0.0, 0.15, False),  # of a set speed of 10 rad/s
        ("min_bit_speed", 0.0, 0.25, True),
        ("sticks", 3.0, 6.0, False),
        ("sticks", 40.0, 52.0, False),
        ("sticks", 3.0, 8.0, True),
        ("settling_time", np.nan, np.nan, False),
        ("settling_time", 40.0, np.nan, True),
        ("settling_time", np.nan, 40.0, True),
        ("status", 0.0, 0.0, False),
        ("status", 0.0, 1.0, True),
    ],
)
def test_every_measure_and_the_status_within_its_own_tolerance(name, batch, reference, wrong):
    found = of_j1([5.0, 5.0], [5.0, 5.0], **{name: ([batch, batch], [batch, reference])})
    assert found.verdict == ("check" if wrong else "ok")
    said = found.summary()["measures"]
    assert said["j1"]["beyond"] == 0
    assert said[name]["beyond"] == wrong
    assert found.beyond.tolist() == [False, wrong]
    label = MEASURES[name].label if name in MEASURES else name
    assert found.wrong == [label] * wrong
    assert (label in found.sentence("cells")) == wrong
    assert [label in note for note in doubted(found)] == [True] * wrong


J1 = [10.0, 20.0, 30.0, 40.0]


def test_a_cell_on_the_verge_is_listed_and_does_not_fail_alone():
    """The engine by itself at a finer step is as far off: one stick more or less decides."""
    reference, finer = [10.0, 20.0, 30.0, 42.0], [10.0, 20.0, 30.0, 41.0]
    found = of_j1(J1, reference, finer)
    assert found.verge.tolist() == [False, False, False, True]
    assert found.summary()["verge"] == found.summary()["beyond"] == [3]
    assert found.summary()["measures"]["j1"]["worst"] == 0.0
    assert found.worst == pytest.approx(2.0 / 42.0)
    assert found.verdict == "ok"
    assert "1 on the verge of another stick" in found.sentence("cells")
    assert of_j1(J1, reference, J1).verdict == "check"  # the engine is sure, and wrong
    assert of_j1([40.0], [42.0], [41.0]).verdict == "ok"


def test_a_step_that_is_too_long_is_no_verge():
    """Where the finer step moves many cells, it is not one stick in some of them."""
    found = of_j1(J1, [10.0, 20.0, 31.0, 42.0], [10.0, 20.0, 30.9, 41.9])
    assert found.verge.sum() == 2
    assert found.wrong == []
    assert found.verdict == "check"
    assert found.unsettled == ["J1"]
    assert "step is too long for J1" in next(doubted(found))
    assert found.sentence("cells").endswith("another at a finer step too often: J1")


def test_a_settling_time_that_jumps_by_a_swing_is_excused_alone():
    jump = ([50.0] * 4, [50.0, 50.0, 50.0, 53.0], [50.0, 50.0, 50.0, 53.0])
    found = of_j1(J1, J1, J1, settling_time=jump)
    assert (found.verdict, found.verge.any(), found.beyond.sum()) == ("ok", False, 1)
    j1 = [10.0, 20.0, 30.0, 40.8]
    assert of_j1(J1, j1, J1, settling_time=jump).wrong == ["J1"]


def test_the_errors_of_the_design_by_its_own_estimate():
    found = of_j1(J1, J1, [10.0, 20.0 * (1.0 - 15e-4), 30.0, 40.0])
    assert found.summary()["estimated_error"]["worst"] == pytest.approx(16e-4, rel=2e-3)
    assert found.summary()["estimated_error"]["median"] == 0.0


def test_what_a_reader_is_shown_of_the_verge():
    tables = list(audit_tables(of_j1(J1, J1, [10.0, 20.0, 30.0, 41.0]), "draw {}".format))
    assert [(one.name, one.shown) for one in tables] == [("audit", False), ("verge", True)]
    assert tables[1].rows == [["draw 3", 40.0, 41.0, 40.0]]
    assert [row[0] for row in tables[0].rows] == ["j1"]
    assert list(audit_tables(of_j1([], []), str)) == []


@pytest.mark.parametrize("error", [SimulationError("no"), OverflowError("math range error")])
def test_a_reference_that_fails_is_a_verdict_not_an_exception(design, monkeypatch, error):
    def fail(*arguments, **options):
        raise error

    monkeypatch.setattr("drillctl.simulation.reference.solve", fail)
    assert np.isnan(list(by_reference(design).values())).all()
    rig = cell_design(design, axes_of(design), 4)
    found = audited(np.array([4]), {"j1": np.array([5.0])}, [rig])
    assert (found.verdict, found.worst, found.wrong) == ("check", None, [])
    assert found.batch["j1"].tolist() == [5.0]
    assert list(doubted(found)) == ["audit: check: the reference solver fails in 1"]


def test_a_rig_that_grows_without_bound_is_told_quietly(recwarn):
    wild = drillctl.load(
        "monteiro-trindade-140kn", **{"controller.kp": -1e8, "simulation.duration": "5 s"}
    )
    assert np.isnan(by_reference(wild)["j1"])
    assert not recwarn.list


class Interrupting:
    def begin(self, task, total):
        pass

    def advance(self, done):
        raise KeyboardInterrupt


def test_an_interruption_ends_what_other_threads_run(design, monkeypatch):
    ran = {}

    def kept(design, progress):
        ran[design.tables.simulation.duration] = by_reference(design, progress)["j1"]
        return {"j1": 0.0}

    monkeypatch.setattr("drillctl.ensemble.audit.by_reference", kept)
    long = design.replace({"simulation.duration": "20000 s"})
    with pytest.raises(KeyboardInterrupt):
        audited(np.arange(2), {}, [design, long], progress=Interrupting())
    assert np.isfinite(ran[10.0])
    assert np.isnan(ran.get(20000.0, np.nan))  # stopped, or never begun


def test_real_audit_of_two_cells(design):
    told = Told()
    found = drillctl.sweep(design, audit_cells=2, progress=told)
    assert len(found.audit.cells) == 2
    for name, values in found.measures.items():
        np.testing.assert_array_equal(found.audit.batch[name], values.ravel()[found.audit.cells])
    assert found.audit.batch["status"].tolist() == found.status.ravel()[found.audit.cells].tolist()
    assert found.audit.verdict == "ok"
    assert 0.0 < found.audit.worst < MEASURES["j1"].tolerance
    designs = [cell_design(design, found.axes, int(cell)) for cell in found.audit.cells]
    for k, rig in enumerate(designs):
        for tolerance, run in (
            (1e-4, drillctl.simulate(rig).measures.as_dict()),
            (1e-3, drillctl.simulate(rig, engine="batch").measures.as_dict()),
        ):
            for name in ("j1", "stuck_time", "peak_top_torque", "work_at_bit"):
                own = found.audit.reference[name][k]
                assert own == pytest.approx(run[name], rel=tolerance, abs=1e-3)
    # Errors fall with the square of the step: what the engine says of itself is the difference.
    np.testing.assert_allclose(found.audit.estimates, found.audit.differences, rtol=0.2)
    assert told.tasks[-1] == ["auditing cells", 2, 2]
    assert ["simulating lanes", 6, 6] in told.tasks


def test_measures_that_a_map_does_not_keep_are_compared_too(design):
    found = drillctl.sweep(design, audit_cells=1, measures=["sticks"])
    assert list(found.measures) == ["j1", "sticks"]
    assert {*found.audit.batch} == {*BATCH_MEASURES, "status"}


def test_a_step_of_a_fifth_of_a_second_is_told():
    rig = drillctl.load(
        "monteiro-trindade-140kn",
        **{"simulation.step": "0.2 s", "simulation.duration": "60 s", "map.audit_cells": 12},
    )
    assert drillctl.sweep(rig).audit.verdict == "check"


def test_no_audit_is_silent(design):
    told = Told()
    assert drillctl.sweep(design, audit_cells=0, progress=told).audit.verdict == "none"
    assert [task for task, *_ in told.tasks] == ["loading kernels", "simulating lanes"]
