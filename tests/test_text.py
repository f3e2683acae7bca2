"""Text from outside: nothing in it reaches a terminal or a page that is not text."""

from __future__ import annotations

import os
import re
import unicodedata

import numpy as np
import pint
import pytest
import xarray
from hypothesis import given
from hypothesis import strategies as st

import drillctl
from drillctl import catalog, units
from drillctl.cli import console, run
from drillctl.design import to_toml
from drillctl.errors import InputError, shown
from drillctl.text import LONGEST_ERROR, clean, one_line, shortened

PAPER = "monteiro-trindade-140kn"
BAD = "a\0b\x1b[31mc\x07d\u202ee\u2066f\u200fg\x85h\u2028i\ufffej"
FAMILY = "\U0001f469\u200d\U0001f469\u200d\U0001f467 \U0001f3f3\ufe0f\u200d\U0001f308"


def harmless(text):
    """Whether a text holds no control character but line feeds and tabs, and no hidden mark."""
    kinds = {unicodedata.category(c) for c in text if c not in "\n\t\u200c\u200d"}
    return not kinds & {"Cc", "Cs", "Zl", "Zp"} and not re.search(
        "[\u202a-\u202e\u2066-\u2069]", text
    )


@given(st.text(st.characters()))
def test_a_cleaned_text_is_harmless_and_stays_as_it_is(text):
    assert harmless(clean(text))
    assert clean(clean(text)) == clean(text)
    assert len(one_line(text).splitlines()) <= 1
    clean(text).encode("utf-8")


def test_marks_are_written_out_and_joiners_kept():
    assert clean("a\x1b[31m\u202e") == r"a\x1b[31m\u202e"
    assert clean(FAMILY) == FAMILY
    assert clean("a\n\tb") == "a\n\tb"
    assert one_line("a\n\tb") == r"a\n\tb"
    assert shortened("x" * 1000, 100).count("x") == 97


def test_texts_of_a_design_are_cleaned_when_it_is_read(tmp_path):
    design = drillctl.load(PAPER, title=BAD, notes=f"{BAD}\nand {FAMILY}")
    assert harmless(design.tables.title)
    assert design.tables.notes.endswith(f"\nand {FAMILY}")
    path = tmp_path / "a\x1bb.toml"
    path.write_text(to_toml(design))
    again = drillctl.load(path)
    assert again == design
    assert harmless(again.name)


def section(name):
    return {"drillstring.sections": [{"name": name, "polar_moment": "1e-5 m^4", "length": "9 m"}]}


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("", "a name must hold more than blanks"),
        (" \u3000", "a name must hold more than blanks"),
        ("x" * 201, "at most 200 characters, this one 201"),
        ("a\nb", r"'a\nb': a name is of one line, without tabs"),
    ],
)
def test_names_that_are_refused_with_the_reason(name, reason):
    for values in (section(name), {"compare.cases": [{"name": name}]}):
        with pytest.raises(InputError, match=re.escape(reason)):
            drillctl.load(PAPER, **values)


@pytest.mark.parametrize("name", [FAMILY, "x" * 200, "a.b", "\u0645\u06cc\u200c\u062e"])
def test_names_that_are_taken(name):
    design = drillctl.load(PAPER, **{"compare.cases": [{"name": name}]}, **section(name))
    assert design.tables.compare.cases[0].name == name
    changed = design.replace({f"drillstring.sections.{name}.length": "7 m"})
    assert changed.tables.drillstring.sections[-1].length == 7.0


def test_names_are_cleaned_wherever_they_stand(tmp_path):
    path = tmp_path / "case.toml"
    name = r'"a\u001b[2J\u202e"'
    path.write_text(
        f'model = "{PAPER}"\n[[drillstring.sections]]\nname = {name}\nlength = "9 m"\n'
        f'polar_moment = "1e-5 m^4"\n[uncertain.{name}]\ndistribution = "normal"\ncov = 0.1\n'
    )
    design = drillctl.load(path)
    assert harmless(to_toml(design))
    clean_name = r"a\x1b[2J\u202e"
    changed = design.replace({f"drillstring.sections.{clean_name}.length": "7 m"})
    assert changed.tables.drillstring.sections[-1].length == 7.0
    path.write_text(path.read_text().replace("9 m", "9 kg"))
    with pytest.raises(InputError, match=r"case\.toml:4: drillstring"):
        drillctl.load(path)


def test_an_error_is_one_short_line():
    long = "k" * 10_000
    for values in ({long: 1}, {f"controller.{long}": 1}, {"title": [long]}, {"start.kind": long}):
        with pytest.raises(InputError) as caught:
            drillctl.load(PAPER, **values)
        assert len(str(caught.value)) <= LONGEST_ERROR
    error = InputError("line\none\x1b" * 300, "where" * 300)
    assert len(str(error)) <= LONGEST_ERROR
    assert harmless(str(error))
    assert "\n" not in str(error.within("x" * 300))


def test_the_terminal_gets_clean_text(capsys):
    console.note(BAD)
    console.line(BAD)
    console.table(BAD, ["name"], [[BAD]])
    out, err = capsys.readouterr()
    assert harmless(out)
    assert harmless(err)
    assert run(["show", f"{BAD}.toml"]) == 2
    assert harmless(capsys.readouterr().err)


# Files


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with a name here")
def test_pipes_and_devices_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "fifo.toml")
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    for name in ("fifo.toml", "zero.toml"):
        with pytest.raises(InputError, match="is a pipe or a device, not a file"):
            drillctl.load(tmp_path / name)
        table = {"distribution": "samples", "file": str(tmp_path / name)}
        with pytest.raises(InputError, match="is a pipe or a device, not a file"):
            drillctl.load(PAPER, **{"uncertain": {"bit_rock.a1_factor": table}})
        (tmp_path / "case.toml").write_text(f'model = "{name}"\n')
        with pytest.raises(InputError, match="is a pipe or a device, not a file"):
            drillctl.load(tmp_path / "case.toml")


def test_files_are_read_up_to_a_size(tmp_path, monkeypatch):
    monkeypatch.setattr(catalog, "MOST_BYTES", 2**20)
    (tmp_path / "large.toml").write_bytes(b"#" * (2**20 + 1))
    with pytest.raises(InputError, match=r"large\.toml: is larger than 1 MiB"):
        drillctl.load(tmp_path / "large.toml")


def test_a_cell_beyond_what_csv_takes(tmp_path):
    (tmp_path / "wide.csv").write_text("1" * 200_000)
    table = {"distribution": "samples", "file": str(tmp_path / "wide.csv")}
    with pytest.raises(InputError, match=r"wide\.csv: field larger than field limit"):
        drillctl.load(PAPER, **{"uncertain": {"bit_rock.a1_factor": table}})


# Numbers of other libraries

UREG = pint.UnitRegistry()


@pytest.mark.parametrize(
    ("path", "value", "plain"),
    [
        ("controller.kp", np.int64(400), 400),
        ("controller.kp", np.float32(0.5), 0.5),
        ("controller.kp", np.array(400.0), 400),
        ("controller.kp", xarray.DataArray(400.0), 400),
        ("controller.kp", xarray.DataArray(400.0, attrs={"units": "N*m*s/rad"}), 400),
        ("controller.kp", UREG.Quantity(400, "N*m*s/rad"), 400),
        ("operating_point.speed", UREG.Quantity(np.float64(80), "rpm"), "80 rpm"),
        ("operating_point.weight_on_bit", UREG.Quantity(130, "kN"), "130 kN"),
        ("top_drive.inertia", UREG.Quantity(3e6, "kg*cm^2"), "300 kg*m^2"),
        ("map.audit_cells", np.int8(7), 7),
        ("map.levels", np.array([20.0, 30.0]), [20, 30]),
        ("bit_rock.a1_factor", np.float64(0.9), 0.9),
        ("bit_rock.a1_factor", UREG.Quantity(0.9, ""), 0.9),
        ("simulation.step", xarray.DataArray(0.002, attrs={"units": "s"}), "2 ms"),
        ("uncertainty.full", np.bool_(True), True),
        ("simulation.engine", np.str_("batch"), "batch"),
    ],
)
def test_numbers_of_other_libraries_are_taken(path, value, plain):
    expected = drillctl.load(PAPER, **{path: plain})
    assert drillctl.load(PAPER, **{path: value}) == expected
    assert drillctl.load(PAPER).replace({path: value}) == expected
    assert to_toml(drillctl.load(PAPER, **{path: value})) == to_toml(expected)


@pytest.mark.parametrize(
    "value", [np.array([1.0, 2.0]), UREG.Quantity(3.0, "kN"), np.nan, np.datetime64("2020-01-01")]
)
def test_others_are_refused(value):
    with pytest.raises(InputError, match=r"controller\.kp"):
        drillctl.load(PAPER, **{"controller.kp": value})


def test_quantities_are_read_wherever_a_number_is():
    assert units.parse(UREG.Quantity(2.0, "m"), units.LENGTH) == 2.0
    assert units.parse(np.float64(3.0), units.PROPORTIONAL_GAIN) == 3.0
    assert shown(np.float64(3.0)) == "3.0"
