"""String as data, pairs of symbols, numbers of drives, crossings, each by its definition."""

import casadi as ca
import numpy as np
import pytest

import drillctl
from drillctl.linear.ends import ends_of
from drillctl.linear.loop_analysis import tolerated_slope
from drillctl.linear.slope_margin import slope_margin
from drillctl.studies.tune.linear_design import circle_data, constants_of, point_functions
from drillctl.studies.tune.loops import (
    TERMS,
    WITHIN,
    Pair,
    chain,
    circles,
    crossings_of,
    least_seen,
    loops_of,
    pair,
    slope_margin_of,
)
from drillctl.studies.tune.tuned import (
    by_path,
    drive_numbers,
    put,
    spread,
    string_numbers,
    tuned_parameters,
)

HOLDS = {
    "linear design": "maps and grids of the slope margin, figures of `drillctl.loop`; derivatives "
    "of D* against differences",
}

PAPER = "monteiro-trindade-140kn"
DAMPED = {"drillstring.sections.pipe.stiffness_damping": "1 ms"}
LAGS = {
    "controller.drive.lag": "20 ms", "controller.drive.encoder_lag": "5 ms",
    "controller.drive.torque_lag": "5 ms",
}  # fmt: skip
MOVING = {
    "weight_on_bit.law": "navarro-lopez-suarez",
    "weight_on_bit.gain": "2 kN*s/rad",
    "weight_on_bit.path.delay": "0.3 s",
    "weight_on_bit.path.hoist_lag": "0.5 s",
}


def of_law(law, **more):
    return drillctl.load(PAPER, **({"controller.law": law} if law != "pi" else {}), **more)


def test_pairs_are_complex_numbers():
    z, w = 0.3 - 1.2j, -0.7 + 0.4j
    a, b = pair(z), pair(w)

    def number(p):
        return complex(float(p.re), float(p.im))

    both = {
        a + b: z + w, a - b: z - w, a * b: z * w, a / b: z / w, -a: -z, 2.0 - a: 2.0 - z,
        3.0 / a: 3.0 / z, a + np.float64(1.5): z + 1.5, np.float64(1.5) * a: 1.5 * z,
        np.exp(-a): np.exp(-z), a.conjugate(): z.conjugate(),
    }  # fmt: skip
    for found, expected in both.items():
        assert number(found) == pytest.approx(expected, rel=1e-14)
    assert float(a.square) == pytest.approx(abs(z) ** 2)
    x = ca.SX.sym("x")
    assert isinstance(x * a, Pair)


@pytest.mark.parametrize("more", [{}, DAMPED, {"drillstring.modal_damping": 0.01}])
def test_a_string_as_data_is_the_string(more):
    ends = ends_of(of_law("pi", **more).string)
    omega = np.array([1e-3, 0.4, 3.7, 31.0])
    drive = 625 - 125j / omega
    over, under = chain(ends, 1j * omega).bit(drive)
    np.testing.assert_allclose(over / under, ends.bit_impedance(1j * omega, drive), rtol=1e-10)
    known = chain(ends, 1j * omega)
    top = (known.alpha - 290.0 * known.gamma) / (known.beta - 290.0 * known.delta)
    np.testing.assert_allclose(top, ends.top_impedance(1j * omega, -290.0 + 0j), rtol=1e-9)
    for circle in circles(ends, 1j * omega):
        for u in (WITHIN, -WITHIN * 1j, WITHIN * (0.6 + 0.8j)):
            exact = chain(ends, np.array([circle.centre + circle.radius * u]))
            series = circle.terms @ u ** np.arange(TERMS)
            np.testing.assert_allclose(series, np.concatenate(exact), rtol=3e-9)


@pytest.mark.parametrize(
    "law",
    ["pi", "stiff-speed", "soft-torque", "z-torque", "torsional-rectification", "active-damping",
     "constant-torque"],
)  # fmt: skip
def test_numbers_of_drives_are_those_of_designs(law):
    more = {"controller.torque": "7 kN*m"} if law == "constant-torque" else LAGS
    if law == "pi":
        more = {}
    design = of_law(law, **more)
    tuned = tuned_parameters(design)
    for values in spread(tuned, 3):
        numbers = drive_numbers(design, by_path(tuned, values), string_numbers(design.string))
        law_of_design = put(design, tuned, values).top_drive
        shared = [key for key in numbers if key in law_of_design._fields]
        assert shared
        for key in shared:
            assert numbers[key] == pytest.approx(getattr(law_of_design, key), rel=1e-13)


@pytest.mark.parametrize(
    ("law", "more"),
    [("pi", {}), ("pi", MOVING), ("soft-torque", DAMPED), ("z-torque", DAMPED),
     ("z-torque", LAGS | DAMPED), ("active-damping", LAGS | DAMPED),
     ("torsional-rectification", DAMPED)],
)  # fmt: skip
def test_crossings_give_the_slope_margin(law, more):
    design = of_law(law, **more)
    tuned = tuned_parameters(design)
    (loop,) = loops_of([design], tuned)
    seen = 0
    for values in spread(tuned, 6):
        variant = put(design, tuned, values)
        expected, _ = tolerated_slope(variant, variant.speed)
        if np.isnan(expected):  # without slope the loop is not stable
            continue
        seen += 1
        named = by_path(tuned, values)
        found = crossings_of(loop, named)
        # Of an undamped string the lowest of many high modes is not always refined.
        assert slope_margin_of(found) == pytest.approx(expected, rel=1e-8 if more else 2e-4)
        assert least_seen(loop, named) == pytest.approx(expected, rel=0.05)
    assert seen >= 1


def test_derivatives_of_a_crossing_are_exact():
    """Of its slope over the gains, the frequency following: against differences of D*."""
    design = of_law("pi")
    tuned = tuned_parameters(design)
    (loop,) = loops_of([design], tuned)
    gains = np.array([625.0, 125.0])
    crossing = crossings_of(loop, by_path(tuned, gains))[0]
    p, u = ca.MX.sym("p", 2), ca.MX.sym("u")
    function = point_functions(loop, tuned).crossing
    slope, imaginary = function(p, constants_of(loop), circle_data(crossing.circle), u)
    moves = -ca.jacobian(imaginary, p) / ca.jacobian(imaginary, u)
    whole = ca.Function("whole", [p, u], [ca.jacobian(slope, p) + ca.jacobian(slope, u) * moves])
    at = (crossing.omega - crossing.circle.centre.imag) / crossing.circle.radius
    found = np.asarray(whole(gains, at)).ravel()
    ends = ends_of(design.string)
    h = 1e-3
    for k in range(2):
        step = h * np.eye(2)[k]
        difference = slope_margin(ends, *(gains + step))[0] - slope_margin(ends, *(gains - step))[0]
        assert found[k] == pytest.approx(difference / (2 * h), rel=1e-6)
