"""What changes by the clock: set speed, weight on bit, rock; the same in both engines."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.rig.program import NONE, Ramp

HOLDS = (
    (
        "programs",
        "both engines; jumps cost no order",
    ),
)

DESIGN = "monteiro-trindade-140kn"
FIXED = {"bit_rock": {"law": "navarro-lopez-suarez", "a1": 0.026, "a2": 0.085, "beta": 0.098}}


def rig(**values):
    return drillctl.load(DESIGN, **FIXED, **({"simulation.duration": "60 s"} | values))


SPEED = {"scenario.speed": {"start": "0 rpm", "begin": "2 s", "end": "22 s"}, "start.kind": "rest"}
WEIGHT = {"scenario.weight_on_bit": {"start": "20 kN", "begin": "25 s", "end": "40 s"}}
STEP = {"scenario.weight_on_bit": {"start": "120 kN", "begin": "30 s", "end": "30 s"}}
JUMP = {"scenario.speed": {"start": "80 rpm", "begin": "30 s", "end": "30 s"}}
ROCK = {"scenario.bit_rock": {"until": "30 s", "static_factor": 0.9, "sliding_factor": 0.95}}


@pytest.mark.parametrize("name", ["start-up", "weight step", "speed step", "rock"])
def test_engines_agree(name):
    values = {"start-up": SPEED | WEIGHT, "weight step": STEP, "speed step": JUMP, "rock": ROCK}
    design = rig(**values[name], **{"simulation.step": "5 ms"})
    batch, reference = (
        drillctl.simulate(design, engine=e).measures for e in ("batch", "reference")
    )
    assert batch.j1 == pytest.approx(reference.j1, rel=5e-5)
    assert batch.peak_bit_speed == pytest.approx(reference.peak_bit_speed, rel=1e-4)
    assert batch.mean_weight_on_bit == pytest.approx(reference.mean_weight_on_bit, rel=1e-4)


@pytest.mark.parametrize("values", [STEP, JUMP, ROCK])
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
