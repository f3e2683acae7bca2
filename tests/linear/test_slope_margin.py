"""Friction-slope margin against eigenvalues of the closed loop and closed forms."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

import drillctl
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.loop_model import with_slope
from drillctl.linear.operating_point import operating_point
from drillctl.linear.slope_margin import crossings, slope_margin, slope_margins
from drillctl.linear.state_space import closed_loop_matrices
from drillctl.rig.drillstring import Section, assemble
from drillctl.rig.drillstring.frequencies import natural_frequencies

HOLDS = {
    "slope margin D*": "eigenvalue crossing by bisection: 1e-8 for low modes (30, 100, 400 "
    "elements), 1e-4 for high ones; Hurwitz",
}

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"
SLOPE = 290.075


def string_of(elements=30, **values):
    return drillctl.load(DESIGN, **{f"{PIPE}.elements": elements, **values}).string


def low_mode_limit(string):
    """Angular frequency (rad/s) between the fifth and the sixth elastic mode."""
    free = natural_frequencies(string.parts, "finite-elements", 7)
    return 0.5 * (free[5] + free[6]) if len(free) > 6 else math.inf


class Loop:
    """Poles of the closed loop with a falling slope at the bit, densely."""

    def __init__(self, string, kp, ki, fastest=math.inf):
        self.a, b, c, _ = closed_loop_matrices(string, kp, ki)
        self.bit = np.outer(b[:, 1], c[1])
        self.fastest = fastest

    def rightmost(self, slope):
        """The pole of largest real part, no faster than `fastest`; in the upper half plane."""
        poles = np.linalg.eigvals(self.a - slope * self.bit)
        poles = poles[(poles.imag >= 0.0) & (poles.imag < self.fastest)]
        return poles[np.argmax(poles.real)]

    def margin(self, upper=1600.0, steps=12):
        """The first slope at which a pole reaches the axis, and the pole."""

        def growth(slope):
            return self.rightmost(slope).real

        grid = np.linspace(0.0, upper, steps + 1)[1:]
        low = 1e-6 * upper
        assert growth(low) < 0.0
        for high in grid:
            if growth(high) > 0.0:
                # Brackets by bisection alone: the growth has kinks where poles take turns.
                for _ in range(4):
                    middle = 0.5 * (low + high)
                    low, high = (low, middle) if growth(middle) > 0.0 else (middle, high)
                slope = brentq(growth, low, high, xtol=1e-11 * upper, rtol=1e-13)
                return slope, self.rightmost(slope)
            low = high
        raise AssertionError("stable at any slope")


def low_mode_gains(count, seed):
    """Random gains where the rigid body or one of the first modes decides."""
    rng = np.random.default_rng(seed)
    return [(rng.uniform(620.0, 1000.0), rng.uniform(20.0, 450.0)) for _ in range(count)]


def against_low_poles(string, kp, ki, rtol=1e-8, steps=12):
    limit = low_mode_limit(string)
    found, omega = slope_margin(ends_of(string), kp, ki)
    assert omega < limit, "not a low mode: another case"
    slope, pole = Loop(string, kp, ki, limit).margin(steps=steps)
    assert found == pytest.approx(slope, rel=rtol)
    assert omega == pytest.approx(pole.imag, rel=1e-6, abs=1e-7)


@pytest.mark.parametrize("elements", [10, 30, 60])
def test_linear_region_of_the_gains(elements):
    """861 pairs at 140 kN and 100 rpm: 56 tolerate the slope of the rock."""
    design = drillctl.load(DESIGN, **{f"{PIPE}.elements": elements})
    slope = operating_point(design).slope
    assert slope == pytest.approx(SLOPE, abs=5e-4)
    kp, ki = np.meshgrid(np.linspace(0.0, 1000.0, 41), np.linspace(0.0, 500.0, 21))
    margins = slope_margins(ends_of(design.string), kp, ki)
    assert margins.slope.shape == margins.omega.shape == (21, 41)
    stable = margins.slope > slope
    assert stable.sum() == 56
    assert (kp[stable].min(), kp[stable].max()) == (475.0, 700.0)
    assert (ki[stable].min(), ki[stable].max()) == (50.0, 200.0)


@pytest.mark.parametrize(("kp", "ki"), low_mode_gains(12, seed=11))
def test_low_modes_of_thirty_elements(kp, ki):
    against_low_poles(string_of(), kp, ki)


@pytest.mark.parametrize(("kp", "ki"), low_mode_gains(2, seed=12))
def test_low_modes_of_a_hundred_elements(kp, ki):
    against_low_poles(string_of(100), kp, ki, steps=3)


@pytest.mark.slow
@pytest.mark.parametrize(("kp", "ki"), low_mode_gains(2, seed=13))
def test_low_modes_of_four_hundred_elements(kp, ki):
    """No bisection: one pole pair is on one side, then on the other, of 1e-8 of D*."""
    string = string_of(400)
    limit = low_mode_limit(string)
    slope, omega = slope_margin(ends_of(string), kp, ki)
    assert omega < limit
    loop = Loop(string, kp, ki, limit)
    below, above = loop.rightmost(slope * (1 - 1e-8)), loop.rightmost(slope * (1 + 1e-8))
    assert below.real < 0.0 < above.real
    assert above.imag == pytest.approx(omega, rel=1e-6)
    assert loop.rightmost(0.5 * slope).real < 0.0


@pytest.mark.parametrize("seed", range(6))
def test_high_modes_of_thirty_elements(seed):
    """Their damping is near the rounding of a pole: that knows the margin to 1e-4."""
    rng = np.random.default_rng(100 + seed)
    kp, ki = rng.uniform(150.0, 470.0), rng.uniform(70.0, 140.0)
    string = string_of()
    found, omega = slope_margin(ends_of(string), kp, ki)
    assert omega > low_mode_limit(string)
    slope, pole = Loop(string, kp, ki).margin()
    assert found == pytest.approx(slope, rel=1e-4)
    assert pole.imag > low_mode_limit(string)
    # High modes alone: D = Kp (J_b / J_m)^2.
    assert found == pytest.approx(kp * (394.0 / 500.0) ** 2, rel=2e-3)


DAMPED = {
    "internal": {f"{PIPE}.stiffness_damping": "2 ms"},
    "heavily": {f"{PIPE}.stiffness_damping": "100 ms"},
    "coupling": {f"{PIPE}.damping": "5 N*m*s/rad"},
    "drag": {f"{PIPE}.drag": "0.02 N*s/rad"},
    "to ground": {f"{PIPE}.mass_damping": "0.2 1/s"},
    "ends": {"top_drive.damping": "100 N*m*s/rad", "bha.damping": "30 N*m*s/rad"},
    "modal": {"drillstring.modal_damping": 0.02},
    "modal, coupled": {
        "drillstring.modal_damping": 0.01,
        "bha.damping": "30 N*m*s/rad",
        f"{PIPE}.damping": "3 N*m*s/rad",
    },
}


@pytest.mark.parametrize("name", DAMPED)
@pytest.mark.parametrize(("kp", "ki"), [(625.0, 125.0), (250.0, 40.0), (900.0, 0.0), (80.0, 300.0)])
def test_damped_strings(name, kp, ki):
    string = string_of(20, **DAMPED[name])
    found, omega = slope_margin(ends_of(string), kp, ki)
    slope, pole = Loop(string, kp, ki).margin(upper=3000.0, steps=40)
    low = omega < low_mode_limit(string)
    assert found == pytest.approx(slope, rel=1e-8 if low else 1e-4)
    if low:
        assert omega == pytest.approx(pole.imag, rel=1e-6, abs=1e-6)
    both = slope_margins(ends_of(string), kp, ki)
    assert both.slope == pytest.approx(found, rel=1e-4)


@pytest.mark.parametrize("name", ["two sections", "four inertias"])
@pytest.mark.parametrize(("kp", "ki"), [(800.0, 400.0), (3e3, 700.0), (150.0, 2e3), (400.0, 0.0)])
def test_other_strings(name, kp, ki):
    string = {
        "two sections": drillctl.load(
            "aarsnes-shor-well-a", **{f"{PIPE}.stiffness_damping": "2 ms"}
        ),
        "four inertias": drillctl.load("navarro-lopez-4dof"),
    }[name].string
    found, omega = slope_margin(ends_of(string), kp, ki)
    slope, pole = Loop(string, kp, ki).margin(upper=12 * max(found, 1.0), steps=120)
    assert found == pytest.approx(slope, rel=1e-7)
    assert omega == pytest.approx(pole.imag, rel=1e-6, abs=1e-6)


def test_poles_lie_on_the_axis_at_every_crossing():
    string = string_of(20, **DAMPED["internal"])
    found = crossings(ends_of(string), 625.0, 125.0)
    assert len(found.slope) >= 3
    assert (np.diff(found.slope) >= 0.0).all()
    loop = Loop(string, 625.0, 125.0)
    for slope, omega in zip(found.slope, found.omega, strict=True):
        poles = np.linalg.eigvals(loop.a - slope * loop.bit)
        assert np.abs(poles - 1j * omega).min() <= 1e-7 * max(omega, 1.0)


def test_as_many_crossings_as_poles_change_sides():
    """All but one pair of poles cross twice, or never, as the slope grows without end."""
    string = string_of(8, **DAMPED["internal"])
    found = crossings(ends_of(string), 625.0, 125.0)
    loop = Loop(string, 625.0, 125.0)

    def growing(slope):
        return int((np.linalg.eigvals(loop.a - slope * loop.bit).real > 0.0).sum())

    edges = np.concatenate([[0.0], found.slope, [10.0 * found.slope[-1]]])
    counts = [growing(0.5 * (low + high)) for low, high in pairwise(edges)]
    assert counts[0] == 0
    assert (np.abs(np.diff(counts)) == 2).all()


def test_high_mode_limit():
    """Kp = D (J_m / J_b)^2 at Ki 125, from the crossings of fast modes alone."""
    ends = ends_of(string_of())

    def excess(kp):
        found = crossings(ends, kp, 125.0)
        return found.slope[found.omega > 20.0].min() - SLOPE

    limit = brentq(excess, 440.0, 490.0, xtol=1e-6)
    assert limit == pytest.approx(467.14, abs=0.1)
    assert limit != pytest.approx(SLOPE * (500.0 / 394.0) ** 2, abs=1e-4)
    # There the high modes do decide.
    assert slope_margin(ends, limit, 125.0)[0] == pytest.approx(SLOPE, abs=1e-6)


def test_stiffness_proportional_damping_relaxes_the_high_mode_limit(figure):
    """The second mode, near 3.7 rad/s, is then the last to need gain."""
    string = string_of(**{f"{PIPE}.stiffness_damping": "1 ms"})
    ends = ends_of(string)

    def excess(kp):
        found = crossings(ends, kp, 125.0)
        return found.slope[found.omega > 2.0].min() - SLOPE

    def growth(kp):
        poles = np.linalg.eigvals(Loop(string, kp, 125.0).a - SLOPE * Loop(string, kp, 125.0).bit)
        return poles[poles.imag > 2.0].real.max()

    limit = brentq(excess, 300.0, 450.0, xtol=1e-9)
    by_poles = brentq(growth, 300.0, 450.0, xtol=1e-9)
    assert limit == pytest.approx(by_poles, rel=1e-8)
    figure("limit of Kp by the slope margin against poles, relative", abs(limit / by_poles - 1.0))
    assert 350.0 < limit < 380.0


def test_largest_margin():
    """At (600, 112) it is 369.8; the ridge goes on to 371.7 at (599, 115.5)."""
    ends = ends_of(string_of())
    assert slope_margin(ends, 600.0, 112.0)[0] == pytest.approx(369.8, abs=0.051)
    kp, ki = np.meshgrid(np.arange(0.0, 1001.0, 20.0), np.arange(0.0, 501.0, 10.0))
    found = slope_margins(ends, kp, ki).slope
    best = np.unravel_index(np.argmax(found), found.shape)
    assert (kp[best], ki[best]) == (pytest.approx(600.0, abs=20.1), pytest.approx(112.0, abs=10.1))
    kp, ki = np.meshgrid(np.arange(560.0, 641.0, 1.0), np.arange(90.0, 135.0, 0.5))
    found = slope_margins(ends, kp, ki).slope
    best = np.unravel_index(np.argmax(found), found.shape)
    assert found[best] == pytest.approx(371.74, abs=0.05)
    assert (kp[best], ki[best]) == (pytest.approx(599.0, abs=2.1), pytest.approx(115.5, abs=1.1))
    loop = Loop(string_of(), kp[best], ki[best])
    assert loop.rightmost(371.0).real < 0.0 < loop.rightmost(372.5).real


def sampled(string, seed, count, model):
    rng = np.random.default_rng(seed)
    kp, ki = rng.uniform(0.0, 1000.0, count), rng.uniform(0.0, 500.0, count)
    ki[::20] = 0.0
    ends = ends_of(string, model)
    found = slope_margins(ends, kp.reshape(2, -1), ki.reshape(2, -1))
    assert found.slope.shape == (2, count // 2)
    one = np.array([slope_margin(ends, *pair)[0] for pair in zip(kp, ki, strict=True)])
    return found.slope.ravel(), one


@pytest.mark.parametrize(
    ("values", "model"),
    [
        ({}, "finite-elements"),
        ({}, "wave"),
        (DAMPED["internal"], "finite-elements"),
        (DAMPED["ends"], "finite-elements"),
        (DAMPED["modal"], "finite-elements"),
    ],
)
def test_maps_are_the_scalar_margin(values, model):
    plain = not values and model == "finite-elements"
    found, one = sampled(string_of(**values), 6, 200 if plain else 60, model)
    np.testing.assert_allclose(found, one, rtol=1e-4)
    # The scalar looks at every crossing, the map at a few.
    assert (found >= one * (1.0 - 1e-9)).all()


def test_maps_where_a_low_mode_and_the_high_modes_meet():
    ends = ends_of(string_of())
    one, omega = slope_margin(ends, 400.0, 160.5534)
    assert omega < 1.0
    assert slope_margins(ends, 400.0, 160.5534).slope == pytest.approx(one, rel=1e-4)


def test_maps_of_gains_far_apart():
    rng = np.random.default_rng(8)
    kp, ki = 10 ** rng.uniform(0, 5, 60), 10 ** rng.uniform(-1, 5, 60)
    for string in (string_of(), drillctl.load("navarro-lopez-4dof").string):
        ends = ends_of(string)
        one = [slope_margin(ends, *pair)[0] for pair in zip(kp, ki, strict=True)]
        np.testing.assert_allclose(slope_margins(ends, kp, ki).slope, one, rtol=1e-4)


def test_maps_broadcast_and_do_not_depend_on_their_neighbours():
    ends = ends_of(string_of())
    kp, ki = np.linspace(50.0, 1000.0, 30), np.linspace(0.0, 500.0, 20)
    whole = slope_margins(ends, kp[:, None], ki)
    assert whole.slope.shape == (30, 20)
    part = slope_margins(ends, kp[7], ki)
    np.testing.assert_allclose(part.slope, whole.slope[7], rtol=1e-12)
    np.testing.assert_allclose(part.omega, whole.omega[7], rtol=1e-9)


@pytest.mark.parametrize("model", ["finite-elements", "wave"])
@pytest.mark.parametrize("ki", [0.0, 0.01, 80.0, 500.0, 1e4])
def test_nothing_damps_an_undamped_string_without_proportional_gain(model, ki):
    string = string_of()
    assert slope_margin(ends_of(string, model), 0.0, ki)[0] == 0.0


def test_maps_as_well_give_exactly_zero_there():
    ki = 10 ** np.random.default_rng(0).uniform(-3, 5, 200)
    for model in ("finite-elements", "wave"):
        assert not slope_margins(ends_of(string_of(), model), 0.0, ki).slope.any()


def test_a_damper_alone_gives_a_margin_without_gains():
    assert slope_margin(ends_of(string_of(**DAMPED["internal"])), 0.0, 0.0) == (0.0, 0.0)
    found, omega = slope_margin(ends_of(string_of(**DAMPED["drag"])), 0.0, 0.0)
    assert found > 0.0
    assert found == pytest.approx(Loop(string_of(**DAMPED["drag"]), 0, 0).margin(500, 20)[0])
    assert omega > 0.0 or found == pytest.approx(0.02 * 3000.0)


def test_without_integral_action_the_whole_string_may_run_away():
    """A real pole: D = Kp and all damping to ground, at frequency zero."""
    string = string_of(
        **{f"{PIPE}.stiffness_damping": "0.3 s", f"{PIPE}.drag": "0.01 N*s/rad"},
        **{"bha.damping": "5 N*m*s/rad", "top_drive.damping": "9 N*m*s/rad"},
    )
    lowest = next(zip(*crossings(ends_of(string), 60.0, 0.0), strict=True))
    for slope, omega in (slope_margin(ends_of(string), 60.0, 0.0), lowest):
        assert slope == pytest.approx(60.0 + 0.01 * 3000.0 + 5.0 + 9.0, rel=1e-12)
        assert omega == 0.0
    both = slope_margins(ends_of(string), [60.0, 30.0], 0.0)
    np.testing.assert_allclose(both.slope, [104.0, 74.0], rtol=1e-12)
    np.testing.assert_array_equal(both.omega, 0.0)
    assert Loop(string, 60.0, 0.0).margin()[0] == pytest.approx(104.0, rel=1e-9)


def test_a_little_integral_action_changes_little():
    string = string_of(**{f"{PIPE}.stiffness_damping": "0.1 s"})
    for ki in (1e-6, 1e-4, 1e-2):
        slope, omega = slope_margin(ends_of(string), 10.0, ki)
        assert slope == pytest.approx(10.0, rel=1e-3)
        assert omega == pytest.approx(math.sqrt(ki / string.mass.sum()), rel=1e-2)


@pytest.mark.parametrize("ki", [1e-8, 1e-12])
def test_least_integral_action(ki):
    string = string_of(**{f"{PIPE}.stiffness_damping": "0.1 s"})
    assert slope_margin(ends_of(string), 10.0, ki)[0] == pytest.approx(10.0, rel=1e-3)


def test_least_integral_action_and_no_other_crossing():
    string = assemble((Section("spring", 1, 100.0, coupling_damping=1e4),), 10.0, 10.0)
    assert slope_margin(ends_of(string), 5.0, 1e-9)[0] == pytest.approx(5.0, rel=1e-3)


def two_inertias(kp):
    """Where a2 a1 = a3 a0 in the cubic of the 2-DOF string, and the frequency there."""
    j, jb, k, c, cr, cb = 2122.0, 471.9698, 861.5336, 172.3067, 425.0 + kp, 50.0

    def cubic(slope):
        lower = c + cb - slope
        return (
            j * jb,
            j * lower + jb * (c + cr),
            k * (j + jb) + (c + cr) * lower - c**2,
            k * (cr + cb - slope),
        )

    def hurwitz(slope):
        a3, a2, a1, a0 = cubic(slope)
        return a2 * a1 - a3 * a0

    slope = brentq(hurwitz, 0.0, cr + cb, xtol=1e-13, rtol=1e-14)
    a3, _, a1, _ = cubic(slope)
    return slope, math.sqrt(a1 / a3)


@pytest.mark.parametrize("kp", [0.0, 40.0, 600.0])
@pytest.mark.parametrize("model", ["finite-elements", "wave"])
def test_two_inertias_at_constant_torque_by_hand(model, kp):
    ends = ends_of(drillctl.load("navarro-lopez-2dof").string, model)
    slope, omega = two_inertias(kp)
    found = slope_margin(ends, kp, 0.0)
    assert found == pytest.approx((slope, omega), rel=1e-11)
    both = slope_margins(ends, kp, 0.0)
    assert (both.slope, both.omega) == (pytest.approx(slope), pytest.approx(omega))


def quartic(slope, kp, ki, j=500.0, jb=394.0, k=300.0):
    """Of two undamped inertias: (J s^2 + Kp s + Ki + k)(J_b s^2 - D s + k) - k^2."""
    return (
        j * jb,
        kp * jb - slope * j,
        (ki + k) * jb + k * j - kp * slope,
        k * kp - slope * (ki + k),
        ki * k,
    )


def hurwitz(slope, kp, ki):
    a4, a3, a2, a1, a0 = quartic(slope, kp, ki)
    return a3 * a2 * a1 - a4 * a1**2 - a3**2 * a0


def test_two_undamped_inertias_under_pi_by_hand():
    ends = ends_of(assemble((Section("spring", 1, 300.0),), 500.0, 394.0))
    for kp, ki in ((200.0, 30.0), (625.0, 125.0), (50.0, 300.0)):
        grid = np.linspace(0.0, 2.0 * kp, 4001)
        values = np.array([hurwitz(x, kp, ki) for x in grid])
        first = np.flatnonzero(values[:-1] * values[1:] < 0.0)[0]
        slope = brentq(hurwitz, grid[first], grid[first + 1], args=(kp, ki), xtol=1e-12)
        _, a3, _, a1, _ = quartic(slope, kp, ki)
        found = slope_margin(ends, kp, ki)
        assert found == pytest.approx((slope, math.sqrt(a1 / a3)), rel=1e-9)


@pytest.mark.parametrize(("kp", "ki"), [(625.0, 125.0), (700.0, 60.0), (900.0, 400.0)])
def test_continuum_is_the_limit_of_elements_with_order_two(kp, ki):
    exact = slope_margin(ends_of(string_of(), "wave"), kp, ki)
    errors = []
    for elements in (25, 50, 100, 200, 400):
        found = slope_margin(ends_of(string_of(elements)), kp, ki)
        assert found[1] < low_mode_limit(string_of(elements))
        errors.append(np.abs(np.array(found) / exact - 1.0))
    orders = -np.diff(np.log2(errors), axis=0)
    np.testing.assert_allclose(orders, 2.0, atol=0.15)


def test_continuum_where_high_modes_decide():
    """Their common limit Kp (J_b / J_m)^2, approached from above as modes go up."""
    found, omega = slope_margin(ends_of(string_of(), "wave"), 300.0, 125.0)
    assert omega > 60.0
    assert found == pytest.approx(300.0 * (394.0 / 500.0) ** 2, rel=1e-4)


@pytest.mark.parametrize(
    "string",
    [
        assemble((Section("pipe", 1, 315.0, inertia=280.0),), 500.0, 394.0),
        assemble((Section("pipe", 6, 315.0, inertia=280.0),), 500.0, 4e4),
        assemble((Section("pipe", 6, 315.0, inertia=280.0),), 500.0, 0.0),
        assemble((Section("pipe", 6, 315.0, inertia=280.0),), 0.0, 394.0),
        assemble(
            (
                Section("swivel", 1, 1e4, end_inertia=20.0, coupling_damping=40.0),
                Section("pipe", 7, 400.0, inertia=200.0, stiffness_damping=2e-3),
                Section("tool", 1, 5e3, end_inertia=50.0),
                Section("collar", 2, 2e4, inertia=40.0, stiffness_damping=1e-3),
            ),
            500.0,
            150.0,
        ),
    ],
    ids=["one element", "heavy bit", "no bit inertia", "no top inertia", "mixed"],
)
def test_extreme_strings(string):
    rng = np.random.default_rng(21)
    for kp, ki in zip(10 ** rng.uniform(1, 4, 6), 10 ** rng.uniform(0, 4, 6), strict=True):
        found, _ = slope_margin(ends_of(string), kp, ki)
        loop = Loop(string, kp, ki)
        # Rounding of a pole, 1e-13 of the fastest, over its speed in the slope.
        assert loop.rightmost(0.999 * found).real < 0.0 < loop.rightmost(1.001 * found).real
        for share in (0.1, 0.3, 0.6, 0.9):
            assert loop.rightmost(share * found).real < 0.0
        assert slope_margins(ends_of(string), kp, ki).slope == pytest.approx(found, rel=1e-4)


def test_maps_of_a_continuum_without_bit_inertia():
    ends = ends_of(assemble((Section("pipe", 30, 315.0, inertia=280.0),), 500.0, 0.0), "wave")
    one, _ = slope_margin(ends, 1.7e5, 0.33)
    assert slope_margins(ends, 1.7e5, 0.33).slope == pytest.approx(one, rel=1e-4)


def test_the_bits_own_damper_is_all_that_an_undamped_string_tolerates():
    string = string_of(**{"bha.damping": "180 N*m*s/rad"})
    for model in ("finite-elements", "wave", "matrices"):
        assert slope_margin(ends_of(string, model), 0.0, 100.0)[0] == 180.0
    assert np.all(slope_margins(ends_of(string), 0.0, [0.0, 50.0, 100.0]).slope == 180.0)
    for slope, stable in ((178.0, True), (182.0, False)):
        poles = np.linalg.eigvals(with_slope(closed_loop_matrices(string, 0.0, 100.0), slope).a)
        assert (poles.real.max() < 0.0) == stable


@pytest.mark.parametrize("gains", [(-1.0, 5.0), (5.0, -1.0), (float("nan"), 5.0)])
def test_gains_that_feed_energy_are_refused(gains):
    for function in (slope_margin, slope_margins):
        with pytest.raises(InputError, match="gains of 0 or more"):
            function(ends_of(string_of()), *gains)
