"""Bit-rock laws: printed figures, slopes, and the table over the weight on bit."""

from __future__ import annotations

import math

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import drillctl
from drillctl.rig.bit_rock import NavarroLopezSuarez, WeightTable

HOLDS = {
    "friction": "Table 1, slopes against differences, CasADi",
}

RPM = 2 * math.pi / 60

# Table 1 of Monteiro & Trindade (2012): weight (kN), a1 (m), a2 (m), beta (s/rad); and what
# follows from it by hand: static torque (N m), torque (N m) and slope (N m s) at 100 rpm.
TABLE_1 = [
    (80, 0.037, 0.057, 0.082, 4560, 3637.9, -55.6),
    (100, 0.032, 0.070, 0.093, 7000, 4634.9, -133.4),
    (120, 0.029, 0.079, 0.097, 9480, 5652.7, -210.8),
    (140, 0.026, 0.085, 0.098, 11900, 6599.9, -290.1),
    (160, 0.025, 0.089, 0.099, 14240, 7631.2, -359.5),
]
ROWS = WeightTable(
    weight=tuple(row[0] * 1e3 for row in TABLE_1),
    a1=tuple(row[1] for row in TABLE_1),
    a2=tuple(row[2] for row in TABLE_1),
    beta=tuple(row[3] for row in TABLE_1),
)


def design_at(kilonewton, **values):
    weight = f"{kilonewton} kN"
    return drillctl.load(
        "monteiro-trindade-140kn", **{"operating_point.weight_on_bit": weight} | values
    )


@st.composite
def laws(draw):
    a2 = draw(st.floats(1e-3, 1.0))
    a1 = a2 * draw(st.floats(0.0, 1.0))
    return NavarroLopezSuarez(a1, a2, draw(st.floats(0.0, 2.0)))


weights = st.floats(1e3, 5e5)


# The paper's figures


@pytest.mark.parametrize("row", TABLE_1, ids=lambda row: f"{row[0]} kN")
def test_table_1(row):
    kilonewton, a1, a2, beta, static, torque, slope = row
    law = design_at(kilonewton).bit_rock
    assert law == (a1, a2, beta)  # to the last bit: no interpolation at a row
    weight = kilonewton * 1e3
    assert law.static_torque(weight) == pytest.approx(static, rel=1e-12)
    found = law.torque_and_slope(weight, 100 * RPM, math.exp)
    assert found[0] == pytest.approx(torque, abs=0.05)
    assert found[1] == pytest.approx(slope, abs=0.05)


def test_slope_that_decides_stability_at_140_kn():
    _, slope = design_at(140).bit_rock.torque_and_slope(140e3, 100 * RPM, math.exp)
    assert slope == pytest.approx(-290.075, abs=5e-4)


# The law


@settings(max_examples=100, deadline=None)
@given(law=laws(), weight=weights, speed=st.floats(0.01, 60.0))
def test_slope_is_the_derivative_of_the_torque(law, weight, speed):
    h = 1e-4
    above, below = (
        law.torque_and_slope(weight, speed + s, math.exp)[0] for s in (h, -h)
    )  # fmt: skip
    _, slope = law.torque_and_slope(weight, speed, math.exp)
    # Rounding of the difference, and its third-order error beta^2 h^2 / 6 of the slope.
    noise = 4 * np.finfo(float).eps * law.static_torque(weight) / h
    assert (above - below) / (2 * h) == pytest.approx(slope, rel=1e-7, abs=noise)


@settings(max_examples=50, deadline=None)
@given(law=laws(), weight=weights)
def test_steepest_fall_bounds_the_slope_everywhere_and_is_reached(law, weight):
    speeds = np.linspace(0.0, 60.0, 3001)
    _, slopes = law.torque_and_slope(weight, speeds, np.exp)
    assert (-slopes).max() == pytest.approx(law.steepest_fall(weight), rel=1e-12)
    assert law.steepest_fall(weight) >= 0.0


@settings(max_examples=50, deadline=None)
@given(law=laws(), weight=weights)
def test_torque_falls_from_static_to_sliding(law, weight):
    at_rest, _ = law.torque_and_slope(weight, 0.0, math.exp)
    assert at_rest == pytest.approx(law.static_torque(weight), rel=1e-12)
    assert law.kinetic_torque_at_rest(weight) == law.static_torque(weight) == law.a2 * weight
    torque, _ = law.torque_and_slope(weight, np.linspace(0.0, 60.0, 200), np.exp)
    assert (np.diff(torque) <= 1e-12 * at_rest).all()
    assert (torque >= law.a1 * weight * (1 - 1e-12)).all()
    assert law.set_valued is True


def test_every_number_of_the_law_may_be_an_array():
    law = NavarroLopezSuarez(*np.array([row[1:4] for row in TABLE_1]).T)
    weight = np.array([row[0] * 1e3 for row in TABLE_1])
    torque, slope = law.torque_and_slope(weight, 100 * RPM, np.exp)
    np.testing.assert_allclose(torque, [row[5] for row in TABLE_1], atol=0.05)
    np.testing.assert_allclose(slope, [row[6] for row in TABLE_1], atol=0.05)
    np.testing.assert_allclose(law.static_torque(weight), [row[4] for row in TABLE_1])


@settings(max_examples=25, deadline=None)
@given(law=laws(), weight=weights, speed=st.floats(0.0, 60.0))
def test_the_same_law_with_symbols(law, weight, speed):
    symbols = casadi.SX.sym("x", 5)
    w, speed_symbol, *numbers = casadi.vertsplit(symbols)
    torque, slope = NavarroLopezSuarez(*numbers).torque_and_slope(w, speed_symbol, casadi.exp)
    derivative = casadi.jacobian(torque, speed_symbol)
    function = casadi.Function("law", [symbols], [torque, slope, derivative])
    found = [float(value) for value in function([weight, speed, *law])]
    expected = law.torque_and_slope(weight, speed, math.exp)
    assert found[:2] == pytest.approx(expected, rel=1e-12, abs=1e-9)
    assert found[2] == pytest.approx(expected[1], rel=1e-12, abs=1e-9)


# Coefficients over the weight on bit


@pytest.mark.parametrize("row", range(5))
def test_rows_are_kept_as_printed(row):
    assert ROWS.at(ROWS.weight[row]) == (ROWS.a1[row], ROWS.a2[row], ROWS.beta[row])


@settings(max_examples=100, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(1.0, 1e6), st.floats(0, 1), st.floats(0, 1), st.floats(0, 1)),
        min_size=2,
        max_size=6,
        unique_by=lambda row: row[0],
    )
)
def test_rows_of_any_table_are_kept_to_the_last_bit(rows):
    weight, a1, a2, beta = zip(*sorted(rows), strict=True)
    table = WeightTable(weight, a1, a2, beta)
    for row, at in enumerate(weight):
        assert table.at(at) == (a1[row], a2[row], beta[row])


@settings(max_examples=200, deadline=None)
@given(weight=st.floats(80e3, 160e3))
def test_torques_and_decay_are_linear_between_rows(weight):
    law = ROWS.at(weight)
    for found, values in [
        (law.a1 * weight, [a * w for a, w in zip(ROWS.a1, ROWS.weight, strict=True)]),
        (law.a2 * weight, [a * w for a, w in zip(ROWS.a2, ROWS.weight, strict=True)]),
        (law.beta, ROWS.beta),
    ]:
        assert found == pytest.approx(np.interp(weight, ROWS.weight, values), rel=1e-12)


def test_halfway_by_hand():
    law = ROWS.at(130e3)
    assert law.a1 * 130e3 == pytest.approx((0.029 * 120e3 + 0.026 * 140e3) / 2)
    assert law.a2 * 130e3 == pytest.approx((9480 + 11900) / 2)
    assert law.beta == pytest.approx(0.0975)


@pytest.mark.parametrize("row", range(5))
def test_coefficients_are_continuous_at_the_rows(row):
    weight = ROWS.weight[row]
    for side in (-1.0, 1.0):
        beside = ROWS.at(weight * (1 + side * 1e-12))
        assert tuple(beside) == pytest.approx(tuple(ROWS.at(weight)), rel=1e-9)


@settings(max_examples=50, deadline=None)
@given(weight=st.floats(0.0, 80e3))
def test_below_the_first_row_its_coefficients_hold(weight):
    assert ROWS.at(weight) == (0.037, 0.057, 0.082)


@settings(max_examples=50, deadline=None)
@given(weight=st.floats(160e3, 400e3))
def test_above_the_last_row_its_segment_goes_on(weight):
    law = ROWS.at(weight)
    share = (weight - 140e3) / 20e3
    assert law.a1 * weight == pytest.approx(3640 + share * (4000 - 3640), rel=1e-12)
    assert law.a2 * weight == pytest.approx(11900 + share * (14240 - 11900), rel=1e-12)
    assert law.beta == pytest.approx(0.098 + share * 0.001, rel=1e-12)


@pytest.mark.parametrize(
    ("kilonewton", "inside"), [(79.999, False), (80, True), (123, True), (160, True), (161, False)]
)
def test_what_the_table_covers(kilonewton, inside):
    assert ROWS.covers(kilonewton * 1e3) is inside


def test_design_extrapolates_when_told_to():
    law = design_at(200, **{"bit_rock.outside_table": "extrapolate"}).bit_rock
    assert law == ROWS.at(200e3)


def test_factors_multiply_the_table():
    factors = {"bit_rock.a1_factor": 0.9, "bit_rock.a2_factor": 1.1, "bit_rock.beta_factor": 2.0}
    plain, scaled = design_at(130).bit_rock, design_at(130, **factors).bit_rock
    assert scaled == (plain.a1 * 0.9, plain.a2 * 1.1, plain.beta * 2.0)


# The form with a bit radius


@settings(max_examples=50, deadline=None)
@given(speed=st.floats(0.0, 40.0), weight=st.floats(1.0, 200.0), reference=st.floats(0.1, 5.0))
def test_bit_radius_form_is_its_formula(speed, weight, reference):
    design = drillctl.load(
        "navarro-lopez-2dof",
        **{
            "operating_point.weight_on_bit": f"{weight!r} kN",
            "bit_rock.reference_speed": f"{reference!r} rad/s",
        },
    )
    newton = design.tables.operating_point.weight_on_bit
    torque, slope = design.bit_rock.torque_and_slope(newton, speed, math.exp)
    decay = math.exp(-0.9 * speed / reference)
    friction = 0.5 + (0.8 - 0.5) * decay
    assert torque == pytest.approx(newton * 0.155575 * friction, rel=1e-12)
    fall = newton * 0.155575 * 0.3 * 0.9 / reference * decay
    assert slope == pytest.approx(-fall, rel=1e-11)
    assert design.bit_rock.static_torque(newton) == pytest.approx(newton * 0.155575 * 0.8)


def test_constant_torque_that_sustains_5_005_rad_per_s():
    # 10 kN m at 97 347 N balances friction and damping at 5.005 rad/s.
    design = drillctl.load("navarro-lopez-2dof")
    torque, _ = design.bit_rock.torque_and_slope(97347.0, 5.005, math.exp)
    assert torque + (425.0 + 50.0) * 5.005 == pytest.approx(10e3, abs=2.0)
