"""Assembly of the string: matrices by hand, properties of any string, published pipe data."""

from __future__ import annotations

import math

import numpy as np
import opentorsion
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import drillctl
from drillctl.rig.drillstring import GRADES, PIPES, Section, assemble, polar_moment
from drillctl.rig.drillstring.section import torsional_yield

DESIGN = "monteiro-trindade-140kn"
PIPE = Section("pipe", elements=2, stiffness=300.0, inertia=12.0, length=200.0)


def first_elastic_frequency(string):
    return string.undamped_modes[0][1]


def test_consistent_matrices_by_hand():
    string = assemble((PIPE,), top_inertia=5.0, bit_inertia=7.0)
    k, m = 600.0, 6.0
    np.testing.assert_allclose(
        string.stiffness.toarray(), [[k, -k, 0], [-k, 2 * k, -k], [0, -k, k]], rtol=1e-14
    )
    np.testing.assert_allclose(
        string.mass.toarray(),
        [[5 + m / 3, m / 6, 0], [m / 6, 2 * m / 3, m / 6], [0, m / 6, 7 + m / 3]],
        rtol=1e-14,
    )
    assert string.undamped
    np.testing.assert_allclose(string.depth, [0.0, 100.0, 200.0])
    assert string.static_stiffness == pytest.approx(300.0)


def test_lumped_mass_is_diagonal_with_the_same_total():
    string = assemble((PIPE,), top_inertia=5.0, bit_inertia=7.0, mass="lumped")
    np.testing.assert_allclose(string.mass.toarray(), np.diag([8.0, 6.0, 10.0]), rtol=1e-14)


def test_dampers_stand_where_they_were_put():
    section = Section("s", elements=1, stiffness=10.0, end_inertia=3.0, coupling_damping=4.0)
    string = assemble((section,), 1.0, 2.0, top_damping=0.5, bit_damping=0.25)
    np.testing.assert_allclose(string.damping.toarray(), [[4.5, -4.0], [-4.0, 4.25]])
    np.testing.assert_allclose(string.ground_damping, [0.5, 0.25])
    np.testing.assert_allclose(string.mass.toarray(), np.diag([1.0, 5.0]))


def test_drag_sums_to_its_total():
    section = Section("s", elements=4, stiffness=10.0, inertia=2.0, drag=8.0, mass_damping=0.5)
    string = assemble((section,), 1.0, 2.0)
    assert string.ground_damping.sum() == pytest.approx(8.0 + 0.5 * 2.0)


def test_lumped_and_consistent_bracket_the_continuous_string():
    # Rayleigh: consistent elements are too stiff, lumped masses too soft.
    exact = 0.1805748 * 2 * math.pi
    consistent = drillctl.load(DESIGN, **{"drillstring.sections.pipe.elements": 10})
    lumped = consistent.replace({"drillstring.mass": "lumped"})
    low, high = (first_elastic_frequency(d.string) for d in (lumped, consistent))
    assert low < exact * (1 - 1e-5)
    assert high > exact * (1 + 1e-5)
    assert high / low == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    ("pipe", "impedance"),
    [
        ("4 in 14.0 lb/ft", 134.1),
        ("4 1/2 in 16.6 lb/ft", 199.6),
        ("5 in 19.5 lb/ft", 296.4),
        ("5 1/2 in 21.9 lb/ft", 401.6),
        ("5 7/8 in 23.4 lb/ft", 495.7),
        ("6 5/8 in 25.2 lb/ft", 673.3),
    ],
)
def test_impedance_of_api_pipes(pipe, impedance):
    moment = polar_moment(PIPES[pipe].outer_diameter, PIPES[pipe].inner_diameter)
    length = 1234.0
    section = Section("pipe", 1, 79.3e9 * moment / length, 7850.0 * moment * length, length=length)
    assert section.impedance == pytest.approx(impedance, abs=0.05)
    assert section.travel_time == pytest.approx(length / math.sqrt(79.3e9 / 7850.0))


@pytest.mark.parametrize(
    ("grade", "limit"), [("E-75", 55.8e3), ("X-95", 70.7e3), ("G-105", 78.1e3), ("S-135", 100.5e3)]
)
def test_torsional_yield_of_five_inch_pipe(grade, limit):
    pipe = PIPES["5 in 19.5 lb/ft"]
    computed = torsional_yield(pipe.outer_diameter, pipe.inner_diameter, GRADES[grade])
    # API rounds 1/sqrt(3) to .577, 6e-4 less; its values are given to three figures.
    assert computed == pytest.approx(limit, rel=1.2e-3)


def test_reconstructed_string_has_its_derived_values():
    string = drillctl.load(DESIGN).string
    inertia = string.mass.sum() - 500.0 - 394.0
    assert string.static_stiffness == pytest.approx(315.32, abs=0.005)
    assert inertia == pytest.approx(279.86, abs=0.005)
    assert math.sqrt(string.static_stiffness * inertia) == pytest.approx(297.06, abs=0.005)
    assert math.sqrt(inertia / string.static_stiffness) == pytest.approx(0.9421, abs=5e-5)


def peer_frequency(shafts, disks):
    squares, _ = opentorsion.Assembly(shafts, disks).undamped_modal_analysis()
    return math.sqrt(np.sort(squares.real)[1])


def test_opentorsion_agrees_on_consistent_elements():
    design = drillctl.load(DESIGN)
    shafts = [
        opentorsion.Shaft(i, i + 1, L=100e3, odl=127.0, idl=108.6, G=79.6e9, rho=7850.0)
        for i in range(30)
    ]
    disks = [opentorsion.Disk(0, I=500.0), opentorsion.Disk(30, I=394.0)]
    assert first_elastic_frequency(design.string) == pytest.approx(
        peer_frequency(shafts, disks), rel=1e-6
    )


def test_opentorsion_agrees_on_lumped_masses_of_two_sections():
    design = drillctl.load("aarsnes-shor-well-a", **{"drillstring.mass": "lumped"})
    string = design.string
    shafts = [opentorsion.Shaft(i, i + 1, k=k) for i, k in enumerate(string.element_stiffness)]
    pipe = polar_moment(0.146529, 0.123024) * 7850.0 * 2270.0 / 45
    bha = 8.494e-5 * 8622.131147540984 * 230.0 / 10
    halves = np.repeat([pipe, bha], [45, 10]) / 2
    masses = np.append(halves, 0.0) + np.append(0.0, halves)
    masses[0] += 2900.0
    disks = [opentorsion.Disk(i, I=mass) for i, mass in enumerate(masses)]
    assert first_elastic_frequency(string) == pytest.approx(peer_frequency(shafts, disks), rel=1e-6)


def test_two_lumped_inertias():
    string = drillctl.load("navarro-lopez-2dof").string
    assert first_elastic_frequency(string) == pytest.approx(1.49379, abs=5e-6)


SIZE = st.floats(0.1, 1e3)
DAMPER = st.one_of(st.just(0.0), st.floats(1e-3, 1e2))
DISTRIBUTED = st.builds(
    Section,
    name=st.just("pipe"),
    elements=st.integers(1, 6),
    stiffness=SIZE,
    inertia=SIZE,
    end_inertia=DAMPER,
    length=SIZE,
    coupling_damping=DAMPER,
    stiffness_damping=DAMPER,
    mass_damping=DAMPER,
    drag=DAMPER,
)
LUMPED = st.builds(
    Section,
    name=st.just("spring"),
    elements=st.just(1),
    stiffness=SIZE,
    end_inertia=SIZE,
    coupling_damping=DAMPER,
    mass_damping=DAMPER,
)


@given(
    sections=st.lists(st.one_of(DISTRIBUTED, LUMPED), min_size=1, max_size=4).map(tuple),
    ends=st.tuples(SIZE, SIZE, DAMPER, DAMPER),
    ratio=st.sampled_from([0.0, 0.05]),
    mass=st.sampled_from(["consistent", "lumped"]),
)
@settings(max_examples=60, deadline=None)
def test_any_string_is_sound(sections, ends, ratio, mass):
    string = assemble(sections, *ends, modal_damping=ratio, mass=mass)
    m, c, k = (x.toarray() for x in (string.mass, string.damping, string.stiffness))
    for matrix in (m, c, k):
        np.testing.assert_allclose(matrix, matrix.T, atol=1e-12 * np.abs(matrix).max())
    rigid = np.ones(string.nodes)
    assert np.linalg.eigvalsh(m)[0] > 0.0
    np.testing.assert_allclose(k @ rigid, 0.0, atol=1e-12 * np.abs(k).max())
    springs = np.linalg.eigvalsh(k)
    assert springs[0] >= -1e-12 * springs[-1]
    assert springs[1] > 1e-12 * springs[-1]
    assert np.linalg.eigvalsh(c)[0] >= -1e-10 * np.abs(c).max()
    np.testing.assert_allclose(
        c @ rigid, string.ground_damping, atol=1e-8 * max(np.abs(c).max(), 1.0)
    )
    total = sum(s.inertia + s.end_inertia for s in sections) + ends[0] + ends[1]
    assert m.sum() == pytest.approx(total)
    assert string.static_stiffness == pytest.approx(1 / sum(1 / s.stiffness for s in sections))


def test_classical_is_told_from_coupled_damping():
    def classical(**values):
        return drillctl.load(DESIGN, **values).string.classical

    pipe = "drillstring.sections.pipe"
    assert classical()
    assert classical(**{f"{pipe}.stiffness_damping": "1 ms"})
    assert classical(**{"drillstring.modal_damping": 0.02})
    # The drag of the pipe does not reach the inertias at the ends: not proportional to mass.
    assert not classical(**{f"{pipe}.mass_damping": "0.2 1/s"})
    assert classical(
        **{
            f"{pipe}.mass_damping": "0.2 1/s",
            "top_drive.damping": "100 N*m*s/rad",
            "bha.damping": "78.8 N*m*s/rad",
        }
    )
    assert not classical(**{"top_drive.damping": "50 N*m*s/rad"})
    assert not classical(**{"top_drive.damping": "50 N*m*s/rad", "drillstring.modal_damping": 0.02})
