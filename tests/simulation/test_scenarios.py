"""What changes by the clock: set speed, weight on bit, rock; the same in both engines."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.integrate

import drillctl
from drillctl import units
from drillctl.errors import InputError
from drillctl.rig.program import NONE, Ramp

HOLDS = {
    "programs": "both engines; jumps cost no order",
}

DESIGN = "monteiro-trindade-140kn"
FIXED = {"bit_rock": {"law": "navarro-lopez-suarez", "a1": 0.026, "a2": 0.085, "beta": 0.098}}


def rig(**values):
    return drillctl.load(DESIGN, **FIXED, **({"simulation.duration": "60 s"} | values))


SPEED = {"scenario.speed": {"start": "0 rpm", "begin": "2 s", "end": "22 s"}, "start.kind": "rest"}
WEIGHT = {"scenario.weight_on_bit": {"start": "20 kN", "begin": "25 s", "end": "40 s"}}
STEP = {"scenario.weight_on_bit": {"start": "120 kN", "begin": "30 s", "end": "30 s"}}
JUMP = {"scenario.speed": {"start": "80 rpm", "begin": "30 s", "end": "30 s"}}
STOP = [
    ["0 s", "100 rpm"],
    ["10 s", "100 rpm"],
    ["15 s", "0 rpm"],
    ["30 s", "0 rpm"],
    ["40 s", "set"],
]
CONNECTION = {"scenario.speed": {"points": STOP, "lag": "1 s"}}
WEIGHTS = {"scenario.weight_on_bit": [["0 s", "20 kN"], ["20 s", "80 kN"], ["30 s", "set"]]}
LATE = {"scenario.speed": {"start": "0 rpm", "lag": "1 s"}, "start.kind": "rest"}
ROCK = {"scenario.bit_rock": {"until": "30 s", "static_factor": 0.9, "sliding_factor": 0.95}}


RUNS = {
    "start-up": SPEED | WEIGHT, "weight step": STEP, "speed step": JUMP, "rock": ROCK,
    "connection": CONNECTION | WEIGHTS, "set speed behind a lag": LATE,
}  # fmt: skip


@pytest.mark.parametrize("values", RUNS.values(), ids=RUNS)
def test_engines_agree(values):
    design = rig(**values, **{"simulation.step": "5 ms"})
    batch, reference = (
        drillctl.simulate(design, engine=e).measures for e in ("batch", "reference")
    )
    assert batch.j1 == pytest.approx(reference.j1, rel=5e-5)
    assert batch.peak_bit_speed == pytest.approx(reference.peak_bit_speed, rel=1e-4)
    assert batch.mean_weight_on_bit == pytest.approx(reference.mean_weight_on_bit, rel=1e-4)


@pytest.mark.parametrize("values", [STEP, JUMP, ROCK, LATE])
def test_jumps_cost_no_order(values):
    expected = drillctl.simulate(rig(**values)).measures.j1
    apart = [
        drillctl.simulate(
            rig(**values, **{"simulation.step": step, "simulation.modes": 31}), engine="batch"
        ).measures.j1
        - expected
        for step in ("40 ms", "20 ms", "10 ms")
    ]
    orders = np.log2(np.abs(np.array(apart[:-1]) / apart[1:]))
    assert orders.mean() == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("engine", ["batch", "reference"])
def test_signals_follow_the_program(engine):
    run = drillctl.simulate(rig(**(SPEED | WEIGHT)), engine=engine, interval=0.5)
    at = {float(t): i for i, t in enumerate(np.round(run.time, 6))}
    weight = run.signals["weight_on_bit"]
    assert weight[at[10.0]] == pytest.approx(20e3)
    assert weight[at[32.5]] == pytest.approx(80e3, rel=1e-3)
    assert weight[at[50.0]] == pytest.approx(140e3)
    assert run.signals["top_speed"][at[1.0]] == pytest.approx(0.0, abs=1e-6)
    assert run.signals["top_speed"][-1] == pytest.approx(run.design.speed, rel=0.1)


def test_a_program_that_changes_nothing_is_none():
    same = {"start": "100 rpm", "begin": "5 s", "end": "9 s"}
    still = rig(**{"scenario.speed": same})
    assert rig().program == NONE
    alone = drillctl.simulate(rig(), engine="batch").measures
    assert drillctl.simulate(still, engine="batch").measures == alone


def test_maps_run_over_programs():
    axes = [{"path": "scenario.speed.end", "min": "2 s", "max": "22 s", "points": 2}]
    found = drillctl.sweep(rig(**SPEED, map={"axes": axes, "audit_cells": 0}))
    alone = drillctl.simulate(rig(**SPEED), engine="batch").measures.j1
    assert found.measures["j1"][1] == pytest.approx(alone, rel=1e-12)
    assert found.measures["j1"][0] != found.measures["j1"][1]


def test_a_ramp_and_its_integral():
    ramp = Ramp(-6.0, 2.0, 5.0)
    assert [ramp.at(t) for t in (0.0, 2.0, 3.5, 5.0, 9.0)] == [-6.0, -6.0, -3.0, 0.0, 0.0]
    times = np.linspace(0.0, 7.0, 7001)
    values = np.array([ramp.at(t) for t in times])
    assert ramp.integral(7.0) == pytest.approx(np.trapezoid(values, times), abs=1e-6)
    assert ramp.integral(3.5) == pytest.approx(-12.0 - 1.5 * 4.5)
    jump = Ramp(1.0, 2.0, 2.0)
    assert (jump.at(1.999), jump.at(2.0), jump.integral(5.0)) == (1.0, 0.0, 2.0)


@pytest.mark.parametrize("lag", [0.0, 0.7])
def test_a_path_goes_through_its_points_behind_its_lag(lag):
    """Against the lag's differential equation, integrated with steps that meet every corner."""
    points = [["1 s", "40 rpm"], ["3 s", "90 rpm"], ["3 s", "20 rpm"], ["5 s", "20 rpm"]]
    program = {"points": [*points, ["8 s", "set"]], "lag": f"{lag} s"}
    path = rig(**{"scenario.speed": program}).program.speed
    times = np.linspace(0.0, 12.0, 12001)
    corners = [0.0, 1.0, 3.0, 3.0 + 1e-12, 5.0, 8.0, 12.0]
    inputs = np.interp(times, corners, np.array([40, 40, 90, 20, 20, 100, 100]) - 100.0)
    expected = inputs * units.RPM
    if lag:
        decay = np.exp(-1e-3 / lag)
        for k in range(1, len(times)):
            # Exact for an input that is straight over the step; the jump at 3 s is before it.
            begin = inputs[k - 1] if times[k - 1] != 3.0 else -80.0
            rise = (inputs[k] if times[k] != 3.0 else -10.0) - begin
            straight = begin + rise - rise * lag / 1e-3 * (1.0 - decay)
            expected[k] = expected[k - 1] * decay + units.RPM * (straight - begin * decay)
    values = np.array([path.at(t) for t in times])
    apart = np.abs(values - expected)
    assert np.delete(apart, 3000).max() < 1e-9
    sums = [path.integral(t) for t in times[::500]]
    whole = scipy.integrate.cumulative_trapezoid(values, times, initial=0.0)[::500]
    # The trapezoidal rule sees the jump a step late without a lag.
    assert np.abs(np.array(sums) - whole).max() < (1e-5 if lag else 6e-3)


def test_a_program_of_two_points_is_the_table():
    points = [["2 s", "0 rpm"], ["22 s", "100 rpm"]]
    assert rig(**{"scenario.speed": points}).program == rig(**SPEED).program
    assert rig(**{"scenario.speed": {"points": points}}).program == rig(**SPEED).program


def test_a_changed_rock_is_another_law():
    design = rig(**ROCK)
    before, after = design.bit_rock_before, design.bit_rock
    assert before.a2 == pytest.approx(0.9 * after.a2)
    assert before.a1 == pytest.approx(0.95 * after.a1)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"scenario.speed": {"begin": "1 s", "end": "2 s"}}, "scenario.speed.start: is missing"),
        (
            {"scenario.speed": {"start": "0 rpm", "begin": "3 s", "end": "2 s"}},
            "scenario.speed: end 2 s must not come before begin 3 s",
        ),
        (
            {"scenario.weight_on_bit": {"start": "0 kN", "begin": "1 s", "end": "90 s"}},
            "scenario.weight_on_bit.end: 90 s: the run ends at 60 s",
        ),
        ({"scenario.bit_rock": {"until": "60 s"}}, "scenario.bit_rock.until: 60 s"),
        (
            {"scenario.bit_rock": {"until": "9 s", "static_factor": 0.2}},
            "scenario.bit_rock.static_factor: static torque would be less",
        ),
        ({"scenario.bit_rock": {"static_factor": 0.9}}, "scenario.bit_rock.until: is missing"),
        (
            {"scenario.speed": [["0 s", "0 rpm"], ["20 s", "80 rpm"]]},
            "scenario.speed.points: the last value must be that of operating_point.speed; write",
        ),
        (
            {"scenario.speed": [["9 s", "0 rpm"], ["2 s", "set"]]},
            "scenario.speed: points: 2 s must not come after 9 s",
        ),
        (
            {"scenario.speed": [["0 s", "0 rpm"], ["90 s", "set"]]},
            "scenario.speed.points: 90 s: the run ends at 60 s",
        ),
        (
            {"scenario.speed": [[f"{k} s", f"{k % 2} rpm"] for k in range(10)] + [["11 s", "set"]]},
            "scenario.speed.points: 10 changes; allowed are 8",
        ),
        (
            {"scenario.speed": {"points": [["0 s", "0 rpm"], ["2 s", "set"]], "end": "3 s"}},
            "points is not allowed with start, begin and end",
        ),
        ({"scenario.sped": {}}, "scenario.sped: unknown key; did you mean 'speed'"),
        (
            {
                "bit_rock": {"law": "coulomb", "a": 0.05},
                "scenario.bit_rock": {"until": "9 s", "decay_factor": 2.0},
            },
            "scenario.bit_rock.decay_factor: JansenVanDenSteen has no decay number",
        ),
    ],
)
def test_bad_programs_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        drillctl.load(DESIGN, **(FIXED | {"simulation.duration": "60 s"} | values))


def test_a_string_at_rest_off_bottom_waits_for_its_drive():
    """Neither weight nor torque: nothing holds the bit, and nothing moves it, for five seconds."""
    design = drillctl.load("start-up-140kn")
    exact = drillctl.simulate(design)
    assert exact.measures.sticks <= 1
    assert exact.measures.peak_bit_speed > 9.0
    assert exact.energy.relative_residual < 1e-8
    batch = drillctl.simulate(design, engine="batch")
    assert batch.measures.j1 == pytest.approx(exact.measures.j1, rel=1e-3)
