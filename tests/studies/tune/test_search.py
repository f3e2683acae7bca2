"""The search: its runs are those of the design, its gains beat grids, its failures are told."""

import math

import numpy as np
import pytest

import drillctl
from drillctl.ensemble.draws import drawn_lanes, run_draws
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.studies.tune.problem import GainProblem, GainRuns
from drillctl.studies.tune.search import optimum, polished, search, search_problem
from drillctl.studies.tune.tuned import put, tuned_parameters

HOLDS = {
    "search of gains": "runs of `compare`, to the last bit; an exhaustive grid, within 1 % from a "
    "tenth of its trajectories (slow)",
}

PAPER = "monteiro-trindade-140kn"
WINDOW = {"controller.kp": {"min": 400, "max": 800}, "controller.ki": {"min": 0, "max": 200}}
MOVING = {"weight_on_bit.law": "navarro-lopez-suarez", "weight_on_bit.gain": "2 kN*s/rad"}
LAGS = {"controller.drive.lag": "20 ms", "controller.drive.torque_limit": "14 kN*m"}


def tuning(parameters=WINDOW, values=(), **table):
    table = {"parameters": parameters, "realizations": 60, **table}
    return drillctl.load(PAPER, **{"simulation.accuracy": "fast", **dict(values), "tune": table})


def bounds(**paths):
    return {path.replace("__", "."): {"min": a, "max": b} for path, (a, b) in paths.items()}


@pytest.mark.parametrize(
    ("parameters", "values"),
    [
        (WINDOW, {}),
        (WINDOW, LAGS),
        (bounds(controller__kp=(0, 900), weight_on_bit__gain=("0 kN*s/rad", "8 kN*s/rad")), MOVING),
        (bounds(controller__absorption=(0.1, 1)), {"controller.law": "z-torque"} | LAGS),
        (bounds(operating_point__weight_on_bit=("100 kN", "150 kN")), {}),
        (bounds(bha__inertia=("300 kg*m^2", "500 kg*m^2")), {}),
        (bounds(controller__ki=(0, 200)), LAGS | {"controller.drive.tracking_time": "1 s"}),
    ],
)
def test_runs_are_those_of_the_design_with_the_gains(parameters, values):
    design = tuning(parameters, values)
    tuned = tuned_parameters(design)
    runs = GainRuns(design, tuned, 8, 5)
    points = np.array([[a * t.low + (1.0 - a) * t.high for t in tuned] for a in (0.3, 0.0, 1.0)])
    found = runs.measures(points, ("j1", "peak_top_torque"))
    assert runs.trajectories == 24
    for row, point in enumerate(points):
        variant = put(design, tuned, point)
        expected = run_draws(drawn_lanes(variant, draw(variant, 8, 5)), 8).measures
        for name, values_ in found.items():
            np.testing.assert_array_equal(values_[row], expected[name])
    some = runs.measures(points, ("j1",), 2, 6)
    np.testing.assert_array_equal(some["j1"], found["j1"][:, 2:6])


def test_impossible_draws_are_left_out():
    design = tuning(uncertain_draws := WINDOW, {
        "uncertain": {"bit_rock.a2_factor": {"distribution": "uniform", "min": 0.2, "max": 1.2}}
    })  # fmt: skip
    assert uncertain_draws
    runs = GainRuns(design, tuned_parameters(design), 40, 1)
    assert 0 < len(runs) < 40
    assert sum(failure.count for failure in runs.failures) == 40 - len(runs)
    j1 = runs.measures(np.array([[600.0, 140.0]]), ("j1",))["j1"]
    assert j1.shape == (1, len(runs))
    assert np.isfinite(j1).all()


def test_gains_found_beat_a_grid():
    design = tuning()
    found = search(design)
    assert found.feasible
    assert abs(found.values[0] - 630) < 15
    assert abs(found.values[1] - 147) < 8
    problem = GainProblem(design, tuned_parameters(design))
    axes = np.meshgrid(np.linspace(400, 800, 41), np.linspace(0, 200, 41), indexing="ij")
    grid = np.stack([a.ravel() for a in axes], axis=1)
    best = min(problem.points(grid, 60), key=lambda point: point.value)
    assert found.value <= best.value
    assert found.trajectories < problem.trajectories / 2
    again = problem.points(found.values[None, :], 60)[0]
    assert again.value == found.value
    assert found.share == again.share == (again.measures["j1"] <= 33.0).mean()
    merits = [s["merit"] for s in found.stages if s["realizations"] == 60]
    assert merits == sorted(merits, reverse=True)
    assert found.design.top_drive.kp == found.values[0]


def test_a_valley_along_neither_axis_is_followed_to_its_end():
    """A polish alone stops in another one, at half as much again and more."""
    values = {
        "controller.law": "active-damping", "controller.drive.lag": "20 ms",
        "drillstring.sections.pipe.stiffness_damping": "1 ms",
    }  # fmt: skip
    design = drillctl.load(PAPER, **values, tune={"realizations": 60})
    problem = search_problem(design, tuned_parameters(design))
    best = optimum(problem)
    assert best.realizations == 60
    (other,) = problem.points(np.array([[80.0, 570.0]]), 60)
    assert polished(problem, other).merit > 1.5 * best.merit
    assert polished(problem, best).merit == best.merit


def test_known_gains_are_polished_where_they_come_near():
    design = tuning(realizations=24)
    tuned = tuned_parameters(design)
    near, behind, alone = (GainProblem(design, tuned) for _ in range(3))
    own = near.own(design)
    assert tuple(own) == (625.0, 125.0)
    stages = []
    known = [np.array([900.0, -5.0]), own]
    best = optimum(near, known, math.inf, 2, lambda *one: stages.append(one))
    assert [name for name, _ in stages] == ["first look", "race", "population", "polish"]
    assert [points[0].realizations for _, points in stages] == [16, 24, 24, 24]
    assert best.merit <= polished(near, near.points(own[None, :], 24)[0]).merit
    assert best.merit <= optimum(alone).merit == optimum(behind, [own], 1.0).merit
    assert behind.trajectories == alone.trajectories + 24
    assert near.trajectories > behind.trajectories + 24 * 10


@pytest.mark.parametrize("objective", ["mean", "cvar", "worst"])
def test_every_objective_is_lowered(objective):
    design = tuning(objective=objective, realizations=40, starts=1)
    found = search(design)
    problem = GainProblem(design, tuned_parameters(design))
    (paper,) = problem.points(np.array([[625.0, 125.0]]), 40)
    assert found.value < paper.value - 0.3


def test_weight_gain_and_drive_are_tuned_together():
    parameters = bounds(
        controller__kp=(400, 800), controller__ki=(20, 200),
        weight_on_bit__gain=("0.1 kN*s/rad", "4 kN*s/rad"),
    )  # fmt: skip
    design = tuning(parameters, MOVING, realizations=24, starts=1, weights={"lost_weight": 40.0})
    found = search(design)
    problem = GainProblem(design, tuned_parameters(design))
    (held,) = problem.points(np.array([[630.0, 147.0, 2000.0]]), 24)
    assert found.value < held.value


def test_a_search_gives_the_same_gains_again():
    design = tuning(WINDOW, {"controller.drive.sampling_period": "25 ms"}, realizations=24)
    found, again = (search(design) for _ in range(2))
    assert abs(found.values[0] - 630) < 20
    assert (again.values == found.values).all()
    assert [one["stage"] for one in found.stages][-1] == "polish"
    assert found.stages[-1]["trajectories"] == found.trajectories


def test_a_level_that_no_gains_reach_is_told():
    found = search(tuning(level=12.0, realizations=24, starts=1))
    assert "no gains between these bounds have J1 <= 12 s with probability 0.95" in found.message
    assert "controller.kp = " in found.message
    assert found.share < 0.95


def test_requirements_of_runs_and_loop_are_kept_or_told(capfd):
    tight = {"peak_top_torque": "14.35 kN*m", "slope_reserve": "20 N*m*s/rad"}
    free = search(tuning(realizations=24, starts=1))
    kept = search(tuning(realizations=24, starts=1, constraints=tight))
    assert kept.feasible, kept.message
    assert kept.value > free.value
    assert drillctl.loop(kept.design).slope_margin >= 290.07 + 20.0 - 0.01
    never = search(tuning(realizations=24, starts=1, constraints={"mean_weight_on_bit": "150 kN"}))
    assert not never.feasible
    assert never.violations["mean_weight_on_bit"] == pytest.approx(1 - 140 / 150)
    assert "cannot all be met" in never.message
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ({"parameters": bounds(controller__kp=(800, 400))}, "min 800.0 must be less than max"),
        ({"parameters": bounds(controller__kq=(0, 1))}, "did you mean 'controller.kp'"),
        ({"parameters": bounds(start__speed=(1, 2))}, "start.speed"),
        ({"parameters": bounds(simulation__step=("1 ms", "2 ms"))}, "not a number of the rig"),
    ],
)
def test_bounds_that_cannot_be_used_are_refused(table, told):
    with pytest.raises(InputError, match=told):
        search(drillctl.load(PAPER, tune=table))


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ({"objective": "median"}, "objective"),
        ({"quantile": 1.0}, "more than 0 and less than 1"),
        ({"constraints": {"peak_sensitivity": 1.0}}, "more than 1"),
        ({"constraints": {"peak_top_torque": 9000}}, "N"),
        ({"constraints": {"peak_top_torque": "0 kN*m"}}, "greater than 0"),
        ({"constraints": {"mean_weight_on_bit": "0 kN"}}, "greater than 0"),
        ({"realizations": 1}, "at least 2"),
        ({"weights": {"effort": -1}}, "0 or more"),
        ({"parameters": {"controller.kp": {"min": 1}}}, "max"),
    ],
)
def test_tables_that_make_no_sense_are_refused(table, told):
    with pytest.raises(InputError, match=told):
        drillctl.load(PAPER, tune=table)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_papers_case_within_one_percent_of_the_exhaustive_optimum(seed):
    """41 x 41 gains at 1,000 realizations; the search has draws of its own."""
    design = drillctl.load(PAPER, tune={"parameters": WINDOW, "seed": seed})
    found = search(design)
    fast = design.replace({"simulation.accuracy": "fast", "tune": {"seed": 77}})
    problem = GainProblem(fast, tuned_parameters(fast))
    axes = np.meshgrid(np.linspace(400, 800, 41), np.linspace(0, 200, 41), indexing="ij")
    grid = np.stack([a.ravel() for a in axes], axis=1)
    best = min(
        point.value
        for k in range(0, len(grid), 41)
        for point in problem.points(grid[k : k + 41], 1000)
    )
    assert problem.points(found.values[None, :], 1000)[0].value <= 1.01 * best
    assert found.trajectories <= 41 * 41 * 1000 / 10
    assert found.processor_seconds <= 60.0
