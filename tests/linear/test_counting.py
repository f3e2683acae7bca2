"""Natural frequencies by counting: against dense eigenvalues, closed forms, printed values."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import brentq

import drillctl
from drillctl import catalog
from drillctl.rig.drillstring import Section, assemble
from drillctl.rig.drillstring.frequencies import natural_frequencies

HOLDS = {
    "natural frequencies by counting": "dense eigenvalues, closed forms to 1e-10, pairs 1e-9 "
    "apart, 2,000 elements",
}

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"
HELD = list(itertools.product([False, True], repeat=2))

MOMENT = math.pi / 32 * (0.127**4 - 0.1086**4)
ZETA = MOMENT * math.sqrt(79.6e9 * 7850.0)
TRAVEL = 3000.0 * math.sqrt(7850.0 / 79.6e9)
TOP, BIT = 500.0, 394.0


def dense(string, top_held, bit_held):
    kept = slice(1 if top_held else 0, string.nodes - (1 if bit_held else 0))
    stiffness, mass = (x.toarray()[kept, kept] for x in (string.stiffness, string.mass))
    if len(mass) == 0:
        return np.array([])
    return np.sqrt(np.maximum(scipy.linalg.eigvalsh(stiffness, mass), 0.0))


def counted(string, held, count=10**6, model="finite-elements"):
    return natural_frequencies(string.parts, model, count, *held)


def agree(string, held, rtol=1e-9):
    """All of the frequencies, none missed and none twice."""
    found, expected = counted(string, held), dense(string, *held)
    assert len(found) == len(expected)
    if not any(held):
        assert found[0] == 0.0
        found, expected = found[1:], expected[1:]
    np.testing.assert_allclose(found, expected, rtol=rtol)


@pytest.mark.parametrize("held", HELD, ids=str)
@pytest.mark.parametrize("model", catalog.names("models"))
def test_all_frequencies_of_the_shipped_models(model, held):
    agree(drillctl.load(model).string, held)


@pytest.mark.parametrize("held", HELD, ids=str)
@pytest.mark.parametrize("values", [{f"{PIPE}.elements": 1}, {"drillstring.mass": "lumped"}])
def test_one_element_and_lumped_mass(values, held):
    agree(drillctl.load(DESIGN, **values).string, held)


@pytest.mark.parametrize("held", HELD, ids=str)
def test_lumped_springs_pipes_and_inertias_mixed(held):
    sections = (
        Section("swivel", 1, 1e5, end_inertia=20.0),
        Section("pipe", 7, 400.0, inertia=200.0),
        Section("tool", 1, 5e3),
        Section("collar", 2, 2e4, inertia=40.0),
        Section("sub", 1, 8e3, inertia=3.0, end_inertia=11.0),
    )
    agree(assemble(sections, 700.0, 150.0), held)
    agree(assemble(sections, 700.0, 0.0), held)


@pytest.mark.parametrize("held", HELD, ids=str)
def test_ten_sections_of_all_sizes(held):
    rng = np.random.default_rng(3)
    sections = tuple(
        Section(f"{i}", int(rng.integers(1, 6)), 10 ** rng.uniform(2.5, 5), 10 ** rng.uniform(0, 2))
        for i in range(10)
    )
    agree(assemble(sections, 500.0, 394.0), held)


@pytest.mark.parametrize("held", HELD, ids=str)
@pytest.mark.parametrize("ends", [(1e9, 394.0), (500.0, 1e9), (1e-6, 1e-6), (0.0, 0.0)], ids=str)
def test_heavy_and_light_ends(ends, held):
    # What is left of a millionth of an inertia in 280 stands in a dense solve as well.
    agree(assemble((Section("pipe", 20, 315.0, inertia=280.0),), *ends), held, rtol=1e-8)


@pytest.mark.parametrize("model", ["finite-elements", "wave"])
def test_damping_is_left_out(model):
    losses = {
        f"{PIPE}.stiffness_damping": "1 s",
        f"{PIPE}.drag": "5 N*s/rad",
        f"{PIPE}.mass_damping": "2 1/s",
        "top_drive.damping": "900 N*m*s/rad",
    }
    with_losses, without = drillctl.load(DESIGN, **losses).string, drillctl.load(DESIGN).string
    for held in HELD:
        np.testing.assert_array_equal(
            counted(with_losses, held, 12, model), counted(without, held, 12, model)
        )


def roots(residual, count):
    """First positive zeros (rad/s) of a smooth function of w."""
    grid = np.linspace(1e-3, 3.0 * (count + 2) / TRAVEL * 1.5, 20001)
    values = residual(grid)
    left = np.flatnonzero(values[:-1] * values[1:] < 0.0)[:count]
    assert len(left) == count
    return [brentq(residual, grid[i], grid[i + 1], xtol=1e-14, rtol=1e-14) for i in left]


def top_held_residual(w):
    """w J_b tan(w L/c) = zeta, times the cosine."""
    return w * BIT * np.sin(w * TRAVEL) - ZETA * np.cos(w * TRAVEL)


def bit_held_residual(w):
    return w * TOP * np.sin(w * TRAVEL) - ZETA * np.cos(w * TRAVEL)


def free_free_residual(w):
    top, bit = w * TOP / ZETA, w * BIT / ZETA
    return (top + bit) * np.cos(w * TRAVEL) + (1.0 - top * bit) * np.sin(w * TRAVEL)


def test_continuum_satisfies_the_closed_forms():
    string = drillctl.load(DESIGN).string
    for held, residual in (
        ((True, False), top_held_residual),
        ((False, True), bit_held_residual),
        ((False, False), free_free_residual),
        ((True, True), lambda w: np.sin(w * TRAVEL)),
    ):
        found = counted(string, held, 13, "wave")
        found = found if any(held) else found[1:]
        np.testing.assert_allclose(found[:12], roots(residual, 12), rtol=1e-10)


def test_count_is_what_is_returned():
    string = drillctl.load(DESIGN).string
    for held in HELD:
        every = counted(string, held, 31)
        for count in (0, 1, 7):
            np.testing.assert_allclose(counted(string, held, count), every[:count], rtol=1e-13)
        assert len(counted(string, held, 200, "wave")) == 200


@pytest.mark.parametrize(
    ("model", "top_held", "expected"),
    [
        ("wave", True, [0.127537, 0.566018, 1.080143, 1.604787]),
        ("wave", False, [0.0, 0.180575, 0.591335, 1.094460, 1.614593]),
        ("finite-elements", True, [0.127538, 0.566279, 1.082119, 1.611394]),
        ("finite-elements", False, [0.0, 0.180576, 0.591609, 1.096463, 1.621240]),
    ],
)
def test_printed_values(model, top_held, expected):
    string = drillctl.load(DESIGN).string
    found = counted(string, (top_held, False), len(expected), model) / (2 * math.pi)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=5.1e-7)


def test_two_lumped_inertias():
    string = drillctl.load("navarro-lopez-2dof").string
    for model in ("finite-elements", "wave"):
        assert counted(string, (True, False), 9, model) == pytest.approx([1.35107], abs=5e-6)
        free = counted(string, (False, False), 9, model)
        assert free == pytest.approx([0.0, 1.49379], abs=5e-6)
        assert len(counted(string, (True, True), 9, model)) == 0


def test_two_sections_of_well_a():
    string = drillctl.load("aarsnes-shor-well-a").string
    exact = counted(string, (True, False), 1, "wave")[0]
    speed = math.sqrt(61e9 / 7850.0)
    pipe = math.pi / 32 * (0.146529**4 - 0.123024**4) * 61e9 / speed
    bha = 8.494e-5 * 67e9 / speed
    one, two = exact * 2270.0 / speed, exact * 230.0 / speed
    # Fixed-free, one wave speed: tan(w t1) tan(w t2) = zeta1 / zeta2.
    assert math.tan(one) * math.tan(two) == pytest.approx(pipe / bha, rel=1e-10)
    assert exact / (2 * math.pi) == pytest.approx(0.2209, abs=5e-5)
    # 4.52651 s; reference and paper cut it off.
    assert 2 * math.pi / exact == pytest.approx(4.526, abs=6e-4)
    elements = counted(string, (True, False), 1)[0]
    assert elements / (2 * math.pi) == pytest.approx(0.2209, abs=5e-5)
    assert elements == pytest.approx(exact, rel=1e-3)
    assert elements != exact


@pytest.mark.parametrize("link", [1e-2, 1e-6, 1e-9])
def test_nearly_coincident_frequencies_are_both_found(link):
    """Two equal halves on a weak spring: one pair for each mode of a half.

    In phase the spring does nothing; in opposition a half hangs on twice the spring.
    """
    spring, inertia, end = 315.0, 280.0, 500.0
    half = Section("upper", 6, spring, inertia=inertia)
    lower = Section("lower", 6, spring, inertia=inertia)
    string = assemble((half, Section("link", 1, link), lower), end, end)
    zeta, travel = math.sqrt(spring * inertia), math.sqrt(inertia / spring)

    def in_phase(w):
        return w * end * np.cos(w * travel) + zeta * np.sin(w * travel)

    def opposed(w):
        cos, sin = np.cos(w * travel), np.sin(w * travel)
        own = w * end * zeta * cos + zeta**2 * sin
        return w * own + 2.0 * link * (w * end * sin - zeta * cos)

    found = counted(string, (False, False), 8, "wave")[2:]
    for pair, low, high in zip(found.reshape(3, 2), (1.0, 4.0, 7.5), (4.0, 7.5, 11.0), strict=True):
        exact = sorted(brentq(f, low, high, xtol=1e-15, rtol=1e-15) for f in (in_phase, opposed))
        np.testing.assert_allclose(pair, exact, rtol=1e-12)
        gap = exact[1] - exact[0]
        assert 0.0 < gap < 1e-2 * link
        if link > 1e-7:
            assert pair[1] - pair[0] == pytest.approx(gap, rel=1e-3)
    free = counted(string, (False, False))
    halves = counted(assemble((half,), end, 0.0), (False, False))
    assert len(free) == 2 * len(halves) == 14
    np.testing.assert_allclose(free[2::2], halves[1:], rtol=2e-3 * link + 1e-12)
    np.testing.assert_allclose(free[3::2], halves[1:], rtol=2e-3 * link + 1e-12)


def chain(spring, inertia, n, angle, mass):
    """A uniform chain has w^2 = (k / m) 2 (1 - cos) / ((2 + cos) / 3), the last 1 if lumped."""
    share = (2.0 + np.cos(angle)) / 3.0 if mass == "consistent" else 1.0
    return np.sqrt(4.0 * np.sin(angle / 2.0) ** 2 / share * (spring * n) / (inertia / n))


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize("n", [1, 2, 37, 2000])
def test_every_frequency_of_a_bare_chain(n, mass):
    """Without inertia at the ends the free-free frequencies are those with both ends held.

    There the stiffness seen from an end is without bound: half of the digits are lost.
    """
    string = assemble((Section("pipe", n, 315.7, inertia=279.3),), 0.0, 0.0, mass=mass)
    whole, odd = np.arange(n + 1), np.arange(n) + 0.5
    for held, number in (
        ((False, False), whole),
        ((True, True), whole[1:-1]),
        ((True, False), odd),
        ((False, True), odd),
    ):
        exact = chain(315.7, 279.3, n, np.pi * number / n, mass)
        rtol = 1e-10 if any(held) else 2e-8
        np.testing.assert_allclose(counted(string, held), exact, rtol=rtol, atol=1e-12)


def test_two_thousand_elements_with_inertias():
    string = drillctl.load(DESIGN, **{f"{PIPE}.elements": 2000}).string
    for held in HELD:
        fe, wave = counted(string, held, 12), counted(string, held, 12, "wave")
        assert len(counted(string, held)) == 2001 - sum(held)
        # Consistent mass lies above: (w l / c)^2 / 24 of it.
        above = 1.0 + (wave * TRAVEL / 2000) ** 2 / 24.0
        assert (fe[1:] > wave[1:]).all()
        assert (fe <= wave * (1.0 + 1.2 * (above - 1.0)) + 1e-11).all()


def test_a_midpoint_of_the_bisection_on_a_frequency_of_the_held_section():
    """Travel time pi/4: the section, held, has its third frequency at 12 rad/s, a midpoint."""
    for slightly in (0.0, 1e-12):
        travel = math.pi / 4 * (1.0 + slightly)
        string = assemble((Section("pipe", 30, 100.0 / travel, 100.0 * travel),), 50.0, 30.0)
        found = counted(string, (False, False), 5, "wave")
        assert found[-1] == pytest.approx(12.532479, abs=1e-5)
