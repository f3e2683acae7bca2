"""The certificate of tuned gains, from a saved summary alone."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_report import TINY, small_design

from drillctl.reporting.blocks import Checks, Table
from drillctl.reporting.gather import Gathered, NotThereError, Study
from drillctl.reporting.sections import tuning
from drillctl.reporting.words import Words
from drillctl.store.json_files import write_json

SUMMARY = {
    "gains": {"controller.kp": 612.5, "controller.ki": 140.0},
    "objective": "quantile 0.95",
    "value": 21.25,
    "trajectories": 123456,
    "seconds": 4.0,
    "message": "certified",
    "certificate": {
        "level": 33.0,
        "required_probability": 0.95,
        "realizations": 10000,
        "probability": 0.987,
        "interval_95": [0.9846, 0.9891],
        "passed": True,
        "tolerance": {"controller.kp": {"low": 580.0, "high": 655.0}},
    },
    "baselines": {
        "as designed": {
            "gains": {"controller.kp": 625.0}, "probability": 0.95, "interval_95": [0.94, 0.96],
            "value": 30.0,
        },
        "none": {"gains": None, "reason": "it has none"},
    },
}  # fmt: skip


def gathered(folder: Path, name: str, state: str) -> Gathered:
    write_json(folder / "summary.json", SUMMARY)
    study = Study(name, "the tuning", state, "it was not requested", folder)  # type: ignore[arg-type]
    design = small_design()
    return Gathered(design, design, TINY, Words("si"), {name: study})


def test_it_tells_what_was_saved(tmp_path):
    blocks = tuning.build(gathered(tmp_path, "tune", "done"))
    tables = {block.name: block for block in blocks if isinstance(block, Table)}
    assert tables["tuned"].rows[0] == ("Kp (N m s)", "612.5", "580 N m s to 655 N m s")
    assert tables["tuned"].rows[1] == ("Ki (N m)", "140", "–")
    assert tables["baselines"].rows[0][2] == "95 % (94 to 96 %)"
    assert tables["baselines"].rows[1] == ("none", "–", "it has none", "–")
    (certificate,) = (block for block in blocks if isinstance(block, Checks))
    assert certificate.checks[0].answer is True
    assert "98.7 % (98.5 to 98.9 %), 10000 draws" in certificate.checks[0].detail


def test_without_it_the_reason_is_told(tmp_path):
    with pytest.raises(NotThereError, match="it was not requested"):
        tuning.build(gathered(tmp_path, "tune", "left_out"))
