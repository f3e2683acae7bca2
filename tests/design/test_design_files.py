"""Design files: layers, values set by path, and writing that reads back to the same design."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import pydantic
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import drillctl
from drillctl import catalog, units
from drillctl.design import parameter, parameters, parse_setting, to_toml
from drillctl.design.reading import parse_axis
from drillctl.design.validation import validated
from drillctl.errors import InputError
from drillctl.rig.bit_rock import NavarroLopezSuarez
from drillctl.rig.top_drive import PI, ConstantTorque

PAPER = "monteiro-trindade-140kn"
SHIPPED = [*catalog.names("models"), *catalog.names("designs")]

RIG = """\
schema = 1
title = "a rig"
[operating_point]
speed = "120 rpm"
weight_on_bit = "50 kN"
[[drillstring.sections]]
name = "pipe"
pipe = "5 in 19.5 lb/ft"
length = "1000 m"
[[drillstring.sections]]
name = "collars"
outer_diameter = "6 3/4 in"
inner_diameter = "2 13/16 in"
length = "200 m"
shear_modulus = "80 GPa"
[top_drive]
inertia = "2000 kg*m^2"
[bha]
inertia = "50 kg*m^2"
[bit_rock]
law = "navarro-lopez-suarez"
a1 = 0.03
a2 = 0.08
beta = 0.1
a1_factor = 1.5
[controller]
law = "pi"
kp = 600.0
ki = 120.0
[start]
speed = "70 rpm"
"""


@pytest.fixture
def over_rig(tmp_path):
    """A function that loads a design with the given text, laid over `RIG`."""

    def load(text, **values):
        (tmp_path / "rig.toml").write_text(RIG)
        (tmp_path / "design.toml").write_text(f'model = "rig.toml"\n{text}')
        return drillctl.load(tmp_path / "design.toml", **values)

    return load


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("designs") / "resolved.toml"


def read_back(design, path):
    path.write_text(to_toml(design), encoding="utf-8")
    return drillctl.load(path)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_file_loads_complete(name):
    design = drillctl.load(name)
    assert design.name == name
    assert design.tables.title
    assert design.tables.source
    assert design.string.nodes >= 2
    rock = design.bit_rock.static_torque(design.tables.operating_point.weight_on_bit)
    assert rock + (design.wall.total if design.wall else 0.0) > 0
    assert design.top_drive.gains() is not None
    assert design.weight_on_bit.weight(10.0) == design.tables.operating_point.weight_on_bit


@pytest.mark.parametrize("name", SHIPPED)
def test_resolved_design_reads_back_equal(name, tmp_path):
    design = drillctl.load(name)
    again = read_back(design, tmp_path / "resolved.toml")
    assert again == design
    assert hash(again) == hash(design)
    assert to_toml(again) == to_toml(design)


def test_a_design_is_shown_in_a_line():
    shown = repr(drillctl.load("monteiro-trindade-140kn"))
    assert "pi, 100 rpm, 140 kN" in shown
    assert len(shown) < 200


def test_an_empty_list_in_the_place_of_a_default_reads_back_empty(tmp_path):
    design = drillctl.load("monteiro-trindade-140kn", **{"recommend.laws": []})
    assert read_back(design, tmp_path / "resolved.toml").tables.recommend.laws == ()


def positive(low, high):
    return st.floats(low, high, allow_nan=False)


OVERRIDES = st.fixed_dictionaries(
    {},
    optional={
        "operating_point.speed": st.one_of(
            positive(1e-3, 1e3).map(units.SI), positive(1, 500).map("{!r} rpm".format)
        ),
        "operating_point.weight_on_bit": positive(80.1, 159.9).map("{!r} kN".format),
        "drillstring.sections.pipe.length": positive(2, 1e4).map("{!r} ft".format),
        "drillstring.sections.pipe.outer_diameter": st.integers(40, 160).map("{} 1/16 in".format),
        "drillstring.sections.pipe.inner_diameter": positive(0, 100).map("{!r} mm".format),
        "drillstring.sections.pipe.shear_modulus": positive(1, 200).map("{!r} GPa".format),
        "drillstring.sections.pipe.density": positive(1, 2e4).map("{!r} kg/m3".format),
        "drillstring.sections.pipe.elements": st.integers(1, 300),
        "drillstring.sections.pipe.drag": positive(0, 5).map(units.SI),
        "drillstring.modal_damping": positive(0, 0.5),
        "drillstring.mass": st.sampled_from(["consistent", "lumped"]),
        "top_drive.inertia": positive(1e-6, 1e5).map("{!r} kg*m^2".format),
        "bha.inertia": st.one_of(st.just(units.SI(-0.0)), positive(1e-6, 1e5).map(units.SI)),
        "bit_rock.a1_factor": positive(0.01, 1),
        "bit_rock.beta_factor": positive(1e-3, 1e3),
        "bit_rock.outside_table": st.sampled_from(["refuse", "extrapolate"]),
        "controller.kp": st.one_of(positive(-1e4, 1e4), positive(0, 9).map("{!r} N*m*s".format)),
        "controller.ki": st.one_of(st.integers(-500, 500), st.just(-0.0)),
        "start.kind": st.sampled_from(["rest", "turning", "wound_up"]),
        "simulation.duration": positive(60, 500).map("{!r} s".format),
        "simulation.j1_from": positive(0, 59).map("{!r} s".format),
        "simulation.step": positive(0.1, 50).map("{!r} ms".format),
        "simulation.engine": st.sampled_from(["reference", "batch"]),
        "map.levels": st.lists(positive(1, 100), min_size=1, max_size=4),
        "title": st.text(max_size=20),
        "notes": st.text(st.characters(exclude_categories=["Cs"]), max_size=40),
    },
)


@settings(max_examples=60, deadline=None)
@given(values=OVERRIDES)
def test_any_valid_design_reads_back_equal(values, scratch):
    design = drillctl.load(PAPER, **values)
    again = read_back(design, scratch)
    assert again == design
    assert hash(again) == hash(design)


@settings(max_examples=40, deadline=None)
@given(values=OVERRIDES)
def test_replace_equals_loading_with_the_values(values):
    assert drillctl.load(PAPER).replace(values) == drillctl.load(PAPER, **values)


@settings(max_examples=30, deadline=None)
@given(values=OVERRIDES, data=st.data())
def test_order_of_values_does_not_matter(values, data):
    shuffled = dict(data.draw(st.permutations(list(values.items()))))
    assert drillctl.load(PAPER, **shuffled) == drillctl.load(PAPER, **values)


def test_replace_equals_the_value_in_the_file(tmp_path):
    file = tmp_path / "changed.toml"
    file.write_text(RIG.replace("600.0", "450.5").replace('"1000 m"', '"3000 ft"'))
    (tmp_path / "rig.toml").write_text(RIG)
    changed = drillctl.load(tmp_path / "rig.toml").replace(
        {"controller.kp": 450.5, "drillstring.sections.pipe.length": "3000 ft"}
    )
    assert changed == drillctl.load(file)
    assert changed != drillctl.load(tmp_path / "rig.toml")


def test_replace_leaves_the_first_design_alone():
    design = drillctl.load(PAPER)
    design.replace({"controller.kp": 1.0, "drillstring.sections.pipe.length": "1 m"})
    assert design == drillctl.load(PAPER)
    assert design.replace({"controller.kp": 2.0}).tables.drillstring == design.tables.drillstring


def test_design_is_laid_over_its_model(over_rig):
    tables = over_rig('[operating_point]\nspeed = "90 rpm"').tables
    assert tables.operating_point.speed == pytest.approx(90 * units.RPM)
    assert tables.operating_point.weight_on_bit == 50e3
    assert tables.title == "a rig"


def test_sections_are_merged_by_name_and_keep_their_order(over_rig):
    sections = over_rig(
        '[[drillstring.sections]]\nname = "collars"\nlength = "150 m"\n'
        '[[drillstring.sections]]\nname = "bit sub"\npolar_moment = "1e-4 m^4"\nlength = "2 m"\n'
        '[[drillstring.sections]]\nname = "pipe"\nelements = 7\n'
    ).tables.drillstring.sections
    assert [s.name for s in sections] == ["pipe", "collars", "bit sub"]
    assert [s.length for s in sections] == [1000.0, 150.0, 2.0]
    assert sections[0].pipe == "5 in 19.5 lb/ft"
    assert sections[0].elements == 7
    assert sections[1].outer_diameter == pytest.approx(0.17145)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("outer_diameter", '"5 in"\ninner_diameter = "4 in"'),
        ("polar_moment", '"1e-5 m^4"'),
        ("pipe", '"4 in 14.0 lb/ft"'),
    ],
)
def test_another_cross_section_replaces_the_models(over_rig, key, value):
    for name in ("pipe", "collars"):
        text = f'[[drillstring.sections]]\nname = "{name}"\n{key} = {value}'
        sections = {s.name: s for s in over_rig(text).tables.drillstring.sections}
        ways = ("pipe", "outer_diameter", "polar_moment", "stiffness")
        assert [way for way in ways if getattr(sections[name], way) is not None] == [key]


def test_youngs_modulus_replaces_the_models_shear_modulus(over_rig):
    text = '[[drillstring.sections]]\nname = "collars"\nyoungs_modulus = "208 GPa"'
    section = over_rig(text).tables.drillstring.sections[1]
    assert (section.shear_modulus, section.youngs_modulus) == (None, 208e9)


def test_another_law_drops_the_numbers_of_the_old(over_rig):
    design = over_rig('[controller]\nlaw = "constant-torque"\ntorque = "8 kN*m"')
    assert design.top_drive == ConstantTorque(8e3)
    with pytest.raises(InputError, match=r"controller\.ki: is missing"):
        design.replace({"controller.law": "pi", "controller.kp": 3.0})


def test_the_same_law_keeps_its_other_numbers(over_rig):
    assert over_rig('[controller]\nlaw = "pi"\nkp = 1.0').top_drive == PI(1.0, 120.0)
    assert over_rig("[controller]\nkp = 1.0").top_drive == PI(1.0, 120.0)


@pytest.mark.parametrize("swap", [False, True])
def test_law_and_its_number_come_in_any_order(over_rig, swap):
    values = {"controller.law": "constant-torque", "controller.torque": "8 kN*m"}
    values = dict(reversed(values.items())) if swap else values
    assert over_rig("", **values).top_drive == ConstantTorque(8e3)
    assert over_rig("").replace(values).top_drive == ConstantTorque(8e3)


def test_another_kind_of_start_drops_the_speed(over_rig):
    assert over_rig("").tables.start.speed == pytest.approx(70 * units.RPM)
    start = over_rig('[start]\nkind = "rest"').tables.start
    assert (start.kind, start.speed) == ("rest", None)
    start = over_rig("", **{"start.kind": "wound_up"}).tables.start
    assert (start.kind, start.speed) == ("wound_up", None)
    assert over_rig('[start]\nkind = "turning"').tables.start.speed is not None


TABLE = (
    'table = [{ weight_on_bit = "40 kN", a1 = 0.01, a2 = 0.02, beta = 0.1 },'
    ' { weight_on_bit = "60 kN", a1 = 0.01, a2 = 0.02, beta = 0.1 }]'
)


def test_a_friction_table_replaces_single_coefficients_and_back(over_rig):
    design = over_rig(f"[bit_rock]\n{TABLE}")
    assert design.tables.bit_rock.a1 is None
    assert design.tables.bit_rock.a1_factor == 1.5
    assert design.bit_rock == pytest.approx((0.015, 0.02, 0.1))
    back = design.replace({"bit_rock.a1": 0.04, "bit_rock.a2": 0.09, "bit_rock.beta": 0.2})
    assert back.tables.bit_rock.table is None
    assert back.bit_rock == pytest.approx((0.06, 0.09, 0.2))


def test_model_is_looked_for_beside_the_design(tmp_path, monkeypatch):
    inner = tmp_path / "rigs" / "deep"
    inner.mkdir(parents=True)
    (tmp_path / "rigs" / "rig.toml").write_text(RIG)
    (inner / "case.toml").write_text('model = "../rig.toml"\n[controller]\nkp = 1.0')
    monkeypatch.chdir(tmp_path)
    assert drillctl.load("rigs/deep/case.toml").top_drive == PI(1.0, 120.0)


def test_model_of_a_model(over_rig, tmp_path):
    over_rig("[controller]\nkp = 1.0")
    (tmp_path / "top.toml").write_text('model = "design.toml"\n[controller]\nki = 2.0')
    assert drillctl.load(tmp_path / "top.toml").top_drive == PI(1.0, 2.0)


@pytest.mark.parametrize("chain", [["a"], ["a", "b"], ["a", "b", "c"]])
def test_a_model_that_leads_back_is_refused(tmp_path, chain):
    for name, below in zip(chain, [*chain[1:], chain[0]], strict=True):
        (tmp_path / f"{name}.toml").write_text(f'model = "{below}.toml"')
    with pytest.raises(InputError) as caught:
        drillctl.load(tmp_path / "a.toml")
    assert str(caught.value).endswith(f"{chain[-1]}.toml: model: 'a.toml' leads back to this file")


def test_a_gain_alone_changes_the_default_controller(tmp_path):
    (tmp_path / "rig.toml").write_text(RIG[: RIG.index("[controller]")])
    design = drillctl.load(tmp_path / "rig.toml")
    assert design.top_drive == PI(200.0, 100.0)
    assert design.replace({"controller.kp": 300.0}).top_drive == PI(300.0, 100.0)
    torque = {"controller.torque": "1 kN*m", "controller.law": "constant-torque"}
    assert design.replace(torque).top_drive == ConstantTorque(1e3)


def test_section_names_may_hold_dots_and_spaces(tmp_path):
    text = RIG.replace('"pipe"', '"5 in"', 1).replace('"collars"', '"5 in.lower"')
    (tmp_path / "rig.toml").write_text(text)
    design = drillctl.load(tmp_path / "rig.toml")
    changed = design.replace(
        {
            "drillstring.sections.5 in.length": "10 m",
            "drillstring.sections.5 in.lower.length": "20 m",
        }
    )
    assert [s.length for s in changed.tables.drillstring.sections] == [10.0, 20.0]


def test_a_whole_section_can_be_set(over_rig):
    value = {"stiffness": "500 N*m/rad", "length": "1 m"}
    with pytest.raises(InputError, match="length is not allowed with stiffness"):
        over_rig("", **{"drillstring.sections.pipe": value})
    value = {"polar_moment": "1e-5 m^4", "elements": 3}
    section = over_rig("", **{"drillstring.sections.pipe": value}).tables.drillstring.sections[0]
    assert (section.pipe, section.elements, section.length) == (None, 3, 1000.0)


def test_byte_order_mark_is_no_mistake(tmp_path):
    (tmp_path / "rig.toml").write_text(RIG, encoding="utf-8-sig")
    assert drillctl.load(tmp_path / "rig.toml").top_drive == PI(600.0, 120.0)


def test_design_is_frozen():
    design = drillctl.load(PAPER)
    with pytest.raises(dataclasses.FrozenInstanceError):
        design.name = "other"
    with pytest.raises(pydantic.ValidationError):
        design.tables.operating_point.speed = 1.0
    with pytest.raises(AttributeError):
        design.bit_rock.a1 = 0.0


def test_designs_compare_by_their_tables(tmp_path):
    design = drillctl.load(PAPER)
    assert design == read_back(design, tmp_path / "other name.toml")
    assert len({design, drillctl.load(PAPER), drillctl.load("monteiro-trindade-120kn")}) == 2
    assert design != design.replace({"controller.kp": 625.0000001})
    zeros = [design.replace({"controller.ki": zero}) for zero in (0.0, -0.0)]
    assert len(set(zeros)) == 1


@pytest.mark.parametrize("again", [copy.deepcopy, lambda d: pickle.loads(pickle.dumps(d))])
@pytest.mark.parametrize("name", [PAPER, "navarro-lopez-4dof"])
def test_copies_are_equal(name, again):
    design = drillctl.load(name)
    assert design.string.nodes  # with the cached string in it
    other = again(design)
    assert other == design
    assert other.replace({"bha.inertia": "9 kg*m^2"}) == design.replace({"bha.inertia": "9 kg*m^2"})


def test_parameters_bear_their_path_unit_and_value():
    design = drillctl.load(PAPER)
    found = {p.path: p for p in parameters(design)}
    assert found["controller.kp"].value == 625.0
    assert found["operating_point.weight_on_bit"].value == 140e3
    assert found["operating_point.weight_on_bit"].si_unit == "N"
    assert found["drillstring.sections.pipe.length"].value == 3000.0
    assert found["bit_rock.a1_factor"].si_unit == ""
    assert "bit_rock.law" not in found
    assert "controller.torque" not in found
    assert parameter(design, "start.speed").parse("70 rpm") == pytest.approx(70 * units.RPM)
    assert parameter(design, "bit_rock.a1_factor").parse("0.5") == 0.5


@pytest.mark.parametrize("name", SHIPPED)
def test_every_parameter_can_be_set_to_its_own_value(name):
    design = drillctl.load(name)
    set_again = {
        p.path: units.SI(p.value) if p.kind else p.value
        for p in parameters(design)
        if p.value is not None
    }
    assert design.replace(set_again) == design


@pytest.mark.parametrize(
    ("text", "path", "value"),
    [
        ("controller.kp=300", "controller.kp", 300),
        ("controller.kp = 3e2", "controller.kp", 300.0),
        ("operating_point.speed=120 rpm", "operating_point.speed", "120 rpm"),
        ('operating_point.speed="120 rpm"', "operating_point.speed", "120 rpm"),
        ("start.kind=rest", "start.kind", "rest"),
        ("map.levels=[10, 20]", "map.levels", [10, 20]),
        ("title=a = b", "title", "a = b"),
    ],
)
def test_setting_of_the_command_line(text, path, value):
    assert parse_setting(text) == (path, value)


def test_axis_of_the_command_line():
    axis = {"path": "controller.kp", "min": 0.0, "max": 1000.0, "points": 41}
    assert parse_axis("controller.kp=0:1000:41") == axis
    axis = {"path": "operating_point.speed", "min": "60 rpm", "max": "180 rpm", "points": 3}
    assert parse_axis("operating_point.speed=60 rpm:180 rpm:3") == axis


def test_reconstructed_rig_as_numbers():
    design = drillctl.load(PAPER)
    assert design.speed == pytest.approx(100 * units.RPM)
    assert design.bit_rock == NavarroLopezSuarez(0.026, 0.085, 0.098)
    assert design.string.static_stiffness == pytest.approx(315.32, abs=0.005)
    assert design.tables.start.speed == pytest.approx(70 * units.RPM)


@pytest.mark.parametrize("name", ["monteiro-trindade-2012", "navarro-lopez-4dof", "typical-land"])
def test_a_change_gives_what_reading_the_whole_gives(name):
    """What does not change is not validated again."""
    design = drillctl.load(name)
    changes = [
        {one.path: units.SI(0.99 * one.value + 1e-3) if one.kind else 0.99 * one.value + 1e-3}
        for one in parameters(design)[::4] if one.value is not None and not one.whole
    ]  # fmt: skip
    changes.append({"controller.law": "pi", "controller.kp": 1.0, "controller.ki": 2.0})
    compared = 0
    for change in changes:
        try:
            changed = design.replace(change).replace({"title": "another"})
        except InputError:  # beyond its range
            continue
        compared += 1
        assert changed.tables == validated(changed.tree, changed.origin)
        assert changed != design
    assert compared > 0.6 * len(changes)
