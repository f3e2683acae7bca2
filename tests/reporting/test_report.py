"""Reports from a design to a folder: contents, profiles, what is left out, what fails."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import pytest
from small_report import TINY, TITLE, small_design

import drillctl
from drillctl.cli import run
from drillctl.design import axis_tables
from drillctl.errors import InputError, SimulationError
from drillctl.reporting import PROFILES, QUICK, SECTIONS, STANDARD, cells, gather, making
from drillctl.reporting import pages as pdf
from drillctl.reporting.blocks import Words
from drillctl.reporting.sections.runs import mesh_check
from drillctl.reporting.sections.summary import verdict


def test_every_section_is_there_or_says_why_not(small):
    content = small.content
    titles = {SECTIONS[name].title for name in content["sections"]}
    assert titles | set(content["left_out"]) == {kind.title for kind in SECTIONS.values()}
    assert all(len(why) > 10 for why in content["left_out"].values())
    for name in ("summary", "rig", "modes", "loop", "map", "uncertainty", "audit", "glossary"):
        assert name in content["sections"]
    assert content["complete"]
    assert json.loads((small.folder / "summary.json").read_text()) == content
    assert small.summary() == content


def test_the_numbers_are_those_of_the_studies(small, page):
    swept = drillctl.open(small.folder / "studies" / "map")
    assert small.content["studies"]["map"]["minimum"]["j1"] == swept.minimum[0]
    assert f"{swept.minimum[0]:.2f}".rstrip("0") in page
    own = drillctl.simulate(small_design())
    told = small.content["studies"]["simulate"]["measures"]["j1"]
    assert told == pytest.approx(own.measures.j1, rel=1e-9)


def test_pictures_and_tables_lie_beside_it(small):
    drawn = {path.stem for path in (small.folder / "figures").glob("*.svg")}
    assert drawn == {path.stem for path in (small.folder / "figures").glob("*.png")}
    assert {"rig", "map", "runs", "responses", "nyquist", "impedance", "convergence"} <= drawn
    with (small.folder / "tables" / "map-regions.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][:2] == ["J1 at or under (s)", "cells"]
    assert [int(row[1]) for row in rows[1:]] == [
        one["cells"] for one in small.content["studies"]["map"]["regions"].values()
    ]


def test_markdown_shows_the_same(small):
    text = small.files["md"].read_text(encoding="utf-8")
    assert text.startswith("# &lt;script&gt;alert(1)&lt;/script&gt; &amp;")
    assert TITLE not in text
    for name in re.findall(r"!\[[^\]]*\]\(([^)]*)\)", text):
        assert (small.folder / name).is_file()
    for name in small.content["sections"]:
        assert f"## {SECTIONS[name].title}" in text
    assert text.count("\n|---") > 10


@pytest.mark.parametrize(("finer", "answer"), [((20.1, 20.1), True), ((20.1, 20.76), False)])
def test_the_audit_judges_the_mesh(small, finer, answer):
    with (small.folder / "tables" / "audit-audit.csv").open(encoding="utf-8", newline="") as file:
        assert "Do the elements suffice?" in {row[0] for row in csv.reader(file)}
    runs = {f"mesh-{k}": j1 for k, j1 in zip((1, 2, 4), (20.0, *finer), strict=True)}
    studies = {k: SimpleNamespace(summary={"measures": {"j1": j1}}) for k, j1 in runs.items()}
    (check,) = mesh_check(SimpleNamespace(have=studies.get))
    assert check.answer is answer
    assert ("3.8 %" in check.detail) is not answer
    assert not list(mesh_check(SimpleNamespace(have=lambda name: None)))


def test_cells_of_a_map_over_the_set_speed_have_each_its_own(tmp_path):
    axes = [
        {"path": "operating_point.speed", "min": "60 rpm", "max": "120 rpm", "points": 3},
        {"path": "controller.kp", "min": 500, "max": 600, "points": 2},
    ]
    short = {"simulation.duration": "1 s", "simulation.j1_from": "0 s", "map.audit_cells": 0}
    result = drillctl.stability_map(small_design(**short, **{"map.axes": axes}))
    (tmp_path / cells.FILE).write_text('{"traced": [0, 3, 5]}')
    assert cells.shown(tmp_path, result, Words("si"))["set_speed"] == [60.0, 90.0, 120.0]


def test_saved_studies_and_pictures_are_read_not_done_again(small, monkeypatch):
    def refuse(*args: object, **kwargs: object) -> None:
        raise AssertionError("done again")

    monkeypatch.setattr("drillctl.store.result.Result.write", refuse)
    monkeypatch.setattr("drillctl.reporting.cells.traced", refuse)
    monkeypatch.setattr("drillctl.reporting.pictures._draw", refuse)
    before = small.files["html"].read_text(encoding="utf-8")
    again = drillctl.report(small_design(), small.folder, TINY, formats=("html", "md"))
    assert again.content == small.content
    assert again.files["html"].read_text(encoding="utf-8") == before


def test_a_folder_of_another_design_is_refused(small):
    other = small_design(**{"controller.kp": 500.0})
    with pytest.raises(InputError, match=r"controller\.kp is '625 N\*m\*s/rad', here '500"):
        drillctl.report(other, small.folder, TINY)


def test_units_are_those_asked_for(small, tmp_path, page):
    assert "klbf" in page
    design = small_design()
    made = drillctl.report(design, tmp_path / "r", TINY, sections=["rig"], system="si")
    text = made.files["html"].read_text(encoding="utf-8")
    assert "klbf" not in text
    assert "3000\xa0m" in text


def test_sections_decide_what_is_computed(tmp_path):
    made = drillctl.report(small_design(), tmp_path / "r", TINY, sections=["modes", "rig"])
    assert made.content["sections"] == ["rig", "modes"]
    assert list(made.content["studies"]) == ["modes"]
    assert sorted(path.name for path in (made.folder / "studies").iterdir()) == ["modes"]


def test_its_own_title(tmp_path):
    design = small_design()
    made = drillctl.report(design, tmp_path / "r", TINY, sections=["glossary"], title="Well 7 <x>")
    assert "<h1>Well 7 &lt;x&gt;</h1>" in made.files["html"].read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (
            ["--sections", "summary,modess"],
            "--sections: no section 'modess'; did you mean 'modes'?",
        ),
        (["--sections", ","], "--sections: must name a section"),
        (["--format", "docx"], "--format: no format 'docx'"),
        (["--profile", "fast"], "fast"),
    ],
)
def test_wrong_options_are_told(options, told, capsys):
    assert run(["report", "monteiro-trindade-140kn", *options]) == 2
    shown = capsys.readouterr()
    assert told in shown.err
    assert shown.out == ""


def test_a_failed_study_is_told_first_and_the_rest_is_there(tmp_path, monkeypatch):
    def fail(*args: object, **kwargs: object) -> None:
        raise SimulationError("the machine went away")

    monkeypatch.setattr("drillctl.studies.three_regions.compute.three_regions", fail)
    made = drillctl.report(
        small_design(), tmp_path / "r", TINY, sections=("regions", "modes"), formats=("html", "md")
    )
    told = "The three regions failed: the machine went away"
    assert made.problems == (told,)
    assert not made.content["complete"]
    page = made.files["html"].read_text(encoding="utf-8")
    assert page.index("This report is not complete") < page.index(told) < page.index("<nav")
    lines = made.files["md"].read_text(encoding="utf-8").splitlines()
    assert lines[2:5] == ["**This report is not complete.**", "", f"- {told}"]
    assert 'id="modes"' in page
    assert 'id="regions"' not in page


def test_a_section_that_cannot_be_written_is_told_first(tmp_path, monkeypatch):
    def fail(*args: object) -> None:
        raise KeyError("kp")

    monkeypatch.setattr("drillctl.reporting.sections.rig.rig_drawing", lambda *given: None)
    monkeypatch.setattr("drillctl.reporting.sections.rig.section", fail)
    made = drillctl.report(small_design(), tmp_path / "r", TINY, sections=["rig", "glossary"])
    why = "an error of the program itself (KeyError, 'kp')"
    assert made.problems == (f"The section 'The rig' failed: {why}",)
    assert made.content["left_out"] == {"The rig": why}
    assert made.content["sections"] == ["glossary"]


def test_an_interrupted_report_is_written_and_goes_on(tmp_path, monkeypatch, capsys):
    def interrupted(*args: object, **kwargs: object) -> None:
        raise KeyboardInterrupt

    asked = ["report", "monteiro-trindade-140kn", "--sections", "modes,regions,map"]
    asked += ["--set", "map.audit_cells=0", "--out", str(tmp_path / "r")]
    with monkeypatch.context() as patch:
        patch.setattr("drillctl.ensemble.sweeps.sweep", interrupted)
        assert run(asked) == 130
    shown = capsys.readouterr()
    assert "is not finished" in shown.err
    page = (tmp_path / "r" / "report.html").read_text(encoding="utf-8")
    assert "The J1 map is not finished: the report was interrupted" in page
    assert page.index("is not finished") < page.index("<nav")
    assert 'id="modes"' in page
    assert not json.loads((tmp_path / "r" / "run.json").read_text())["finished"]
    assert run([*asked, "--json"]) == 0
    assert json.loads((tmp_path / "r" / "run.json").read_text())["finished"]
    told = json.loads(capsys.readouterr().out)
    assert told["complete"]
    assert told["problems"] == []
    assert {"modes", "map", "regions"} <= set(told["sections"])


def test_a_picture_that_cannot_be_drawn_is_told_first(tmp_path, monkeypatch):
    def fail(*args: object) -> None:
        raise ValueError("no ink")

    with monkeypatch.context() as patch:
        patch.setattr("drillctl.reporting.sections.rig.rig_drawing", fail)
        made = drillctl.report(small_design(), tmp_path / "r", TINY, sections=["rig", "glossary"])
    told = "Figure rig could not be drawn: no ink"
    assert made.problems == (told,)
    page = made.files["html"].read_text(encoding="utf-8")
    assert page.index("This report is not complete") < page.index(told) < page.index("<nav")
    again = drillctl.report(small_design(), tmp_path / "r", TINY, sections=["rig", "glossary"])
    assert again.problems == ()


def test_a_title_is_no_formula(tmp_path):
    design = small_design(title=r"costs $5 and \frac{ $")
    made = drillctl.report(design, tmp_path / "r", TINY, sections=("rig", "map", "uncertainty"))
    assert made.problems == ()


def test_no_browser_is_told_with_the_way_to_one(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv(pdf.CHOICE, "no-such-browser")
    asked = ["report", "monteiro-trindade-140kn", "--sections", "glossary", "--format", "pdf"]
    assert run([*asked, "--out", str(tmp_path / "r")]) == 1
    shown = capsys.readouterr()
    assert "apt install chromium" in shown.err
    assert (tmp_path / "r" / "report.html").is_file()
    assert not (tmp_path / "r" / "report.pdf").exists()


@pytest.mark.parametrize(
    ("name", "sections", "left_out"),
    [
        ("navarro-lopez-2dof-bistable", "rig,operating-point,loop,map,responses", set()),
        ("wob-rpm-chart", "rig,map", set()),
    ],
)
def test_other_rigs_have_reports_too(name, sections, left_out, tmp_path):
    few = replace(TINY, points=3)
    made = drillctl.report(drillctl.load(name), tmp_path / "r", few, sections=sections.split(","))
    assert made.problems == ()
    assert set(made.content["sections"]) == set(sections.split(",")) - left_out


def test_a_drive_whose_map_has_no_ends(tmp_path):
    drive = {"law": "constant-torque", "torque": "0 N*m"}
    design = drillctl.load("navarro-lopez-2dof", controller=drive)
    made = drillctl.report(design, tmp_path / "r", TINY, sections=("rig", "map"))
    (why,) = made.content["left_out"].values()
    assert "no bounds about it" in why


def test_a_line_of_cells_and_a_drive_without_gains(tmp_path):
    design = drillctl.load(
        "navarro-lopez-2dof",
        **{
            "map.axes": [
                {"path": "controller.torque", "min": "8 kN*m", "max": "12 kN*m", "points": 5}
            ]
        },
    )
    made = drillctl.report(design, tmp_path / "r", TINY, sections=("map", "regions", "uncertainty"))
    assert made.problems == ()
    assert made.content["sections"] == ["map", "uncertainty"]
    assert "two parameters" in made.content["left_out"]["Three regions"]
    own = drillctl.report(
        drillctl.load("navarro-lopez-2dof"), tmp_path / "n", TINY, sections=("map", "rig")
    )
    assert set(own.content["sections"]) == {"map", "rig"}  # over what its law is tuned by


def test_a_profile_cuts_map_and_draws():
    design = drillctl.load("monteiro-trindade-fig6-10000")
    quick = QUICK.applied(design)
    assert [axis.points for axis in axis_tables(quick)] == [21, 21]
    assert axis_tables(quick)[0].max == 800
    assert quick.tables.uncertainty.realizations == 200
    assert quick.tables.map.audit_cells == 4
    standard = STANDARD.applied(design)
    assert standard.tables.map == design.tables.map
    assert standard.tables.uncertainty.realizations == 4_000_000 // 41**2
    assert PROFILES["full"].applied(design) == design


def test_a_profile_keeps_replicates_whole():
    values = {"uncertainty.sampling": "sobol", "uncertainty.realizations": 4096}
    cut = QUICK.applied(drillctl.load("monteiro-trindade-fig6", **values))
    table = cut.tables.uncertainty
    assert table.realizations % table.replicates == 0
    assert 0 < table.realizations <= 200


def test_the_verdict_needs_every_answer(small):
    found = gather.gather(
        small_design(), TINY, small.folder / "studies", ("loop", "simulate", "setting"),
        making.Words("si"),
    )  # fmt: skip
    told = verdict(found)
    assert len(told.checks) == 3
    answers = [check.answer for check in told.checks]
    expected = "does not pass" if False in answers else "is undecided"
    assert told.word == ("passes" if all(answers) else expected)


def test_a_setting_that_sticks_does_not_pass(tmp_path):
    design = small_design(**{"controller.kp": 200.0, "controller.ki": 100.0})
    made = drillctl.report(design, tmp_path / "r", TINY, sections=["operating-point"])
    assert made.content["verdict"]["current_setting"] == "does not pass"


@pytest.mark.slow
@pytest.mark.parametrize("name", drillctl.catalog.names("designs"))
def test_every_shipped_design_has_a_report(name, tmp_path):
    made = drillctl.report(drillctl.load(name), tmp_path / "r", QUICK)
    assert made.problems == ()
    assert made.files["html"].stat().st_size < 10e6


def test_indices_are_for_the_longer_profiles(tmp_path):
    design = drillctl.load("uncertain-string-140kn")
    assert design.tables.uncertainty.sensitivity is not None
    assert QUICK.applied(design).tables.uncertainty.sensitivity is None
    assert STANDARD.applied(design).tables.uncertainty.sensitivity is not None
    made = drillctl.report(design, tmp_path / "r", TINY, sections=["operating-point"])
    assert made.problems == ()
    few = drillctl.report(design, tmp_path / "s", replace(TINY, points=3), sections=["sensitivity"])
    assert "--profile standard" in few.content["left_out"]["Sensitivity"]


def test_the_loop_of_a_cutting_bit_shows_no_gains_that_another_rock_would_allow(tmp_path):
    """Its roots decide: slope margin and stable gains are of a torque that does not fall."""
    made = drillctl.report(
        drillctl.load("richard-detournay-2dof"), tmp_path / "made", sections=["loop"],
        formats=["md"],
    )  # fmt: skip
    told = made.files["md"].read_text(encoding="utf-8")
    assert "Stability is that of the roots of the cutting bit" in told
    assert "cutting-roots" in {path.stem.removeprefix("loop-") for path in
                               (made.folder / "tables").iterdir()}  # fmt: skip
    for name in ("boundary", "root-locus", "slope-margin"):
        assert f"figures/{name}.png" not in told
