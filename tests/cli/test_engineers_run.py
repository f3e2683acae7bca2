"""From a rig of one's own to numbers for the drive, a schedule and a PDF, command by command."""

import csv
import json
import time
from pathlib import Path

import pytest

import drillctl
from tests.code_blocks import blocks

TUTORIAL = Path(__file__).resolve().parents[2] / "docs" / "tutorial.md"
COMMANDS = (
    ("validate", "my-rig.toml"),
    ("modes", "my-rig.toml", "--out", "modes"),
    ("loop", "my-rig.toml", "--no-map", "--out", "loop"),
    ("simulate", "my-rig.toml", "--out", "now"),
    ("recommend", "my-rig.toml", "--out", "recommended"),
    ("simulate", "recommended/recommended.toml", "--out", "then"),
    (
        "schedule", "recommended/recommended.toml", "--depth", "2000 m:4000 m:5",
        "--out", "schedule",
    ),
    ("export", "recommended/recommended.toml", "--out", "drive"),
    (
        "report", "recommended/recommended.toml", "--format", "pdf",
        "--sections", "recommend,summary,modes,responses", "--out", "report",
    ),
)  # fmt: skip
MOST = 600.0  # of processor time (s)


def test_the_tutorial_is_a_run_of_less_than_fifteen_commands():
    commands = [one for block in blocks(TUTORIAL) for one, _ in block.commands]
    assert len(commands) < 15
    verbs = [one.split()[1] for one in commands]
    assert {"recommend", "schedule", "export", "report"} <= set(verbs)
    assert "--format pdf" in commands[-1]


@pytest.mark.slow
def test_a_rig_of_ones_own_ends_with_numbers_a_schedule_and_a_pdf(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rig = next(one.text for one in blocks(TUTORIAL) if one.mark == "file my-rig.toml")
    Path("my-rig.toml").write_text(rig)
    begin = time.process_time()
    for command in COMMANDS:
        code, _, err = call(*command)
        assert code == 0, (command, err)
    assert time.process_time() - begin < MOST

    told = json.loads(Path("recommended/summary.json").read_text())["recommended"]
    assert told["verdict"] in ("passes", "fragile")
    assert told["drive_units"]["kp"]["N*m*s/rad"] == told["gains"]["controller.kp"]
    assert (
        drillctl.load("recommended/recommended.toml").top_drive.kp
        == (told["gains"]["controller.kp"])
    )
    assert drillctl.open("now").status == "sticking"
    assert drillctl.open("then").status in ("ok", "not_settled")
    with Path("schedule/stands.csv").open() as stream:
        rows = list(csv.reader(stream))
    assert len(rows) > 2000.0 / 28.35
    assert any(path.stat().st_size > 1000 for path in Path("drive").iterdir())
    assert Path("report/report.pdf").read_bytes().startswith(b"%PDF")
