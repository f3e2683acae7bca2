"""Sum over modes against dense solves of M, C and K."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from dense import answered, solved

import drillctl
from drillctl.linear import frequency_response
from drillctl.linear.ends import ends_of
from drillctl.linear.modal import Expansion
from drillctl.linear.state_space import closed_loop_matrices
from drillctl.linear.transmission import Lines
from drillctl.rig.drillstring import Section, assemble

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"
HZ = np.array([0.02, 0.08, 0.15, 0.3, 0.5, 0.9, 1.4, 2.4, 5.0, 14.0, 40.0])

MODAL = {"drillstring.modal_damping": 0.02}
ENDS = {"top_drive.damping": "100 N*m*s/rad", "bha.damping": "30 N*m*s/rad"}
COUPLED = {f"{PIPE}.damping": "600 N*m*s/rad", f"{PIPE}.drag": "0.02 N*s/rad"}

STRINGS = {
    "modal alone": (DESIGN, MODAL),
    "and dampers at the ends": (DESIGN, {**MODAL, **ENDS}),
    "and the pipe's own": (DESIGN, {**MODAL, **COUPLED}),
    "all": (DESIGN, {**MODAL, **ENDS, **COUPLED}),
    "heavy": (DESIGN, {"drillstring.modal_damping": 3.0, "top_drive.damping": "1e5 N*m*s/rad"}),
    "lumped mass": (DESIGN, {**MODAL, "drillstring.mass": "lumped"}),
    "two sections, coupled": (
        "aarsnes-shor-well-a",
        {**MODAL, f"{PIPE}.damping": "500 N*m*s/rad", "top_drive.damping": "40 N*m*s/rad"},
    ),
    "springs, coupled": ("navarro-lopez-4dof", MODAL),
}


def check(seen, expected, rtol):
    """Each within `rtol` of its largest magnitude at that end, and closely where it is large."""
    found = (seen.top, seen.bit, seen.transfer, *seen[2:])
    for value, exact in zip(found, expected, strict=True):
        size = np.maximum(np.abs(exact), 1e-4 * np.abs(exact).max())
        assert (np.abs(value - exact) <= rtol * size).all()


@pytest.mark.parametrize("name", STRINGS)
def test_modes_solve_the_matrices(name):
    design, values = STRINGS[name]
    string = drillctl.load(design, **values).string
    ends = ends_of(string)
    assert isinstance(ends, Expansion)
    s = 2j * math.pi * HZ
    check(ends.mobility(s), solved(string, s), 1e-9)
    drive, rock = 625.0 + 125.0 / s, -200.0
    check(ends.mobility(s, drive, rock), solved(string, s, drive, rock), 1e-9)
    np.testing.assert_allclose(
        ends.bit_impedance(s, drive), 1.0 / solved(string, s, drive)[1], rtol=1e-9
    )
    np.testing.assert_allclose(
        ends.top_impedance(s, rock), 1.0 / solved(string, s, 0.0, rock)[0], rtol=1e-9
    )


@pytest.mark.parametrize("name", STRINGS)
@pytest.mark.parametrize("turn", [0.4, -0.9])
def test_off_the_axis(name, turn):
    design, values = STRINGS[name]
    string = drillctl.load(design, **values).string
    s = 2j * math.pi * HZ[:9] * cmath.exp(-1j * turn)
    drive = 625.0 + 125.0 / s
    check(ends_of(string).mobility(s, drive, -50.0), solved(string, s, drive, -50.0), 1e-9)


@pytest.mark.parametrize("name", STRINGS)
def test_named_responses_by_both_routes(name):
    design, values = STRINGS[name]
    string = drillctl.load(design, **values).string
    s = 2j * math.pi * HZ
    top, bit, down, up, pipe_top, pipe_bit = solved(string, s)
    for route in ("finite-elements", "matrices"):
        found = frequency_response(string, HZ, model=route)
        for source, target, expected in (
            ("top_torque", "top_speed", top),
            ("top_torque", "bit_speed", down),
            ("bit_torque", "top_speed", -up),
            ("bit_torque", "bit_speed", -bit),
            ("top_torque", "pipe_torque", pipe_top),
            ("bit_torque", "pipe_torque", -pipe_bit),
            ("top_torque", "twist", (top - down) / s),
            ("bit_torque", "twist", (bit - up) / s),
        ):
            value = found.between(source, target)
            error = np.abs(value - expected) / np.maximum(
                np.abs(expected), 1e-4 * np.abs(expected).max()
            )
            assert error.max() <= 1e-9, (route, source, target)


def test_closed_loop_with_slope_against_state_space():
    rig = drillctl.load(DESIGN, **MODAL, **ENDS, **COUPLED)
    expected = answered(closed_loop_matrices(rig.string, 625.0, 125.0), HZ[:9], 290.0)
    found = frequency_response(rig, HZ[:9], loop="closed_loop", slope=290.0)
    np.testing.assert_allclose(found.response, expected, rtol=1e-8)


@pytest.mark.parametrize("coupled", [False, True])
def test_without_modal_damping_modes_and_lines_are_one(coupled):
    losses = {"stiffness_damping": 5e-3, "mass_damping": 0.1}
    sections = (Section("pipe", 20, 315.0, inertia=280.0, **losses),)
    if coupled:
        sections += (Section("tool", 1, 4e3, end_inertia=30.0, coupling_damping=90.0),)
    string = assemble(sections, 500.0, 394.0, 60.0, 20.0)
    s = 2j * math.pi * HZ
    drive = 600.0 + 100.0 / s
    lines = Lines(string.parts, "finite-elements").mobility(s, drive, -100.0)
    modes = Expansion(string).mobility(s, drive, -100.0)
    check(modes, [lines.top, lines.bit, lines.transfer, lines.transfer, *lines[3:]], 1e-9)


def test_light_modal_damping_is_felt_at_resonance():
    """At an undamped frequency the mode alone: mobility phi^2 / (2 ratio w)."""
    string = drillctl.load(DESIGN, **{"drillstring.modal_damping": 1e-6}).string
    frequency, shapes = string.undamped_modes
    s = 1j * frequency[1:6]
    expected = shapes[-1, 1:6] ** 2 / (2e-6 * frequency[1:6])
    np.testing.assert_allclose(ends_of(string).mobility(s).bit.real, expected, rtol=1e-8)


def test_shape_of_the_frequencies_is_kept_and_blocks_do_not_show():
    string = drillctl.load("navarro-lopez-4dof", **MODAL).string
    hz = np.geomspace(0.02, 5.0, 600)
    s = 2j * math.pi * hz
    flat, square = ends_of(string).mobility(s), ends_of(string).mobility(s.reshape(20, 30))
    for one, other in zip(flat, square, strict=True):
        assert other.shape == (20, 30)
        np.testing.assert_array_equal(other.ravel(), one)
    check(flat, solved(string, s), 1e-9)
