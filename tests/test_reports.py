"""The committed report against what the code gives now."""

import json
from pathlib import Path

import pytest

import drillctl
import drillctl.studies

REPORT = Path(__file__).resolve().parents[1] / "reports" / "monteiro-trindade-140kn"


def test_the_map_of_the_report_is_what_the_code_gives():
    committed = json.loads((REPORT / "summary.json").read_text(encoding="utf-8"))
    design = drillctl.load("monteiro-trindade-140kn")
    found = drillctl.stability_map(design, audit_cells=0).summary()
    assert found["axes"] == committed["axes"]
    assert found["minimum"]["at"] == committed["minimum"]["at"]
    # Another processor may round the modal data otherwise.
    assert found["minimum"]["j1"] == pytest.approx(committed["minimum"]["j1"], rel=1e-7)
    assert found["regions"] == committed["regions"]
    assert found["statuses"] == committed["statuses"]
    assert committed["audit"]["cells"] == 12
    assert committed["audit"]["worst_relative_difference"] < 1e-2


def test_the_loop_of_the_report_is_what_the_code_gives():
    committed = json.loads((REPORT / "loop.json").read_text(encoding="utf-8"))
    found = drillctl.loop(drillctl.load("monteiro-trindade-140kn")).summary()
    for key in ("slope", "slope_margin", "deciding_frequency_hz", "peak_sensitivity",
                "critical_speed", "critical_weight_on_bit"):  # fmt: skip
        assert found[key] == pytest.approx(committed[key], rel=1e-7)


def test_the_three_regions_of_the_report_are_what_the_code_gives():
    committed = json.loads((REPORT / "three-regions.json").read_text(encoding="utf-8"))
    found = drillctl.studies.three_regions(drillctl.load("monteiro-trindade-140kn")).summary()
    assert found["counts"] == committed["counts"]


@pytest.mark.parametrize(
    "name",
    [
        "map",
        "responses",
        "modes",
        "bode",
        "friction",
        "nyquist",
        "three-regions",
        "slope-margin",
        "impedance",
    ],
)
def test_the_pictures_are_there(name):
    assert (REPORT / f"{name}.png").stat().st_size > 20_000
