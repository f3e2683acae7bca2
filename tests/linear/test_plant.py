"""Plant and loops: signals, signs, steady states, poles."""

from __future__ import annotations

import subprocess
import sys
import warnings

import control
import numpy as np
import pytest
from scipy.optimize import brentq

import drillctl
from drillctl.linear import closed_loop, open_loop, plant
from drillctl.linear.loop_model import loop_poles
from drillctl.linear.state_space import plant_matrices

HOLDS = {
    "plant": "banded frequency response, 1e-10; signs",
}

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"
SLOPE = 290.075
"""Fall of the bit torque with speed at 140 kN and 100 rpm (N m s)."""


def of(design=DESIGN, **values):
    return drillctl.load(design, **values)


def abscissa(string, kp, ki):
    return loop_poles(string, kp, ki, SLOPE).real.max()


def steady_state(system, inputs):
    """Outputs at rest of all states, the rigid body's speed zero where it is free."""
    state = np.linalg.lstsq(system.A, -system.B @ inputs, rcond=1e-12)[0]
    np.testing.assert_allclose(system.A @ state, -system.B @ inputs, atol=1e-9)
    return dict(zip(system.output_labels, system.C @ state + system.D @ inputs, strict=True))


def test_named_signals():
    system = plant(of("navarro-lopez-4dof").string)
    assert system.name == "drillstring"
    assert system.input_labels == ["top_torque", "bit_torque"]
    assert system.output_labels == ["top_speed", "bit_speed", "pipe_torque", "twist"]
    twists = ["twist_1", "twist_2", "twist_3"]
    assert system.state_labels == [*twists, "speed_0", "speed_1", "speed_2", "speed_3"]
    assert of().plant().nstates == 61


def test_top_torque_speeds_the_top_up_and_bit_torque_brakes_the_bit():
    for design in (DESIGN, "navarro-lopez-2dof"):
        system = plant(of(design).string)
        at_once = system.C @ system.B
        assert at_once[0, 0] > 0.0
        assert at_once[1, 1] < 0.0


def test_accelerations_of_two_inertias_by_hand():
    a, b, _, _ = plant_matrices(of("navarro-lopez-2dof").string)
    j, jb, k, c, cr, cb = 2122.0, 471.9698, 861.5336, 172.3067, 425.0, 50.0
    expected = [[0, 1, -1], [-k / j, -(c + cr) / j, c / j], [k / jb, c / jb, -(c + cb) / jb]]
    np.testing.assert_allclose(a, expected, rtol=1e-12)
    np.testing.assert_allclose(b, [[0, 0], [1 / j, 0], [0, -1 / jb]], rtol=1e-12)


def test_pipe_torque_and_twist_are_positive_when_the_top_leads():
    string = of(**{f"{PIPE}.damping": "600 N*m*s/rad"}).string
    system = plant(string)
    stiffness, damping = 30 * string.static_stiffness, 30 * 600.0 / 1.0
    assert string.element_damping[0] == pytest.approx(damping)
    lead = np.zeros(system.nstates)
    lead[0] = 1e-3
    assert (system.C @ lead)[2:] == pytest.approx([1e-3 * stiffness, 1e-3])
    turning = np.zeros(system.nstates)
    turning[system.find_state("speed_0")] = 0.5
    assert (system.C @ turning) == pytest.approx([0.5, 0.0, 0.5 * damping, 0.0])


def test_balanced_torques_wind_the_string_up():
    string = of().string
    outputs = steady_state(plant(string), np.array([2000.0, 2000.0]))
    assert outputs["twist"] == pytest.approx(2000.0 / string.static_stiffness)
    assert outputs["pipe_torque"] == pytest.approx(2000.0)


def test_rigid_body_takes_the_whole_inertia():
    string = of().string
    a, b, c, _ = plant_matrices(string)
    momentum = np.concatenate([np.zeros(30), np.asarray(string.mass.sum(axis=0)).ravel()])
    np.testing.assert_allclose(momentum @ b, [1.0, -1.0], atol=1e-10)
    np.testing.assert_allclose(momentum @ a, 0.0, atol=1e-7)
    assert not c[:2, :30].any()


def test_damping_given_mode_by_mode_reaches_the_plant():
    string = of(**{"drillstring.modal_damping": 0.02}).string
    poles = np.linalg.eigvals(plant_matrices(string).a)
    elastic = poles[poles.imag > 1e-6]
    assert len(elastic) == 30
    np.testing.assert_allclose(-elastic.real / np.abs(elastic), 0.02, rtol=1e-6)


def test_closed_loop_holds_set_speed_against_the_bit():
    design = of(**{f"{PIPE}.stiffness_damping": "1 ms"})
    system = closed_loop(design)
    assert system.input_labels == ["set_speed", "bit_torque"]
    assert system.output_labels == [*plant(design.string).output_labels, "top_torque"]
    assert system.state_labels[-1] == "integral"
    outputs = steady_state(system, np.array([10.0, 6600.0]))
    assert outputs["top_speed"] == pytest.approx(10.0)
    assert outputs["bit_speed"] == pytest.approx(10.0)
    assert outputs["top_torque"] == pytest.approx(6600.0)
    assert outputs["pipe_torque"] == pytest.approx(6600.0)
    assert outputs["twist"] == pytest.approx(6600.0 / design.string.static_stiffness)


def test_top_torque_is_the_law_itself():
    system = closed_loop(of(**{"controller.kp": 300.0, "controller.ki": 40.0}))
    state = np.zeros(system.nstates)
    state[system.find_state("speed_0")] = 2.0
    state[system.find_state("integral")] = 3.0
    torque = system.C[-1] @ state + system.D[-1] @ np.array([5.0, 0.0])
    assert torque == pytest.approx(300.0 * (5.0 - 2.0) + 40.0 * 3.0)


def test_closing_the_open_loop_gives_the_closed_loop():
    design = of()
    loop = open_loop(design)
    assert loop.input_labels == ["speed_error", "bit_torque"]
    closed = control.feedback(loop["top_speed", "speed_error"], 1)
    points = 2j * np.pi * np.array([0.05, 0.1, 0.2, 0.7, 3.0])
    system = closed_loop(design)
    np.testing.assert_allclose(closed(points), system["top_speed", "set_speed"](points), rtol=1e-10)
    law = 625.0 + 125.0 / points
    np.testing.assert_allclose(
        loop["top_speed", "speed_error"](points),
        law * plant(design.string)["top_speed", "top_torque"](points),
        rtol=1e-9,
    )
    np.testing.assert_allclose(loop["top_torque", "speed_error"](points), law, rtol=1e-12)


@pytest.mark.parametrize(
    ("design", "values"),
    [("navarro-lopez-2dof", {}), (DESIGN, {"controller.kp": 200.0, "controller.ki": 0.0})],
)
def test_no_integrator_without_integral_action(design, values):
    rig = of(design, **values)
    system = closed_loop(rig)
    assert "integral" not in system.state_labels
    assert system.nstates == plant(rig.string).nstates
    assert open_loop(rig).nstates == system.nstates


def test_constant_torque_leaves_the_string_as_it_is():
    rig = of("navarro-lopez-2dof")
    system, alone = closed_loop(rig), plant(rig.string)
    np.testing.assert_array_equal(system.A, alone.A)
    np.testing.assert_array_equal(system.B[:, 1], alone.B[:, 1])
    assert not system.B[:, 0].any()
    assert not system.C[-1].any()


def test_design_offers_plant_and_loop():
    design = of()
    np.testing.assert_array_equal(design.plant().A, plant(design.string).A)
    np.testing.assert_array_equal(design.loop().A, closed_loop(design).A)


def test_linear_region_of_the_gains():
    string = of(**{f"{PIPE}.elements": 10}).string
    stable = [
        (kp, ki)
        for kp in np.linspace(0.0, 1000.0, 41)
        for ki in np.linspace(0.0, 500.0, 21)
        # Without gains the speed of the whole is no one's: not stable, whatever rounding says.
        if kp > 0.0 and ki > 0.0 and abscissa(string, kp, ki) < 0.0
    ]
    kp, ki = np.array(stable).T
    assert len(stable) == 56
    assert (kp.min(), kp.max(), ki.min(), ki.max()) == (475.0, 700.0, 50.0, 200.0)


def test_high_modes_alone_need_gain():
    string = of().string

    def decay(kp):
        return abscissa(string, kp, 125.0)

    assert brentq(decay, 455.0, 475.0, xtol=1e-3) == pytest.approx(467.14, abs=0.1)


def test_importing_the_room_leaves_control_alone():
    code = "import sys, drillctl.linear; sys.exit('control' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_inertias_far_apart_are_no_matter():
    design = drillctl.load("richard-detournay-2dof", **{"bha.inertia": "1e-6 kg*m^2"})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pushed = plant_matrices(design.string).b
    np.testing.assert_allclose(pushed, [[0.0, 0.0], [1e-10, 0.0], [0.0, -1e6]], rtol=1e-12)
