"""Drives tuned to the string they turn: gains, and what they do."""

from __future__ import annotations

import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear.tuning import pipe_impedance, soft_torque, stiff_speed

DESIGN = "monteiro-trindade-140kn"


def test_gains_come_from_the_string():
    soft = drillctl.load(DESIGN, controller={"law": "soft-torque"})
    assert soft.top_drive == soft_torque(soft.string)
    assert soft.top_drive == pytest.approx((4 * 297.06, 321.07), rel=1e-4)
    stiff = drillctl.load(DESIGN, controller={"law": "stiff-speed"})
    assert stiff.top_drive == stiff_speed(stiff.string)
    matched = drillctl.load(DESIGN, controller={"law": "soft-torque", "share": 1.0})
    assert matched.top_drive.kp == pytest.approx(pipe_impedance(matched.string))


def test_a_longer_string_is_tuned_anew():
    short, long = (
        drillctl.load(
            DESIGN,
            **{"controller": {"law": "soft-torque"}, "drillstring.sections.pipe.length": length},
        )
        for length in ("2000 m", "4000 m")
    )
    assert short.top_drive.ki > 2 * long.top_drive.ki
    assert short.top_drive.kp == long.top_drive.kp


def test_a_tuned_drive_is_the_pi_of_its_gains():
    tuned = drillctl.load(DESIGN, controller={"law": "soft-torque", "share": 0.4})
    kp, ki = tuned.top_drive
    by_hand = drillctl.load(DESIGN, **{"controller.kp": kp, "controller.ki": ki})
    for engine in ("batch", "reference"):
        values = {"simulation.duration": "20 s"}
        a, b = (drillctl.simulate(d, engine=engine, **values) for d in (tuned, by_hand))
        np.testing.assert_array_equal(a.signals["bit_speed"], b.signals["bit_speed"])
    assert drillctl.loop(tuned).slope_margin == drillctl.loop(by_hand).slope_margin


def test_maps_over_the_share_and_over_the_length():
    design = drillctl.load(DESIGN, controller={"law": "soft-torque"})
    axes = [{"path": "controller.share", "min": 0.2, "max": 1.0, "points": 5},
            {"path": "drillstring.sections.pipe.length", "min": "2000 m", "max": "3000 m",
             "points": 2}]  # fmt: skip
    found = drillctl.stability_map(
        design.replace({"map.axes": axes, "simulation.duration": "20 s"}), audit_cells=2
    )
    assert found.audit.worst < 1e-2
    assert np.ptp(found.j1, axis=0).min() > 0.0


def test_misuse_is_refused():
    with pytest.raises(InputError, match=r"controller\.share: must be at most 1"):
        drillctl.load(DESIGN, controller={"law": "soft-torque", "share": 2.0})
    message = "controller.law: soft-torque is tuned to the pipe: a lumped spring has no impedance"
    with pytest.raises(InputError, match=message):
        drillctl.load("navarro-lopez-2dof", controller={"law": "soft-torque"})
    with pytest.raises(InputError, match="kp: unknown key"):
        drillctl.load(DESIGN, controller={"law": "stiff-speed", "kp": 1.0})
