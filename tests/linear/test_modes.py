"""Modes: exact continuous strings, order of convergence, every kind of damping."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.optimize import brentq

import drillctl
from drillctl.errors import InputError
from drillctl.linear import modes
from drillctl.rig.drillstring import Section, assemble
from drillctl.studies.modes import pictures

HOLDS = {
    "frequencies, top held and both ends free": "exact transcendental roots; order 2 in the "
    "element length",
    "first mode": "openTorsion, 1e-6",
    "two-section string": "Aarsnes & Shor (2018) Well A",
    "overdamped and non-classical strings": "eigenvalues of the companion matrix",
}

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"

MOMENT = math.pi / 32 * (0.127**4 - 0.1086**4)
IMPEDANCE = MOMENT * math.sqrt(79.6e9 * 7850.0)
TRAVEL = 3000.0 / math.sqrt(79.6e9 / 7850.0)
TOP, BIT = 500.0, 394.0


def roots_hz(residual, count):
    """The first positive roots of a smooth function of w (rad/s), in Hz."""
    grid = np.linspace(1e-3, 12.0, 4001)
    values = np.array([residual(w) for w in grid])
    left = np.flatnonzero(values[:-1] * values[1:] < 0)[:count]
    return [brentq(residual, grid[i], grid[i + 1], xtol=1e-15) / (2 * math.pi) for i in left]


def fixed_top_residual(w):
    x = w * TRAVEL
    return w * BIT * math.sin(x) - IMPEDANCE * math.cos(x)


def free_free_residual(w):
    x, top, bit = w * TRAVEL, w * TOP / IMPEDANCE, w * BIT / IMPEDANCE
    return (top + bit) * math.cos(x) + (1 - top * bit) * math.sin(x)


def frequencies(found):
    return [mode.frequency_hz for mode in found]


def of(design=DESIGN, count=10, **values):
    return modes(drillctl.load(design, **values), count)


def companion_poles(string, first=0):
    """Eigenvalues of the first-order form in angles and speeds, nodes from `first` on."""
    m, c, k = (x.toarray()[first:, first:] for x in (string.mass, string.damping, string.stiffness))
    n = len(m)
    lower = -np.linalg.solve(m, np.hstack([k, c]))
    return np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [lower]]))


def expected_entries(poles, zeros):
    """Sorted (frequency, ratio) of poles in the upper half plane, `zeros` smallest left out."""
    kept = sorted(poles, key=abs)[zeros:]
    found = [(abs(p), -p.real / abs(p)) for p in kept if p.imag >= -1e-9 * abs(p)]
    return np.array([(f / (2 * math.pi), min(z, 1.0)) for f, z in sorted(found)])


def entries(found):
    """The same of modes; an overdamped pole has ratio 1."""
    return np.array([(m.frequency_hz, 1.0 if m.overdamped else m.damping_ratio) for m in found])


def test_exact_frequencies_of_the_continuous_string():
    assert roots_hz(fixed_top_residual, 4) == pytest.approx(
        [0.127537, 0.566018, 1.080143, 1.604787], abs=6e-7
    )
    assert roots_hz(free_free_residual, 4) == pytest.approx(
        [0.180575, 0.591335, 1.094460, 1.614593], abs=6e-7
    )


def test_thirty_elements():
    found = of()
    assert frequencies(found.fixed_top)[:4] == pytest.approx(
        [0.127538, 0.566279, 1.082119, 1.611394], abs=6e-7
    )
    assert frequencies(found.free_free)[:5] == pytest.approx(
        [0, 0.180576, 0.591609, 1.096463, 1.621240], abs=6e-7
    )
    assert found.free_free[0].frequency_hz == 0.0
    assert found.free_free[0].damping_ratio is None
    assert not found.free_free[0].overdamped


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_second_order_convergence(mass, figure):
    counts = (10, 20, 40, 80, 160)
    errors = []
    for elements in counts:
        found = of(**{f"{PIPE}.elements": elements, "drillstring.mass": mass})
        computed = frequencies(found.fixed_top)[:3] + frequencies(found.free_free)[1:4]
        exact = roots_hz(fixed_top_residual, 3) + roots_hz(free_free_residual, 3)
        errors.append(np.array(computed) - exact)
    orders = np.diff(np.log2(np.abs(errors)), axis=0)
    np.testing.assert_allclose(-orders, 2.0, atol=0.15)
    figure(f"order of frequencies in the element length, {mass} mass", -orders[-1].mean())


def test_two_section_string_of_well_a():
    """Fixed-free, equal wave speeds: tan(w t1) tan(w t2) = zeta1 / zeta2."""
    speed = math.sqrt(61e9 / 7850.0)
    pipe = math.pi / 32 * (0.146529**4 - 0.123024**4) * 61e9 / speed
    bha = 8.494e-5 * 67e9 / speed

    def residual(w):
        one, two = w * 2270.0 / speed, w * 230.0 / speed
        return bha * math.sin(one) * math.sin(two) - pipe * math.cos(one) * math.cos(two)

    exact = roots_hz(residual, 3)
    assert exact[0] == pytest.approx(0.2209, abs=5e-5)
    assert 1 / exact[0] == pytest.approx(4.526, abs=1e-3)
    computed = frequencies(of("aarsnes-shor-well-a").fixed_top)
    assert computed[:3] == pytest.approx(exact, rel=1e-3)
    assert computed[0] == pytest.approx(exact[0], rel=1e-4)
    assert min(np.array(computed[:3]) - exact) > 0  # consistent elements are too stiff


def test_two_lumped_inertias():
    none = "0 N*m*s/rad"
    found = of(
        "navarro-lopez-2dof",
        **{"top_drive.damping": none, "bha.damping": none, f"{PIPE}.damping": none},
    )
    assert frequencies(found.fixed_top) == pytest.approx([1.35107 / (2 * math.pi)], abs=1e-6)
    assert frequencies(found.free_free) == pytest.approx([0, 1.49379 / (2 * math.pi)], abs=1e-6)
    ratio = -471.9698 / 2122  # the top moves against the bit, by the inertias
    assert found.free_free[1].shape == pytest.approx([ratio, 1.0], rel=1e-12)


def test_modal_damping_ratio_is_reproduced():
    found = of(count=40, **{"drillstring.modal_damping": 0.03})
    assert [m.damping_ratio for m in found.free_free[1:]] == pytest.approx([0.03] * 30, rel=1e-9)
    assert frequencies(found.free_free) == pytest.approx(frequencies(of(count=40).free_free))
    # With the top held the shapes differ: the same dampers couple them.
    string = drillctl.load(DESIGN, **{"drillstring.modal_damping": 0.03}).string
    np.testing.assert_allclose(
        entries(found.fixed_top), expected_entries(companion_poles(string, 1), 0), rtol=1e-8
    )


def test_stiffness_proportional_damping():
    found = of(count=5, **{f"{PIPE}.stiffness_damping": "5 ms"})
    for mode in (*found.free_free[1:], *found.fixed_top):
        omega = 2 * math.pi * mode.frequency_hz
        assert mode.damping_ratio == pytest.approx(5e-3 * omega / 2, rel=1e-10)


def test_mass_proportional_damping():
    """Ratio a / (2 w), and the rigid body's speed decays at a: a real pole of its own."""
    found = of(
        count=6,
        **{
            f"{PIPE}.mass_damping": "0.2 1/s",
            "top_drive.damping": "100 N*m*s/rad",
            "bha.damping": "78.8 N*m*s/rad",
        },
    )
    rigid, speed, *elastic = found.free_free
    assert (rigid.frequency_hz, rigid.damping_ratio, rigid.overdamped) == (0.0, None, False)
    assert speed.overdamped
    assert speed.damping_ratio is None
    assert speed.frequency_hz == pytest.approx(0.2 / (2 * math.pi), rel=1e-10)
    assert not speed.torque_shape.any()
    assert len(elastic) == 4
    for mode in (*elastic, *found.fixed_top):
        omega = 2 * math.pi * mode.frequency_hz
        assert mode.damping_ratio == pytest.approx(0.2 / (2 * omega), rel=1e-9)


def test_overdamped_modes_have_two_entries_each():
    """One spring with a damper: s^2 + c/J s + k/J, J the series inertia."""
    spring = Section("spring", elements=1, stiffness=8.0, coupling_damping=12.0)
    string = assemble((spring,), top_inertia=4.0, bit_inertia=2.0)
    found = modes(string)
    inertia = 4.0 * 2.0 / 6.0
    roots = np.sort(np.abs(np.roots([1.0, 12.0 / inertia, 8.0 / inertia]))) / (2 * math.pi)
    assert frequencies(found.free_free) == pytest.approx([0.0, *roots], rel=1e-12)
    assert [m.overdamped for m in found.free_free] == [False, True, True]
    assert found.summary()["free_free"][1]["overdamped"] is True
    roots = np.sort(np.abs(np.roots([1.0, 12.0 / 2.0, 8.0 / 2.0]))) / (2 * math.pi)
    assert frequencies(found.fixed_top) == pytest.approx(roots, rel=1e-12)
    assert np.count_nonzero([m.overdamped for m in found.fixed_top]) == 2


def test_critical_damping_is_two_equal_entries():
    spring = Section("spring", elements=1, stiffness=4.0, coupling_damping=8.0)
    found = modes(assemble((spring,), top_inertia=1.0, bit_inertia=4.0)).fixed_top
    assert frequencies(found) == pytest.approx([1 / (2 * math.pi)] * 2, rel=1e-12)
    assert all(mode.overdamped for mode in found)


@pytest.mark.parametrize("elements", [6, 15])
def test_high_modes_overdamped_by_stiffness_damping(elements):
    string = drillctl.load(
        DESIGN, **{f"{PIPE}.stiffness_damping": "100 ms", f"{PIPE}.elements": elements}
    ).string
    found = modes(string, count=100)
    assert any(m.overdamped for m in found.free_free)
    assert any(m.damping_ratio is not None for m in found.free_free)
    np.testing.assert_allclose(
        entries(found.free_free[1:]), expected_entries(companion_poles(string), 2), rtol=1e-6
    )
    np.testing.assert_allclose(
        entries(found.fixed_top), expected_entries(companion_poles(string, 1), 0), rtol=1e-6
    )


def test_non_classical_lumped_string():
    string = drillctl.load("navarro-lopez-4dof").string
    assert not string.classical
    found = modes(string)
    np.testing.assert_allclose(
        entries(found.free_free[1:]), expected_entries(companion_poles(string), 1), rtol=1e-9
    )
    np.testing.assert_allclose(
        entries(found.fixed_top), expected_entries(companion_poles(string, 1), 0), rtol=1e-9
    )


@pytest.mark.parametrize(
    "values",
    [
        {"top_drive.damping": "200 N*m*s/rad"},
        {"bha.damping": "30 N*m*s/rad"},
        {"top_drive.damping": "50 kN*m*s/rad"},
        {"top_drive.damping": "1 N*m*s/rad", f"{PIPE}.stiffness_damping": "50 ms"},
        {f"{PIPE}.drag": "0.05 N*s/rad"},
    ],
)
def test_end_dampers_and_drag(values):
    string = drillctl.load(DESIGN, **values, **{f"{PIPE}.elements": 8}).string
    found = modes(string, count=30)
    assert not string.classical
    for computed, first, zeros in ((found.free_free[1:], 0, 1), (found.fixed_top, 1, 0)):
        expected = expected_entries(companion_poles(string, first), zeros)
        np.testing.assert_allclose(entries(computed), expected, rtol=1e-7, atol=1e-9)


def test_internal_damping_that_couples_modes_leaves_the_rigid_body_free():
    sections = (
        Section("pipe", elements=4, stiffness=300.0, inertia=200.0, stiffness_damping=0.05),
        Section("collars", elements=2, stiffness=900.0, inertia=150.0),
    )
    string = assemble(sections, top_inertia=500.0, bit_inertia=300.0)
    assert not string.classical
    found = modes(string).free_free
    assert [m.frequency_hz for m in found].count(0.0) == 1
    assert found[1].frequency_hz > 0.05
    np.testing.assert_allclose(
        entries(found[1:]), expected_entries(companion_poles(string), 2), rtol=1e-7
    )


def test_shapes_fulfil_the_equation_of_motion():
    string = drillctl.load(DESIGN).string
    found = modes(string)
    m, k = string.mass.toarray(), string.stiffness.toarray()
    for mode in found.free_free[1:]:
        inertia = (2 * math.pi * mode.frequency_hz) ** 2 * m @ mode.shape
        np.testing.assert_allclose(k @ mode.shape, inertia, atol=1e-9 * np.abs(inertia).max())
    for mode in found.fixed_top:
        residual = (k - (2 * math.pi * mode.frequency_hz) ** 2 * m) @ mode.shape
        np.testing.assert_allclose(residual[1:], 0.0, atol=1e-9 * np.abs(k).max())
        assert mode.shape[0] == 0.0


def test_shapes_of_a_damped_string_fulfil_it_too():
    """Null vector of s^2 M + s C + K, as it stands when its largest angle has its peak."""
    string = drillctl.load("navarro-lopez-4dof").string
    for mode in modes(string).free_free[1:]:
        ratio = 1.0 if mode.overdamped else mode.damping_ratio
        s = 2 * math.pi * mode.frequency_hz * complex(-ratio, math.sqrt(1 - ratio**2))
        dynamic = s**2 * string.mass + s * string.damping + string.stiffness
        null = np.linalg.svd(dynamic.toarray())[2][-1].conj()
        shape = (null / null[np.argmax(np.abs(null))]).real
        np.testing.assert_allclose(mode.shape, shape * np.sign(shape[-1]), atol=1e-9)


@pytest.mark.parametrize("design", [DESIGN, "navarro-lopez-4dof"])
def test_shapes_are_normalised_with_the_bit_positive(design):
    found = of(design)
    assert len(found.node_depth) == len(found.element_depth) + 1
    for mode in (*found.free_free, *found.fixed_top):
        assert np.abs(mode.shape).max() == pytest.approx(1.0)
        assert mode.shape[-1] > 0.0
    for mode in (*found.free_free[1:], *found.fixed_top):
        assert np.abs(mode.torque_shape).max() == pytest.approx(1.0)
    assert not found.free_free[0].torque_shape.any()
    # In the first elastic mode the bit leads the top: its torque is negative all the way.
    assert (of().free_free[1].torque_shape < 0).all()


def test_summary_is_strict_json_as_agreed():
    summary = of("navarro-lopez-2dof").summary()
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert set(summary) == {"free_free", "fixed_top", "mesh"}
    rigid, speed, elastic = summary["free_free"]
    assert rigid == {"frequency_hz": 0.0, "damping_ratio": None}
    assert speed["overdamped"] is True
    assert speed["damping_ratio"] is None
    assert set(elastic) == {"frequency_hz", "damping_ratio"}


def test_data_carries_units():
    data = of(count=3).data
    assert data.free_free_frequency.attrs["units"] == "Hz"
    assert data.node_depth.attrs["units"] == "m"
    assert data["free_free.shape"].shape == (3, 31)
    assert data["fixed_top.torque_shape"].shape == (3, 30)
    assert np.isnan(data.free_free_damping_ratio[0])
    assert float(data.fixed_top_frequency[0]) == pytest.approx(0.127538, abs=6e-7)


@pytest.mark.parametrize("count", [0, -3])
def test_count_is_one_or_more(count):
    with pytest.raises(InputError, match="count"):
        of(count=count)
    assert len(of(count=1).free_free) == len(of(count=1).fixed_top) == 1


@pytest.mark.parametrize(
    ("name", "at"),
    [
        ("monteiro-trindade-140kn", "each weight of the friction table"),
        ("navarro-lopez-2dof-bistable", "the weight on bit"),
    ],
)
def test_a_caption_tells_of_a_friction_table_where_there_is_one(name, at):
    captions = {one.name: one.caption for one in pictures(modes(drillctl.load(name)))}
    assert captions["friction"] == f"Bit torque against bit speed, at {at}."
