"""J1 in CasADi against the batch engine, and its derivatives against differences."""

import numpy as np
import pytest

import drillctl
from drillctl.ensemble.draws import drawn_lanes
from drillctl.ensemble.parameters import draw
from drillctl.errors import InputError
from drillctl.simulation.batch import prepare, run_batch, trace
from drillctl.studies.robust.trajectory import MEASURED, Trajectories
from drillctl.studies.robust.tuned import put, tuned_parameters

HOLDS = (
    (
        "J1 and its derivatives in CasADi",
        "runs of the batch engine, to 1e-9; central differences",
    ),
)

PAPER = "monteiro-trindade-140kn"
FAST = {"simulation.accuracy": "fast"}
DAMPED = {"drillstring.sections.pipe.stiffness_damping": "1 ms"}
DRAGGED = {"drillstring.sections.pipe.mass_damping": "0.05 1/s"}
LAGS = {
    "controller.drive.lag": "20 ms", "controller.drive.encoder_lag": "5 ms",
    "controller.drive.torque_lag": "5 ms",
}  # fmt: skip
LIMITS = {"controller.drive.torque_limit": "13 kN*m", "controller.drive.power_limit": "110 kW"}
MOVING = {"weight_on_bit.law": "navarro-lopez-suarez", "weight_on_bit.gain": "2 kN*s/rad"}


def tuning(**bounds):
    named = {path.replace("__", "."): {"min": a, "max": b} for path, (a, b) in bounds.items()}
    return {"tune": {"parameters": named}}


KP_KW = tuning(controller__kp=(0, 900), weight_on_bit__gain=("0 kN*s/rad", "8 kN*s/rad"))


def made(count=6, **values):
    design = drillctl.load(PAPER, **{**FAST, **values})
    (group,) = drawn_lanes(design, draw(design, count, 7)).groups
    prepared = prepare(group.lanes, design.tables.simulation)
    return design, Trajectories(group.design, group.lanes, prepared, tuned_parameters(design))


def by_engine(design, trajectories, values):
    """Measures of the batch engine with the values put into the design itself."""
    variant = put(design, trajectories.tuned, np.array(values))
    (group,) = drawn_lanes(variant, draw(variant, len(trajectories.lanes), 7)).groups
    return run_batch(group.lanes, trajectories.prepared).measures


CASES = [
    ({}, [(630.0, 145.0), (200.0, 400.0)]),
    ({"simulation.step": "20 ms", "simulation.modes": 20}, [(630.0, 145.0)]),
    (DAMPED, [(300.0, 100.0)]),
    (DRAGGED | {"start.kind": "wound_up"}, [(630.0, 145.0)]),
    ({"start.kind": "rest", "simulation.j1_from": "20.03 s"}, [(630.0, 145.0)]),
    (MOVING | KP_KW, [(600.0, 2000.0), (300.0, 5000.0)]),
    (LAGS | LIMITS, [(630.0, 145.0)]),
    ({"controller.law": "soft-torque"}, [(0.4,)]),
    ({"controller.law": "z-torque"} | DAMPED, [(0.5,)]),
    ({"controller.law": "active-damping"} | DAMPED | LAGS, [(300.0, 600.0)]),
]


@pytest.mark.parametrize(("values", "points"), CASES)
def test_j1_is_that_of_the_batch_engine(values, points, figure):
    design, trajectories = made(**values)
    for point in points:
        expected = by_engine(design, trajectories, point)
        found = trajectories.measures(np.array(point))
        for name in MEASURED[:3]:
            np.testing.assert_allclose(found[name], expected[name], rtol=1e-9)
        apart = abs(found["j1"] / expected["j1"] - 1.0).max()
        figure("J1 of the scheme in CasADi against the batch engine, relative", apart)
        again = trajectories.sensitivities(np.array(point))
        np.testing.assert_allclose(again.values["j1"], found["j1"], rtol=1e-13)
    assert np.ptp(found["j1"]) > 0.0


@pytest.mark.parametrize(
    ("values", "point"),
    [({}, (630.0, 145.0)), (MOVING | KP_KW, (600.0, 2000.0)), (LAGS | LIMITS, (630.0, 145.0)),
     (DRAGGED | {"start.kind": "wound_up"}, (630.0, 145.0))],
)  # fmt: skip
def test_derivatives_equal_differences(values, point):
    _, trajectories = made(3, **values)
    found = trajectories.sensitivities(np.array(point))
    for k, value in enumerate(point):
        step = np.zeros(len(point))
        step[k] = 1e-5 * value
        above, below = (trajectories.measures(np.array(point) + s) for s in (step, -step))
        for name in ("j1", "mean_weight_on_bit", "effort"):
            difference = (above[name] - below[name]) / (2 * step[k])
            size = np.abs(found.slopes[name]).max() + 1e-12
            np.testing.assert_allclose(found.slopes[name][:, k], difference, atol=3e-3 * size)
            if size > 1e-9:
                assert np.corrcoef(found.slopes[name][:, k], difference)[0, 1] > 0.99


def test_a_jump_of_j1_has_no_derivative():
    """Where an event appears J1 jumps: derivatives on both sides do not tell of it."""
    _, trajectories = made(1)
    kp = np.linspace(300.0, 340.0, 81)
    both = [trajectories.sensitivities(np.array([k, 145.0])) for k in kp]
    j1 = np.array([b.values["j1"][0] for b in both])
    slope = np.array([b.slopes["j1"][0, 0] for b in both])
    assert np.isfinite(slope).all()
    told = 0.5 * (slope[1:] + slope[:-1]) * np.diff(kp)
    jump = np.abs(np.diff(j1) - told)
    assert np.median(jump) < 5e-3  # mostly the derivatives tell all
    assert jump.max() > 10 * np.median(jump)


def test_effort_is_that_of_the_traced_torque():
    design, trajectories = made(4)
    found = trajectories.measures(np.array([630.0, 145.0]))["effort"]
    variant = put(design, trajectories.tuned, np.array([630.0, 145.0]))
    (group,) = drawn_lanes(variant, draw(variant, 4, 7)).groups
    _, signals = trace(group.lanes, trajectories.prepared, 0.05)
    friction, weight, omega = group.lanes.friction, group.lanes.weight, group.lanes.set_speed
    steady = friction.torque_and_slope(weight.level, omega, np.exp)[0]
    away = np.sqrt(np.mean((signals["top_torque"] - steady) ** 2, axis=0))
    np.testing.assert_allclose(found, away, rtol=5e-3)  # means of steps, and their ends


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"bit_rock.law": "tucker-wang", "bit_rock.a": 0.03}, "not set-valued"),
        ({"controller.drive.sampling_period": "10 ms"}, "the drive is sampled"),
        (MOVING | {"weight_on_bit.path.delay": "1 s"}, "the weight on bit has a memory"),
        (tuning(bit_rock__a1_factor=(0.5, 1.5)), "bit_rock.a1_factor has no derivative"),
    ],
)
def test_what_has_no_derivatives_says_so(values, reason):
    with pytest.raises(InputError, match=reason):
        made(2, **values)
