"""Every bit-rock law: its slope, its limits, and the same motion in both engines."""

from __future__ import annotations

import math

import casadi
import numpy as np
import pytest

import drillctl
from drillctl.errors import InputError
from drillctl.rig.bit_rock import (
    JansenVanDenSteen,
    NavarroLopezSuarez,
    Stribeck,
    TuckerWang,
    tabulated,
)

DESIGN = "monteiro-trindade-140kn"
POINTS = (0.0, 2.0, 5.0, 12.0, 30.0), (0.085, 0.07, 0.06, 0.044, 0.03)
LAWS = {
    "navarro-lopez-suarez": NavarroLopezSuarez(0.026, 0.085, 0.098),
    "jansen-van-den-steen": JansenVanDenSteen(0.047, 0.085),
    "coulomb": JansenVanDenSteen(0.05, 0.05),
    "tucker-wang": TuckerWang(0.0239, 1.91, 8.5, 5.47),
    "stribeck": Stribeck(0.08, 0.05, 1.0, 20.0),
    "tabulated": tabulated(0.09, *POINTS),
}
TABLES = {
    "jansen-van-den-steen": {"a1": 0.047, "a2": 0.085},
    "coulomb": {"a": 0.05},
    "tucker-wang": {},
    "stribeck": {"bit_radius": "0.1 m"},
    "tabulated": {
        "points": [
            {"speed": "0 rpm", "a": 0.085},
            {"speed": "60 rpm", "a": 0.056},
            {"speed": "120 rpm", "a": 0.043},
            {"speed": "300 rpm", "a": 0.03},
        ]
    },
}
WEIGHT = 140e3


def under(law, **values):
    return drillctl.load(DESIGN, **{"bit_rock": {"law": law} | TABLES[law]} | values)


@pytest.mark.parametrize("name", LAWS)
def test_slope_is_the_derivative(name):
    law, h = LAWS[name], 1e-6
    for speed in (0.003, 0.4, 1.0, 3.3, 10.0, 50.0):
        above, below = (law.torque_and_slope(WEIGHT, speed + s, math.exp)[0] for s in (h, -h))
        slope = law.torque_and_slope(WEIGHT, speed, math.exp)[1]
        assert (above - below) / (2 * h) == pytest.approx(slope, rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("name", LAWS)
def test_no_slope_is_steeper_than_said(name):
    law = LAWS[name]
    speeds = np.concatenate([np.geomspace(1e-4, 1, 4000), np.linspace(1, 60, 4000)])
    _, slope = law.torque_and_slope(WEIGHT, speeds, np.exp)
    assert -np.min(slope) <= law.steepest_fall(WEIGHT) * (1 + 1e-12) + 1e-9


@pytest.mark.parametrize("name", LAWS)
def test_limits_at_rest(name):
    law = LAWS[name]
    at_rest, _ = law.torque_and_slope(WEIGHT, 0.0, math.exp)
    assert law.kinetic_torque_at_rest(WEIGHT) == pytest.approx(at_rest, abs=1e-9)
    assert law.static_torque(WEIGHT) >= law.kinetic_torque_at_rest(WEIGHT)
    assert law.set_valued == (law.static_torque(WEIGHT) > 0.0)


@pytest.mark.parametrize("name", LAWS)
def test_casadi_takes_the_law(name):
    law = LAWS[name]
    weight, speed = casadi.MX.sym("W"), casadi.MX.sym("w")
    torque, slope = law.torque_and_slope(weight, speed, casadi.exp)
    found = casadi.Function("law", [weight, speed], [torque, slope, casadi.jacobian(torque, speed)])
    for at in (0.3, 4.0, 17.0):
        by_numbers = law.torque_and_slope(WEIGHT, at, math.exp)
        symbolic = [float(x) for x in found(WEIGHT, at)]
        assert symbolic[:2] == pytest.approx(by_numbers, rel=1e-12)
        assert symbolic[2] == pytest.approx(symbolic[1], rel=1e-12, abs=1e-9)


def test_points_are_on_the_curve_and_the_last_one_holds():
    law = LAWS["tabulated"]
    for speed, arm in zip(*POINTS, strict=True):
        assert law.torque_and_slope(1.0, speed, math.exp)[0] == pytest.approx(arm, abs=1e-15)
    assert law.torque_and_slope(1.0, 99.0, math.exp) == pytest.approx((0.03, 0.0), abs=1e-15)
    assert law.torque_and_slope(1.0, 3.5, math.exp)[0] == pytest.approx(0.065)
    assert law.static_torque(1.0) == 0.09


@pytest.mark.parametrize("law", TABLES)
def test_both_engines_agree(law):
    # Broken on purpose: with theta = 1/2 throughout the creeping bit rings, and stuck phases of
    # the peaked law came out wrong without the early impulse.
    design = under(law)
    exact = drillctl.simulate(design)
    assert exact.energy.relative_residual < 1e-8
    standard = drillctl.simulate(design, engine="batch").measures
    fine = drillctl.simulate(design, engine="batch", **{"simulation.accuracy": "fine"}).measures
    assert standard.j1 == pytest.approx(exact.measures.j1, rel=4e-4)
    assert fine.j1 == pytest.approx(exact.measures.j1, rel=3e-5)
    assert fine.stuck_time == pytest.approx(exact.measures.stuck_time, rel=1e-4)
    assert fine.peak_bit_speed == pytest.approx(exact.measures.peak_bit_speed, rel=1e-4)


@pytest.mark.parametrize("kp", [200.0, 400.0])
def test_both_engines_agree_where_a_smooth_law_creeps(kp):
    # Stick-slip of a regularised law: the bit creeps through what should be a stick, where the
    # law is too steep for the step and only an implicit mean of the torque follows it.
    design = drillctl.load(
        DESIGN,
        **{
            "bit_rock.regularised_over": "0.05 rad/s",
            "controller.kp": kp,
            "simulation.duration": "40 s",
        },
    )
    exact = drillctl.simulate(design).measures
    for accuracy, close in (("standard", 1e-3), ("fine", 1e-4)):
        found = drillctl.simulate(design, engine="batch", **{"simulation.accuracy": accuracy})
        assert found.measures.j1 == pytest.approx(exact.j1, rel=close)
        assert found.measures.min_bit_speed > -0.05


def test_a_narrow_regularisation_tends_to_the_set():
    exact = drillctl.simulate(drillctl.load(DESIGN), engine="batch").measures.j1
    shifts = []
    for width in (0.5, 0.1, 0.02):
        design = drillctl.load(DESIGN, **{"bit_rock.regularised_over": f"{width} rad/s"})
        shifts.append(abs(drillctl.simulate(design, engine="batch").measures.j1 / exact - 1))
    assert shifts[0] > 0.05
    assert shifts[0] > 3 * shifts[1] > 9 * shifts[2]


def test_a_peak_without_falling_slope_is_stable_and_may_stick():
    design = under("jansen-van-den-steen", **{"controller.kp": 200.0, "controller.ki": 100.0})
    found = drillctl.simulate(design, **{"start.kind": "wound_up"})
    assert found.measures.stuck_time > 0.0
    assert design.bit_rock.steepest_fall(WEIGHT) == 0.0


def test_a_bit_never_sticks_under_a_smooth_law():
    for law in ("tucker-wang", "stribeck"):
        found = drillctl.simulate(under(law), engine="batch").measures
        assert found.stuck_time == 0.0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"law": "jansen-van-den-steen", "a1": 0.1, "a2": 0.05}, "must not be less than a1"),
        ({"law": "coulomb"}, "a"),
        ({"law": "coulomb", "a": -1.0}, "0 or more"),
        ({"law": "tabulated", "points": [{"speed": "0 rpm", "a": 0.1}]}, "needs 2 to 13 points"),
        (
            {"law": "tabulated", "points": [{"speed": "1 rpm", "a": 0.1},
                                            {"speed": "2 rpm", "a": 0.1}]},
            "begin at 0 and increase",
        ),
        (
            {"law": "tabulated", "static": 0.05, "points": [{"speed": "0 rpm", "a": 0.1},
                                                            {"speed": "2 rpm", "a": 0.1}]},
            "static = 0.05",
        ),
        ({"law": "stribeck", "bit_radius": "0.1 m", "regularised_over": "0 rad/s"},
         "greater than 0"),
        ({"law": "stribek"}, "stribeck"),
    ],
)  # fmt: skip
def test_impossible_laws_are_refused(table, message):
    with pytest.raises(InputError, match=message):
        drillctl.load(DESIGN, bit_rock=table)
