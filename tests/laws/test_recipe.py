"""The recipes of CONTRIBUTING, followed to the letter in a copy of the package."""

from __future__ import annotations

import pytest

from tests.package_copy import answer, changed, copied, inserted, marked, script

FILES = marked("howto-law.md", "file")


def added(folder, room, file, registered):
    """A copy of the package with one law more: its own file, and a line of the registry."""
    copied(folder)
    (folder / "drillctl" / "rig" / room / file).write_text(FILES[file])
    line = f'    "drillctl.rig.{room}.{file.removesuffix(".py")}",\n'
    inserted(folder / "drillctl" / "registry.py", f"{registered} = (\n", after=line)
    assert sorted(changed(folder)) == ["drillctl/registry.py", f"drillctl/rig/{room}/{file}"]


def written(folder, text):
    path = folder / "toy.toml"
    path.write_text(f'schema = 1\nmodel = "monteiro-trindade-100kn"\n{text}')
    return path.name


@pytest.fixture(scope="module")
def friction(tmp_path_factory):
    folder = tmp_path_factory.mktemp("friction")
    added(folder, "bit_rock", "popp_stelter.py", "FRICTION_LAWS")
    return folder, written(
        folder,
        """
[bit_rock]
law = "popp-stelter"
a1 = 0.02
a2 = 0.06
delta = 0.15

[scenario.bit_rock]
until = "0.5 s"
decay_factor = 1.1

[simulation]
duration = "2 s"
""",
    )


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drive")
    added(folder, "top_drive", "matched_pipe.py", "DRIVE_LAWS")
    return folder, written(
        folder, '[controller]\nlaw = "matched-pipe"\n\n[simulation]\nduration = "2 s"\n'
    )


def test_a_friction_law_is_one_file_and_one_line(friction):
    folder, design = friction
    assert answer(folder, "show", design)["bit_rock"]["delta"] == 0.15
    assert answer(folder, "validate", design)
    found = answer(folder, "simulate", design, "--out", "reference")
    assert found["engine"] == "reference"
    assert found["measures"]["j1"] > 0.0


def test_another_rock_and_draws_come_with_a_friction_law(friction):
    folder, design = friction
    told = script(
        folder,
        f"""
import drillctl
from drillctl.ensemble.parameters import uncertain_parameters
design = drillctl.load({design!r})
assert [p.path for p in uncertain_parameters(design)] == ["bit_rock.a1", "bit_rock.a2"]
assert design.bit_rock_before.delta == 1.1 * design.bit_rock.delta
try:
    design.replace({{"scenario.bit_rock.static_factor": 0.1}})
except drillctl.InputError as error:
    print(error)
""",
    )
    assert "static torque would be less than the sliding one" in told


@pytest.mark.slow
def test_the_batch_engine_compiles_a_friction_law_from_its_file(friction):
    folder, design = friction
    run = answer(folder, "simulate", design, "--engine", "batch", "--out", "batch")
    exact = answer(folder, "simulate", design, "--out", "again")
    assert run["measures"]["j1"] == pytest.approx(exact["measures"]["j1"], rel=1e-3)
    axes = ["--axis", "controller.kp=300:600:2", "--axis", "controller.ki=50:150:2"]
    small = [*axes, "--set", "map.audit_cells=0", "--realizations", "2", "--audit", "0"]
    assert (
        answer(folder, "map", design, *axes, "--audit", "1", "--out", "map")["audit"]["cells"] == 1
    )
    assert answer(folder, "uncertainty", design, *small, "--out", "draws")["realizations"] == 2


def test_a_drive_law_is_one_file_and_one_line(drive):
    folder, design = drive
    shown = answer(folder, "show", design)["controller"]
    assert (shown["law"], shown["period"]) == ("matched-pipe", "5 s")
    assert answer(folder, "validate", design)
    assert answer(folder, "simulate", design, "--out", "run")["measures"]["j1"] > 0.0


def test_a_drive_law_says_what_is_tuned_and_takes_arrays(drive):
    folder, design = drive
    script(
        folder,
        f"""
import drillctl, numpy as np
from drillctl.studies.tune.tuned import drive_numbers, string_numbers, tuned_parameters
design = drillctl.load({design!r})
assert drillctl.loop(design).slope_margin > 0.0
(tuned,) = tuned_parameters(design)
assert (tuned.path, tuned.unit, tuned.low, tuned.high) == ("controller.period", "s", 2.0, 10.0)
numbers = drive_numbers(design, {{tuned.path: np.array([4.0, 5.0])}}, string_numbers(design.string))
assert numbers["ki"][1] == design.top_drive.ki < numbers["ki"][0]
""",
    )
