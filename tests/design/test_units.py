"""Quantities: text with a unit in, SI numbers out, and back to the same bits."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import drillctl
from drillctl import units
from drillctl.errors import InputError

KINDS = [value for value in vars(units).values() if isinstance(value, units.Kind)]
RPM = 2 * math.pi / 60


def bits(value):
    return struct.pack("<d", value)


@pytest.mark.parametrize(
    ("text", "kind", "si"),
    [
        ("4 1/2 in", units.DIAMETER, 0.1143),
        ("4-1/2 in", units.DIAMETER, 0.1143),
        ("  4 1/2in ", units.DIAMETER, 0.1143),
        ("5 in", units.DIAMETER, 0.127),
        ("1/2 in", units.DIAMETER, 0.0127),
        ("13 3/8 in", units.DIAMETER, 0.339725),
        ("127 mm", units.DIAMETER, 0.127),
        ("9842.5 ft", units.LENGTH, 2999.994),
        ("-3 m", units.LENGTH, -3.0),
        ("+3 m", units.LENGTH, 3.0),
        ("-4 1/2 in", units.DIAMETER, -0.1143),
        (".5 m", units.LENGTH, 0.5),
        ("140 kN", units.FORCE, 140e3),
        ("1.4e5 N", units.FORCE, 140e3),
        ("1.4E+2 kN", units.FORCE, 140e3),
        ("14e-2 MN", units.FORCE, 140e3),
        ("20 klbf", units.FORCE, 20e3 * 4.4482216152605),
        ("14 tf", units.FORCE, 14e3 * 9.80665),
        ("100 rpm", units.SPEED, 100 * RPM),
        ("100 rev/min", units.SPEED, 100 * RPM),
        ("10 rad/s", units.SPEED, 10.0),
        ("180 deg/s", units.SPEED, math.pi),
        ("10 kN*m", units.TORQUE, 10e3),
        ("10 klbf*ft", units.TORQUE, 10e3 * 4.4482216152605 * 0.3048),
        ("20 ms", units.TIME, 0.02),
        ("2 min", units.TIME, 120.0),
        ("7850 kg/m3", units.DENSITY, 7850.0),
        ("7850 kg/m^3", units.DENSITY, 7850.0),
        ("7.85 g/cm^3", units.DENSITY, 7850.0),
        ("500 kg*m2", units.INERTIA, 500.0),
        ("500 kg*m^2", units.INERTIA, 500.0),
        ("1 in4", units.POLAR_MOMENT, 0.0254**4),
        ("8.494e-5 m^4", units.POLAR_MOMENT, 8.494e-5),
        ("79.6 GPa", units.MODULUS, 79.6e9),
        ("11.5e6 psi", units.MODULUS, 11.5e6 * 6894.757293168361),
        ("200 N*m*s", units.PROPORTIONAL_GAIN, 200.0),
        ("200 N*m*s/rad", units.DAMPING, 200.0),
        ("100 N*m", units.INTEGRAL_GAIN, 100.0),
        ("0.2 1/s", units.RATE, 0.2),
        ("0.1 s/rad", units.SLOWNESS, 0.1),
        ("20 klb", units.FORCE, 20e3 * 4.4482216152605),
        ("12 t", units.FORCE, 12e3 * 9.80665),
        ("12 tonf", units.FORCE, 12e3 * 9.80665),
        ("10 kft-lb", units.TORQUE, 10e3 * 4.4482216152605 * 0.3048),
        ("10 kft-lbf", units.TORQUE, 10e3 * 4.4482216152605 * 0.3048),
        ("10 ft-lbf", units.TORQUE, 10 * 4.4482216152605 * 0.3048),
        ("10 lbf-ft", units.TORQUE, 10 * 4.4482216152605 * 0.3048),
        ("10 kNm", units.TORQUE, 10e3),
        ('5 7/8"', units.DIAMETER, 5.875 * 0.0254),
        ("13360'", units.LENGTH, 13360 * 0.3048),
        ("10 ppg", units.DENSITY, 10 * 0.45359237 / 0.003785411784),
        ("1.2 sg", units.DENSITY, 1200.0),
        ("20 cP", units.VISCOSITY, 0.02),
        ("16.6 lb/ft", units.LINEAR_MASS, 16.6 * 0.45359237 / 0.3048),
        ("16.6 ppf", units.LINEAR_MASS, 16.6 * 0.45359237 / 0.3048),
        ("100 RPM", units.SPEED, 100 * RPM),
        ("140 KN", units.FORCE, 140e3),
        ("800 KW", units.POWER, 800e3),
        ("30K lbs", units.FORCE, 30e3 * 4.4482216152605),
        ("13 tonnes", units.FORCE, 13e3 * 9.80665),
        ("12 kip-ft", units.TORQUE, 12e3 * 4.4482216152605 * 0.3048),
        ("12 k ft-lb", units.TORQUE, 12e3 * 4.4482216152605 * 0.3048),
        ("900 ft.lbs", units.TORQUE, 900 * 4.4482216152605 * 0.3048),
        ("12 daN.m", units.TORQUE, 120.0),
        ("1200 kgf-m", units.TORQUE, 1200 * 9.80665),
        ("5½ in", units.DIAMETER, 5.5 * 0.0254),
        ("12¼”", units.DIAMETER, 12.25 * 0.0254),
        ("171,45 mm", units.DIAMETER, 0.17145),
        ("9,842.5 ft", units.LENGTH, 9842.5 * 0.3048),
        ("4 500 m", units.LENGTH, 4500.0),
        ("75 pcf", units.DENSITY, 75 * 0.45359237 / 0.3048**3),
        ("20 fph", units.VELOCITY, 20 * 0.3048 / 3600),
        ("23 kgm2", units.INERTIA, 23.0),
        ("23 kg-m²", units.INERTIA, 23.0),
        ("68800 lb-ft²", units.INERTIA, 68800 * 0.45359237 * 0.3048**2),
        ("2140 lbf-ft-s2", units.INERTIA, 2140 * 4.4482216152605 * 0.3048),
        ("900 in-lbs", units.TORQUE, 900 * 4.4482216152605 * 0.0254),
        ("12 kftlbs", units.TORQUE, 12e3 * 4.4482216152605 * 0.3048),
        ("900 lb\u00b7ft", units.TORQUE, 900 * 4.4482216152605 * 0.3048),
        ("1.2 t\u00a0m", units.TORQUE, 1200 * 9.80665),
        ("15 mT", units.FORCE, 15e3 * 9.80665),
        ("15 kdaN", units.FORCE, 150e3),
        ("625 Nms", units.PROPORTIONAL_GAIN, 625.0),
        ("625 Nm/(rad/s)", units.PROPORTIONAL_GAIN, 625.0),
        ("50 ft-lbf/rpm", units.PROPORTIONAL_GAIN, 50 * 4.4482216152605 * 0.3048 / RPM),
        ("1 kNms/rad", units.DAMPING, 1000.0),
        ("125 Nm/rad", units.INTEGRAL_GAIN, 125.0),
        ("310 ft-lbf/rad", units.STIFFNESS, 310 * 4.4482216152605 * 0.3048),
        ("30 kNm/s", units.TORQUE_RATE, 30e3),
        ("20 kft-lbf/s", units.TORQUE_RATE, 20e3 * 4.4482216152605 * 0.3048),
        ("5 klbs/s", units.FORCE_RATE, 5e3 * 4.4482216152605),
        ("2 t/s", units.FORCE_RATE, 2e3 * 9.80665),
        ("1100 lbs", units.MASS, 1100 * 0.45359237),
        ("21.9 lbs per ft", units.LINEAR_MASS, 21.9 * 0.45359237 / 0.3048),
        ("120 r.p.m.", units.SPEED, 120 * RPM),
        ("120 U/min", units.SPEED, 120 * RPM),
        ("1.25 S.G.", units.MUD, 1250.0),
        ("4.500,5 m", units.LENGTH, 4500.5),
        ("4’500 m", units.LENGTH, 4500.0),
        ("31’6½”", units.LENGTH, 31.5 * 0.3048 + 0.0127),
        ("9 5⁄8 in", units.DIAMETER, 9.625 * 0.0254),
    ],
)
def test_text_is_read_in_its_unit(text, kind, si):
    assert units.parse(text, kind) == pytest.approx(si, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "si", "field"),
    [
        ("Kp 200 N*m*s/rad", "Kp 200 N m s", "Kp 0.015447 klbf ft/rpm"),
        ("at 140000 N, 12.5 rad/s", "at 140 kN, 119.37 rpm", "at 31.473 klbf, 119.37 rpm"),
        ("3000 m of pipe, 33 s", "3000 m of pipe, 33 s", "9842.5 ft of pipe, 33 s"),
        ("pipe-2 m, 5 min, N 3 mm", "pipe-2 m, 5 min, N 3 mm", "pipe-2 m, 5 min, N 3 mm"),
    ],
)
def test_quantities_in_a_text_are_told_in_the_units_of_the_reader(text, si, field):
    assert (units.told(text, "si"), units.told(text, "field")) == (si, field)


def test_units_that_people_read_are_read_as_well():
    for system in ("si", "field"):
        for si_unit, unit in units._SHOWN[system].items():
            for kind in (kind for kind in KINDS if kind.si == si_unit):
                assert units.parse(f"2 {unit}", kind) == 2.0 * units._KNOWN[si_unit][unit]


def test_a_drillers_fraction_is_not_a_product():
    assert units.parse("4 1/2 in", units.DIAMETER) == 0.1143


@pytest.mark.parametrize("text", ["1.667 Hz", "100 1/min", "1.667 1/s", "100 rps", "10 m/s"])
def test_a_speed_comes_in_four_units_only(text):
    with pytest.raises(InputError) as caught:
        units.parse(text, units.SPEED)
    assert repr(text) in str(caught.value)
    assert "rpm, rev/min, rad/s or deg/s" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "kind", "message"),
    [
        ("13,360 ft", units.LENGTH, "may be 13360 or 13.360"),
        ("20 mph", units.VELOCITY, "two meanings"),
        ("35 Mlbf", units.FORCE, 'thousands of pounds-force, "klbf", or millions'),
        ("13 Ton", units.FORCE, "two meanings"),
        ("1,23,4 m", units.LENGTH, "not a known unit"),
    ],
)
def test_what_may_be_read_in_two_ways_is_refused(text, kind, message):
    with pytest.raises(InputError, match=message):
        units.parse(text, kind)


def test_a_mass_is_no_force():
    with pytest.raises(InputError) as caught:
        units.parse("140 kg", units.FORCE)
    assert str(caught.value) == "'140 kg': 'kg' is not a unit of force; use kN, N, klbf or tf"


@pytest.mark.parametrize(
    ("text", "meanings"), [("20 lb", ("lbf", "0.4536 kg")), ("12 ton", ("tf", "short ton-force"))]
)
def test_a_unit_of_two_meanings_is_refused_with_both(text, meanings):
    with pytest.raises(InputError, match="two meanings") as caught:
        units.parse(text, units.FORCE)
    assert all(meaning in str(caught.value) for meaning in meanings)


@pytest.mark.parametrize("text", ["3 furlongz", "3 m**", "3 $", "3 2 m", "-1/2 in", "3 /m", "3 m)"])
def test_what_is_no_unit_is_refused(text):
    with pytest.raises(InputError, match=r"not a known unit; use m or ft"):
        units.parse(text, units.LENGTH)


@pytest.mark.parametrize(
    ("value", "kind", "suggestion"),
    [
        (100, units.SPEED, '"100 rpm"'),
        (100.0, units.SPEED, '"100 rpm"'),
        ("100", units.SPEED, '"100 rpm"'),
        (140, units.FORCE, '"140 kN"'),
        (0.5, units.TIME, '"0.5 s"'),
        (3000, units.LENGTH, '"3000 m"'),
        ("4 1/2", units.DIAMETER, '"4.5 in"'),
        (5.875, units.DIAMETER, '"5.875 in"'),
        (127, units.DIAMETER, '"127 mm"'),
        (10, units.TORQUE, '"10 kN*m"'),
        (1.25, units.MUD, '"1.25 g/cm^3"'),
        (10.2, units.MUD, '"10.2 lb/gal"'),
        (1234567.25, units.LENGTH, '"1234567.25 m"'),
        (-3, units.LENGTH, '"-3 m"'),
    ],
)
def test_a_bare_number_is_refused_with_the_likely_meaning(value, kind, suggestion):
    with pytest.raises(InputError) as caught:
        units.parse(value, kind)
    number = suggestion.strip('"').split()[0]
    assert str(caught.value) == f"{number} has no unit; did you mean {suggestion}?"


@pytest.mark.parametrize("kind", [units.PROPORTIONAL_GAIN, units.INTEGRAL_GAIN])
def test_gains_may_be_bare(kind):
    assert units.parse(200, kind) == 200.0
    assert units.parse("200", kind) == 200.0
    assert units.parse(-1e-3, kind) == -1e-3


@pytest.mark.parametrize(
    "value", [True, None, [1], {"a": 1}, "", "kN", "ten kN", "1/0 in", 10**400, b"1 m", "nan m"]
)
def test_what_is_no_quantity_is_an_input_error(value):
    with pytest.raises(InputError):
        units.parse(value, units.LENGTH)


@pytest.mark.parametrize("text", ["1" * 5000 + "/3 m", "3 1/" + "7" * 5000 + " m"])
def test_numbers_of_thousands_of_digits_raise_nothing_else(text):
    assert not math.isnan(units.parse(text, units.LENGTH))


@pytest.mark.parametrize(
    "value", [math.nan, math.inf, -math.inf, "nan rpm", "inf rpm", "1e999 rpm"]
)
def test_a_design_takes_finite_numbers_only(value):
    with pytest.raises(InputError, match=r"operating_point\.speed"):
        drillctl.load("monteiro-trindade-140kn", **{"operating_point.speed": value})


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 10**400])
def test_a_gain_is_finite(value):
    with pytest.raises(InputError, match=r"controller\.kp: .* is not a"):
        drillctl.load("monteiro-trindade-140kn", **{"controller.kp": value})


def test_si_numbers_need_no_reading():
    assert units.parse(units.SI(0.1), units.SPEED) == 0.1


@pytest.mark.parametrize(
    ("value", "kind", "text"),
    [
        (100 * units.RPM, units.SPEED, "100 rpm"),
        (140e3, units.FORCE, "140 kN"),
        (0.127, units.DIAMETER, "127 mm"),
        (0.0, units.DAMPING, "0 N*m*s/rad"),
        (np.float64(3000.0), units.LENGTH, "3000 m"),
    ],
)
def test_written_as_people_write_it(value, kind, text):
    assert units.write(value, kind) == text


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: f"{kind.name}-{kind.si}")
@settings(max_examples=150, deadline=None)
@given(value=st.floats(allow_nan=False, allow_infinity=False))
def test_what_is_written_reads_back_to_the_same_bits(kind, value):
    assert bits(units.parse(units.write(value, kind), kind)) == bits(value)


@settings(max_examples=200, deadline=None)
@given(
    value=st.one_of(
        st.text(max_size=12),
        st.builds("{} {}".format, st.floats(), st.text("mkNrads/*^ 0123456789in.e-", max_size=8)),
        st.integers(),
        st.floats(),
    ),
    kind=st.sampled_from(KINDS),
)
def test_any_text_is_a_number_or_an_input_error(value, kind):
    try:
        found = units.parse(value, kind)
    except InputError:
        return
    assert isinstance(found, float)


@pytest.mark.parametrize(
    "unit",
    ["2^9", "9^9^9", "9**9 m", "(9)^9 m", "m^9^99", "9\u2079\u2079\u2079 m", "9^(9^9)", "1e9^9 m"],
)
def test_no_number_is_raised_to_a_power(unit):
    """Some would be computed for hours, in gigabytes."""
    with pytest.raises(InputError, match="not a known unit"):
        units.parse(f"5 {unit}", units.LENGTH)


@pytest.mark.parametrize(
    ("unit", "kind"), [("s^-1", units.RATE), ("s\u207b\u00b9", units.RATE), ("1/s**1", units.RATE),
                       ("kg*(m/s)^2*s\u00b2", units.INERTIA), ("kg m\u00b2", units.INERTIA)],
)  # fmt: skip
def test_units_are_raised_to_powers_however_they_are_written(unit, kind):
    assert units.parse(f"5 {unit}", kind) == pytest.approx(5.0, rel=1e-15)


@pytest.mark.parametrize(
    ("si_unit", "system", "per_unit", "name"),
    [
        ("rad/s", "si", RPM, "rpm"),
        ("N", "si", 1e3, "kN"),
        ("N", "field", 4448.2216152605, "klbf"),
        ("N*m", "field", 4448.2216152605 * 0.3048, "klbf ft"),
        ("m", "si", 1.0, "m"),
        ("m", "field", 0.3048, "ft"),
        ("", "field", 1.0, ""),
    ],
)
def test_numbers_are_shown_in_the_units_people_read(si_unit, system, per_unit, name):
    values = np.array([0.0, 1.0, 250.0])
    shown, unit = units.displayed(values, si_unit, system)
    np.testing.assert_allclose(shown, values / per_unit, rtol=1e-12)
    assert unit == name


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.si)
def test_common_units_are_known_without_pint_and_as_pint_has_them(kind):
    known = units._KNOWN[kind.si]
    assert {*kind.examples, kind.si} <= set(known)
    for unit, factor in known.items():
        assert math.isclose(factor, units._by_pint(unit, unit, kind), rel_tol=2.3e-16)
