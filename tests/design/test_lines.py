"""Every error of a design is told at once, with its line in the file that it stands in."""

from __future__ import annotations

import pytest

import drillctl
from drillctl.cli import run
from drillctl.design import Design
from drillctl.errors import InputError, MultipleInputError

MODEL = """\
# a rig
schema = 1

[operating_point]
speed = "90 kN"
[[drillstring.sections]]
name = "pipe"
pipe = "5 in 19.5 lb/ft"
length = "1000 m"
[[drillstring.sections]]
name = "collars"
outer_diameter = "4 in"
inner_diameter = "5 in"
length = "200 m"
[top_drive]
inertia = "2000 kg*m^2"
[bha]
inertia = "50 kg*m^2"
[bit_rock]
law = "navarro-lopez-suarez"
table = [
  { weight_on_bit = "40 kN", a1 = 0.01, a2 = 0.06, beta = 0.1 },  # the first
  # a comment
  { weight_on_bit = "60 kN", a1 = 0.01, a2 = -0.06, beta = 0.1 },
]
"""
TOP = '''\
model = "rig.toml"
notes = """
three
lines"""
controller.law = "pi"
controller."kpp" = 3
controller.ki = 1979-05-27
[[drillstring.sections]]
name = "pipe"
length = "1000 kg"
[uncertain."bit_rock.a1"]
distribution = "normal"
cof = 0.1
[map]
axes = [{ path = "controller.kp", min = 0, max = 1, points = 1 }]
'''


@pytest.fixture
def files(tmp_path):
    (tmp_path / "rig.toml").write_text(MODEL)
    (tmp_path / "top.toml").write_text(TOP)
    return tmp_path


def told(path, **values):
    with pytest.raises(InputError) as caught:
        drillctl.load(path, **values)
    return str(caught.value).split("\n")


def test_each_error_is_told_with_the_line_of_its_own_file(files):
    model, top = files / "rig.toml", files / "top.toml"
    places = {line.split(": ")[0]: line.split(": ")[1] for line in told(top)}
    assert places == {
        f"{model}:5": "operating_point.speed",
        f"{top}:10": "drillstring.sections.pipe.length",
        f"{model}:10": "drillstring.sections.collars",
        f"{model}:24": "bit_rock.table.2.a2",
        f"{top}:7": "controller.ki",
        f"{top}:6": "controller.kpp",
        f"{top}:15": "map.axes.1.points",
        f"{top}:13": "uncertain.bit_rock.a1.cof",
    }


def test_dates_are_shown_as_they_are_written(files):
    (line,) = [one for one in told(files / "top.toml") if "controller.ki" in one]
    assert "1979-05-27 is not a gain" in line


def test_a_missing_key_is_told_with_the_line_of_its_table(files):
    (files / "rig.toml").write_text(MODEL.replace('law = "navarro-lopez-suarez"\n', ""))
    lines = told(files / "top.toml")
    assert any(x.startswith(f"{files / 'rig.toml'}:19: bit_rock: law is missing") for x in lines)


def test_what_no_rig_can_be_is_told_of_string_and_program_at_once(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(
        'model = "monteiro-trindade-140kn"\n[scenario.speed]\nend = "1 s"\n'
        '[top_drive]\ninertia = "0 kg*m^2"\n[[drillstring.sections]]\nname = "pipe"\n'
        'length = "1e8 m"\nouter_diameter = "999 m"\ninner_diameter = "0 m"\n'
    )
    lines = told(path)
    assert [line.removeprefix(f"{path}:").split(":")[0] for line in lines] == ["6", "2"]
    assert "stiffness = " in lines[0]


def test_at_most_ten_are_told_and_the_rest_counted(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text("".join(f"key{n} = 1\n" for n in range(14)))
    lines = told(path, model="monteiro-trindade-140kn")
    assert len(lines) == 11
    assert (
        lines[-1] == "and 5 more"
    )  # `model` is no key after the file; missing tables are not told


def test_what_was_set_has_no_line(files):
    top = files / "top.toml"
    lines = told(top, **{"controller.ki": "3 m", "controller.kp": "x"})
    assert f"{top}: controller.ki: '3 m': 'm' is not a unit of gain; use N*m/rad" in lines
    assert any(line.startswith(f"{top}: controller.kp: ") for line in lines)


def test_what_was_set_on_the_command_line_is_named_by_its_option(files, capsys):
    top = str(files / "top.toml")
    arguments = ["--set", "controller.ki=3 m", "--set", "bha.inertiaa=1"]
    assert run(["show", top, *arguments]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert all(line.startswith("drillctl: ") for line in lines)
    assert "drillctl: --set controller.ki: '3 m': 'm' is not a unit of gain; use N*m/rad" in lines
    assert any(line.startswith("drillctl: --set bha.inertiaa: unknown key") for line in lines)
    assert any(line.startswith(f"drillctl: {top}:6: controller.kpp") for line in lines)


def test_a_study_names_the_line_as_well(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(
        'model = "monteiro-trindade-140kn"\n\n[uncertain."bit_rock.a3"]\n'
        'distribution = "normal"\ncov = 0.1\n'
    )
    from drillctl.ensemble.parameters import uncertain_parameters

    design = drillctl.load(path)
    with pytest.raises(InputError, match=r"case\.toml:3: uncertain\.bit_rock\.a3: no numeric"):
        uncertain_parameters(design)
    with (
        pytest.raises(InputError, match=r"case\.toml: here: controller\.kp: no"),
        design.within("here"),
    ):
        raise InputError("no", design.where("controller.kp"))


def test_several_errors_go_into_a_place_together():
    both = MultipleInputError([InputError("a", "x"), InputError("b", "y")])
    assert str(both.within("file")) == "file: x: a\nfile: y: b"


def test_a_file_that_is_gone_or_changed_has_no_lines(files):
    path = files / "rig.toml"
    path.write_text(
        MODEL.replace('"5 in"', '"3 in"')
        .replace("90 kN", "90 rpm")
        .replace("-0", "0")
        .replace("60 kN", "160 kN")
    )
    design = drillctl.load(path)
    path.unlink()
    assert isinstance(design, Design)
    with pytest.raises(InputError, match=r"rig\.toml: operating_point\.speed: "):
        design.replace({"operating_point.speed": "3 kN"})
