"""Weight on bit that follows the bit speed: the law, the friction under it, both engines."""

from __future__ import annotations

import math

import casadi
import numpy as np
import pytest

import drillctl
from drillctl import units
from drillctl.errors import InputError
from drillctl.linear import cancelling_weight_gain, operating_point
from drillctl.rig.bit_rock import NavarroLopezSuarez, WeightTable, contact, over_weight
from drillctl.rig.bit_rock.law import by_weight
from drillctl.rig.weight_on_bit import ConstantWeight, FollowingSpeed

DESIGN = "monteiro-trindade-140kn"
ROWS = WeightTable(
    weight=(80e3, 100e3, 120e3, 140e3, 160e3),
    a1=(0.037, 0.032, 0.029, 0.026, 0.025),
    a2=(0.057, 0.070, 0.079, 0.085, 0.089),
    beta=(0.082, 0.093, 0.097, 0.098, 0.099),
)
FIXED = {"law": "navarro-lopez-suarez", "a1": 0.026, "a2": 0.085, "beta": 0.098}


def following(gain, **values):
    law = {"law": "navarro-lopez-suarez", "gain": f"{gain} kN*s/rad"}
    given = {"controller.kp": 200.0, "controller.ki": 100.0} | values
    limits = given.pop("limits", {})
    return drillctl.load(DESIGN, **{"weight_on_bit": law | limits}, **given)


# The laws


@pytest.mark.parametrize("weight", [1e3, 60e3, 80e3, 95e3, 120e3, 139e3, 160e3, 200e3])
def test_coefficients_follow_the_table(weight):
    law, fixed = over_weight(ROWS), ROWS.at(weight)
    for speed in (0.0, 0.5, 10.0, 30.0):
        expected = fixed.torque_and_slope(weight, speed, math.exp)
        assert law.torque_and_slope(weight, speed, math.exp) == pytest.approx(expected, rel=1e-11)
    assert law.static_torque(weight) == pytest.approx(fixed.static_torque(weight), rel=1e-12)
    assert law.steepest_fall(weight) == pytest.approx(fixed.steepest_fall(weight), rel=1e-11)


@pytest.mark.parametrize("weight", [50e3, 90e3, 133e3, 170e3])
@pytest.mark.parametrize("law", [over_weight(ROWS), NavarroLopezSuarez(0.026, 0.085, 0.098)])
def test_torque_by_weight_is_the_derivative(law, weight):
    for speed in (0.3, 10.0):
        above, below = (law.torque_and_slope(weight + h, speed, math.exp)[0] for h in (1.0, -1.0))
        found = by_weight(law, weight, speed, math.exp)
        assert (above - below) / 2.0 == pytest.approx(found, rel=1e-6)


def test_at_a_row_the_mean_of_both_sides():
    law = over_weight(ROWS)
    sides = [by_weight(law, w, 10.0, math.exp) for w in (140e3 - 1e-3, 140e3, 140e3 + 1e-3)]
    assert sides[0] != pytest.approx(sides[2], rel=0.05)
    assert sides[1] == pytest.approx(0.5 * (sides[0] + sides[2]), rel=1e-7)


def test_factors_act_on_every_row():
    law, plain = over_weight(ROWS, 0.9, 1.1, 2.0), ROWS.at(110e3)
    scaled = NavarroLopezSuarez(0.9 * plain.a1, 1.1 * plain.a2, 2.0 * plain.beta)
    expected = scaled.torque_and_slope(110e3, 7.0, math.exp)
    assert law.torque_and_slope(110e3, 7.0, math.exp) == pytest.approx(expected, rel=1e-11)


def test_weight_within_its_limits():
    law = FollowingSpeed(140e3, 5e3, 10.0, 120e3, 160e3)
    speeds = np.array([0.0, 5.9, 6.1, 10.0, 13.9, 14.1, 50.0])
    expected = np.clip(140e3 + 5e3 * (speeds - 10.0), 120e3, 160e3)
    np.testing.assert_allclose(law.weight(speeds), expected)
    np.testing.assert_array_equal(law.slope(speeds), [0, 0, 5e3, 5e3, 5e3, 0, 0])
    assert ConstantWeight(140e3).slope(3.0) == 0.0


def test_casadi_takes_the_contact():
    friction, weight = over_weight(ROWS), FollowingSpeed(140e3, 5e3, 10.0, 42e3, 182e3)
    speed = casadi.MX.sym("w")
    torque, slope = contact(friction, weight, speed, casadi.exp)
    found = casadi.Function("contact", [speed], [torque, slope, casadi.jacobian(torque, speed)])
    for at in (1.0, 9.0, 11.3, 30.0):
        symbolic = [float(x) for x in found(at)]
        assert symbolic[:2] == pytest.approx(contact(friction, weight, at, math.exp), rel=1e-12)
        assert symbolic[2] == pytest.approx(symbolic[1], rel=1e-9)


# The linear side


@pytest.mark.parametrize(("weight", "gain"), [("120 kN", 4.34e3), ("140 kN", 5.87e3)])
def test_gain_that_cancels_the_slope(weight, gain):
    design = drillctl.load(DESIGN, **{"operating_point.weight_on_bit": weight})
    found = cancelling_weight_gain(design)
    assert found == pytest.approx(gain, rel=0.01)
    there = design.replace(
        {"weight_on_bit": {"law": "navarro-lopez-suarez", "gain": units.SI(found)}}
    )
    assert operating_point(there).slope == pytest.approx(0.0, abs=1e-9)


def test_a_following_weight_widens_the_margin():
    slopes = [operating_point(following(gain)).slope for gain in (0, 2, 4, 6)]
    assert slopes[0] == pytest.approx(290.075, abs=1e-3)
    assert np.all(np.diff(slopes) < 0.0)
    assert drillctl.loop(following(6)).stable
    assert not drillctl.loop(following(0)).stable


# Both engines


@pytest.mark.parametrize(("gain", "j1"), [(2, 75.68), (4, 22.15), (6, 12.40)])
def test_published_study_with_the_table(gain, j1):
    design = following(gain)
    exact = drillctl.simulate(design).measures
    assert exact.j1 == pytest.approx(j1, abs=0.02)
    for accuracy, close in (("standard", 3e-4), ("fine", 3e-5)):
        found = drillctl.simulate(design, engine="batch", **{"simulation.accuracy": accuracy})
        assert found.measures.j1 == pytest.approx(exact.j1, rel=close)
        assert found.measures.mean_weight_on_bit == pytest.approx(
            exact.mean_weight_on_bit, rel=1e-4
        )
        assert found.measures.rop_proxy == pytest.approx(exact.rop_proxy, rel=1e-4)
    outside = exact.time_outside_table
    assert 0.0 < outside < 100.0
    assert found.measures.time_outside_table == pytest.approx(outside, abs=0.1)


@pytest.mark.parametrize(("gain", "j1"), [(1, 85.974), (4, 28.268)])
def test_published_study_with_one_row_and_limits(gain, j1):
    limits = {"minimum": "42 kN", "maximum": "182 kN"}
    design = following(gain, bit_rock=FIXED, limits=limits)
    exact = drillctl.simulate(design)
    assert exact.measures.j1 == pytest.approx(j1, abs=1.5e-3)
    assert exact.energy.relative_residual < 1e-8
    fine = drillctl.simulate(design, engine="batch", **{"simulation.accuracy": "fine"})
    assert fine.measures.j1 == pytest.approx(j1, abs=2e-3)
    weight = exact.signals["weight_on_bit"]
    assert 42e3 <= weight.min() < weight.max() <= 182e3


def test_order_two_over_a_whole_run():
    design = following(4, bit_rock=FIXED)
    exact = drillctl.simulate(design).measures.j1
    errors = [
        abs(drillctl.simulate(design, engine="batch", **{"simulation.step": f"{step} ms",
                                                         "simulation.modes": 31}).measures.j1
            - exact)
        for step in (20, 10, 5)
    ]  # fmt: skip
    assert math.log2(errors[0] / errors[2]) / 2 == pytest.approx(2.0, abs=0.4)


def test_no_gain_is_constant_weight_to_rounding():
    still = drillctl.load(DESIGN, **{"controller.kp": 200.0, "controller.ki": 100.0})
    for engine in ("batch", "reference"):
        a = drillctl.simulate(following(0), engine=engine).measures.j1
        b = drillctl.simulate(still, engine=engine).measures.j1
        assert a == pytest.approx(b, rel=1e-7)


@pytest.mark.slow
def test_maps_take_the_gain_as_an_axis():
    design = following(1)
    axes = [{"path": "weight_on_bit.gain", "min": "0 kN*s/rad", "max": "6 kN*s/rad", "points": 4},
            {"path": "controller.kp", "min": 200.0, "max": 600.0, "points": 3}]  # fmt: skip
    found = drillctl.stability_map(design.replace({"map.axes": axes}), audit_cells=3)
    assert found.audit.worst < 1e-2
    assert found.j1[3, 0] < 0.2 * found.j1[0, 0]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"weight_on_bit.gain": "-1 kN*s/rad"}, "0 or more"),
        ({"weight_on_bit.gain": 4}, "kN\\*s/rad"),
        ({"weight_on_bit.minimum": "150 kN", "weight_on_bit.maximum": "100 kN"}, "more than min"),
        ({"bit_rock.regularised_over": "0.1 rad/s"}, "is not allowed with a weight"),
        ({"weight_on_bit.maximum": "120 kN"}, "outside the limits of the weight-on-bit law"),
    ],
)
def test_impossible_laws_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        drillctl.simulate(following(4).replace(values))
