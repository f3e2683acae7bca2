"""The top drive as the string feels it, and gains from the string."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear import drive_impedance
from drillctl.linear.tuning import soft_torque, stiff_speed


@pytest.mark.parametrize(("share", "reflection"), [(1.0, 0.0), (0.5, 1 / 3), (0.25, 0.6)])
def test_tuned_drive_reflects_what_it_should(design, share, reflection):
    kp, ki = soft_torque(design.string, share)
    tuned = design.replace({"controller.kp": kp, "controller.ki": ki})
    at = design.string.stick_slip_frequency / (2 * math.pi)
    found = drive_impedance(tuned, [at])
    assert abs(found.reflection[0]) == pytest.approx(reflection, abs=1e-12)
    assert found.impedance[0].imag == pytest.approx(0.0, abs=1e-9)


def test_numbers_of_the_paper(design):
    string = design.string
    assert string.pipe_impedance == pytest.approx(297.06, abs=5e-3)
    assert string.stick_slip_frequency == pytest.approx(0.80134, abs=5e-6)
    assert soft_torque(string)[1] == pytest.approx(321.07, abs=0.01)
    assert stiff_speed(string) == pytest.approx((50 * 297.06, 2500.0), rel=1e-4)


def test_a_stiff_drive_reflects_everything(design):
    kp, ki = stiff_speed(design.string)
    stiff = drive_impedance(design.replace({"controller.kp": kp, "controller.ki": ki}))
    assert np.abs(stiff.reflection).min() > 0.95
    free = drive_impedance(
        design.replace({"controller": {"law": "constant-torque", "torque": "5 kN*m"}})
    )
    np.testing.assert_allclose(np.abs(free.reflection), 1.0)
    assert "constant-torque" in free.label


def test_reflection_is_passive_and_saved_with_units(design):
    found = drive_impedance(design)
    assert np.abs(found.reflection).max() <= 1.0
    assert found.data["impedance"].attrs["units"] == "N*m*s/rad"
    assert found.data.attrs["pipe_impedance"] == found.pipe


def test_misuse_is_refused(design):
    with pytest.raises(InputError, match="above 0 and at most 1"):
        soft_torque(design.string, 1.5)
    with pytest.raises(InputError, match="lumped spring has no impedance"):
        drive_impedance(drillctl.load("navarro-lopez-2dof"))
    with pytest.raises(InputError, match="more than 0 Hz"):
        drive_impedance(design, [0.0, 1.0])
