"""The section on a moving weight: from a saved study to tables and pictures."""

from small_report import TINY

import drillctl
from drillctl.reporting.blocks import Figure, Table
from drillctl.reporting.gather import Gathered, Study
from drillctl.reporting.sections import advantage
from drillctl.reporting.words import Words
from drillctl.store.json_files import write_json


def told(value, low, high):
    return {"value": value, "interval_95": [low, high]}


def case(gain, objective, less):
    return {
        "terms": "equal mean weight",
        "gains": {
            "controller.kp": 630.0, "controller.ki": 145.0, "weight_on_bit.gain": gain,
        },
        "objective": told(objective, objective - 1, objective + 1),
        "objective_difference": less,
        "means": {"mean_weight_after_start": 140e3, "rop_proxy": 0.95},
    }  # fmt: skip


AREA = {"nominal_area": 0.05, "area_p95": told(0.01, 0, 0.02), "area_p05": told(0.1, 0.1, 0.2)}
SUMMARY = {
    "objective": "quantile 0.95", "realizations": 1000, "seed": 7, "material": 0.01,
    "cases": {
        "constant weight": case(0.0, 18.4, None),
        "dynamic, ideal path, equal mean weight": case(10e3, 3.7, told(-14.7, -15.3, -14.6)),
    },
    "regions": {"constant weight": {"gain": 0.0, "levels": {"33": AREA}}},
    "delay": {
        "kept": {"zero": {"delay": 0.358, "interval_95": [0.352, 0.363]}},
        "anew": {"material": {"delay": None, "interval_95": [None, None]}},
    },
}  # fmt: skip


def test_it_tells_what_was_saved(tmp_path):
    write_json(tmp_path / "summary.json", SUMMARY)
    design = drillctl.load("monteiro-trindade-140kn")
    study = Study("advantage", "the study", "done", "", tmp_path)
    blocks = advantage.build(Gathered(design, design, TINY, Words("si"), {"advantage": study}))
    tables = {block.name: block for block in blocks if isinstance(block, Table)}
    constant, dynamic = tables["advantage"].rows
    assert constant[3] == "–"
    assert dynamic[1] == "Kp 630 N m s, Ki 145 N m, K_w 10 kN s/rad"
    assert dynamic[3] == "-14.7 (-15.3 to -14.6)" or dynamic[3] == "−14.7 (−15.3 to −14.6)"
    assert tables["advantage-areas"].rows == (
        ("constant weight", "J1 ≤ 33 s", "5.0 %", "1.0 %", "10.0 %"),
    )
    assert [row[1] for row in tables["advantage-ends"].rows] == [
        "0.358 (0.352 to 0.363)", "beyond the longest delay",
    ]  # fmt: skip
    assert sum(isinstance(block, Figure) for block in blocks) == 4
