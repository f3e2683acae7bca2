"""Drives tuned to the string they turn: gains, and what they do."""

from __future__ import annotations

import casadi
import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.linear.tuning import soft_torque, stiff_speed
from drillctl.rig.top_drive.law import DriveTable, StringNumbers, drive_laws, tracking

DESIGN = "monteiro-trindade-140kn"


def test_gains_come_from_the_string():
    soft = drillctl.load(DESIGN, controller={"law": "soft-torque"})
    assert soft.top_drive == soft_torque(soft.string)
    assert soft.top_drive == pytest.approx((4 * 297.06, 321.07), rel=1e-4)
    stiff = drillctl.load(DESIGN, controller={"law": "stiff-speed"})
    assert stiff.top_drive == stiff_speed(stiff.string)
    matched = drillctl.load(DESIGN, controller={"law": "soft-torque", "share": 1.0})
    assert matched.top_drive.kp == pytest.approx(matched.string.pipe_impedance)


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


@pytest.mark.parametrize(
    ("table", "rates"),
    [
        ({}, [0.2, 0.0, 1.0, 1.0, 0.0]),
        ({"tracking_time": "2 s"}, [0.5, 0.0, 0.5, 0.5, 0.0]),
        ({"anti_windup": "none"}, [0.0] * 5),
    ],
)
def test_the_rate_of_the_anti_windup_is_the_same_of_numbers_arrays_and_symbols(table, rates):
    drive = DriveTable(**table)
    pairs = np.array([(600.0, 120.0), (600.0, 0.0), (0.0, 120.0), (-5.0, 3.0), (0.0, 0.0)])
    kp, ki = casadi.SX.sym("kp"), casadi.SX.sym("ki")
    symbols = casadi.Function("rate", [kp, ki], [casadi.SX(tracking(kp, ki, drive))])
    np.testing.assert_array_equal(tracking(*pairs.T, drive), rates)
    for (p, i), rate in zip(pairs.tolist(), rates, strict=True):
        assert tracking(p, i, drive) == float(symbols(p, i)) == rate


@pytest.mark.parametrize("name", drive_laws())
def test_one_function_gives_a_drive_of_numbers_and_of_symbols(name):
    table = {"torque": "7 kN*m"} if name == "constant-torque" else {}
    table |= {"kp": 600.0, "ki": 120.0} if name == "pi" else {}
    design = drillctl.load(DESIGN, controller={"law": name} | table)
    law = drive_laws()[name]
    numbers = law.controller(design.tables.controller, design.string)
    known = StringNumbers(*(getattr(design.string, field) for field in StringNumbers._fields))
    assert law.controller(design.tables.controller, known) == numbers
    symbols = StringNumbers(*casadi.vertsplit(casadi.SX.sym("string", len(known))))
    made = law.controller(design.tables.controller, symbols)
    found = casadi.Function("law", list(symbols), [casadi.SX(number) for number in made])(*known)
    assert [float(number) for number in found] == pytest.approx(numbers, rel=1e-15)
