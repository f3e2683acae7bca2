"""Whatever is wrong in a design is told in one line: file, key, what came, what is allowed."""

from __future__ import annotations

import copy
import datetime
import math
import os
import re
import tomllib
from pathlib import Path

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

import drillctl
from drillctl import catalog, units
from drillctl.design import Design, parameter, parameters, parse_setting, to_toml
from drillctl.design.reading import parse_axis, to_tree
from drillctl.errors import InputError
from drillctl.text import one_line

HOLDS = {
    "design files": "round trip, every kind of mistake, fuzzing",
}

PAPER = "monteiro-trindade-140kn"

HEAD = 'schema = 1\ntitle = "a rig"\n'
OPERATING_POINT = '[operating_point]\nspeed = "120 rpm"\nweight_on_bit = "50 kN"\n'
SECTION = '[[drillstring.sections]]\nname = "pipe"\n'
PIPE = f'{SECTION}pipe = "5 in 19.5 lb/ft"\nlength = "1000 m"\n'
ENDS = '[top_drive]\ninertia = "2000 kg*m^2"\n[bha]\ninertia = "50 kg*m^2"\n'
FRICTION = '[bit_rock]\nlaw = "navarro-lopez-suarez"\na1 = 0.03\na2 = 0.08\nbeta = 0.1\n'
CONTROLLER = '[controller]\nlaw = "pi"\nkp = 600.0\nki = 120.0\n'


def rig(
    head=HEAD,
    operating_point=OPERATING_POINT,
    string=PIPE,
    ends=ENDS,
    friction=FRICTION,
    controller=CONTROLLER,
    more="",
):
    """A valid design as text, with parts of it replaced."""
    return head + operating_point + string + ends + friction + controller + more


@pytest.fixture
def told(tmp_path):
    """A function that returns what is said of a design, after the file's name."""

    def tell(text, **values):
        path = tmp_path / "rig.toml"
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError) as caught:
            drillctl.load(path, **values)
        message = str(caught.value)
        assert "\n" not in message
        place = re.match(rf"{re.escape(str(path))}(:\d+)?: ", message)
        assert place
        return message[place.end() :]

    return tell


def test_the_text_that_is_spoilt_below_is_valid(tmp_path):
    (tmp_path / "rig.toml").write_text(rig())
    assert drillctl.load(tmp_path / "rig.toml").string.nodes > 40


# Files and names


@pytest.mark.parametrize(
    "name", ["nowhere.toml", "no/such/design.toml", "./rig", "~nobody-here/r.toml"]
)
def test_missing_file(name):
    with pytest.raises(InputError) as caught:
        drillctl.load(name)
    assert name in str(caught.value)
    assert "no such file" in str(caught.value) or "cannot be read" in str(caught.value)


def test_missing_file_with_a_neighbour_of_nearly_that_name(tmp_path):
    (tmp_path / "my-rig.toml").write_text(rig())
    with pytest.raises(
        InputError, match=r"my_rig\.toml: no such file; did you mean 'my-rig\.toml'"
    ):
        drillctl.load(tmp_path / "my_rig.toml")


@pytest.mark.parametrize("name", ["x" * 300 + ".toml", "a\0b.toml", "/", ".", "", "~", "a\\b"])
def test_names_that_no_file_can_have(name):
    with pytest.raises(InputError):
        drillctl.load(name)


def test_a_folder_is_no_design(tmp_path):
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(InputError, match=r"folder\.toml: is a folder, not a file"):
        drillctl.load(tmp_path / "folder.toml")


def test_what_is_there_but_no_file_is_named_as_what_it_is(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    Path("folder").mkdir()
    Path("rig.toml").write_text(rig())
    for name, kind in (("pipe", "a pipe or a device"), ("folder", "a folder")):
        with pytest.raises(InputError, match=f"^{name}: is {kind}, not a file"):
            drillctl.load(name)
    with pytest.raises(InputError, match=r"rig\.tml: no such file; did you mean 'rig\.toml'"):
        drillctl.load("rig.tml")


def test_unknown_shipped_name():
    with pytest.raises(InputError) as caught:
        drillctl.load("monteiro-trindade-140")
    assert "did you mean 'monteiro-trindade-140kn'?" in str(caught.value)
    assert "wob-rpm-chart" in str(caught.value)


def test_unknown_model(told):
    message = told('model = "monteiro-trindade-2102"')
    assert message.startswith("model: 'monteiro-trindade-2102': not a shipped name")
    assert "did you mean 'monteiro-trindade-2012'?" in message


@pytest.mark.parametrize(
    ("model", "came"),
    [
        ('"rigs/none.toml"', "'rigs/none.toml': no such file"),
        ("3", "got 3; a model is a name or a path in quotes"),
        ("[1]", "got a list; a model is a name or a path in quotes"),
        ("true", "got true; a model is a name or a path in quotes"),
        (f'"{"x" * 300}.toml"', "cannot be read"),
    ],
)
def test_impossible_model(told, model, came):
    message = told(f"model = {model}")
    assert message.startswith("model: ")
    assert came in message


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('schema = 1\ntitle = "open\n', "line 2"),
        ("schema = 1\n\n[bha\n", "line 3"),
        ("schema = 1\nschema = 1\n", "line 2"),
        ("speed = 100 rpm\n", "line 1"),
    ],
)
def test_broken_toml_is_told_with_its_line(told, text, line):
    message = told(text)
    assert message.startswith("broken TOML: ")
    assert line in message


@pytest.mark.parametrize("text", ["a = " + "1" * 5000, "a = " + "[" * 9000])
def test_toml_that_python_cannot_hold(told, text):
    assert told(text).startswith("broken TOML: ")


def test_not_text_at_all(tmp_path):
    (tmp_path / "rig.toml").write_bytes(b"title = '\xff\xfe'")
    with pytest.raises(InputError, match=r"rig\.toml: not UTF-8 text"):
        drillctl.load(tmp_path / "rig.toml")


# Keys


@pytest.mark.parametrize(
    ("text", "key", "suggestion"),
    [
        (rig(more="[simulaton]\nstep = 1"), "simulaton", "simulation"),
        (rig(controller=CONTROLLER.replace("kp", "kpp")), "controller.kpp", "kp"),
        (rig(friction=FRICTION.replace("beta", "betta")), "bit_rock.betta", "beta"),
        (rig(string=PIPE.replace("length", "lenght")),
         "drillstring.sections.pipe.lenght", "length"),
        (rig(ends=ENDS.replace("inertia", "inertie", 1)), "top_drive.inertie", "inertia"),
        (rig(operating_point='[operating_point]\nweight_on_bits = "1 kN"\n'),
         "operating_point.weight_on_bits", "weight_on_bit"),
        (rig(more="[simulation]\nj1from = 1"), "simulation.j1from", "j1_from"),
        (rig(head="schema_version = 1\n"), "schema_version", "schema"),
        (rig(more="[map]\naxis = []"), "map.axis", "axes"),
        (rig(more='[map]\naxes = [{ path = "controller.kp", minn = 0, max = 1, points = 2 }]'),
         "map.axes.1.minn", "min"),
        (rig(friction='[bit_rock]\nlaw = "bit-radius-friction"\nradius = "1 in"\n'),
         "bit_rock.radius", "bit_radius"),
    ],
)  # fmt: skip
def test_unknown_key_is_told_with_the_nearest(told, text, key, suggestion):
    assert told(text).startswith(f"{key}: unknown key; did you mean '{suggestion}'? allowed: ")


def test_unknown_key_without_a_neighbour_lists_what_is_allowed(told):
    message = told(rig(controller=CONTROLLER + "zzz = 1\n"))
    assert message == "controller.zzz: unknown key; allowed: drive, ki, kp, law"


def test_parameter_of_nearly_that_name():
    design = drillctl.load(PAPER)
    with pytest.raises(InputError) as caught:
        parameter(design, "controller.kpp")
    assert "no numeric parameter 'controller.kpp'" in str(caught.value)
    assert "did you mean 'controller.kp'?" in str(caught.value)


@pytest.mark.parametrize(
    "path", ["", ".", "kp", "controller", "controller.law", "map.levels", "a..b"]
)
def test_what_is_no_numeric_parameter(path):
    with pytest.raises(InputError, match="no numeric parameter"):
        parameter(drillctl.load(PAPER), path)


@pytest.mark.parametrize("value", ["nan", math.inf, True, None, "12 kg", [1], 10**400])
@pytest.mark.parametrize("path", ["bit_rock.a1_factor", "top_drive.inertia", "controller.kp"])
def test_a_parameter_reads_finite_numbers_only(path, value):
    with pytest.raises(InputError):
        parameter(drillctl.load(PAPER), path).parse(value)


@pytest.mark.parametrize(
    "change", [lambda v: drillctl.load(PAPER, **v), drillctl.load(PAPER).replace]
)
@pytest.mark.parametrize(
    ("path", "value", "problem"),
    [
        ("drillstring.sections.pip.length", "1 m", "no section 'pip'; did you mean 'pipe'?"),
        ("drillstring.sections.pipe", 3, "got 3; a section is a table"),
        ("drillstring.sections.pipe.name", "collars", "a section cannot be renamed"),
        ("drillstring.sections.pipe.lenght", "1 m", "unknown key; did you mean 'length'?"),
        ("controller.kpp", 1, "unknown key; did you mean 'kp'?"),
        ("controller", 1, "got 1; it must be a table"),
        ("model", "monteiro-trindade-2012", "unknown key"),
        ("", 1, "unknown key"),
        ("controller.kp", "1 kN", "'kN' is not a unit of gain; use N*m*s/rad"),
        ("operating_point.speed", 100, '100 has no unit; did you mean "100 rpm"?'),
    ],
)  # fmt: skip
def test_wrong_path_or_value_set_after_the_file(change, path, value, problem):
    with pytest.raises(InputError) as caught:
        change({path: value})
    assert f"{PAPER}.toml: {path}" in str(caught.value)
    assert problem in str(caught.value)


@pytest.mark.parametrize("path", ["scenario.speed.points", "scenario.speed"])
def test_a_point_that_is_neither_quantity_nor_word_is_told_once_and_by_its_place(path):
    points = [["0 s", "60 furlong"], ["1 s", "set"]]
    with pytest.raises(InputError) as caught:
        drillctl.load("monteiro-trindade-140kn", **{path: points})
    assert str(caught.value).endswith(
        "scenario.speed.points.1.2: '60 furlong': a speed is given in rpm, rev/min, rad/s or "
        "deg/s, not in 'furlong'"
    )
    assert "\n" not in str(caught.value)


def test_a_path_that_goes_on_below_a_number():
    with pytest.raises(InputError, match=r"controller\.kp: a table is not a gain"):
        drillctl.load(PAPER, **{"controller.kp.x": 1})


@pytest.mark.parametrize("text", ["controller.kp", "=3", "  =3", ""])
def test_setting_without_a_path_or_value(text):
    with pytest.raises(InputError, match=r"--set: .* is not of the form dotted\.path=VALUE"):
        parse_setting(text)


@pytest.mark.parametrize(
    "text",
    ["controller.kp", "controller.kp=0:1", "kp=0:1:x", "kp=0:1:2.5", "kp=0:1:²", "kp=1:2:3:4"],
)
def test_axis_of_another_form(text):
    with pytest.raises(InputError, match="--axis"):
        parse_axis(text)


# Units


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (rig(operating_point='[operating_point]\nspeed = "100 kN"\n'),
         "operating_point.speed: '100 kN': a speed is given in rpm, rev/min, rad/s or deg/s, "
         "not in 'kN'"),
        (rig(operating_point='[operating_point]\nspeed = "1.667 Hz"\n'),
         "operating_point.speed: '1.667 Hz': a speed is given in rpm, rev/min, rad/s or deg/s, "
         "not in 'Hz'"),
        (rig(operating_point='[operating_point]\nweight_on_bit = "14 kg"\n'),
         "operating_point.weight_on_bit: '14 kg': 'kg' is not a unit of force; "
         "use kN, N, klbf or tf"),
        (rig(operating_point='[operating_point]\nweight_on_bit = "140 kNn"\n'),
         "operating_point.weight_on_bit: '140 kNn': 'kNn' is not a known unit; "
         "use kN, N, klbf or tf"),
        (rig(operating_point="[operating_point]\nspeed = 100\n"),
         'operating_point.speed: 100 has no unit; did you mean "100 rpm"?'),
        (rig(operating_point='[operating_point]\nweight_on_bit = "140"\n'),
         'operating_point.weight_on_bit: 140 has no unit; did you mean "140 kN"?'),
        (rig(string=PIPE.replace('"1000 m"', "1000")),
         'drillstring.sections.pipe.length: 1000 has no unit; did you mean "1000 m"?'),
        (rig(string=PIPE.replace('"1000 m"', '"1000 kg"')),
         "drillstring.sections.pipe.length: '1000 kg': 'kg' is not a unit of length; use m or ft"),
        (rig(controller='[controller]\nlaw = "constant-torque"\ntorque = 10\n'),
         'controller.torque: 10 has no unit; did you mean "10 kN*m"?'),
        (rig(more="[simulation]\nduration = 100"),
         'simulation.duration: 100 has no unit; did you mean "100 s"?'),
        (rig(ends="[top_drive]\ninertia = 2000\n"),
         'top_drive.inertia: 2000 has no unit; did you mean "2000 kg*m^2"?'),
    ],
)  # fmt: skip
def test_wrong_or_missing_unit(told, text, message):
    assert told(text) == message


# Values


def geometry(outer, inner, more=""):
    return (
        f'{SECTION}outer_diameter = "{outer}"\ninner_diameter = "{inner}"\nlength = "9 m"\n{more}'
    )


PIPE_KEY = "drillstring.sections.pipe"


@pytest.mark.parametrize(
    ("text", "key", "problem"),
    [
        (rig(string=geometry("100 mm", "100 mm")), PIPE_KEY,
         "inner_diameter 100 mm must be less than outer_diameter 100 mm"),
        (rig(string=geometry("4 in", "5 in")), PIPE_KEY,
         "inner_diameter 127 mm must be less than outer_diameter 101.6 mm"),
        (rig(string=geometry("0 mm", "0 mm")), f"{PIPE_KEY}.outer_diameter",
         "'0 mm' is not allowed: it must be greater than 0"),
        (rig(string=geometry("4 in", "-1 in")), f"{PIPE_KEY}.inner_diameter",
         "'-1 in' is not allowed: it must be 0 or more"),
        (rig(string=geometry("1e200 m", "0 m")), f"{PIPE_KEY}.outer_diameter",
         "'1e200 m' is not allowed: it must be at most 1000 m"),
        (rig(string=geometry("1e-200 m", "0 m")), f"{PIPE_KEY}.outer_diameter",
         "'1e-200 m' is not allowed: it must be at least 0.01 mm"),
        (rig(string=geometry("999 m", "0 m")), PIPE_KEY,
         "its dimensions give stiffness = 8.61574e+20; allowed: 1e-6 to 1e13 N*m/rad"),
        (rig(string=PIPE.replace("1000 m", "0 m")), f"{PIPE_KEY}.length",
         "'0 m' is not allowed: it must be greater than 0"),
        (rig(string=PIPE.replace("1000 m", "-5 ft")), f"{PIPE_KEY}.length",
         "'-5 ft' is not allowed: it must be greater than 0"),
        (rig(string=f"{PIPE}elements = 10001\n"), "drillstring.sections",
         "10001 elements in all; allowed are 10000"),
        (rig(string=f'{PIPE}density = "-1 kg/m3"\n'), f"{PIPE_KEY}.density",
         "'-1 kg/m3' is not allowed: it must be greater than 0"),
        (rig(string=f'{PIPE}density = "0 kg/m3"\n'), f"{PIPE_KEY}.density",
         "'0 kg/m3' is not allowed: it must be greater than 0"),
        (rig(string=f"{PIPE}elements = 0\n"), f"{PIPE_KEY}.elements",
         "0 is not allowed: it must be greater than 0"),
        (rig(string=f"{PIPE}elements = -3\n"), f"{PIPE_KEY}.elements",
         "-3 is not allowed: it must be greater than 0"),
        (rig(string=f"{PIPE}elements = 2.5\n"), f"{PIPE_KEY}.elements",
         "2.5 is not a whole number"),
        (rig(string=f"{PIPE}elements = 0x{'F' * 4000}\n"), f"{PIPE_KEY}.elements",
         "a number of more than 18 digits is not allowed: it must be at most 1e9"),
        (rig(string=f"{PIPE}tool_joint_factor = 0\n"), f"{PIPE_KEY}.tool_joint_factor",
         "0 is not allowed: it must be greater than 0"),
        (rig(string=f'{PIPE}drag = "-1 N*s/rad"\n'), f"{PIPE_KEY}.drag",
         "'-1 N*s/rad' is not allowed: it must be 0 or more"),
        (rig(string=f'{SECTION}stiffness = "0 N*m/rad"\n'), f"{PIPE_KEY}.stiffness",
         "'0 N*m/rad' is not allowed: it must be greater than 0"),
        (rig(string=f'{SECTION}stiffness = "-5 N*m/rad"\n'), f"{PIPE_KEY}.stiffness",
         "'-5 N*m/rad' is not allowed: it must be greater than 0"),
        (rig(string=f'{PIPE}youngs_modulus = "210 GPa"\npoisson_ratio = 0.5\n'), PIPE_KEY,
         "poisson_ratio 0.5 must lie between -1 and 0.5"),
        (rig(string=f'{PIPE}youngs_modulus = "210 GPa"\npoisson_ratio = -1\n'), PIPE_KEY,
         "poisson_ratio -1 must lie between -1 and 0.5"),
        (rig(string=f"{PIPE}poisson_ratio = 0.3\n"), PIPE_KEY,
         "poisson_ratio requires youngs_modulus"),
        (rig(string=f'{PIPE}shear_modulus = "80 GPa"\nyoungs_modulus = "210 GPa"\n'), PIPE_KEY,
         "give shear_modulus or youngs_modulus, not both"),
        (rig(string=f'{PIPE}stiffness = "5 N*m/rad"\n'), PIPE_KEY,
         "needs exactly one of pipe, outer_diameter, polar_moment, stiffness; "
         "got pipe and stiffness"),
        (rig(string=f'{PIPE}outer_diameter = "5 in"\ninner_diameter = "4 in"\n'), PIPE_KEY,
         "got pipe and outer_diameter"),
        (rig(string=f'{SECTION}length = "9 m"\n'), PIPE_KEY, "got none of them"),
        (rig(string=f'{PIPE}inner_diameter = "4 in"\n'), PIPE_KEY,
         "inner_diameter requires outer_diameter"),
        (rig(string=f'{SECTION}outer_diameter = "5 in"\nlength = "9 m"\n'), PIPE_KEY,
         'inner_diameter is missing ("0 mm" for a solid bar)'),
        (rig(string=f'{SECTION}pipe = "5 in 19.5 lb/ft"\n'), PIPE_KEY, "length is missing"),
        (rig(string=f'{SECTION}pipe = "5 in 19 lb/ft"\nlength = "9 m"\n'), f"{PIPE_KEY}.pipe",
         "no API pipe '5 in 19 lb/ft'; did you mean '5 in 19.5 lb/ft'? allowed: "),
        (rig(string=f'{PIPE}grade = "S135"\n'), f"{PIPE_KEY}.grade",
         "no grade 'S135'; did you mean 'S-135'? allowed: E-75, G-105, S-135, X-95"),
        (rig(string=f'{SECTION}polar_moment = "1 in4"\nlength = "9 m"\ngrade = "E-75"\n'), PIPE_KEY,
         "grade needs pipe or outer_diameter, not polar_moment"),
        (rig(string=f'{SECTION}stiffness = "5 N*m/rad"\nlength = "9 m"\n'), PIPE_KEY,
         "length is not allowed with stiffness (a lumped spring)"),
        (rig(string=f'{SECTION}stiffness = "5 N*m/rad"\ninner_diameter = "0 m"\n'), PIPE_KEY,
         "inner_diameter is not allowed with stiffness (a lumped spring)"),
        (rig(string=f'{SECTION}stiffness = "5 N*m/rad"\ntool_joint_factor = 1.1\n'), PIPE_KEY,
         "tool_joint_factor is not allowed with stiffness (a lumped spring)"),
        (rig(string=f'{SECTION}stiffness = "5 N*m/rad"\nelements = 2\n'), PIPE_KEY,
         "elements must be 1 for a lumped spring (stiffness)"),
        (rig(string=PIPE + PIPE), "drillstring.sections",
         "two sections are called 'pipe'; names must differ"),
        (rig(string="[drillstring]\nsections = []\n"), "drillstring.sections",
         "a drillstring needs at least one section"),
        (rig(string=""), "drillstring", "is missing"),
        (rig(string=PIPE.replace('name = "pipe"\n', "")), "drillstring.sections.1.name",
         "is missing"),
        (rig(ends=ENDS.replace("2000 kg", "-2000 kg")), "top_drive.inertia",
         "'-2000 kg*m^2' is not allowed: it must be 0 or more"),
        (rig(ends=ENDS.replace("50 kg", "-50 kg")), "bha.inertia",
         "'-50 kg*m^2' is not allowed: it must be 0 or more"),
        (rig(ends=""), "top_drive", "is missing"),
        (rig(operating_point='[operating_point]\nweight_on_bit = "-1 kN"\n'),
         "operating_point.weight_on_bit", "'-1 kN' is not allowed: it must be 0 or more"),
        (rig(operating_point='[operating_point]\nspeed = "0 rpm"\n'),
         "operating_point.speed", "'0 rpm' is not allowed: it must be greater than 0"),
        (rig(operating_point='[operating_point]\nspeed = "-9 rpm"\n'),
         "operating_point.speed", "'-9 rpm' is not allowed: it must be greater than 0"),
        (rig(operating_point="[operating_point]\nspeed = nan\n"),
         "operating_point.speed", "nan is not a speed"),
        (rig(operating_point='[operating_point]\nspeed = "1e999 rpm"\n'),
         "operating_point.speed", "'1e999 rpm' is not a finite speed"),
        (rig(controller=CONTROLLER.replace("600.0", "inf")), "controller.kp",
         "inf is not a finite gain"),
        (rig(friction=FRICTION.replace("0.03", "nan")), "bit_rock.a1",
         "nan is not a finite number"),
        (rig(friction=FRICTION.replace("0.03", "-inf")), "bit_rock.a1",
         "-inf is not a finite number"),
        (rig(friction=FRICTION.replace("0.03", "-0.03")), "bit_rock.a1",
         "-0.03 is not allowed: it must be 0 or more"),
        (rig(friction=FRICTION.replace("0.03", "0.09")), "bit_rock",
         "a2 = 0.08 must not be less than a1 = 0.09"),
        (rig(friction=FRICTION + "a1_factor = 3\n"), "bit_rock",
         "a2 = 0.08 must not be less than a1 = 0.09"),
        (rig(friction=FRICTION.replace("0.08", "1e308")), "bit_rock.a2",
         "1e+308 is not allowed: it must be at most 1000"),
        (rig(friction=FRICTION.replace("0.08", "999"),
             operating_point='[operating_point]\nweight_on_bit = "1e6 kN"\n'), "bit_rock",
         "its numbers give static torque = 9.99e+11 at 1e+06 kN"),
        (rig(more='[simulation]\nduration = "0 s"'), "simulation.duration",
         "'0 s' is not allowed: it must be greater than 0"),
        (rig(more='[simulation]\nduration = "-1 s"'), "simulation.duration",
         "'-1 s' is not allowed: it must be greater than 0"),
        (rig(more='[simulation]\nstep = "0 ms"'), "simulation.step",
         "'0 ms' is not allowed: it must be greater than 0"),
        (rig(more='[simulation]\nstep = "-5 ms"'), "simulation.step",
         "'-5 ms' is not allowed: it must be greater than 0"),
        (rig(more='[simulation]\nstep = "101 s"'), "simulation",
         "step 101 s must not exceed duration 100 s"),
        (rig(more='[simulation]\nj1_from = "100 s"'), "simulation",
         "j1_from 100 s must be less than duration 100 s"),
        (rig(more='[simulation]\nj1_from = "-1 s"'), "simulation.j1_from",
         "'-1 s' is not allowed: it must be 0 or more"),
        (rig(more="[simulation]\nmodes = 0"), "simulation.modes",
         "0 is not allowed: it must be greater than 0"),
        (rig(more='[start]\nkind = "rest"\nspeed = "7 rpm"'), "start",
         "speed is not allowed with kind = 'rest', only with 'turning'"),
        (rig(more='[map]\naxes = [{ path = "controller.kp", min = 0, max = 1, points = 1 }]'),
         "map.axes.1.points", "an axis needs 2 points or more, got 1"),
        (rig(more='[map]\naxes = [{ path = "controller.kp", min = nan, max = 1, points = 3 }]'),
         "map.axes.1.min", "nan is not a finite number"),
        (rig(more='[map]\naxes = [{ path = "controller.kp", min = 0, max = true, points = 3 }]'),
         "map.axes.1.max", "true is not a number"),
        (rig(more='[map]\naxes = [{ path = "controller.kp", max = 1, points = 3 }]'),
         "map.axes.1.min", "is missing"),
        (rig(more='[map]\naxes = [{ path = "controller.kp", min = 0, max = 1, points = 3 },'
                  ' { path = "controller.kp", min = 0, max = 2, points = 3 }]'),
         "map.axes", "two axes run over 'controller.kp'"),
        (rig(more="[map]\naxes = []"), "map.axes", "a map needs at least one axis"),
        (rig(more="[map]\nlevels = []"), "map.levels", "a map needs at least one level"),
        (rig(more="[map]\nlevels = [20, 0]"), "map.levels.2",
         "0 is not allowed: it must be greater than 0"),
        (rig(more="[map]\naudit_cells = -1"), "map.audit_cells",
         "-1 is not allowed: it must be 0 or more"),
        (rig(head="schema = 2\n"), "", "schema = 2 is not known; this version reads schema = 1"),
        (rig(head='schema = "1"\n'), "", "schema = '1' is not known"),
        (rig(head="schema = true\n"), "", "schema = true is not known"),
    ],
)  # fmt: skip
def test_impossible_value(told, text, key, problem):
    message = told(text)
    assert message.startswith(f"{key}: " if key else problem)
    assert problem in message


SPRINGS = [
    {"name": "upper", "stiffness": "700 N*m/rad", "inertia": "2782 kg*m^2"},
    {"name": "middle", "stiffness": "1080 N*m/rad", "inertia": "750 kg*m^2"},
    {"name": "lower", "stiffness": "907 N*m/rad"},
]


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        ("top_drive.inertia", "0 leaves a node without inertia; give it more than 0"),
        ("drillstring.sections.upper.inertia", "0 leaves a node without inertia"),
        ("drillstring.sections.middle.inertia", "0 leaves a node without inertia"),
        ("bha.inertia", "0 leaves the bit without inertia; give it more than 0"),
    ],
)
def test_a_node_without_inertia(told, path, problem):
    tree = tomllib.loads(rig(string="[drillstring]\n"))
    tree["drillstring"] = {"sections": SPRINGS}
    message = told(tomli_w.dumps(tree), **{path: "0 kg*m^2"})
    assert message.startswith(f"{path}: {problem}")


def test_a_lumped_section_without_its_inertia(told):
    tree = tomllib.loads(rig(string="[drillstring]\n"))
    sections = copy.deepcopy(SPRINGS)
    del sections[1]["inertia"]
    tree["drillstring"] = {"sections": sections}
    assert told(tomli_w.dumps(tree)).startswith("drillstring.sections.middle.inertia: 0 leaves")


def test_sections_named_twice_over_a_model(told):
    text = f'model = "monteiro-trindade-2012"\n{SECTION}elements = 4\n{SECTION}elements = 5\n'
    problem = "drillstring.sections: two sections are called 'pipe'; names must differ"
    assert told(text) == problem


def test_sections_named_twice_in_the_model(tmp_path):
    (tmp_path / "model.toml").write_text(rig(string=PIPE + PIPE))
    (tmp_path / "case.toml").write_text(f'model = "model.toml"\n{SECTION}elements = 4\n')
    with pytest.raises(InputError, match="two sections are called 'pipe'"):
        drillctl.load(tmp_path / "case.toml")


# Laws and tables


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (rig(controller='[controller]\nlaw = "pid"\nkp = 1\nki = 1\n'),
         "controller.law: no law 'pid'; did you mean 'pi'? "
         "allowed: active-damping, constant-torque, pi, soft-torque, "
         "stiff-speed, torsional-rectification, z-torque"),
        (rig(controller="[controller]\nlaw = 3\n"),
         "controller.law: no law 3; allowed: active-damping, constant-torque, pi, soft-torque, "
         "stiff-speed, torsional-rectification, z-torque"),
        (rig(controller="[controller]\nlaw = [3]\n"),
         "controller.law: no law a list; allowed: active-damping, constant-torque, pi, "
         "soft-torque, stiff-speed, torsional-rectification, z-torque"),
        (rig(friction=FRICTION.replace("lopez-suarez", "lopes-suarez")),
         "bit_rock.law: no law 'navarro-lopes-suarez'; did you mean 'navarro-lopez-suarez'? "
         "allowed: bit-aggressiveness, bit-radius-friction, coulomb, jansen-van-den-steen, "
         "navarro-lopez-suarez, "
         "printed-three-branch, richard-detournay, stribeck, tabulated, tucker-wang"),
        (rig(controller="[controller]\nkp = 1\n"),
         "controller: law is missing; allowed: active-damping, constant-torque, pi, soft-torque, "
         "stiff-speed, torsional-rectification, z-torque"),
        (rig(friction=""), "bit_rock: is missing"),
        (rig(more='[weight_on_bit]\nlaw = "konstant"\n'),
         "weight_on_bit.law: no law 'konstant'; did you mean 'constant'? "
         "allowed: constant, navarro-lopez-suarez, stick-slip-alarm, surface-observer"),
        (rig(more='[start]\nkind = "turn"\n'),
         "start.kind: got 'turn'; did you mean 'turning'? "
         "allowed: rest, steady, turning, wound_up"),
        (rig(more='[simulation]\naccuracy = "finer"\n'),
         "simulation.accuracy: got 'finer'; did you mean 'fine'? allowed: fast, fine, standard"),
        (rig(controller='[controller]\nlaw = "pi"\nkp = 1\n'), "controller.ki: is missing"),
        (rig(controller='[controller]\nlaw = "constant-torque"\n'),
         "controller.torque: is missing"),
        (rig(controller='[controller]\nlaw = "constant-torque"\nkp = 1\ntorque = "1 N*m"\n'),
         "controller.kp: unknown key; allowed: drive, law, torque"),
        (rig(friction=FRICTION.replace("beta = 0.1\n", "")),
         "bit_rock: beta missing: give a1, a2 and beta, or a table"),
        (rig(friction='[bit_rock]\nlaw = "navarro-lopez-suarez"\n'),
         "bit_rock: a1, a2, beta missing: give a1, a2 and beta, or a table"),
    ],
)  # fmt: skip
def test_laws_and_choices(told, text, message):
    assert told(text) == message


def friction_table(*rows, more=""):
    lines = ", ".join(
        f'{{ weight_on_bit = "{w} kN", a1 = {a1}, a2 = {a2}, beta = {b} }}' for w, a1, a2, b in rows
    )
    return f'[bit_rock]\nlaw = "navarro-lopez-suarez"\ntable = [{lines}]\n{more}'


ROWS = [(40, 0.02, 0.06, 0.09), (60, 0.03, 0.07, 0.06)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (rig(friction=friction_table(ROWS[0])),
         "bit_rock.table: a table needs two rows or more; give a1, a2 and beta instead"),
        (rig(friction=friction_table(*reversed(ROWS))),
         "bit_rock.table: weight_on_bit must increase from row to row"),
        (rig(friction=friction_table(ROWS[0], ROWS[0])),
         "bit_rock.table: weight_on_bit must increase from row to row"),
        (rig(friction=friction_table(ROWS[0], (60, 0.09, 0.07, 0.1))),
         "bit_rock.table.2: a2 = 0.07 must not be less than a1 = 0.09"),
        (rig(friction=friction_table(*ROWS, more="a1 = 1\n")),
         "bit_rock: give table, or a1, a2 and beta; got table and a1"),
        (rig(friction=friction_table(*ROWS, more="a2_factor = 0.1\n")),
         "bit_rock.a2_factor: the factors give a2 = 0.0066, less than a1 = 0.026"),
    ],
)  # fmt: skip
def test_friction_table(told, text, message):
    assert told(text) == message


@pytest.mark.parametrize("weight", ["39.99 kN", "60.01 kN", "0 kN"])
def test_weight_outside_the_table(told, tmp_path, weight):
    text = rig(friction=friction_table(*ROWS)).replace("50 kN", weight)
    assert told(text) == (
        f"operating_point.weight_on_bit: {weight} lies outside the friction table (40 to 60 kN); "
        'allowed with bit_rock.outside_table = "extrapolate"'
    )
    (tmp_path / "rig.toml").write_text(text)
    allowed = drillctl.load(tmp_path / "rig.toml", **{"bit_rock.outside_table": "extrapolate"})
    assert 0.0 < allowed.bit_rock.a1 < allowed.bit_rock.a2


@pytest.mark.parametrize("weight", ["40 kN", "60 kN"])
def test_the_rows_themselves_lie_inside(tmp_path, weight):
    text = rig(friction=friction_table(*ROWS)).replace("50 kN", weight)
    (tmp_path / "rig.toml").write_text(text)
    assert drillctl.load(tmp_path / "rig.toml").tables.bit_rock.outside_table == "refuse"


def test_extrapolation_stops_where_friction_ends(told):
    table = friction_table(*ROWS, more='outside_table = "extrapolate"\n')
    problem = told(rig(friction=table).replace("50 kN", "140 kN"))
    assert problem == "bit_rock: its numbers give beta = -0.06 at 140 kN"


# Types


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (rig(string='drillstring = "long"\n').replace(HEAD, "").replace(OPERATING_POINT, ""),
         "drillstring: got 'long'; it must be a table"),
        ("bha = 3\n" + rig(ends='[top_drive]\ninertia = "1 kg*m^2"\n'),
         "bha: got 3; it must be a table"),
        ("bha = [1]\n" + rig(ends='[top_drive]\ninertia = "1 kg*m^2"\n'),
         "bha: got a list; it must be a table"),
        ("controller = 'pi'\n" + rig(controller=""), "controller: got 'pi'; it must be a table"),
        ("bit_rock = [1]\n" + rig(friction=""), "bit_rock: got a list; it must be a table"),
        ("title = 5\n" + rig(head=""), "title: got 5; it must be text in quotes"),
        ("notes = ['a']\n" + rig(head=""), "notes: got a list; it must be text in quotes"),
        (rig(controller=CONTROLLER.replace("600.0", "{ a = 1 }")),
         'controller.kp: a table is not a gain; write it like "100 N*m*s/rad"'),
        (rig(controller=CONTROLLER.replace("600.0", "[600]")),
         'controller.kp: a list is not a gain; write it like "100 N*m*s/rad"'),
        (rig(controller=CONTROLLER.replace("600.0", "true")),
         'controller.kp: true is not a gain; write it like "100 N*m*s/rad"'),
        (rig(friction=FRICTION.replace("0.03", "true")),
         "bit_rock.a1: true is not a number; write it without quotes or unit"),
        (rig(friction=FRICTION.replace("0.03", '"0.03"')),
         "bit_rock.a1: '0.03' is not a number; write it without quotes or unit"),
        (rig(friction=FRICTION.replace("0.03", "1979-05-27")),
         "bit_rock.a1: 1979-05-27 is not a number; write it without quotes or unit"),
        (rig(more="[map]\naudit_cells = false"), "map.audit_cells: false is not a whole number"),
        (rig(more="[map]\nlevels = 3"), "map.levels: got 3; it must be a list"),
        (rig(more="[map.axes]\nkp = 3"), "map.axes: got a table; it must be a list"),
        (rig(more="[map]\naxes = ['controller.kp']"),
         "map.axes.1: got 'controller.kp'; it must be a table"),
        (rig(string='[drillstring.sections]\nname = "pipe"\n'),
         "drillstring.sections: got a table; "
         "it must be a list of tables, each under [[drillstring.sections]]"),
        (rig(string="[drillstring]\nsections = [1]\n"),
         "drillstring.sections.1: got 1; it must be a table"),
        (rig(string=PIPE.replace('"pipe"', "3", 1)),
         "drillstring.sections.1.name: got 3; it must be text in quotes"),
    ],
)  # fmt: skip
def test_wrong_type(told, text, message):
    assert told(text) == message


def test_sections_given_as_a_table_over_a_model(told):
    text = 'model = "monteiro-trindade-2012"\n[drillstring.sections]\nname = "pipe"\n'
    assert told(text).startswith("drillstring.sections: got a table; it must be a list of tables")


def test_long_values_are_cut_in_the_message(told):
    message = told(rig(more=f'[start]\nkind = "{"x" * 5000}"\n'))
    assert len(message) < 200


def test_keys_with_line_breaks_stay_on_one_line(told):
    assert "unknown key" in told(rig(more='[map]\n"a\\nb" = 3\n'))


# Random damage

JUNK = st.one_of(
    st.none().map(lambda _: []),
    st.booleans(),
    st.integers(-3, 3),
    st.sampled_from([10**25, -(10**400), 1e308, 1e-308, math.nan, math.inf, -math.inf, 0.0, -1.0]),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(
        [
            "0 m",
            "-3 kN",
            "1e308 kg*m^2",
            "1e-320 m",
            "9 rpm",
            "9",
            "kN",
            "1/0 in",
            "pi",
            "rest",
            "constant-torque",
            "bit-radius-friction",
            "5 in 19.5 lb/ft",
            "extrapolate",
            "lumped",
        ]
    ),
    st.dates(max_value=datetime.date(2030, 1, 1)),
    st.lists(st.one_of(st.integers(), st.text(max_size=3), st.just({})), max_size=2),
    st.dictionaries(
        st.sampled_from(["law", "name", "path", "kp", "min", "table", "sections", "a\nb", ""]),
        st.one_of(st.integers(), st.text(max_size=3), st.lists(st.integers(), max_size=1)),
        max_size=2,
    ),
)
KEYS = st.one_of(
    st.sampled_from(["law", "kind", "table", "name", "model", "stiffness", "schema", "sections"]),
    st.text(max_size=4),
)
SHIPPED_TREES = {
    name: to_tree(drillctl.load(name).tables)
    for name in [*catalog.names("models"), "navarro-lopez-2dof-bistable"]
}


def nodes(value, place=()):
    """Every place in a tree but its root."""
    children = value.items() if isinstance(value, dict) else enumerate(value)
    for key, child in children:
        yield (*place, key)
        if isinstance(child, (dict, list)):
            yield from nodes(child, (*place, key))


def damaged(tree, draw):
    """`tree` with one node replaced or dropped, or one key added."""
    tree = copy.deepcopy(tree)
    *parents, last = draw(st.sampled_from(list(nodes(tree))))
    inside = tree
    for key in parents:
        inside = inside[key]
    how = draw(st.sampled_from(["replace", "drop", "add"]))
    if how == "replace":
        inside[last] = draw(JUNK)
    elif how == "drop":
        del inside[last]
    elif isinstance(inside, dict):
        inside[draw(KEYS)] = draw(JUNK)
    else:
        inside.insert(last, draw(JUNK))
    return tree


def assert_design_or_one_line(make):
    try:
        design = make()
    except InputError as error:
        lines = str(error).split("\n")
        assert 1 <= len(lines) <= 11
        assert all(line and one_line(line) == line and len(line) <= 500 for line in lines)
        return
    assert isinstance(design, Design)
    assert design.bit_rock.static_torque(1.0) >= 0.0
    assert isinstance(to_toml(design), str)


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("damaged")


@settings(max_examples=100, deadline=None)
@given(name=st.sampled_from(list(SHIPPED_TREES)), data=st.data())
def test_damage_over_a_damaged_model(name, data, scratch):
    model = damaged(SHIPPED_TREES[name], data.draw)
    top = damaged(SHIPPED_TREES[name], data.draw) | {"model": "model.toml"}
    (scratch / "model.toml").write_text(tomli_w.dumps(model), encoding="utf-8")
    (scratch / "over.toml").write_text(tomli_w.dumps(top), encoding="utf-8")
    assert_design_or_one_line(lambda: drillctl.load(scratch / "over.toml"))


@pytest.mark.parametrize(
    "below",
    [{"map": []}, {"map": {"axes": 1}}, {"map": {"axes": [1]}}, {"tune": 1},
     {"tune": {"parameters": [1]}}],
)  # fmt: skip
def test_another_law_over_a_model_whose_tables_are_none(tmp_path, below):
    model = SHIPPED_TREES["navarro-lopez-2dof"] | below
    (tmp_path / "model.toml").write_text(tomli_w.dumps(model), encoding="utf-8")
    over = 'model = "model.toml"\n[controller]\nlaw = "pi"\nkp = 1.0\nki = 1.0\n'
    (tmp_path / "over.toml").write_text(over, encoding="utf-8")
    with pytest.raises(InputError, match=next(iter(below))):
        drillctl.load(tmp_path / "over.toml")


PATHS = sorted({p.path for name in SHIPPED_TREES for p in parameters(drillctl.load(name))})


@settings(max_examples=200, deadline=None)
@given(
    name=st.sampled_from(list(SHIPPED_TREES)),
    values=st.dictionaries(
        st.one_of(
            st.sampled_from(
                [
                    *PATHS,
                    "controller.law",
                    "drillstring.sections",
                    "drillstring.sections.pipe",
                    "bit_rock",
                    "map.axes",
                    "start.kind",
                    "drillstring",
                ]
            ),
            st.text("ab.", max_size=4),
        ),
        st.one_of(JUNK, st.floats().map(units.SI)),
        max_size=3,
    ),
)
def test_any_values_set_are_a_design_or_an_input_error(name, values):
    assert_design_or_one_line(lambda: drillctl.load(name).replace(values))
