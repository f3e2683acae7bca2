"""What a design allows and probably does not mean."""

import json

import numpy as np
import pytest

import drillctl
from drillctl import catalog
from drillctl.cli import run
from drillctl.linear import loop
from drillctl.rig.drillstring.frequencies import followed

HOLDS = {
    "warnings of a design": "sticks of the reference solver on a light bit; the key of each "
    "clears it",
}

DESIGN = "monteiro-trindade-140kn"
PIPE = "drillstring.sections.pipe"
DAMPED = {f"{PIPE}.stiffness_damping": "1 ms"}
HEAVY = {"bha.inertia": "300 kg*m^2"}
GROWING = {"bha.inertia": "150 kg*m^2"}


def keys(**values):
    return [one.key for one in drillctl.load(DESIGN, **values).warnings]


@pytest.mark.parametrize("name", [one.name for one in catalog.entries("designs")])
def test_a_shipped_design_is_warned_of_a_weak_drive_alone(name):
    warned = [one.key for one in drillctl.load(name).warnings]
    assert set(warned) <= {"controller.drive.torque_limit"}


def test_growing_modes_of_a_string_without_damping():
    (warning,) = drillctl.load(DESIGN, **GROWING).warnings
    assert "the mesh decides" in warning.text
    assert (warning.key, warning.usual) == (f"{PIPE}.stiffness_damping", "1e-3 s")
    assert str(warning).endswith(f"set {warning.key}, usually {warning.usual}")
    assert keys(**GROWING, **{warning.key: warning.usual}) == []
    for key, value in (("damping", "1 N*m*s/rad"), ("mass_damping", "0.1 1/s"), ("drag", "1 N*s")):
        text = f"{value}/rad" if key == "drag" else value
        assert keys(**GROWING, **{f"{PIPE}.{key}": text}) == []
    assert keys(**GROWING, **{"drillstring.modal_damping": 0.01}) == []
    # What the rock gives is taken at the bit, or by the drive, or for too short a time to matter.
    for ends in (
        {"bha.damping": "300 N*m*s/rad"},
        {"controller.kp": 5000.0},
        {"simulation.duration": "30 s"},
    ):
        assert keys(**GROWING | ends) == []
    assert len(keys(**GROWING, **{"bha.damping": "1 N*m*s/rad"})) == 1
    assert drillctl.load("navarro-lopez-4dof").warnings == ()


@pytest.mark.parametrize(("values", "moved"), [({}, (0.0, 0.003)), (GROWING, (0.03, 1.0))])
def test_growing_modes_make_j1_a_matter_of_the_mesh(values, moved):
    j1 = [
        drillctl.simulate(
            drillctl.load(DESIGN, **values, **{f"{PIPE}.elements": elements}), engine="batch"
        ).measures.j1
        for elements in (30, 60)
    ]
    assert moved[0] <= abs(j1[1] / j1[0] - 1.0) < moved[1]


def test_growing_modes_are_unstable_poles():
    for kp in (800.0, 2000.0, 2600.0, 5000.0):
        design = drillctl.load(DESIGN, **GROWING | {"controller.kp": kp})
        poles = loop(design).poles
        fast = poles[np.abs(poles.imag) > followed(design.string.parts)]
        assert bool(design.warnings) == bool(100.0 * fast.real.max() > 0.1)


def test_a_light_bit_chatters_and_damping_or_inertia_ends_it():
    """What the warning says, the reference solver shows: the bit sticks many times as often."""
    light = {
        "bha.inertia": "5 kg*m^2", "simulation.duration": "40 s", "operating_point.speed": "60 rpm",
        "controller.kp": 800.0, "controller.ki": 250.0,
    }  # fmt: skip
    sticks = {}
    for name, more in (("light", {}), ("damped", DAMPED), ("heavy", HEAVY)):
        design = drillctl.load(DESIGN, **(light | more))
        warned = any("light" in one.text for one in design.warnings)
        assert warned == (name == "light")
        events = drillctl.simulate(design, engine="reference").events
        sticks[name] = sum(one.kind == "stick" for one in events)
    assert sticks["light"] > 8 * max(sticks["damped"], sticks["heavy"], 1)


def test_a_light_bit_that_damping_does_not_help_asks_for_inertia():
    damped = {f"{PIPE}.stiffness_damping": "0.01 ms", "bha.inertia": "1 kg*m^2"}
    (warning,) = drillctl.load(DESIGN, **damped).warnings
    assert (warning.key, "chatters" in warning.text) == ("bha.inertia", True)


def test_a_mesh_or_a_step_outside_what_was_verified():
    assert keys(**DAMPED, **{f"{PIPE}.elements": 8}) == [f"{PIPE}.elements"]
    assert keys(**DAMPED, **{f"{PIPE}.elements": 20}) == []
    assert keys(**DAMPED, **{f"{PIPE}.elements": 2000}) == [f"{PIPE}.elements"]
    assert keys(**DAMPED, **{"simulation.step": "60 ms"}) == ["simulation.step"]
    assert keys(**DAMPED, **{"simulation.step": "50 ms"}) == []


@pytest.mark.parametrize(
    "command",
    [("validate",), ("show",), ("modes", "--out", "m"), ("loop", "--no-map", "--out", "l")],
)
def test_every_verb_says_them_once(command, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    light = ("--set", "bha.inertia=150 kg*m^2")
    assert run([command[0], DESIGN, *command[1:], *light, "--json"]) == 0
    said = capsys.readouterr()
    (warning,) = drillctl.load(DESIGN, **GROWING).warnings
    assert said.err.count(f"warning: {warning}\n") == 1
    assert json.loads(said.out)["warnings"] == [warning._asdict()]


@pytest.mark.parametrize(
    ("values", "usual"),
    [
        (
            {f"{PIPE}.outer_diameter": "5.9 mm", f"{PIPE}.inner_diameter": "0 mm"},
            "12 mm to 1000 mm",
        ),
        ({"controller.drive.torque_limit": "300 kN*m"}, "up to 150 kN m"),
        ({"operating_point.speed": "3000 rpm"}, "up to 400 rpm"),
    ],
)
def test_a_value_of_no_rig_is_told_with_the_usual_range(values, usual):
    found = drillctl.load("monteiro-trindade-120kn", **values).warnings
    key = next(iter(values))
    (warning,) = [one for one in found if one.key == key and "far from" in one.text]
    assert str(warning).endswith(f"usually {usual}")
    assert values[key].replace("*", " ") in str(warning)
    assert usual not in warning.said("field") or "rpm" in usual
