"""The command `delay`: its answers, files, messages and options."""

from __future__ import annotations

from pathlib import Path

import pytest
from strict_json import strict

import drillctl
from tests.alike import rows_of

SHIPPED = "dynamic-wob-delay-140kn"
SMALL = [
    "--set", "simulation.duration=10 s", "--realizations", "3",
    "--set", "weight_delay.gains=['0 kN*s/rad', '6 kN*s/rad']",
    "--set", "weight_delay.delays=['0 s', '0.2 s', '1 s']",
]  # fmt: skip


def test_json_tells_limits_and_every_point(call):
    code, out, err = call("delay", SHIPPED, *SMALL, "--seed", "7", "--json", "--out", "run")
    assert (code, err.splitlines()) == (0, ["results: run"])
    found = strict(out)
    assert (found["realizations"], found["seed"]) == (3, 7)
    assert found["delays"] == [0.0, 0.2, 1.0]
    assert [one["gain"] for one in found["gains"]] == [0.0, 6000.0]
    moving = found["gains"][1]
    assert set(moving) == {"gain", "ends_up_to", "harmful_from", "delays"}
    assert set(moving["ends_up_to"]) == {"delay", "at", "next"}
    assert set(moving["harmful_from"]) == {"delay", "interval_95"}
    for one in moving["delays"]:
        assert one["pairs"] == 3
        assert one["difference_interval_95"][0] <= one["difference"]
        assert one["ended_interval_95"][0] <= one["ended_share"] <= one["ended_interval_95"][1]
    assert found["constant"]["mean_weight"] == pytest.approx(140e3)
    assert strict(Path("run/summary.json").read_text()) == found
    assert drillctl.open("run").summary() | {"warnings": found["warnings"]} == found


def test_folder_holds_table_picture_and_the_run(call):
    assert call("delay", SHIPPED, *SMALL, "--out", "run")[0] == 0
    held = {path.name for path in Path("run").iterdir()}
    assert held >= {"weight-delay.png", "weight-delay.csv", "design.toml", "data.zarr"}
    result = drillctl.open("run")
    rows = rows_of("run/weight-delay.csv")
    assert len(rows) == 6
    point = result.benefits[1][1]
    assert float(rows[4]["difference (s)"]) == point.difference.value
    assert float(rows[4]["ended_share_high"]) == point.ended.interval[1]
    assert [float(rows[4][key]) for key in ("gain (N*s/rad)", "delay (s)")] == [6000.0, 0.2]


def test_tables_for_people(call):
    code, out, _ = call("delay", SHIPPED, *SMALL)
    assert code == 0
    assert "J1 and end of stick-slip over 3 draws (95 % intervals)" in out
    assert "delay that each gain bears" in out
    assert "K_w (kN s/rad)" in out
    assert "harmful from a delay of (s)" in out
    assert "Constant weight: mean J1 " in out
    assert "3 draws of bit_rock.a1_factor, bit_rock.a2_factor; seed 2012" in out
    assert "nan" not in out
    assert "klbf/rpm" in call("delay", SHIPPED, *SMALL, "--units", "field")[1]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("weight_delay.gains=['-1 kN*s/rad']", "weight_delay.gains"),
        ("weight_delay.gains=[]", "weight_delay.gains: is empty"),
        ("weight_delay.delay=['1 s']", "weight_delay.delay: unknown key; did you mean 'delays'"),
        ("weight_delay.delays=['1 m']", "weight_delay.delays"),
        ("weight_delay.set.weight_on_bit.lag='1 s'", "weight_delay.set: weight_on_bit.lag"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_and_leaves_nothing(call, setting, message):
    for verb in ("delay", "validate"):
        code, out, err = call(verb, SHIPPED, "--set", setting, "--json")
        assert (code, out) == (2, ""), verb
        assert message in err
        assert "--set weight_delay" in err or f"{SHIPPED}.toml" in err
        assert err.count("\n") == 1
    assert not list(Path().glob("runs/*"))
