"""What a page shows as one value: requests change it, files and commands give it back."""

from __future__ import annotations

import dataclasses
import json
import shlex

import pytest

import drillctl
from drillctl.cli import run
from drillctl.errors import InputError
from drillctl.explorer import controls
from drillctl.explorer import state as s

WEIGHT = "operating_point.weight_on_bit"


@pytest.fixture(scope="module")
def base():
    return drillctl.load("monteiro-trindade-140kn")


@pytest.fixture(scope="module")
def first(base):
    return s.first_state(base, "si")


def ask(state, base, **request):
    return s.changed(state, request, base)


def test_a_page_opens_with_the_design_as_it_is(base, first):
    assert first.settings == {}
    assert first.cross == (625.0, 125.0)
    assert first.at_cross(base).tables == base.tables


def test_a_slider_sets_what_a_file_would_say(base, first):
    new = ask(first, base, do="set", path=WEIGHT, value=125)
    assert new.settings == {WEIGHT: "125 kN"}
    assert new.at_cross(base).tables.operating_point.weight_on_bit == 125e3
    field = dataclasses.replace(first, units="field")
    new = ask(field, base, do="set", path=WEIGHT, value=30)
    assert new.settings == {WEIGHT: "30 klbf"}


def test_depth_is_made_up_by_the_topmost_pipe():
    base = drillctl.load("typical-land")
    state = s.first_state(base, "si")
    new = ask(state, base, do="set", path="depth", value=5000)
    sections = new.design(base).tables.drillstring.sections
    assert sum(one.span for one in sections) == pytest.approx(5000, rel=1e-9)
    assert sections[1:] == base.tables.drillstring.sections[1:]


def test_gains_of_an_axis_move_the_cross(base, first):
    new = ask(first, base, do="set", path="controller.kp", value=300)
    assert new.cross == (300.0, 125.0)
    assert new.settings == {}
    new = ask(first, base, do="cross", x=1, y=-2, cells=True)
    assert new.cross == (650.0, 100.0)
    new = ask(first, base, do="cross", x=333.333, y=1e9)
    assert new.cross == (335.0, 500.0)  # as a person would write it, and on the map


@pytest.mark.parametrize("law", controls.laws()["controller.law"])
@pytest.mark.parametrize("rig", ["monteiro-trindade-140kn", "typical-land"])
def test_every_drive_law_can_be_chosen(rig, law):
    base = drillctl.load(rig)
    new = ask(s.first_state(base, "si"), base, do="law", path="controller.law", value=law)
    at = new.at_cross(base)
    assert at.tables.controller.law == law
    known = controls.axis_ranges(at)
    assert all(axis.path in known for axis in new.axes)
    for one in controls.ranges(at).values():
        assert one.low <= one.value <= one.high, one
    back = ask(new, base, do="law", path="controller.law", value="pi")
    assert back.at_cross(base).tables.controller.law == "pi"


@pytest.mark.parametrize("law", controls.laws()["weight_on_bit.law"])
def test_every_weight_law_can_be_chosen(base, first, law):
    new = ask(first, base, do="law", path="weight_on_bit.law", value=law)
    assert new.at_cross(base).tables.weight_on_bit.law == law


def test_another_axis_keeps_what_stood_at_the_cross(base, first):
    moved = ask(first, base, do="set", path="controller.ki", value=200)
    new = ask(moved, base, do="axis", place=1, path=WEIGHT)
    assert [axis.path for axis in new.axes] == ["controller.kp", WEIGHT]
    assert new.at_cross(base).tables == moved.at_cross(base).tables
    ends = ask(new, base, do="axis", place=1, path=WEIGHT, low=100, high=150)
    assert ends.axes[1][1:3] == ("100 kN", "150 kN")


def test_the_range_of_a_slow_speed_holds_it(base):
    slow = controls.ranges(base.replace({controls.SPEED: "3 rpm"}))[controls.SPEED]
    assert slow.low <= slow.value < slow.high


def test_impossible_requests_are_refused(base, first):
    for request in (
        {"do": "set", "path": WEIGHT, "value": -5},
        {"do": "set", "path": WEIGHT, "value": "x"},
        {"do": "set", "path": "nothing", "value": 1},
        {"do": "axis", "place": 0, "path": "controller.ki"},
        {"do": "axis", "place": 0, "path": "controller.kp", "low": 5, "high": 5},
        {"do": "choose", "name": "level", "value": 0},
        {"do": "choose", "name": "draws", "value": 10**9},
        {"do": "choose", "name": "measure", "value": "j2"},
        {"do": "law", "path": "controller.law", "value": "magic"},
        {"do": "open", "text": "no JSON"},
        {"do": "open", "text": "{}"},
        {"do": "fly"},
        {},
    ):
        with pytest.raises(InputError):
            s.changed(first, request, base)


def test_a_saved_page_opens_as_it_was(base, first):
    state = ask(first, base, do="set", path=WEIGHT, value=120)
    state = ask(state, base, do="keep")
    state = ask(state, base, do="set", path="depth", value=3500)
    text = s.saved(state, base)
    assert s.read(text, base) == state
    assert ask(first, base, do="open", text=text) == state
    assert state.case_a(base).tables.drillstring == base.tables.drillstring
    for wrong in (
        {"design": "another"}, {"explorer": 0}, {"cross": [1.0, float("nan")]}, {"draws": -1},
        {"measure": "j2"}, {"level": "high"}, {"units": "cubits"}, {"axes": [1, 2]},
    ):  # fmt: skip
        with pytest.raises(InputError):
            s.changed(first, {"do": "open", "text": json.dumps(json.loads(text) | wrong)}, base)


def test_commands_give_what_the_page_shows(base, first, capsys):
    state = ask(first, base, do="set", path=WEIGHT, value=120)
    state = ask(state, base, do="axis", place=1, path="controller.ki", low=50, high=150)
    state = dataclasses.replace(
        state, axes=tuple(axis._replace(points=3) for axis in state.axes)
    )  # fmt: skip
    from drillctl.explorer.computed import mapped

    design = state.design(base)
    *_, last = mapped(design, state.grid(design), "j1")
    words = shlex.split(s.command(state, base))
    assert run([*words[1:], "--audit", "0", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["minimum"]["j1"] == last.whole.minimum[0]
    words = shlex.split(s.run_command(state, base))
    assert run([*words[1:], "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    own = drillctl.simulate(state.at_cross(base), engine="batch")
    assert told["measures"] == own.measures.as_dict()


def test_values_of_the_command_line_stay_in_the_commands_of_a_page(base):
    state = s.first_state(base, "si", {WEIGHT: "120 kN", "controller.kp": 300})
    assert state.cross == (300.0, 125.0)
    assert state.at_cross(base).tables.operating_point.weight_on_bit == 120e3
    for words in (s.command(state, base), s.run_command(state, base)):
        assert f"--set '{WEIGHT}=120 kN'" in words


def test_the_command_of_drawn_rocks_gives_what_the_page_shows(base, first, capsys):
    from drillctl.explorer.computed import probability

    few = tuple(axis._replace(points=3) for axis in first.axes)
    state = dataclasses.replace(first, axes=few, draws=5)
    design = state.design(base)
    *_, last = probability(design, state.grid(design), state.level, 5)
    words = shlex.split(s.command(state, base))
    assert run([*words[1:], "--audit", "0", "--out", "drawn"]) == 0
    capsys.readouterr()
    found = drillctl.open("drawn").maps[state.level]
    assert (found.counts / 5).tolist() == last.values.tolist()


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
