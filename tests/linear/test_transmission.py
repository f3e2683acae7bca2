"""Transmission lines against dense solves, closed forms and the state-space loop."""

from __future__ import annotations

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from dense import answered, solved

import drillctl
from drillctl.errors import InputError
from drillctl.linear import frequency_response
from drillctl.linear.ends import ends_of
from drillctl.linear.state_space import closed_loop_matrices, plant_matrices
from drillctl.linear.transmission import Lines
from drillctl.rig.drillstring import Section, assemble

HOLDS = {
    "string as transmission lines": "dense M, C, K on nine strings, 1e-10; hand-written cot and "
    "csc; order 2 to the continuum",
}

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"
HZ = np.array([0.02, 0.08, 0.15, 0.3, 0.5, 0.9, 1.4, 2.4, 5.0])

DESIGNS = {
    "paper": (DESIGN, {}),
    "lumped mass": (DESIGN, {"drillstring.mass": "lumped"}),
    "internal damping and drag": (
        DESIGN,
        {f"{PIPE}.stiffness_damping": "10 ms", f"{PIPE}.drag": "0.02 N*s/rad"},
    ),
    "mass damping": (DESIGN, {f"{PIPE}.mass_damping": "0.2 1/s"}),
    "dampers at the ends": (
        DESIGN,
        {"top_drive.damping": "100 N*m*s/rad", "bha.damping": "30 N*m*s/rad"},
    ),
    "two lumped inertias": ("navarro-lopez-2dof", {}),
    "four lumped inertias": ("navarro-lopez-4dof", {}),
    "two sections": ("aarsnes-shor-well-a", {f"{PIPE}.damping": "5 N*m*s/rad"}),
}


def mixed():
    """Lumped springs, pipes and inertias between them, each with another damping."""
    return assemble(
        (
            Section("swivel", 1, 1e5, end_inertia=20.0, coupling_damping=40.0, mass_damping=0.1),
            Section("pipe", 7, 400.0, inertia=200.0, drag=12.0, stiffness_damping=2e-3),
            Section("tool", 1, 5e3, end_inertia=0.0),
            Section("collar", 2, 2e4, inertia=40.0, mass_damping=0.3),
            Section("sub", 1, 8e3, inertia=3.0, end_inertia=11.0, mass_damping=0.5),
        ),
        top_inertia=700.0,
        bit_inertia=150.0,
        top_damping=9.0,
        bit_damping=4.0,
    )


STRINGS = {
    **{k: lambda d=d, v=v: drillctl.load(d, **v).string for k, (d, v) in DESIGNS.items()},
    "lumped and distributed": mixed,
}


def check(seen, expected, rtol):
    """Mobilities of both ends, across from either, and both pipe torques."""
    found = (seen.top, seen.bit, seen.transfer, *seen[2:])
    for value, exact in zip(found, expected, strict=True):
        np.testing.assert_allclose(value, exact, rtol=rtol)


@pytest.mark.parametrize("name", STRINGS)
def test_lines_of_elements_solve_the_matrices(name):
    string = STRINGS[name]()
    s = 2j * math.pi * HZ
    check(Lines(string.parts, "finite-elements").mobility(s), solved(string, s), 1e-10)


@pytest.mark.parametrize("name", STRINGS)
@pytest.mark.parametrize("turn", [0.3, -0.7, 1.2])
def test_off_the_axis_and_with_impedances_at_the_ends(name, turn):
    """Decaying and growing motions; a drive with integral action, a falling rock."""
    string = STRINGS[name]()
    s = 2j * math.pi * HZ * cmath.exp(-1j * turn)
    drive, rock = 625.0 + 125.0 / s + 3.0 * s, -290.0 + 7.0 / (1.0 + s)
    check(Lines(string.parts, "finite-elements").mobility(s), solved(string, s), 1e-10)
    seen = Lines(string.parts, "finite-elements").mobility(s, drive, rock)
    check(seen, solved(string, s, drive, rock), 1e-10)
    lines = Lines(string.parts, "finite-elements")
    np.testing.assert_allclose(
        lines.bit_impedance(s, drive), 1.0 / solved(string, s, drive)[1], rtol=1e-10
    )
    np.testing.assert_allclose(
        lines.top_impedance(s, rock), 1.0 / solved(string, s, 0.0, rock)[0], rtol=1e-10
    )


@pytest.mark.parametrize("s", [0.5, 3.0, 40.0, 2e3])
def test_on_the_real_axis(s):
    string = mixed()
    at = np.array([complex(s)])
    seen = Lines(string.parts, "finite-elements").mobility(at, 600.0, -20.0)
    check(seen, solved(string, at, 600.0, -20.0), 1e-9)
    assert abs(seen.top[0].imag) <= 1e-12 * abs(seen.top[0])


@pytest.mark.parametrize("name", STRINGS)
def test_named_responses_have_signals_and_signs_of_the_plant(name):
    string = STRINGS[name]()
    expected = answered(plant_matrices(string), HZ)
    for route in ("finite-elements", "matrices"):
        response = frequency_response(string, HZ, model=route).response
        np.testing.assert_allclose(response, expected, rtol=1e-10)


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("route", ["finite-elements", "matrices"])
def test_closed_loop_with_the_falling_slope_against_state_space(name, route):
    design, values = DESIGNS[name]
    rig = drillctl.load(design, **values)
    slope = 0.6 * 290.0
    expected = answered(closed_loop_matrices(rig.string, *rig.top_drive.gains()), HZ, slope)
    found = frequency_response(rig, HZ, loop="closed_loop", model=route, slope=slope)
    assert found.outputs == ("top_speed", "bit_speed", "pipe_torque", "twist", "top_torque")
    # What the drive adds to a torque on the string vanishes where kp and ki do.
    np.testing.assert_allclose(found.response, expected, rtol=1e-9, atol=1e-300)


def test_unknown_routes_are_refused_with_the_nearest():
    with pytest.raises(InputError, match="did you mean 'wave'"):
        ends_of(mixed(), "waves")
    with pytest.raises(InputError, match="modal_damping"):
        ends_of(drillctl.load(DESIGN, **{"drillstring.modal_damping": 0.02}).string, "wave")


ZETA = math.pi / 32 * (0.127**4 - 0.1086**4) * math.sqrt(79.6e9 * 7850.0)
TRAVEL = 3000.0 * math.sqrt(7850.0 / 79.6e9)
TOP, BIT = 500.0, 394.0


def check_by_hand(seen, v0, v1, pipe, rtol=1e-11):
    """v0, v1, pipe: each a pair, per torque on the top and on the bit."""
    check(seen, (v0[0], v1[1], v0[1], v1[0], *pipe), rtol)


@pytest.mark.parametrize("hz", [0.02, 0.1, 0.31, 0.9, 2.7, 5.0])
def test_undamped_continuum_by_hand(hz):
    """Torques at the ends of a bar turned by u0, u1: zeta w (cot, -csc) of the angle w L / c."""
    w = 2 * math.pi * hz
    x = w * TRAVEL
    upper = ZETA * w / math.tan(x) - w**2 * TOP
    lower = ZETA * w / math.tan(x) - w**2 * BIT
    across = -ZETA * w / math.sin(x)
    whole = upper * lower - across**2
    u0 = np.array([lower, -across]) / whole
    u1 = np.array([-across, upper]) / whole
    seen = Lines(drillctl.load(DESIGN).string.parts, "wave").mobility(np.array([1j * w]))
    # The drive's equation: its inertia takes what the pipe does not.
    pipe = np.array([1.0, 0.0]) + w**2 * TOP * u0
    check_by_hand(seen, 1j * w * u0, 1j * w * u1, pipe)


@pytest.mark.parametrize("s", [0.7j, 3 + 4j, -0.2 + 2j, 5.0 + 0j], ids=str)
def test_damped_continuum_by_hand(s):
    """(K + s c) u'' = s (s I + d) u over a section of unit length, with dampers at its ends."""
    spring, inertia = 315.0, 280.0
    section = Section(
        "pipe", 3, spring, inertia=inertia, end_inertia=25.0, coupling_damping=60.0,
        stiffness_damping=0.02, mass_damping=0.3, drag=18.0,
    )  # fmt: skip
    string = assemble((section,), 500.0, 394.0, top_damping=7.0, bit_damping=5.0)
    link = spring + s * (60.0 + 0.02 * spring)
    angle = cmath.sqrt(s * (s * inertia + 0.3 * inertia + 18.0) / link)
    own, across = link * angle / cmath.tanh(angle), -link * angle / cmath.sinh(angle)
    drive, rock = 600.0 + 100.0 / s, -200.0
    above = s * (500.0 * s + 7.0 + drive)
    below = s * (394.0 * s + 25.0 * (s + 0.3) + 5.0 + rock)
    upper, lower = own + above, own + below
    whole = upper * lower - across**2
    u0 = np.array([lower, -across]) / whole
    u1 = np.array([-across, upper]) / whole
    seen = Lines(string.parts, "wave").mobility(np.array([s], dtype=complex), drive, rock)
    check_by_hand(seen, s * u0, s * u1, np.array([1.0, 0.0]) - above * u0)


def test_lumped_sections_are_the_same_in_both_models():
    parts = drillctl.load("navarro-lopez-4dof").string.parts
    s = 2j * math.pi * HZ
    for fe, wave in zip(
        Lines(parts, "finite-elements").mobility(s), Lines(parts, "wave").mobility(s), strict=True
    ):
        np.testing.assert_allclose(wave, fe, rtol=1e-12)


def damped(section):
    return replace(
        section, coupling_damping=9.0, stiffness_damping=1e-3, drag=6.0, mass_damping=0.1
    )


@pytest.mark.parametrize("model", ["finite-elements", "wave"])
@pytest.mark.parametrize("losses", [False, True])
def test_one_section_in_two_is_the_same(model, losses):
    """10 elements of 300 m and 20 of 600 m are 30 of 900 m."""
    whole = Section("pipe", 30, 315.0, inertia=280.0)
    whole = damped(whole) if losses else whole
    split = [
        replace(
            whole, elements=n, stiffness=whole.stiffness * 30 / n, inertia=whole.inertia * n / 30,
            coupling_damping=whole.coupling_damping * 30 / n, drag=whole.drag * n / 30,
        )
        for n in (10, 20)
    ]  # fmt: skip
    s = np.concatenate([2j * math.pi * HZ, [0.3 + 2j, -0.1 + 5j]])
    one = Lines(assemble((whole,), TOP, BIT).parts, model).mobility(s, 600.0, -100.0)
    two = Lines(assemble(tuple(split), TOP, BIT).parts, model).mobility(s, 600.0, -100.0)
    for a, b in zip(one, two, strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-11)


@pytest.mark.parametrize("model", ["finite-elements", "wave"])
def test_reciprocity_of_a_string_turned_upside_down(model):
    sections = [
        damped(Section("pipe", 9, 400.0, inertia=200.0)),
        Section("collar", 4, 3e4, inertia=30.0, mass_damping=0.4),
        Section("spring", 1, 4e3, coupling_damping=20.0),
        Section("sub", 2, 9e3, inertia=5.0, drag=3.0),
    ]
    up = assemble(tuple(sections), 700.0, 90.0, 11.0, 3.0)
    down = assemble(tuple(reversed(sections)), 90.0, 700.0, 3.0, 11.0)
    s = np.concatenate([2j * math.pi * HZ, [0.3 + 2j, -0.1 + 5j]])
    a = Lines(up.parts, model).mobility(s, 600.0 + 100.0 / s, -50.0)
    b = Lines(down.parts, model).mobility(s, -50.0, 600.0 + 100.0 / s)
    np.testing.assert_allclose(b.transfer, a.transfer, rtol=1e-11)
    np.testing.assert_allclose(b.top, a.bit, rtol=1e-11)
    np.testing.assert_allclose(b.bit, a.top, rtol=1e-11)


@pytest.mark.parametrize("model", ["finite-elements", "wave"])
@pytest.mark.parametrize("name", ["internal damping and drag", "mass damping", "two sections"])
def test_a_damped_string_takes_energy(name, model):
    """Re of the matrix of mobilities is positive definite, and no more than without loss."""
    parts = STRINGS[name]().parts
    s = 2j * math.pi * np.geomspace(1e-3, 300.0, 2000)
    seen = Lines(parts, model).mobility(s)
    assert (seen.top.real > 0.0).all()
    assert (seen.bit.real > 0.0).all()
    deficit = seen.top.real * seen.bit.real - seen.transfer.real**2
    scale = seen.top.real * seen.bit.real + seen.transfer.real**2
    # Semidefinite to rounding where one motion loses far more than the other.
    assert (deficit >= -1e-9 * scale).all()
    assert (deficit > 1e-3 * scale).mean() > 0.1


@pytest.mark.parametrize("model", ["finite-elements", "wave"])
def test_an_undamped_string_takes_none(model):
    parts = drillctl.load(DESIGN).string.parts
    seen = Lines(parts, model).mobility(2j * math.pi * HZ)
    for value in (seen.top, seen.bit, seen.transfer):
        assert (np.abs(value.real) <= 1e-12 * np.abs(value)).all()


@pytest.mark.parametrize("model", ["finite-elements", "wave"])
@pytest.mark.parametrize("losses", [{}, {"stiffness_damping": 1.0, "drag": 3e5}])
@pytest.mark.parametrize("direction", [1j, 1.0, 1j + 0.5, 1j - 0.5], ids=str)
def test_finite_however_fast_and_however_damped(model, losses, direction):
    string = assemble((Section("pipe", 30, 315.0, inertia=280.0, **losses),), TOP, BIT)
    s = direction * np.geomspace(1e-6, 1e9, 301)
    for drive in (0.0, 1e12):
        for value in Lines(string.parts, model).mobility(s, drive, -300.0):
            assert np.isfinite(value).all()


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_heavy_damping_and_high_frequencies_against_the_matrices(mass):
    """Ends that no longer hear of each other; far above the highest mode."""
    section = Section("pipe", 12, 315.0, inertia=280.0, stiffness_damping=0.5, drag=4e3)
    for losses in (section, Section("pipe", 12, 315.0, inertia=280.0)):
        string = assemble((losses,), TOP, BIT, mass=mass)
        s = 1j * np.array([1e-3, 1.0, 60.0, 3e3, 1e6])
        expected = solved(string, s, 500.0, -100.0)
        seen = Lines(string.parts, "finite-elements").mobility(s, 500.0, -100.0)
        np.testing.assert_allclose(seen.top, expected[0], rtol=1e-10)
        np.testing.assert_allclose(seen.bit, expected[1], rtol=1e-10)
        np.testing.assert_allclose(seen.transfer, expected[2], rtol=1e-8)


def test_growing_motions_see_an_endless_pipe():
    """Nothing that grows that fast has had time to come back."""
    parts = assemble((Section("pipe", 1, 315.0, inertia=280.0),), TOP, 0.0).parts
    seen = Lines(parts, "wave").mobility(np.array([400.0 + 0j, 400.0 + 30j]))
    np.testing.assert_allclose(seen.bit, 1.0 / math.sqrt(315.0 * 280.0), rtol=1e-12)


def refined(elements, hz, **values):
    string = drillctl.load(DESIGN, **{f"{PIPE}.elements": elements, **values}).string
    s = 2j * math.pi * np.asarray(hz)
    return ends_of(string).mobility(s), ends_of(string, "wave").mobility(s)


SLOW_HZ = [0.1, 0.23, 0.4, 0.7, 1.3, 2.2, 3.6, 5.0]


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("consistent", {}),
        ("lumped", {"drillstring.mass": "lumped"}),
        ("damped", {f"{PIPE}.stiffness_damping": "5 ms", f"{PIPE}.drag": "0.02 N*s/rad"}),
    ],
)
def test_elements_converge_to_the_continuum_with_order_two(kind, values):
    errors = {"top": [], "bit": [], "transfer": []}
    for count in (200, 400, 800, 1600):
        fe, wave = refined(count, SLOW_HZ, **values)
        for name, error in errors.items():
            exact = getattr(wave, name)
            error.append(np.abs(getattr(fe, name) / exact - 1.0))
    for error in errors.values():
        orders = -np.diff(np.log2(error), axis=0)
        np.testing.assert_allclose(orders, 2.0, atol=0.15)


def test_pipe_torque_is_of_order_one_at_the_top_and_two_at_the_middle_of_an_element():
    """What the first element carries is the continuum's torque half an element lower."""
    hz = np.array([0.1, 0.23, 0.4, 0.7])
    w = 2 * math.pi * hz
    at_top, at_middle = [], []
    for count in (200, 400, 800, 1600):
        fe, wave = refined(count, hz)
        x = w * TRAVEL / count / 2
        for pipe, exact, speed in (
            (fe.pipe_from_top, wave.pipe_from_top, wave.top),
            (fe.pipe_from_bit, wave.pipe_from_bit, wave.transfer),
        ):
            # Torque of a bar turned by u0 at its top, at the angle x below it.
            lower = exact * np.cos(x) + w * ZETA * speed / (1j * w) * np.sin(x)
            at_top.append(np.abs(pipe / exact - 1.0))
            at_middle.append(np.abs(pipe / lower - 1.0))
    for source in (0, 1):
        orders = [-np.diff(np.log2(x[source::2]), axis=0) for x in (at_top, at_middle)]
        np.testing.assert_allclose(orders[0], 1.0, atol=0.15)
        np.testing.assert_allclose(orders[1], 2.0, atol=0.15)
