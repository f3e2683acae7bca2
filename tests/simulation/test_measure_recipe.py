"""The recipe of a measure in docs/howto-study.md, followed literally in a copy of the package."""

from __future__ import annotations

import math

import pytest

from tests.package_copy import answer, changed, copied, inserted, marked, script

LINES = marked("howto-study.md", "line")
BESIDE = {
    "simulation/measures.py": "    work_at_bit: float = _row(",
    "simulation/run.py": "        work_at_bit=",
    "simulation/batch.py": '            "work_at_bit": ',
}
"""Each file of the recipe, and a line of it before which the new one goes."""


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """A copy of the package with one measure more: three lines in three files."""
    folder = copied(tmp_path_factory.mktemp("measure"))
    for file, place in BESIDE.items():
        inserted(folder / "drillctl" / file, place, before=LINES[file])
    (folder / "toy.toml").write_text(
        'schema = 1\nmodel = "monteiro-trindade-100kn"\n[simulation]\nduration = "4 s"\n'
        '[uncertainty]\nrealizations = 2\nkeep = ["turns"]\n[map]\naudit_cells = 0\n'
        'axes = [{path = "controller.kp", min = 300, max = 600, points = 2}, '
        '{path = "controller.ki", min = 50, max = 150, points = 2}]\n'
    )
    return folder


def test_a_recipe_touches_three_files(house):
    assert len(changed(house)) == len(BESIDE) == 3


def test_a_run_reports_it(house):
    measures = answer(house, "simulate", "toy.toml", "--out", "run")["measures"]
    turned = measures["mean_bit_speed"] * 4.0 / (2.0 * math.pi)
    assert measures["turns"] == pytest.approx(turned, rel=1e-12)
    assert "turns" in answer(house, "show", "toy.toml")["uncertainty"]["keep"]


@pytest.mark.slow
def test_maps_and_draws_keep_it(house):
    exact = answer(house, "simulate", "toy.toml", "--out", "exact")["measures"]["turns"]
    lanes = answer(house, "simulate", "toy.toml", "--engine", "batch", "--out", "lanes")
    assert lanes["measures"]["turns"] == pytest.approx(exact, rel=1e-3)
    answer(house, "map", "toy.toml", "--measure", "turns", "--out", "map")
    head = (house / "map" / "map.csv").read_text().splitlines()[0]
    assert head == "controller.kp (N*m*s/rad),controller.ki (N*m/rad),j1 (s),turns,status"
    answer(house, "uncertainty", "toy.toml", "--out", "draws")
    script(
        house,
        """
import drillctl
data = drillctl.open("draws").data["turns"]
assert data.dims == ("realization", "controller.kp", "controller.ki") and data.attrs["units"] == "1"
""",
    )
