"""`drillctl map --adaptive`: its answers, files, messages, checks and resumption."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from strict_json import strict

import drillctl

DESIGN = "monteiro-trindade-140kn"
SHORT = ["--set", "simulation.duration=10 s", "--set", "map.levels=[8.8, 9]", "--audit", "0"]
GAINS = ["--axis", "controller.kp=0:1000:101", "--axis", "controller.ki=0:500:91"]
ADAPTIVE = ["map", DESIGN, "--adaptive", *GAINS, *SHORT]


def test_json_has_the_keys_of_a_map_and_its_own(call):
    code, out, err = call(*ADAPTIVE, "--json", "--out", "run")
    assert (code, err) == (0, "results: run\n")
    found = strict(out)
    assert set(found) == {
        "axes", "minimum", "minimum_over", "regions", "trajectories", "share", "intervals",
        "self_check", "full_audit", "audit", "statuses", "step", "modes", "seconds",
        "total_seconds",
    }  # fmt: skip
    assert found["axes"]["controller.ki"] == {"min": 0.0, "max": 500.0, "points": 91}
    assert list(found["regions"]) == ["8.8", "9"]
    assert found["regions"]["9"]["cells"] > found["regions"]["8.8"]["cells"] > 0
    assert set(found["minimum"]) == {"j1", "at"}
    assert found["share"] == found["trajectories"] / (101 * 91)
    assert found["share"] < 1.0
    assert sum(found["statuses"].values()) == found["trajectories"]
    check = found["self_check"]
    assert set(check) == {"cells", "mismatches", "interval_95", "followed", "seed", "verdict"}
    assert check["cells"] == 300
    assert found["full_audit"] is None
    assert strict(Path("run/summary.json").read_text()) == found
    assert drillctl.open("run").summary() == found


def test_regions_are_those_of_the_map(call):
    mine = strict(call(*ADAPTIVE, "--json", "--full-audit")[1])
    whole = strict(call("map", DESIGN, *GAINS, *SHORT, "--json")[1])
    for key in ("axes", "minimum", "regions", "step", "modes"):
        assert mine[key] == whole[key]
    assert mine["full_audit"]["verdict"] == "ok"
    assert mine["full_audit"]["trajectories"] == 101 * 91 - mine["trajectories"]
    assert mine["full_audit"]["regions"]["9"]["hausdorff"] == 0.0


def test_folder_holds_tables_picture_and_the_run(call):
    assert call(*ADAPTIVE, "--out", "run")[0] == 0
    held = {path.name for path in Path("run").iterdir()}
    assert held == {
        "design.toml", "run.json", "summary.json", "data.zarr", "cells.csv", "regions.csv",
        "outlines.csv", "map.png",
    }  # fmt: skip
    result = drillctl.open("run")
    with Path("run/cells.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == result.trajectories
    last = np.unravel_index(result.cells[-1], (101, 91))
    assert float(rows[-1]["controller.kp"]) == result.axes[0].values[last[0]]
    assert float(rows[-1]["controller.ki"]) == result.axes[1].values[last[1]]
    assert float(rows[-1]["j1"]) == result.measures["j1"][-1]
    with Path("run/regions.csv").open(encoding="utf-8") as stream:
        assert [int(r["cells"]) for r in csv.DictReader(stream)] == [
            region.cells for region in result.regions.values()
        ]
    with Path("run/outlines.csv").open(encoding="utf-8") as stream:
        vertices = list(csv.DictReader(stream))
    assert vertices[0].keys() == {"level", "polygon", "ring", "controller.kp", "controller.ki"}
    first = result.regions[8.8].polygons.geoms[0].exterior.coords
    told = [v for v in vertices if (v["level"], v["polygon"], v["ring"]) == ("8.8", "0", "0")]
    assert [(float(v["controller.kp"]), float(v["controller.ki"])) for v in told] == list(first)


def test_people_are_told_what_was_simulated_and_checked(call):
    code, out, err = call(*ADAPTIVE, "--full-audit", "--out", "run")
    assert code == 0
    assert "J1 <= 8.8 s" in out
    assert "self-check: ok, 0 of 300 cells left out are in another band" in out
    assert "beside the full grid" in out
    assert "of 9191 cells simulated (" in out
    assert err == ""
    code, again, err = call(*ADAPTIVE, "--full-audit", "--out", "run")
    assert (code, again) == (0, out.replace("results: run\n", ""))
    assert "already done: run" in err


def test_a_map_with_and_without_the_audit_are_other_runs(call):
    assert call(*ADAPTIVE, "--out", "run")[0] == 0
    code, _, err = call(*ADAPTIVE, "--full-audit", "--out", "run")
    assert code == 2
    assert "another design or other settings" in err
    code, _, err = call("map", DESIGN, *GAINS, *SHORT, "--out", "run")
    assert code == 2
    assert "holds a run of 'adaptive-map', not 'map'" in err


def test_a_saved_result_is_the_commands_own(call):
    axes = [
        {"path": "controller.kp", "min": 0, "max": 1000, "points": 101},
        {"path": "controller.ki", "min": 0, "max": 500, "points": 91},
    ]
    values = {"simulation.duration": "10 s", "map.levels": [8.8, 9.0], "map.audit_cells": 0}
    result = drillctl.adaptive_map(drillctl.load(DESIGN, **values, **{"map.axes": axes}))
    result.save("saved")
    code, out, err = call(*ADAPTIVE, "--json", "--out", "saved")
    assert code == 0
    assert "already done: saved" in err
    assert strict(out) == result.summary()


def test_a_small_grid_says_that_all_was_simulated(call):
    small = ["--axis", "controller.kp=0:1000:5", "--axis", "controller.ki=0:500:4", *SHORT]
    code, out, err = call("map", DESIGN, "--adaptive", *small)
    assert code == 0
    assert "20 of 20 cells simulated (100.00%)" in out
    assert "self-check: none" in out
    assert "every cell was simulated" in err


def test_a_mismatch_is_told(call, monkeypatch):
    from drillctl.studies.adaptive import checks as adaptive_checks

    real = adaptive_checks.self_check

    def doubted(*arguments):
        check = real(*arguments)
        said = check.said.copy()
        said[:2] = 0
        return adaptive_checks.SelfCheck(check.cells, said, check.found, 17)

    monkeypatch.setattr("drillctl.studies.adaptive.study.self_check", doubted)
    code, out, err = call(*ADAPTIVE)
    assert code == 0
    assert "self-check: look, 2 of 300 cells" in out
    assert "17 more simulated to mend it" in out
    assert "self-check: look: a cell left out was in another band than said" in err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["map", DESIGN, "--full-audit"], "--full-audit: goes with --adaptive"),
        (["map", DESIGN, "--adaptive", "--axis", "controller.kp=0:1000:101"],
         "map.axes: an adaptive map follows contours over 2 parameters, got 1"),
        (["map", DESIGN, "--adaptive", *GAINS, "--axis", "bit_rock.a1_factor=0.9:1.1:3"],
         "over 2 parameters, got 3"),
        (["map", DESIGN, "--adaptive", GAINS[0], GAINS[1], "--axis", "controller.kd=0:1:101"],
         "controller.kd"),
        (["map", DESIGN, "--adaptive", GAINS[0], GAINS[1], "--axis", "controller.ki=0:500:1"],
         "2 points or more"),
        (["map", DESIGN, "--adaptive=yes"], "--adaptive"),
    ],
)  # fmt: skip
def test_misuse_is_refused_in_one_message(call, arguments, told):
    code, out, err = call(*arguments, "--out", "none")
    assert (code, out) == (2, "")
    assert told in err
    assert len(err.strip().splitlines()) == 1
    assert not Path("none").exists()


class Counted:
    """`run_batch` that counts its calls and is interrupted at one of them."""

    def __init__(self, monkeypatch, stop_at=None):
        from drillctl.studies.adaptive import chosen_cells

        self.calls, self.stop_at = 0, stop_at
        self.real = chosen_cells.run_batch
        monkeypatch.setattr(chosen_cells, "run_batch", self)

    def __call__(self, lanes, prepared):
        self.calls += 1
        if self.calls == self.stop_at:
            raise KeyboardInterrupt
        return self.real(lanes, prepared)


def test_interrupted_it_goes_on_and_ends_in_the_same_bits(call, monkeypatch):
    with monkeypatch.context() as patch:
        whole = Counted(patch)
        assert call(*ADAPTIVE, "--out", "whole")[0] == 0
    assert whole.calls >= 3
    with monkeypatch.context() as patch:
        Counted(patch, stop_at=3)
        code, out, err = call(*ADAPTIVE, "--out", "cut", "--json")
        assert (code, out) == (130, "")
        assert "--out cut goes on" in err
    with monkeypatch.context() as patch:
        rest = Counted(patch)
        assert call(*ADAPTIVE, "--out", "cut")[0] == 0
    assert rest.calls == whole.calls - 2
    one, other = drillctl.open("cut"), drillctl.open("whole")
    np.testing.assert_array_equal(one.cells, other.cells)
    np.testing.assert_array_equal(one.bands, other.bands)
    for name, values in one.measures.items():
        np.testing.assert_array_equal(values, other.measures[name])
    assert not Path("cut/blocks").exists()
