"""`drillctl doctor` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

DESIGN = "monteiro-trindade-140kn"
SMALL = [
    "--axis", "controller.kp=0:1000:5", "--axis", "controller.ki=0:500:4",
    "--set", "simulation.duration=10 s", "--audit", "1",
]  # fmt: skip


def test_json_and_folder(call):
    code, out, err = call("doctor", DESIGN, *SMALL, "--json", "--out", "d")
    assert code == 0, err
    found = json.loads(out)
    assert found.keys() == {
        "verdict", "refused", "advice", "engine", "scheme", "estimate", "audit", "speed", "axes",
        "total_seconds", "warnings",
    }  # fmt: skip
    assert found["audit"]["cells"] == found["audit"]["asked"] == 1
    assert {p.name for p in Path("d").iterdir()} == {
        "run.json", "design.toml", "data.zarr", "result.json", "summary.json", "errors.png",
        "journal.jsonl",
        "scheme.csv", "errors.csv", "audited.csv", "speed.csv",
    }  # fmt: skip
    again = call("doctor", DESIGN, *SMALL, "--json", "--out", "d")
    assert json.loads(again[1]) == found
    assert "already done" in again[2]
    assert call("doctor", DESIGN, *SMALL[:-1], "2", "--out", "d")[0] == 2


def test_in_words(call):
    code, out, err = call("doctor", DESIGN, *SMALL, "--out", "d")
    assert code == 0, err
    for words in (
        "at accuracy standard", "25 ms", "13, 18 left out", "undamped modes", "99th percentile",
        "audit of 1 of 1 lanes", "lanes per second", "the reference engine", "'standard'",
    ):  # fmt: skip
        assert words in out
    assert out.split("results")[0] in call("doctor", DESIGN, *SMALL, "--out", "d")[1]


def test_a_refused_law_in_words(call):
    rock = ("law=printed-three-branch", "a1=0.03", "a2=0.07", "beta=0.09")
    sets = [part for key in rock for part in ("--set", f"bit_rock.{key}")]
    code, out, _ = call("doctor", DESIGN, *sets, "--out", "d")
    assert code == 0
    assert "not a law of the batch engine" in out
    assert "navarro-lopez-suarez" in out
    code, out, _ = call("doctor", DESIGN, *sets, "--out", "d", "--json")
    assert json.loads(out)["verdict"] == "refused"


def test_bad_input(call):
    assert call("doctor", DESIGN, "--audit", "-1")[0] == 2
    code, out, err = call("doctor", DESIGN, "--set", "simulation.step=2 s", "--out", "d")
    assert (code, out) == (2, "")
    assert "simulation.step" in err
    assert not Path("d").exists()
