"""The recipe of docs/howto-study.md, followed to the letter in a copy of the package."""

from __future__ import annotations

import json

import pytest

from tests.package_copy import copied, inserted, marked, python, script

FILES = marked("howto-study.md", "file")
SPEEDS = '["9 rad/s", "11 rad/s"]'


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """A copy of the package with one study more: its own files and one line."""
    folder = copied(tmp_path_factory.mktemp("study"))
    package = folder / "drillctl" / "studies" / "speed_scan"
    package.mkdir()
    for name in ("__init__.py", "settings.py", "compute.py"):
        (package / name).write_text(FILES[name])
    inserted(
        folder / "drillctl" / "registry.py", "STUDIES: tuple[str, ...] = (\n",
        after='    "drillctl.studies.speed_scan",\n',
    )  # fmt: skip
    (folder / "toy.toml").write_text(
        'schema = 1\nmodel = "monteiro-trindade-100kn"\n'
        f"[speed_scan]\nspeeds = {SPEEDS}\n[simulation]\nduration = '2 s'\n"
    )
    return folder


def test_its_keys_are_those_of_a_design(house):
    shown = python(house, "-m", "drillctl", "show", "toy.toml", "--json")
    assert json.loads(shown.stdout)["speed_scan"]["speeds"] == ["9 rad/s", "11 rad/s"]
    wrong = python(house, "-m", "drillctl", "show", "toy.toml", "--set", "speed_scan.speds=3")
    assert wrong.returncode == 2
    assert "did you mean 'speeds'" in wrong.stderr


def test_the_command_the_folder_python_and_the_report_come_with_it(house):
    assert "Compute J1 at several set speeds." in python(house, "-m", "drillctl", "-h").stdout
    command = ("-m", "drillctl", "speed-scan", "toy.toml", "--weight", "90 kN", "--out", "run")
    first = python(house, *command, "--json")
    assert first.returncode == 0, first.stderr
    answer = json.loads(first.stdout)
    assert answer["speeds"] == [9.0, 11.0]
    again = python(house, *command)
    assert "already done" in again.stderr
    assert "set speed (rpm)" in again.stdout
    assert (house / "run" / "speed-scan.csv").read_text().startswith("speed (rad/s),j1 (s)\n9.0,")
    script(
        house,
        """
import drillctl
from drillctl.reporting.sections import SECTIONS
back = drillctl.open("run")
assert back.data["j1"].dims == ("speed",) and back.data["speed"].attrs["units"] == "rad/s"
assert "in rad/s" in type(back).__doc__
again = drillctl.speed_scan(back.design)
assert again.summary() == back.summary()
assert "speeds" in SECTIONS
""",
    )
