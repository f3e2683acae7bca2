"""What holds of the command of every study: one short run each, seen from all sides."""

from __future__ import annotations

import contextlib
import io
import itertools
import json
import os
import re
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from matplotlib.text import Text
from strict_json import strict

import drillctl
from drillctl import units
from drillctl.cli import run
from drillctl.studies.base import Study, studies
from tests.alike import same
from tests.logs.synthetic import Rig, sampled, write

DESIGN = "monteiro-trindade-140kn"
BISTABLE = "navarro-lopez-2dof-bistable"
SHORT = ("--set", "simulation.duration=10 s")

# A design and options that keep a run short; a study that is not here runs as it is.
FEW = ("--realizations", "5")
GAINS = ("--axis", "controller.kp=0:1000:5", "--axis", "controller.ki=0:500:4")
QUICK = {
    "modes": (DESIGN,),
    "loop": (DESIGN, *GAINS),
    "identify": (DESIGN, "--log", "log.csv", "--set", "identify.draws=50"),
    "cycle": (BISTABLE,),
    "map": (DESIGN, *GAINS, *SHORT, "--audit", "1"),
    "doctor": (DESIGN, *GAINS, *SHORT, "--audit", "1"),
    "regions": (
        BISTABLE, "--axis", "controller.torque=9 kN*m:11 kN*m:3",
        "--axis", "operating_point.weight_on_bit=96 kN:98.694 kN:3",
    ),
    "regularisation": (
        DESIGN, "--axis", "controller.kp=500:650:2", "--axis", "controller.ki=75:150:2",
    ),
    "compare": ("pi-vs-dynamic-wob-140kn", *SHORT, *FEW, *GAINS),
    "uncertainty": ("wob-rpm-chart", *SHORT, "--realizations", "8", "--audit", "0"),
    "tune": (
        "robust-gains-140kn", "--realizations", "24", "--certificate", "150",
        "--set", "tune.starts=1", "--set", "tune.certificate.audit=1",
        "--set", "simulation.accuracy=fast", "--set", "tune.probability=0.8",
    ),
    "recommend": (
        "robust-gains-140kn", *SHORT, "--realizations", "16", "--fresh", "40",
        "--set", "tune.starts=1", "--set", "simulation.accuracy=fast",
        "--set", "tune.level=9", "--set", "tune.probability=0.5",
        "--set", "recommend.laws=['pi', 'soft-torque']",
        "--set", "recommend.speed_step=20 rpm", "--set", "recommend.weight_step=20 kN",
    ),
    "schedule": (
        DESIGN, *SHORT, "--depth", "2500 m:3000 m:2", "--law", "soft-torque",
        "--set", "schedule.realizations=8", "--set", "simulation.accuracy=fast",
        "--set", "recommend.speed_step=25 rpm", "--set", "recommend.weight_step=35 kN",
    ),
    "delay": (
        "dynamic-wob-delay-140kn", *SHORT, "--realizations", "3",
        "--set", "weight_delay.gains=['0 kN*s/rad', '6 kN*s/rad']",
        "--set", "weight_delay.delays=['0 s', '0.2 s', '1 s']",
    ),
    "advantage": (
        "pi-vs-pi-dynamic-wob", *SHORT, "--set", "advantage.largest_gain=0 kN*s/rad",
        "--set", "tune.realizations=8", "--set", "advantage.realizations=8",
        "--set", "advantage.sweep_realizations=4", "--set", "advantage.region_points=3",
        "--set", "advantage.region_realizations=4", "--set", "advantage.weights=['140 kN']",
        "--set", "advantage.speeds=['100 rpm']", "--set", "advantage.delays=['0 s', '0.5 s']",
    ),
}  # fmt: skip
verb = import_module("drillctl.cli.verb")
COMMANDS = [study for study in studies().values() if study.command]


@dataclass
class Ran:
    """A study that has run once, by its command."""

    study: Study
    arguments: tuple[str, ...]
    folder: Path
    code: int
    out: str
    err: str
    drawn: list[str]  # every text in its pictures, which are in field units as its files

    def call(self, *more: str) -> tuple[int, str, str]:
        """The same command again, from the folder above that of the run."""
        with contextlib.chdir(self.folder.parent):
            return called(self.study.name, *self.arguments, "--out", "once", *more)

    @property
    def result(self) -> Any:
        return drillctl.open(self.folder)


def called(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command line in this process."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(list(arguments))
    return code, out.getvalue(), err.getvalue()


@pytest.fixture(scope="module", params=COMMANDS, ids=[study.name for study in COMMANDS])
def ran(request, tmp_path_factory):
    study, above, drawn = request.param, tmp_path_factory.mktemp("study"), []

    def small(figure, path):
        """A picture that is rendered, in few pixels."""
        figure.savefig(path, dpi=30)
        drawn.extend(text.get_text() for text in figure.findobj(Text))

    arguments = QUICK.get(study.name, (DESIGN, *SHORT))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verb, "draw", small)
        patch.chdir(above)
        if "log.csv" in arguments:
            write("log.csv", sampled(Rig(parts=200).run(130.0), 10.0, 15.0, 130.0))
        said = called(study.name, *arguments, "--out", "once", "--json", "--units", "field")
    return Ran(study, arguments, above / "once", *said, drawn)


def stamps(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*")}


def test_it_answers_by_one_strict_object(ran):
    assert (ran.code, ran.out.count("\n")) == (0, 1), ran.err
    assert ran.err.splitlines()[-1] == "results: once"
    assert isinstance(strict(ran.out), dict)
    assert strict((ran.folder / "summary.json").read_text()) == strict(ran.out)


def test_its_folder_holds_every_table_and_picture(ran):
    held = {path.name for path in ran.folder.iterdir()}
    assert held >= {"run.json", "design.toml", "summary.json", "data.zarr"}
    tables = {f"{table.name}.csv": table for table in ran.study.tables(ran.result)}
    pictures = {f"{picture.name}.png" for picture in ran.study.pictures(ran.result)}
    assert {name for name in held if name.endswith(".png")} == pictures
    assert {name for name in held if name.endswith(".csv")} >= tables.keys()
    assert tables
    for name, table in tables.items():
        lines = (ran.folder / name).read_text(encoding="utf-8").splitlines()
        assert len(lines) >= 1 + len(list(table.rows))
    for name in pictures:
        assert (ran.folder / name).stat().st_size > 2000


def test_its_result_shows_itself(ran):
    """At a prompt in ten lines, in a notebook with its first picture, as a table of its arrays."""
    result = ran.result
    lines = repr(result).splitlines()
    assert 3 <= len(lines) <= 10
    assert lines[0].startswith(f"{type(result).__name__}: ")
    pictured = bool(list(ran.study.pictures(result)))
    assert ('<img src="data:image/png' in result._repr_html_()) == pictured
    if any(one.dims for one in result.data.data_vars.values()):
        frame = result.to_dataframe()
        assert len(frame) > 0
        assert {*frame.columns} <= frame.attrs["units"].keys()


OF_SI = re.compile(
    r"(?<![\w×])(?:[kM]?N|rad|kg|mm|k?J|[kM]?W|[kMG]?Pa)\b(?!-)|(?:[\d.] |[(\[]|re 1 )m(?![\w])"
)
"""What no text in field units holds, but for what the design itself is called."""


def test_in_field_units_nothing_is_in_si(ran):
    result, study, system = ran.result, ran.study, "field"
    said = [*study.remarks(result, system), *ran.drawn]
    said += [units.told(note, system) for note in study.notes(result)]
    checks = study.checks(result)
    said += [f"{one.question} {units.told(one.detail, system)}" for one in checks]
    in_both = {"numbers.csv"} if study.name == "recommend" else set()  # a drive may ask for either
    for table in study.tables(result):
        if f"{table.name}.csv" not in in_both:
            texts = itertools.chain(*table.texts(system))
            said += [table.said(system), *table.heads(system), *texts]
    for picture in study.pictures(result):
        said += [picture.caption, units.told(picture.alt, system)]
    for file in ran.folder.glob("*.csv"):
        if file.name not in in_both:
            said += file.read_text(encoding="utf-8").splitlines()
    title = result.design.tables.title
    own = (title, title.replace("$", r"\$"), *(one.name for one in getattr(result, "cases", ())))
    for name in own:
        said = [text.replace(name, "") for text in said]
    assert [text for text in said if OF_SI.search(text)] == []


def test_it_reads_back_as_it_was(ran, tmp_path):
    result = ran.result
    assert strict(ran.out) == strict(drillctl_json(result))
    again = drillctl.open(result.save(tmp_path / "copy"))
    assert again.data.identical(result.data)
    same(again, result)


def drillctl_json(result):
    """The summary of a result, as a command writes it."""
    from drillctl.store.json_files import strict as without_nan

    warnings = [one._asdict() for one in result.design.warnings]
    return json.dumps(without_nan(result.summary() | {"warnings": warnings}))


def test_the_same_again_is_shown_and_not_computed(ran):
    def fail(*arguments):
        raise AssertionError("computed again")

    before, compute = stamps(ran.folder), ran.study.compute
    object.__setattr__(ran.study, "compute", fail)
    try:
        code, out, err = ran.call("--json")
        assert (code, out) == (0, ran.out)
        assert err.endswith("already done: once\n")
        code, words, err = ran.call()
        assert code == 0, err
    finally:
        object.__setattr__(ran.study, "compute", compute)
    assert stamps(ran.folder) == before
    spoken = " ".join(words.split())
    for table in ran.study.tables(ran.result):
        assert not table.shown or " ".join(table.title.split()) in spoken
    for absent in ("nan", "None", "{", "results: "):
        assert absent not in words


def test_another_design_is_refused_in_its_folder(ran):
    before = stamps(ran.folder)
    code, out, err = ran.call("--set", "bha.inertia=123 kg*m^2", "--json")
    assert (code, out) == (2, "")
    assert "another design" in err
    assert err.count("\n") == 1
    assert stamps(ran.folder) == before


def test_another_study_is_refused_in_its_folder(ran):
    other = "modes" if ran.study.name != "modes" else "simulate"
    with contextlib.chdir(ran.folder.parent):
        code, out, err = called(other, ran.arguments[0], "--out", "once")
    assert (code, out) == (2, "")
    assert f"'{ran.study.name}'" in err


def test_a_wrong_key_is_one_message_and_leaves_nothing(ran, tmp_path):
    out = str(tmp_path / "none")
    code, said, err = called(
        ran.study.name, *ran.arguments, "--set", "bha.inertja=1 kg*m^2", "--out", out, "--json"
    )
    assert (code, said) == (2, "")
    assert "bha.inertja" in err
    assert "did you mean 'inertia'" in err
    assert (err.count("\n"), "Traceback" in err) == (1, False)
    assert not os.path.lexists(out)


def test_an_interruption_leaves_a_folder_only_if_it_resumes(ran, tmp_path):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    compute = ran.study.compute
    object.__setattr__(ran.study, "compute", interrupted)
    try:
        code, out, err = called(
            ran.study.name, *ran.arguments, "--out", str(tmp_path / "cut"), "--json"
        )
    finally:
        object.__setattr__(ran.study, "compute", compute)
    assert (code, out) == (130, "")
    assert err.endswith("drillctl: interrupted\n")
    assert (tmp_path / "cut").exists() == ran.study.resumes


@pytest.mark.parametrize("study", studies().values(), ids=lambda study: study.name)
def test_its_help_says_what_it_does(study):
    for help_line in (study.help, *(option.help for option in study.options)):
        assert 10 <= len(help_line) <= 60, help_line
        assert help_line[0].isupper(), help_line
    if study.command:
        code, out, err = called(study.name, "--help")
        assert (code, err) == (0, "")
        for line in (study.help, *(option.flag for option in study.options)):
            assert line in out
    if study.python:
        assert callable(getattr(drillctl, study.python))
