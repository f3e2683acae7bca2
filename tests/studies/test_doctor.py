"""The doctor's estimate is the error that the reference solver finds; what it advises helps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import drillctl
from drillctl.design.reading import parse_axis
from drillctl.ensemble import audit
from drillctl.errors import InputError
from drillctl.simulation import scheme
from drillctl.simulation.scheme import PROMISES, Promise
from drillctl.studies.doctor import compute as examination
from drillctl.studies.doctor.compute import ErrorEstimate, errors_of
from tests.alike import same

PAPER = "monteiro-trindade-140kn"
GAINS = ("controller.kp=100:1000:9", "controller.ki=20:500:7")


def examined(name=PAPER, axes=GAINS, cells=0, **values):
    design = drillctl.load(name, **values)
    if axes:
        design = design.replace({"map.axes": [parse_axis(a) for a in axes]})
    return drillctl.doctor(design, cells)


@pytest.fixture(scope="module")
def found():
    """The paper's rig over a short horizon with a good many audited lanes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(examination, "AUDIT_SECONDS", 1e9)
        return examined(cells=8, **{"simulation.duration": "40 s", "map.levels": [10, 20, 40]})


def test_the_estimate_is_what_the_reference_solver_finds(found):
    own = found.estimate.of_lanes[np.searchsorted(found.cells, found.audit.cells)]
    assert len(own) == 8
    assert found.confirmed
    # In all but the odd lane to a third of itself, over errors from 1e-5 to 1e-3.
    ratio = own / found.audit.differences
    assert np.median(np.abs(np.log(ratio))) < 0.3
    assert found.estimate.order == pytest.approx(2.0, abs=0.4)


def test_the_summary_says_what_was_chosen_and_why(found):
    said = found.summary()
    assert said["verdict"] == found.verdict
    assert said["scheme"]["decided_by"] == "accuracy"
    assert said["scheme"]["step"] == 0.025
    assert said["scheme"]["modes"] + said["scheme"]["modes_left_out"] == 31
    assert said["scheme"]["strings"] == 1
    assert said["engine"] == "reference"
    assert said["estimate"]["lanes"] == 63
    assert said["estimate"]["failed"] == 0
    assert said["estimate"]["median"] <= said["estimate"]["p90"] <= said["estimate"]["worst"]
    assert [lane["reference_j1"] for lane in said["audit"]["lanes"]] == list(
        found.audit.reference["j1"]
    )
    assert said["audit"]["lanes"][0]["at"].keys() == {"controller.kp", "controller.ki"}


def test_the_speed_is_of_whole_lanes(found):
    speed = found.speed
    assert speed["seconds"] > 0.1  # enough of them; the rest of the machine's mood is not
    steps = found.scheme["steps"] * speed["lanes_per_second"]
    # Threads at work at least, at most all of those there are, by the processor's own time.
    assert 0.0 < steps * speed["lane_step_ns"] * 1e-9 < 1.2 * speed["threads"]


def test_it_comes_back_from_disk(found, tmp_path):
    again = drillctl.open(found.save(tmp_path / "kept"))
    assert again.summary() == found.summary()
    same(again, found)
    again.save(tmp_path / "kept")  # the very same run
    with pytest.raises(InputError, match="another design or other settings"):
        examined(cells=1, **{"simulation.duration": "40 s", "map.levels": [10, 20, 40]}).save(
            tmp_path / "kept"
        )


def test_lanes_are_those_of_the_map(found):
    """The same step, modes and bits as the map's own cells."""
    result = drillctl.sweep(found.design, audit_cells=0)
    np.testing.assert_array_equal(result.j1.ravel()[found.cells], found.estimate.j1[0])
    assert (result.step, result.modes) == (found.scheme["step"], found.scheme["modes"])


def test_the_sample_is_a_matter_of_its_seed(monkeypatch):
    monkeypatch.setattr(examination, "LANES", 10)
    values = {"simulation.duration": "5 s"}
    first, second = examined(**values), examined(**values)
    np.testing.assert_array_equal(first.cells, second.cells)
    assert len(set(first.cells)) == 10
    assert first.cells.max() < 63


@pytest.mark.slow
def test_too_few_modes_are_not_enough_and_the_advice_is():
    found = examined(**{"simulation.duration": "40 s", "simulation.modes": 4})
    assert found.verdict == "not_reached"
    assert found.scheme["modes_by"] == "given"
    assert found.advice.startswith("simulation.accuracy = '")
    name = found.advice.split("'")[1]
    better = examined(**{"simulation.duration": "40 s", "simulation.accuracy": name})
    promise = PROMISES["standard"]
    assert promise.kept(better.estimate.of_lanes)
    assert not promise.kept(found.estimate.of_lanes)


def test_no_step_is_advised_where_none_helps(monkeypatch):
    """The last short element of this string chatters without an inertia at the bit.

    At the longest steps that have a root, since those which follow such a bit do help.
    """
    for name, one in scheme.ACCURACIES.items():
        monkeypatch.setitem(scheme.ACCURACIES, name, replace(one, fall=scheme.STEEPEST))
    found = examined("aarsnes-shor-well-a", ("controller.kp=400:900:4",),
                     **{"simulation.duration": "20 s"})  # fmt: skip
    assert found.verdict == "not_reached"
    assert found.scheme["decided_by"] == "friction"
    assert "will not help" in found.advice or "verge" in found.advice


def test_a_law_that_the_engine_refuses_is_told(tmp_path):
    found = drillctl.doctor(
        drillctl.load(PAPER, **{
            "bit_rock.law": "printed-three-branch", "bit_rock.a1": 0.03, "bit_rock.a2": 0.07,
            "bit_rock.beta": 0.09,
        })
    )  # fmt: skip
    assert found.verdict == "refused"
    assert "printed-three-branch" in found.refused
    assert found.summary()["scheme"] is None
    assert drillctl.open(found.save(tmp_path / "kept")).summary() == found.summary()
    with pytest.raises(InputError, match="refused"):
        drillctl.plots.error_estimate(found)


def test_a_step_that_is_impossible_is_an_error():
    with pytest.raises(InputError, match=r"simulation\.step"):
        examined(**{"simulation.step": "900 ms"})


def test_a_design_without_gains_is_a_sample_of_one():
    found = examined(
        "navarro-lopez-2dof", None,
        **{"controller.law": "constant-torque", "controller.torque": "0 N*m",
           "simulation.duration": "20 s"},
    )  # fmt: skip
    assert found.axes == ()
    assert found.cells.tolist() == [0]
    assert found.estimate.order is None
    assert found.verdict == "ok"
    given = drillctl.load("navarro-lopez-2dof", **{
        "controller.law": "constant-torque", "controller.torque": "9 kN*m",
        "map.axes": [parse_axis("controller.kp=0:100:3")],
    })  # fmt: skip
    with pytest.raises(InputError, match=r"controller\.kp"):
        drillctl.doctor(given)


def test_strings_that_differ_are_each_stepped_by_their_own(found):
    axes = ("bha.inertia=300 kg*m^2:400 kg*m^2:3", "controller.kp=100:900:4")
    several = examined(axes=axes, **{"simulation.duration": "20 s"})
    assert several.summary()["scheme"]["strings"] == 3
    result = drillctl.sweep(several.design, audit_cells=0)
    np.testing.assert_array_equal(result.j1.ravel()[several.cells], several.estimate.j1[0])


# --- the estimate and the promise, as numbers --------------------------------------------------


def made_up(error, order=2, size=50):
    """J1 of lanes whose error falls with a power of the step."""
    exact = np.linspace(10.0, 50.0, size)
    return exact, ErrorEstimate(
        np.array([exact * (1 + error / 2 ** (order * k)) for k in range(3)])
    )


def test_an_error_that_falls_with_the_square_is_found_exactly():
    exact, estimate = made_up(np.linspace(1e-5, 1e-3, 50))
    np.testing.assert_allclose(estimate.best, exact, rtol=1e-14)
    np.testing.assert_allclose(estimate.of_lanes, np.linspace(1e-5, 1e-3, 50), rtol=1e-9)
    np.testing.assert_allclose(
        estimate.of_lanes_at_half, np.linspace(1e-5, 1e-3, 50) / 4, rtol=1e-9
    )
    np.testing.assert_allclose(estimate.of_other(exact * 1.01), 0.01, rtol=1e-9)
    assert estimate.order == pytest.approx(2.0)
    assert made_up(1e-3, order=1)[1].order == pytest.approx(1.0)
    assert made_up(1e-12)[1].order is None  # rounding


def test_lanes_that_failed_are_left_out():
    _, estimate = made_up(1e-4)
    estimate.j1[1, 3] = np.nan
    errors = errors_of(estimate.of_lanes)
    assert np.isfinite(estimate.of_lanes).sum() == 49
    assert errors.worst == pytest.approx(1e-4)
    assert np.isnan(errors_of(np.full(3, np.nan)).median)


@pytest.mark.parametrize(
    ("over_p99", "over_median", "kept"),
    [(0, 128, True), (6, 128, True), (8, 128, False), (0, 140, True), (0, 150, False)],
)
def test_a_promise_stands_until_a_sample_speaks_against_it(over_p99, over_median, kept):
    errors = np.full(256, 1e-6)
    errors[:over_median] = 1e-4
    errors[:over_p99] = 1e-2
    assert Promise(5e-5, 2e-3).kept(errors) is kept
    assert not Promise(5e-5, 2e-3).kept(np.full(5, np.nan))


def test_an_audit_that_differs_by_more_than_said_is_looked_at(found):
    import dataclasses

    checked = found.audit
    worse = dataclasses.replace(
        checked,
        reference={"j1": checked.reference["j1"] * (1 + 1e-2)},
        batch={"j1": checked.batch["j1"]},
    )
    doubted = dataclasses.replace(found, audit=worse)
    assert doubted.confirmed is False
    assert doubted.verdict in ("check", "not_reached")
    unaudited = dataclasses.replace(found, audit=audit.unaudited())
    assert unaudited.confirmed is None
    assert examination.CONFIRMED == 3.0


def test_the_audit_begins_no_run_after_its_time(monkeypatch):
    monkeypatch.setattr(examination, "AUDIT_SECONDS", 0.0)
    few = examined(cells=5, **{"simulation.duration": "5 s", "map.levels": [10, 20]})
    assert len(few.audit.cells) < few.requested_audit == 5
    assert np.isfinite(few.audit.reference["j1"]).all()
