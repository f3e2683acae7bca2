"""Measures that both engines must define alike, in the cases where they once did not."""

import numpy as np
import pytest
from test_reference import paper

import drillctl
from drillctl.errors import InputError


def both(design):
    fine = {"simulation.step": "1 ms", "simulation.modes": 31}
    return (
        drillctl.simulate(design).measures,
        drillctl.simulate(design, "batch", interval=1.0, **fine).measures,
    )


def test_time_outside_the_friction_table():
    design = paper(600, 100, 200, **{"bit_rock.outside_table": "extrapolate"})
    short = design.replace({"simulation.duration": "5 s"})
    for found in both(short):
        assert found.time_outside_table == pytest.approx(5.0)
    for found in both(paper(600, 100, 140, **{"simulation.duration": "5 s"})):
        assert found.time_outside_table == 0.0


def test_work_per_turn_of_a_bit_that_turns_backwards():
    design = drillctl.load(
        "monteiro-trindade-140kn",
        **{
            "controller.law": "constant-torque",
            "controller.torque": "-14 kN*m",
            "start.speed": "-70 rpm",
            "simulation.duration": "10 s",
        },
    )
    reference, batch = both(design)
    assert reference.mean_bit_speed < 0.0
    assert reference.work_per_turn > 0.0
    assert batch.work_per_turn == pytest.approx(reference.work_per_turn, rel=1e-3)


@pytest.mark.parametrize("duration", ["10 s", "0.1 s", "3 ms"])
def test_short_runs(duration):
    reference, batch = both(paper(625, 125, 140, **{"simulation.duration": duration}))
    assert batch.stick_slip_index == pytest.approx(reference.stick_slip_index, rel=2e-3)
    assert batch.rop_proxy == pytest.approx(reference.rop_proxy, rel=5e-4)
    assert batch.j1 == pytest.approx(reference.j1, rel=1e-4)


def test_measures_do_not_depend_on_the_sampling_of_the_signals():
    design = paper(625, 125, 140, **{"simulation.duration": "30.004 s"})
    fine = drillctl.simulate(design)
    coarse = drillctl.simulate(design, interval=7.0)
    assert coarse.measures == fine.measures
    assert coarse.time[-1] == fine.time[-1] == 30.004
    assert np.diff(coarse.time).max() <= 7.0


def test_a_step_too_long_for_the_string_is_refused():
    design = paper(600, 100, 140, **{"simulation.step": "0.3 s", "bit_rock.beta_factor": 0.02})
    with pytest.raises(InputError, match=r"simulation\.step: 0\.3 s.*5\.54 s.*0\.277 s"):
        drillctl.simulate(design, engine="batch")
