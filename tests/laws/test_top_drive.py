"""Top-drive laws: torque at an instant, and its exact mean over a step."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
import scipy.integrate
from hypothesis import given, settings
from hypothesis import strategies as st

import drillctl
from drillctl.rig.top_drive import PI, ConstantTorque

angles = st.floats(-50.0, 50.0)
steps = st.floats(1e-3, 1.0)
gains = st.floats(-1e3, 1e3)


def test_pi_by_hand():
    assert PI(200.0, 100.0).torque(0.5, 2.0) == -200.0 * 2.0 - 100.0 * 0.5
    assert PI(200.0, 100.0).torque(0.0, 0.0) == 0.0
    assert PI(200.0, 100.0).torque(0.0, -1.0) == 200.0  # too slow: the drive pushes
    assert PI(200.0, 100.0).gains() == (200.0, 100.0)


def test_pi_in_the_frame_is_pi_on_the_speed_error():
    # Eq. 2 of Monteiro & Trindade (2012), integrated along a made-up speed of the drive.
    kp, ki, set_speed = 625.0, 125.0, 10.5
    time = np.linspace(0.0, 5.0, 5001)
    speed = set_speed + np.sin(3 * time) * np.exp(-time) - 0.4
    error = set_speed - speed
    integral = scipy.integrate.cumulative_trapezoid(error, time, initial=0.0)
    expected = kp * error + ki * integral
    angle = scipy.integrate.cumulative_trapezoid(speed, time, initial=0.0) - set_speed * time
    np.testing.assert_allclose(PI(kp, ki).torque(angle, speed - set_speed), expected, atol=1e-9)


@settings(max_examples=100, deadline=None)
@given(kp=gains, ki=gains, start=angles, end=angles, step=steps)
def test_mean_over_a_step_is_the_integral_of_the_torque(kp, ki, start, end, step):
    law = PI(kp, ki)
    offset, slope = law.mean_torque(start, 1.0 / step)
    speed = (end - start) / step
    # The torque is linear in time along an angle that is: two Gauss points are exact.
    points = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)
    mean = np.mean([law.torque(start + share * (end - start), speed) for share in points])
    size = (abs(kp) / step + abs(ki)) * (abs(start) + abs(end))
    assert offset - slope * end == pytest.approx(mean, rel=1e-12, abs=1e-12 * size + 1e-300)


@settings(max_examples=100, deadline=None)
@given(kp=gains, ki=gains, start=angles, step=steps)
def test_torque_of_a_step_that_stays_is_the_torque_at_rest(kp, ki, start, step):
    offset, slope = PI(kp, ki).mean_torque(start, 1.0 / step)
    size = (abs(kp) / step + abs(ki)) * abs(start)
    expected = PI(kp, ki).torque(start, 0.0)
    assert offset - slope * start == pytest.approx(expected, abs=1e-12 * size + 1e-300)


def test_mean_by_hand():
    offset, slope = PI(200.0, 100.0).mean_torque(0.5, 50.0)
    assert (offset, slope) == ((10000.0 - 50.0) * 0.5, 10050.0)


@given(level=st.floats(-1e5, 1e5), angle=angles, speed=angles)
def test_constant_torque_is_constant(level, angle, speed):
    law = ConstantTorque(level)
    assert law.torque(angle, speed) == level
    offset, slope = law.mean_torque(angle, 100.0)
    assert offset - slope * speed == level
    assert law.gains() == (0.0, 0.0)


@pytest.mark.parametrize("law", [PI(200.0, 100.0), PI(0.0, 3.0), ConstantTorque(8e3)])
def test_gains_are_the_derivatives_of_the_torque(law):
    kp, ki = law.gains()
    h = 1e-3
    assert (law.torque(0.2, h) - law.torque(0.2, -h)) / (2 * h) == pytest.approx(-kp, abs=1e-6)
    assert (law.torque(h, 0.2) - law.torque(-h, 0.2)) / (2 * h) == pytest.approx(-ki, abs=1e-6)


def test_pi_takes_an_array_for_every_number():
    law = PI(np.array([200.0, 400.0]), np.array([100.0, 50.0]))
    np.testing.assert_array_equal(law.torque(np.array([1.0, 2.0]), 0.5), [-200.0, -300.0])
    offset, slope = law.mean_torque(1.0, 10.0)
    np.testing.assert_array_equal(offset, [1950.0, 3975.0])
    np.testing.assert_array_equal(slope, [2050.0, 4025.0])


def test_pi_takes_symbols():
    kp, ki = casadi.SX.sym("kp"), casadi.SX.sym("ki")
    function = casadi.Function("torque", [kp, ki], [PI(kp, ki).torque(0.5, 2.0)])
    assert float(function(200.0, 100.0)) == PI(200.0, 100.0).torque(0.5, 2.0)


def test_laws_of_designs():
    assert drillctl.load("monteiro-trindade-120kn").top_drive == PI(200.0, 100.0)
    assert drillctl.load("navarro-lopez-2dof").top_drive == ConstantTorque(10e3)
