"""Elements that a design does not name."""

import numpy as np
import pytest

import drillctl
from drillctl import catalog
from drillctl.design import parts
from drillctl.rig.drillstring.frequencies import natural_frequencies

HOLDS = {
    "elements where a design names none": "the first five frequencies of the exact line to 0.3 %, "
    "top free and held; inertia, compliance and damping of lumped pieces kept",
}

ENDS = """
[operating_point]
speed = "110 rpm"
weight_on_bit = "100 kN"
[top_drive]
inertia = "{top} kg*m^2"
[bha]
inertia = "{bit} kg*m^2"
[bit_rock]
law = "navarro-lopez-suarez"
a1 = 0.03
a2 = 0.06
beta = 0.15
[drillstring]
mass = "{mass}"
"""
PIPE = ("pipe", 4000.0, 127.0, 108.6)
TALLY = (
    PIPE, ("hwdp", 110.0, 127.0, 76.2), ("jar", 9.6, 165.0, 70.0), ("collar", 80.0, 171.0, 71.4),
    ("stabiliser", 1.8, 171.0, 71.4), ("mwd", 8.5, 171.0, 100.0), ("filter", 0.41, 171.0, 71.4),
    ("motor", 7.2, 171.0, 90.0), ("bit sub", 0.5, 171.0, 71.4),
)  # fmt: skip


@pytest.fixture
def rig(tmp_path):
    """A rig of lines of a tally: name, length (m), diameters (mm), further keys."""

    def load(*lines, top=2000, bit=20, mass="consistent", **values):
        text = ENDS.format(top=top, bit=bit, mass=mass)
        for name, length, outer, inner, *more in lines:
            text += f'[[drillstring.sections]]\nname = "{name}"\nlength = "{length} m"\n'
            text += f'outer_diameter = "{outer} mm"\ninner_diameter = "{inner} mm"\n'
            text += "\n".join([*more, ""])
        path = tmp_path / "rig.toml"
        path.write_text(text)
        return drillctl.load(path, **values)

    return load


def errors(design):
    """Of the first five elastic frequencies, top free and held, beside the unlumped continuum."""
    found = []
    for held in (False, True):
        count = 5 + (not held)
        exact = natural_frequencies(parts._parts(design.tables), "wave", count, held)[-5:]
        mesh = natural_frequencies(design.string.parts, "finite-elements", count, held)[-5:]
        found.append(np.abs(mesh / exact - 1.0).max())
    return max(found)


RIGS = {
    "3000 m": ((("pipe", 3000.0, 127.0, 108.6),), {"top": 500, "bit": 394}),
    "60 m": ((("pipe", 60.0, 127.0, 108.6),), {}),
    "no bit": ((PIPE,), {"bit": 0}),
    "tally": (TALLY, {}),
    "light bit": (TALLY, {"bit": 0.5}),
    "lumped masses": (TALLY, {"mass": "lumped"}),
}


@pytest.mark.parametrize("name", RIGS)
def test_five_frequencies_are_those_of_the_exact_line(rig, name):
    lines, ends = RIGS[name]
    design = rig(*lines, **ends)
    assert 0.0015 < errors(design) <= 0.003  # and no more elements than that takes
    assert design.string.nodes < 75


def test_a_given_mesh_is_left_alone(rig):
    design = rig(*((*line, f"elements = {n}") for n, line in enumerate(TALLY, start=3)))
    assert [one.elements for one in design.mesh] == list(range(3, 3 + len(TALLY)))
    assert all(one.said == "given" for one in design.mesh)
    assert [s.name for s in design.string.parts.sections] == [line[0] for line in TALLY]


def test_a_given_piece_is_lumped_into_nothing_and_holds_nothing(rig):
    lines = [(*x, "elements = 1") if x[0] in ("filter", "collar") else x for x in TALLY]
    mesh = {one.name: one for one in rig(*lines).mesh}
    assert (mesh["filter"].said, mesh["collar"].said) == ("given", "given")
    assert "filter" not in {one.lumped_into for one in mesh.values()}
    assert mesh["stabiliser"].lumped_into != "collar"
    assert mesh["bit sub"].lumped_into == "motor"


def test_lumping_keeps_inertia_compliance_and_damping_of_slow_motion(rig):
    more = [
        'damping = "40 N*m*s/rad"', 'stiffness_damping = "2e-3 s"', 'mass_damping = "0.3 1/s"',
        'drag = "0.02 N*s/rad"',
    ]  # fmt: skip
    lines = [(*line, *more[: k % 5]) for k, line in enumerate(TALLY)]
    whole = rig(*lines)
    apart = rig(*((*line, "elements = 1") for line in lines))
    assert len(whole.string.parts.sections) < len(TALLY) == len(apart.string.parts.sections)

    def kept(string):
        line = string.parts.sections
        return (
            sum(s.length for s in line), string.mass.sum(), string.static_stiffness,
            string.ground_damping.sum(), sum(s.coupling_damping / s.stiffness**2 for s in line),
            sum(s.stiffness_damping / s.stiffness for s in line),
        )  # fmt: skip

    assert kept(whole.string) == pytest.approx(kept(apart.string), rel=1e-12)


def test_what_was_done_is_said(rig):
    mesh = {one.name: one for one in rig(*TALLY).mesh}
    assert list(mesh) == [line[0] for line in TALLY]
    pipe, sub = mesh["pipe"], mesh["bit sub"]
    assert (pipe.said, pipe.length) == ("chosen", 4000.0 / pipe.elements)
    assert (sub.elements, sub.said) == (0, "lumped into collar")
    assert sub.summary()["length"] is None
    modes = drillctl.modes(rig(*TALLY))
    assert modes.summary()["mesh"] == [one.summary() for one in modes.design.mesh]


@pytest.mark.parametrize(
    "name", [name for name in catalog.names("models") if not name.startswith("typical")]
)
def test_published_models_name_their_elements(name):
    """Their numbers do not move with the rule by which elements are chosen."""
    assert not any(one.chosen for one in drillctl.load(name).mesh)


def test_a_finer_mesh_of_a_report_leaves_lumped_pieces_where_they_are(rig):
    from drillctl.studies import simulate
    from drillctl.studies.base import Requested

    design = rig(*TALLY)
    finer = simulate._finer_mesh(4, Requested(design, None, {}))
    assert finer.mesh[0].elements == 4 * design.mesh[0].elements
    assert len(finer.string.parts.sections) >= len(design.string.parts.sections)
