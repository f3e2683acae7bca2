"""The recipe of a measure in docs/howto-study.md, followed literally in a copy of the package."""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.code_blocks import blocks

ROOT = Path(__file__).resolve().parents[2]
LINES = {b.mark.removeprefix("line "): b.text for b in blocks(ROOT / "docs" / "howto-study.md")}
BESIDE = {
    "simulation/measures.py": "    work_at_bit: float = _row(",
    "simulation/run.py": "        work_at_bit=",
    "simulation/batch.py": '            "work_at_bit": ',
}
"""Each file of the recipe, and a line of it before which the new one goes."""


def answer(folder, *arguments):
    done = subprocess.run(
        [sys.executable, "-m", "drillctl", *arguments, "--json"],
        cwd=folder, env=os.environ | {"PYTHONPATH": str(folder)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    """A copy of the package with one measure more: three lines in three files."""
    folder = tmp_path_factory.mktemp("measure")
    for name in ("drillctl", "models", "designs"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for file, place in BESIDE.items():
        path = folder / "drillctl" / file
        head, mark, tail = path.read_text().partition(place)
        assert mark, f"{file} has no line {place!r}"
        path.write_text(f"{head}{LINES[file]}{mark}{tail}")
    (folder / "toy.toml").write_text(
        'schema = 1\nmodel = "monteiro-trindade-100kn"\n[simulation]\nduration = "4 s"\n'
        '[uncertainty]\nrealizations = 2\nkeep = ["turns"]\n[map]\naudit_cells = 0\n'
        'axes = [{path = "controller.kp", min = 300, max = 600, points = 2}, '
        '{path = "controller.ki", min = 50, max = 150, points = 2}]\n'
    )
    return folder


def test_a_recipe_touches_three_files(house):
    files = sorted((house / "drillctl").rglob("*.py"))
    same = [(ROOT / path.relative_to(house)).read_bytes() == path.read_bytes() for path in files]
    assert len(files) - sum(same) == len(BESIDE) == 3


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
    assert head == "controller.kp,controller.ki,j1,turns,status"
    answer(house, "uncertainty", "toy.toml", "--out", "draws")
    script = """
import drillctl
data = drillctl.open("draws").data["turns"]
assert data.dims == ("realization", "controller.kp", "controller.ki") and data.attrs["units"] == "1"
"""
    subprocess.run(
        [sys.executable, "-c", script],
        cwd=house, env=os.environ | {"PYTHONPATH": str(house)}, check=True,
    )  # fmt: skip
