"""The committed reports against what the code gives now."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

import drillctl
import drillctl.studies

REPORTS = Path(__file__).resolve().parents[1] / "reports"
PAGES = sorted(REPORTS.rglob("*.md"))
ROUNDING = 1e-7  # another processor may round the modal data otherwise


def script(name: str) -> Any:
    """A script of the folder as a module."""
    found = importlib.util.spec_from_file_location(f"reports_{name}", REPORTS / f"{name}.py")
    module = importlib.util.module_from_spec(found)
    sys.modules[found.name] = module
    found.loader.exec_module(module)
    return module


def committed(name: str) -> dict[str, Any]:
    """The studies of a committed report."""
    held = json.loads((REPORTS / name / "summary.json").read_text(encoding="utf-8"))
    assert held["complete"]
    return held["studies"]


def alike(found: Any, held: Any, where: str = "") -> None:
    """Hold nested numbers to others."""
    if isinstance(held, dict):
        assert set(found) == set(held), where
        for key, value in held.items():
            alike(found[key], value, f"{where}.{key}")
    elif isinstance(held, list):
        assert len(found) == len(held), where
        for number, value in enumerate(held):
            alike(found[number], value, f"{where}[{number}]")
    elif isinstance(held, float):
        assert found == pytest.approx(held, rel=ROUNDING, abs=1e-12), where
    else:
        assert found == held, where


@pytest.fixture(scope="module")
def paper_map() -> Any:
    return drillctl.stability_map(drillctl.load("monteiro-trindade-140kn"), audit_cells=0)


def test_the_map_of_the_report_is_what_the_code_gives(paper_map):
    held, found = committed("monteiro-trindade-140kn")["map"], paper_map.summary()
    alike({key: found[key] for key in ("axes", "minimum", "regions", "statuses")},
          {key: held[key] for key in ("axes", "minimum", "regions", "statuses")})  # fmt: skip
    assert held["audit"]["cells"] == 12
    assert held["audit"]["worst_relative_difference"] < 1e-2


def test_the_loop_of_the_report_is_what_the_code_gives():
    held = committed("monteiro-trindade-140kn")["loop"]
    found = drillctl.loop(drillctl.load("monteiro-trindade-140kn")).summary()
    for key in ("slope", "slope_margin", "deciding_frequency_hz", "peak_sensitivity",
                "critical_speed", "critical_weight_on_bit"):  # fmt: skip
        assert found[key] == pytest.approx(held[key], rel=ROUNDING)


def test_the_three_regions_of_the_report_are_what_the_code_gives():
    held = committed("monteiro-trindade-140kn")["regions"]
    found = drillctl.three_regions(drillctl.load("monteiro-trindade-140kn")).summary()
    assert found["counts"] == held["counts"]


def test_the_run_of_the_report_is_what_the_code_gives():
    held = committed("monteiro-trindade-140kn")["simulate"]
    found = drillctl.simulate(drillctl.load("monteiro-trindade-140kn"), interval=0.05).summary()
    alike(found["measures"], held["measures"])


def test_the_numbers_of_the_papers_map_are_what_the_code_gives(paper_map):
    held = json.loads((REPORTS / "paper.json").read_text(encoding="utf-8"))
    minimum, at = paper_map.minimum
    told = {"j1": minimum, "kp": at["controller.kp"], "ki": at["controller.ki"]}
    alike(told, held["minimum"])
    for level, region in paper_map.regions.items():
        assert region.cells == held["regions"][f"{level:g}"]["cells"]


def test_the_pages_are_made_from_their_numbers():
    held = json.loads((REPORTS / "paper.json").read_text(encoding="utf-8"))
    page = (REPORTS / "paper.md").read_text(encoding="utf-8")
    assert page == script("paper").page(held)
    assert "**no**" not in page
    assert (REPORTS / "README.md").read_text(encoding="utf-8") == script("make").index()


@pytest.mark.parametrize("path", PAGES, ids=[str(path.relative_to(REPORTS)) for path in PAGES])
def test_pictures_and_links_are_there(path):
    text = path.read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text):
        target = path.parent / link
        assert target.exists(), link
        if target.suffix == ".png":
            assert 10_000 < target.stat().st_size < 400_000


def test_they_are_small():
    assert sum(path.stat().st_size for path in REPORTS.rglob("*") if path.is_file()) < 6e6


@pytest.mark.slow
def test_all_numbers_beside_the_paper_are_what_the_code_gives(paper_map):
    paper = script("paper")
    fig6 = drillctl.load(paper.FIG6)
    ten = drillctl.uncertainty(fig6, audit_cells=0)
    many = drillctl.uncertainty(fig6, realizations=paper.MANY, audit_cells=0)
    held = json.loads((REPORTS / "paper.json").read_text(encoding="utf-8"))
    alike(json.loads(json.dumps(paper.numbers(paper_map, ten, many))), held)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["six-drives-100kn", "pi-vs-dynamic-wob-140kn"])
def test_the_comparisons_are_what_the_code_gives(name):
    held = committed(name)["compare"]
    found = json.loads(json.dumps(drillctl.compare(drillctl.load(name)).summary()))
    for case, told in held["cases"].items():
        for key in ("measures", "regions", "statuses"):
            alike(found["cases"][case][key], told[key], f"{case}.{key}")
    alike(found["paired"], held["paired"])
