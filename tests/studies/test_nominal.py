"""Cases without draws: maps and responses that are those of the other verbs, honest absences."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.progress import Within
from drillctl.simulation.run import SIGNALS
from drillctl.studies.compare.compute import NO_MAPS, case_designs, compare
from tests.alike import Told, same

HOLDS = {
    "comparison of cases": "J1 of the weight-on-bit law; a case against itself; "
    "`scipy.stats.bootstrap`; weight from traces; maps and responses those of "
    "`map` and `simulate`",
}

SHIPPED = "pi-vs-dynamic-wob-140kn"
PAPER = "monteiro-trindade-140kn"
KP, KI, WEIGHT = "controller.kp", "controller.ki", "operating_point.weight_on_bit"
AXES = [
    {"path": KP, "min": 100, "max": 900, "points": 5},
    {"path": KI, "min": 50, "max": 250, "points": 3},
]
FIXED_TORQUE = {"controller.law": "constant-torque", "controller.torque": "7 kN*m"}


def coarse(**changes):
    return drillctl.load(SHIPPED, **{"map.axes": AXES, **changes})


@pytest.fixture(scope="module")
def result():
    return compare(coarse(), realizations=2)


@pytest.fixture(scope="module")
def short():
    axes = {"map.axes": AXES, "simulation.duration": "20 s"}
    return drillctl.load(PAPER, **{KP: 200.0, KI: 100.0, **axes})


# --- maps --------------------------------------------------------------------------------------


def test_the_map_of_a_case_is_the_sweep_of_its_design(result):
    for case in result.cases:
        alone = drillctl.sweep(case.design, audit_cells=0)
        for name, values in alone.measures.items():
            assert case.nominal.map.measures[name].tobytes() == values.tobytes(), name
    # And they differ: each case is mapped with its own law.
    areas = [case.region(30.0).area_fraction for case in result.cases]
    assert areas == sorted(set(areas))


def test_a_cell_of_the_map_is_the_run_that_simulate_gives(result):
    case = result.cases[2]
    where = {KP: 500.0, KI: 150.0}
    run = drillctl.simulate(case.design.replace(where), engine="batch")
    assert case.nominal.map.j1[2, 1] == pytest.approx(run.measures.j1, rel=1e-9)


def test_regions_stand_beside_the_shares(result):
    for case in result.cases:
        told = result.summary()["cases"][case.name]["regions"]
        for level in result.levels:
            row = told[f"{level:g}"]
            inside = int((case.nominal.map.j1 <= level).sum())
            assert (row["cells"], row["area_fraction"]) == (inside, inside / 15)
            assert row["draws"] == case.share(level).hits


def test_levels_are_those_of_the_comparison(short):
    cases = [{"name": "a"}, {"name": "b", "set": {"map.levels": [3, 4]}}]
    made = compare(short.replace({"compare.cases": cases, "map.levels": [15]}), realizations=2)
    for case in made.summary()["cases"].values():
        assert list(case["regions"]) == ["15"]
    a, b = made.cases
    assert a.region(15.0).cells == b.region(15.0).cells > 0


def test_all_cases_are_mapped_over_the_axes_of_the_first(short):
    other = [{"path": KP, "min": 0, "max": 10, "points": 2}, AXES[1]]
    made = compare({"a": short, "b": short.replace({"map.axes": other})}, realizations=2)
    for case in made.cases:
        assert case.nominal.map.axes[0].values.tolist() == [100.0, 300.0, 500.0, 700.0, 900.0]


# --- no map ------------------------------------------------------------------------------------


def test_a_case_that_the_axes_do_not_fit_has_no_map_and_tells_why(short, tmp_path):
    made = compare({"pi": short, "torque": short.replace(FIXED_TORQUE)}, realizations=2)
    pi, torque = made.cases
    assert pi.nominal.map is not None
    assert pi.nominal.no_map is None
    assert torque.nominal.map is None
    assert torque.region(20.0) is None
    assert "map.axes controller.kp: no numeric parameter" in torque.nominal.no_map
    told = made.summary()["cases"]["torque"]
    assert (told["regions"]["20"]["cells"], told["regions"]["20"]["area_fraction"]) == (None, None)
    assert told["regions"]["20"]["draws"] == 0
    assert told["nominal"]["map"] is None
    assert told["nominal"]["no_map"] == torque.nominal.no_map
    json.dumps(made.summary(), allow_nan=False)
    same(made, drillctl.open(made.save(tmp_path / "run")))


def test_the_baseline_may_be_the_one_without(short, tmp_path):
    torque = short.replace(FIXED_TORQUE).replace({"map.axes": AXES})
    made = compare({"torque": torque, "pi": short}, realizations=2)
    assert made.cases[0].nominal.map is None
    assert made.cases[1].nominal.map is not None
    same(made, drillctl.open(made.save(tmp_path / "run")))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"compare.maps": False}, NO_MAPS),
        ({"map.axes": AXES[:1]}, "a map runs over 2 parameters, [map] has 1"),
        ({"map.axes": [AXES[0], {"path": WEIGHT, "min": "100 kN", "max": "900 kN", "points": 2}]},
         "map.axes"),
    ],
)  # fmt: skip
def test_reasons(short, changes, reason):
    (case,) = compare(short.replace(changes), realizations=2).cases
    assert case.nominal.map is None
    assert reason in case.nominal.no_map
    assert len(case.nominal.response.time) == 201


def test_without_maps_nothing_is_swept_and_all_comes_back(short, tmp_path, monkeypatch):
    def swept(*arguments, **options):
        raise AssertionError("swept")

    monkeypatch.setattr(sys.modules[case_designs.__module__], "sweep", swept)
    made = compare(short.replace({"compare.maps": False}), realizations=2)
    assert not [name for name in made.data.variables if name.startswith("nominal.map")]
    same(made, drillctl.open(made.save(tmp_path / "run")))


def test_maps_too_large_for_the_memory_are_an_error(short):
    huge = [{**axis, "points": 60_000} for axis in AXES]
    with pytest.raises(InputError, match=r"map\.axes: 3,600,000,000 cells need about"):
        compare(short.replace({"map.axes": huge}), realizations=2)


# --- responses ---------------------------------------------------------------------------------


def test_the_response_of_a_case_is_that_of_simulate(result):
    for case in result.cases:
        run = drillctl.simulate(case.design, engine="batch", interval=0.1)
        found = case.nominal.response
        assert found.measures == run.measures
        assert len(found.time) == 1001
        assert found.time[1] == pytest.approx(0.1)
        assert found.signals.keys() == run.signals.keys() <= SIGNALS.keys()
        for name in run.signals:
            assert found.signals[name].tobytes() == run.signals[name].tobytes()


def test_a_step_of_its_own_has_times_of_its_own(short, tmp_path):
    cases = [{"name": "a"}, {"name": "b", "set": {"simulation.step": "15 ms"}}]
    made = compare(short.replace({"compare.cases": cases, "compare.maps": False}), realizations=2)
    a, b = (case.nominal.response for case in made.cases)
    assert a.time[1] == pytest.approx(0.1)
    assert b.time[1] == pytest.approx(0.105, rel=0.01)
    assert len(a.time) != len(b.time)
    same(made, drillctl.open(made.save(tmp_path / "run")))


# --- equal mean weight -------------------------------------------------------------------------


def test_maps_and_responses_are_at_the_shifted_weight():
    made = compare(coarse(), realizations=5, equal_mean_weight=True)
    case = made.cases[1]
    assert case.weight_shift > 500.0
    moved = case.design.replace({WEIGHT: drillctl.units.SI(140e3 + case.weight_shift)})
    alone = drillctl.sweep(moved, audit_cells=0)
    assert case.nominal.map.j1.tobytes() == alone.j1.tobytes()
    run = drillctl.simulate(moved, engine="batch")
    assert case.nominal.response.measures.j1 == run.measures.j1
    assert case.nominal.map.j1.tobytes() != drillctl.sweep(case.design, audit_cells=0).j1.tobytes()


def test_a_shift_may_leave_the_friction_table(tmp_path):
    design = coarse(**{"simulation.duration": "10 s", "map.levels": [5]})
    cases = case_designs(design)
    made = compare({"moving": cases["2 kN s/rad"]}, realizations=3, equal_mean_weight=True)
    (case,) = made.cases
    assert 140e3 + case.weight_shift > 160e3  # the end of the table
    # The response is the run of the draws, with the factors at 1.
    exact = {f"uncertain.bit_rock.{name}_factor.cov": 1e-9 for name in ("a1", "a2")}
    again = compare({"it": case.design.replace(exact)}, realizations=2, equal_mean_weight=True)
    (one,) = again.cases
    assert one.nominal.response.measures.j1 == pytest.approx(one.measures["j1"][0], rel=1e-6)
    same(made, drillctl.open(made.save(tmp_path / "run")))


# --- saved -------------------------------------------------------------------------------------


@pytest.mark.parametrize("equal", [False, True])
def test_there_and_back(tmp_path, equal):
    made = compare(coarse(), realizations=3, equal_mean_weight=equal)
    same(made, drillctl.open(made.save(tmp_path / "run")))


def test_an_axis_that_is_drawn_too_is_told_apart(short, tmp_path):
    path = "bit_rock.a1_factor"
    axes = [AXES[0], {"path": path, "min": 0.9, "max": 1.1, "points": 3}]
    made = compare(short.replace({"map.axes": axes}), realizations=4)
    assert made.data[f"drawn.{path}"].dims == ("case", "realization")
    assert made.data[path].values.tolist() == pytest.approx([0.9, 1.0, 1.1])
    same(made, drillctl.open(made.save(tmp_path / "run")))


def test_data_is_labelled(result):
    data = result.data
    assert data[KP].values.tolist() == [100.0, 300.0, 500.0, 700.0, 900.0]
    assert (data["nominal.map.j1"].dims, data["nominal.map.j1"].units) == (("case", KP, KI), "s")
    cell = data["nominal.map.j1"].sel({"case": "4 kN s/rad", KP: 500.0, KI: 150.0})
    assert cell == result.cases[2].nominal.map.j1[2, 1]
    weight = data["nominal.response.weight_on_bit"]
    assert (weight.dims, weight.units) == (("case", "time"), "N")
    np.testing.assert_array_equal(
        weight.sel(case="4 kN s/rad"), result.cases[2].nominal.response.signals["weight_on_bit"]
    )


# --- progress ----------------------------------------------------------------------------------


def test_progress_is_told_of_runs_and_cells(short):
    told = Told()
    compare({"pi": short, "torque": short.replace(FIXED_TORQUE), "other": short},
            realizations=3, progress=told)  # fmt: skip
    assert told.tasks[0] == ["simulating cases", 54, 54]
    assert {task for task, _, _ in told.tasks[1:]} == {"auditing draws"}


def test_no_maps_are_no_task(short):
    told = Told()
    compare(short.replace({"compare.maps": False}), realizations=3, progress=told)
    assert [task for task, _, _ in told.tasks] == ["simulating cases", "auditing draws"]


def test_a_part_that_tells_again_is_counted_once():
    told = Told()
    told.begin("all", 10)
    part = Within(told)
    part.begin("loading", 1)
    part.begin("running", 5)
    part.advance(0)
    part.advance(2)
    part.begin("loading", 1)
    part.begin("running", 5)  # another kernel: what is done is told again
    part.advance(2)
    part.advance(3)
    assert told.tasks == [["all", 10, 5]]
