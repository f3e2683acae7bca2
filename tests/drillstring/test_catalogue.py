"""Components by name, tool joints, equal pieces: against resolved strings and printed figures."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import drillctl
from drillctl.design import parts
from drillctl.errors import InputError
from drillctl.rig.drillstring import PIPES, Parts, Section, polar_moment
from drillctl.rig.drillstring.catalogue import FOOT, POUND_PER_FOOT, find, homogenised
from drillctl.rig.drillstring.frequencies import natural_frequencies

STEEL = 7850.0
HEAD = """schema = 1
[top_drive]
inertia = "2000 kg*m^2"
[bit_rock]
law = "navarro-lopez-suarez"
a1 = 0.03
a2 = 0.06
beta = 0.1
"""


@pytest.fixture
def rig(tmp_path):
    def made(*sections, head=HEAD):
        path = tmp_path / "rig.toml"
        tables = "".join(f"[[drillstring.sections]]\n{lines}\n" for lines in sections)
        path.write_text(head + tables, encoding="utf-8")
        return drillctl.load(path)

    return made


@pytest.mark.parametrize("name", [n for n, p in PIPES.items() if p.kind == "drill pipe"])
def test_a_pipe_weighs_what_it_is_called(name):
    """Nominal weights are those of plain pipe with threads and couplings, once upon a time."""
    pipe = PIPES[name]
    area = math.pi / 4 * (pipe.outer_diameter**2 - pipe.inner_diameter**2)
    assert 0.87 < area * STEEL / pipe.weight < 1.0
    for joint in pipe.joints.values():
        assert joint.outer_diameter > pipe.outer_diameter
        assert 0.0 < joint.inner_diameter < pipe.outer_diameter


@pytest.mark.parametrize(
    ("name", "grade", "printed"),  # approximate weights of RP 7G, lb/ft
    [("5 in 19.5 lb/ft", "S-135", 22.61), ("5 1/2 in 21.9 lb/ft", "S-135", 26.37),
     ("4 in 14.0 lb/ft", "G-105", 15.91), ("6 5/8 in 27.7 lb/ft", "E-75", 29.06),
     ("5 in HWDP", None, 49.3)],
)  # fmt: skip
def test_a_pipe_with_its_joints_weighs_what_is_printed(name, grade, printed):
    pipe = PIPES[name]
    body = math.pi / 4 * (pipe.outer_diameter**2 - pipe.inner_diameter**2)
    mass = body * pipe.joint_spacing
    for one in (pipe.joint(grade), pipe.upset):
        if one is not None:
            area = math.pi / 4 * (one.outer_diameter**2 - one.inner_diameter**2)
            mass += (area - body) * one.length
    assert mass * STEEL / pipe.joint_spacing / POUND_PER_FOOT == pytest.approx(printed, rel=0.017)


@pytest.mark.parametrize(
    ("written", "name"),
    [("4.5 in 16.60 lb/ft", "4 1/2 in 16.6 lb/ft"), ('5-1/2" 21.9#', "5 1/2 in 21.9 lb/ft"),
     ("5 in 19.5 lb/ft", "5 in 19.5 lb/ft"), ('5" heavy weight', "5 in HWDP"),
     ("6.75 in x 2.8125 in collar", "6 3/4 in x 2 13/16 in collar"),
     ("6 3/4 in mwd", "6 3/4 in MWD"), ("7 in 30 lb/ft", None), ("pipe", None)],
)  # fmt: skip
def test_a_component_is_found_however_it_is_spelt(written, name):
    assert find(written) == name


def test_an_unknown_pipe_names_the_nearest(rig):
    assert rig('name = "p"\npipe = "4.5 in 16.60 lb/ft"\nlength = "9 m"').string.nodes > 1
    with pytest.raises(InputError, match=r"did you mean '5 in 19\.5 lb/ft'"):
        rig('name = "p"\npipe = "5 in 19.9 lb/ft"\nlength = "9 m"')


def resolved(count, pipe, joint, inertia=2000.0, bit=300.0):
    """A string with every joint of pipe as two sections."""
    body = polar_moment(pipe.outer_diameter, pipe.inner_diameter)
    thick = polar_moment(joint.outer_diameter, joint.inner_diameter)
    lengths = (pipe.joint_spacing - joint.length, joint.length)
    sections = tuple(
        Section(f"{n} {part}", 1, 79.3e9 * j / x, STEEL * j * x, length=x)
        for n in range(count)
        for part, (x, j) in enumerate(zip(lengths, (body, thick), strict=True))
    )
    return Parts(sections, inertia, bit, 0.0, 0.0, 0.0, "consistent")


def test_tool_joints_are_those_of_a_string_that_resolves_each(rig):
    """Both by the exact line, so that no mesh is between them: 0.1 % in the first five modes."""
    pipe = PIPES["5 in 19.5 lb/ft"]
    line = 'name = "p"\npipe = "5 in 19.5 lb/ft"\ngrade = "S-135"\n'
    smooth = rig(line + f'tool_joints = true\nlength = "{200 * pipe.joint_spacing} m"')
    assert smooth.string.yield_torque == pytest.approx(100.5e3, rel=2e-3)
    mine = replace(smooth.string.parts, bit_inertia=300.0)
    theirs = resolved(200, pipe, pipe.joint("S-135"))
    for held in (False, True):
        made = natural_frequencies(mine, "wave", 6, held)
        exact = natural_frequencies(theirs, "wave", 6, held, bisections=40)
        np.testing.assert_allclose(made, exact, rtol=3e-4)
    bare = rig(line + f'length = "{200 * pipe.joint_spacing} m"').string
    without = natural_frequencies(replace(bare.parts, bit_inertia=300.0), "wave", 6, True)
    assert without[5] / exact[5] > 1.05  # the joints count


def test_joints_by_their_own_numbers_are_those_of_the_catalogue(rig):
    pipe = PIPES["5 in 19.5 lb/ft"]
    joint = pipe.joint("X-95")
    named = 'name = "p"\npipe = "5 in 19.5 lb/ft"\ngrade = "X-95"\nlength = "940 m"\n'
    given = (
        f'joint_outer_diameter = "{joint.outer_diameter} m"\n'
        f'joint_inner_diameter = "{joint.inner_diameter} m"\njoint_length = "{joint.length} m"\n'
    )
    (one,) = rig(named + "tool_joints = true").string.parts.sections
    (other,) = rig(named + given).string.parts.sections
    assert (one.stiffness, one.inertia) == (other.stiffness, other.inertia)
    factors = homogenised(pipe.outer_diameter, pipe.inner_diameter, 31 * FOOT, (joint,))
    (body,) = rig(named).string.parts.sections
    assert one.inertia / body.inertia == pytest.approx(factors.inertia, rel=1e-14)
    assert 1.0 < factors.stiffness < 1.1 < factors.inertia < 1.5


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ('pipe = "5 in 19.5 lb/ft"\njoint_length = "0.5 m"', "joint_outer_diameter is missing"),
        ('polar_moment = "1e-5 m^4"\ntool_joints = true', "needs a pipe that has some"),
        ('pipe = "5 in 19.5 lb/ft"\njoint_spacing = "9 m"', "joint_spacing is of tool joints"),
        ('pipe = "5 in 19.5 lb/ft"\ntool_joints = true\njoint_spacing = "0.3 m"', "must be less"),
    ],
)
def test_joints_that_cannot_be_are_refused(rig, lines, message):
    with pytest.raises(InputError, match=message):
        rig(f'name = "p"\nlength = "900 m"\n{lines}')


def test_equal_springs_are_as_many_sections(rig):
    """The soft string of 42 segments of a public model."""
    spring = 'stiffness = "35950 N*m/rad"\ninertia = "3.2021 kg*m^2"\n'
    short = rig(f'name = "s"\nrepeat = 42\n{spring}').string
    long = rig(*(f'name = "s {n}"\n{spring}' for n in range(42))).string
    assert short.nodes == 43
    assert (short.mass != long.mass).nnz == (short.stiffness != long.stiffness).nnz == 0


def test_equal_lengths_are_one_run_unless_something_is_at_their_ends(rig):
    tube = 'name = "p"\nouter_diameter = "127 mm"\ninner_diameter = "108.6 mm"\n'
    (run,) = rig(f'{tube}length = "9.45 m"\nrepeat = 42').string.parts.sections
    (one,) = rig(f'{tube}length = "{9.45 * 42} m"').string.parts.sections
    assert run == one
    loaded = rig(f'{tube}length = "200 m"\nrepeat = 3\ninertia = "50 kg*m^2"')
    ends = loaded.string.parts.sections
    assert [x.end_inertia for x in ends] == [50.0] * 3
    assert [x.name for x in loaded.mesh] == ["p 1", "p 2", "p 3"]
    assert loaded.string.mass.sum() == pytest.approx(2000 + 150 + sum(x.inertia for x in ends))


def test_a_point_inertia_stays_where_it_is_when_a_piece_beside_it_is_lumped(rig):
    """Frequencies of the chosen mesh are those of the exact line, with short pieces around it."""
    tube = 'outer_diameter = "165 mm"\ninner_diameter = "71 mm"\n'
    design = rig(
        'name = "pipe"\npipe = "5 in 19.5 lb/ft"\nlength = "2000 m"\ninertia = "80 kg*m^2"',
        f'name = "sub"\n{tube}length = "0.5 m"\ninertia = "20 kg*m^2"',
        f'name = "collars"\n{tube}length = "150 m"',
    )
    made = design.string.parts
    exact = replace(made, sections=tuple(map(parts.section, parts.pieces(design.tables))))
    assert len(made.sections) < len(exact.sections) == 3
    for held in (False, True):
        np.testing.assert_allclose(
            natural_frequencies(made, "wave", 6, held),
            natural_frequencies(exact, "wave", 6, held),
            rtol=1e-3,
        )


def test_a_tool_has_the_numbers_of_the_catalogue(rig):
    (jar,) = rig('name = "jar"\npipe = "6 3/4 in jar"').string.parts.sections
    assert (jar.stiffness, jar.inertia) == (3.35e5, 5.35)
    assert jar.length == 9.75


def test_the_catalogue_is_listed_with_its_sources(capsys):
    from drillctl.cli import run

    assert run(["catalog", "--json"]) == 0
    listed = {one["name"]: one for one in json.loads(capsys.readouterr().out)["components"]}
    assert list(listed) == list(PIPES)
    assert all(one["source"] and one["checked"] for one in listed.values())
    pipe = listed["5 in 19.5 lb/ft"]
    assert pipe["yield_torque"] == pytest.approx(100.5e3, rel=2e-3)
    assert pipe["mass_per_length_with_joints"] == pytest.approx(22.4 * POUND_PER_FOOT, rel=5e-3)
    jar = listed["6 3/4 in jar"]
    assert (jar["mass"], jar["inertia"], jar["stiffness"]) == (1310.0, 5.35, 3.35e5)


def test_show_prints_the_factors_of_tool_joints(capsys):
    from drillctl.cli import run

    assert run(["show", "typical-land"]) == 0
    assert "5 1/2 in drill pipe: inertia of the body x 1.4037, stiff" in capsys.readouterr().out
