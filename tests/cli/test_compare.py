"""The command `compare`: its answers, files, messages and options."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from strict_json import strict

import drillctl
from tests.alike import rows_of

SHIPPED = "pi-vs-dynamic-wob-140kn"
ALONE = "monteiro-trindade-140kn"
SHORT = ["--set", "simulation.duration=10 s", "--realizations", "5"]


def test_json_has_the_keys_of_the_contract(call):
    code, out, err = call("compare", SHIPPED, *SHORT, "--seed", "7", "--json", "--out", "run")
    assert (code, err.splitlines()) == (0, ["results: run"])
    found = strict(out)
    names = ["constant weight", "2 kN s/rad", "4 kN s/rad", "6 kN s/rad"]
    assert list(found["cases"]) == names
    for case in found["cases"].values():
        assert {"measures", "regions"} <= set(case)
        assert case["measures"]["j1"]["defined"] == 5
        assert list(case["regions"]) == ["20", "30", "40", "50"]
        assert case["nominal"]["no_map"] is None
        assert case["nominal"]["measures"]["j1"] > 0.0
        for region in case["regions"].values():
            assert region["area_fraction"] == region["cells"] / 41**2
            low, high = region["interval_95"]
            assert 0.0 <= low <= region["share"] <= high <= 1.0
    assert list(found["paired"]) == names[1:]
    for measures in found["paired"].values():
        for difference in measures.values():
            assert {"difference", "interval_95"} <= set(difference)
    j1 = found["paired"]["4 kN s/rad"]["j1"]
    assert j1["interval_95"][0] < j1["difference"] < j1["interval_95"][1]
    assert (found["realizations"], found["seed"], found["baseline"]) == (5, 7, names[0])
    # A run of 10 s never settles: null, not NaN.
    assert found["cases"][names[0]]["measures"]["settling_time"]["mean"] is None
    assert strict(Path("run/summary.json").read_text()) == found


def test_folder_holds_tables_pictures_and_the_run(call):
    assert call("compare", SHIPPED, *SHORT, "--out", "run")[0] == 0
    assert {
        "distributions.png", "differences.png", "weight.png", "regions.png", "responses.png",
        "design.toml", "data.zarr",
    } <= {path.name for path in Path("run").iterdir()}  # fmt: skip
    result = drillctl.open("run")
    assert result.realizations == 5
    rows = rows_of("run/draws.csv")
    assert len(rows) == 20
    assert float(rows[6]["j1 (s)"]) == result.cases[1].measures["j1"][1]
    assert float(rows[6]["bit_rock.a1_factor"]) == result.cases[1].drawn["bit_rock.a1_factor"][1]
    assert rows[0]["settling_time (s)"] == ""
    rows = {(row["case"], row["measure"]): row for row in rows_of("run/comparison.csv")}
    told = rows["6 kN s/rad", "j1"]
    expected = result.paired["6 kN s/rad"]["j1"]
    assert float(told["difference"]) == expected.value
    assert (float(told["difference_low"]), float(told["difference_high"])) == expected.interval
    assert rows["constant weight", "j1"]["difference"] == ""
    rows = rows_of("run/shares.csv")
    assert len(rows) == 16
    assert int(rows[0]["draws"]) == result.cases[0].share(20.0).hits
    region = result.cases[1].region(30.0)
    assert (rows[5]["cells"], rows[5]["area_fraction"]) == (
        str(region.cells), str(region.area_fraction)
    )  # fmt: skip


AXES = ["--axis", "controller.kp=100:900:5", "--axis", "controller.ki=50:250:3"]


def test_axes_of_the_maps_may_be_given(call):
    code, out, _ = call("compare", SHIPPED, *SHORT, *AXES, "--json", "--out", "run")
    assert code == 0
    for case in strict(out)["cases"].values():
        assert case["nominal"]["map"]["axes"]["controller.ki"] == {
            "min": 50.0, "max": 250.0, "points": 3
        }  # fmt: skip
        assert case["regions"]["50"]["area_fraction"] == case["regions"]["50"]["cells"] / 15
    assert drillctl.open("run").cases[3].nominal.map.j1.shape == (5, 3)


def test_maps_may_be_left_out(call):
    code, out, _ = call(
        "compare", SHIPPED, *SHORT, "--set", "compare.maps=false", "--json", "--out", "run"
    )
    assert code == 0
    for case in strict(out)["cases"].values():
        assert case["nominal"]["map"] is None
        assert case["nominal"]["no_map"] == "compare.maps is false"
        assert case["regions"]["20"]["area_fraction"] is None
        assert case["regions"]["20"]["share"] is not None
    assert Path("run/responses.png").exists()
    assert not Path("run/regions.png").exists()
    code, out, _ = call("compare", SHIPPED, *SHORT, "--set", "compare.maps=false", "--out", "run")
    assert code == 0
    assert "share of the map" not in out
    assert "cells of the map" not in out
    assert "no map" not in out  # it was asked for
    assert {row["cells"] for row in rows_of("run/shares.csv")} == {""}


def test_a_case_without_map_is_told(call):
    law = "{'controller.law' = 'constant-torque', 'controller.torque' = '7 kN*m'}"
    cases = f"compare.cases=[{{name = 'pi'}}, {{name = 'torque', set = {law}}}]"
    code, out, _ = call("compare", ALONE, *SHORT, *AXES, "--set", cases, "--out", "run")
    assert code == 0
    assert "map over controller.kp, controller.ki" in out
    assert "share of the map (%)" in out
    assert "torque: no map: map.axes controller.kp: no numeric parameter" in out
    assert "pi: no map" not in out
    assert Path("run/regions.png").exists()


def test_tables_for_people(call):
    long = ["--set", "simulation.duration=60 s"]
    code, out, _ = call("compare", SHIPPED, *SHORT, *long, "--equal-mean-weight")
    assert code == 0
    assert "Measures over 5 draws, and mean differences (95 % interval)" in out
    assert "less 'constant weight', draw by draw" in " ".join(out.split())
    assert "Draws at or under each level of J1 (95 % interval)" in out
    assert "mean WOB" in out
    assert re.search(r"\d kN ", out)
    assert "nominal weight shifted by" in out
    assert "5 draws of bit_rock.a1_factor, bit_rock.a2_factor, the same for every case" in out
    assert "seed 2012" in out
    assert "nan" not in out
    assert " klbf " in call("compare", ALONE, *SHORT, "--units", "field")[1]


def test_impossible_draws_are_told(call):
    law = "{distribution = 'uniform', min = 0.1, max = 0.9}"
    wide = ["--set", f"uncertain={{'bit_rock.a2_factor' = {law}}}"]
    code, out, err = call("compare", ALONE, *SHORT, "--realizations", "40", *wide)
    assert code == 0
    assert "of 40 draws failed; " in out
    assert "bit_rock.a2_factor: the factors give a2" in out
    assert "one case only" in err
    assert "Traceback" not in err


def test_options_are_part_of_the_run(call):
    assert call("compare", ALONE, *SHORT, "--out", "run")[0] == 0
    assert "already done: run" in call("compare", ALONE, *SHORT, "--out", "run")[2]
    for other in (["--seed", "3"], ["--equal-mean-weight"], ["--realizations", "6"]):
        code, out, err = call("compare", ALONE, *SHORT, *other, "--out", "run")
        assert (code, out) == (2, "")
        assert "another design or other settings" in err


@pytest.mark.parametrize(
    ("arguments", "messages"),
    [
        (["--realizations", "0"], ["uncertainty.realizations: 0 is not allowed"]),
        (["--seed", "-3"], ["uncertainty.seed: -3 is not allowed"]),
        (["--set", "compare.cases=[{name = 'a', set = {'controller.kpp' = 3}}]"],
         ["compare.cases 'a': controller.kpp", "did you mean 'kp'"]),
        (["--set", "simulation.duration=10 s", "--realizations", "5", "--equal-mean-weight"],
         ["compare.cases '6 kN s/rad': weight_on_bit: within its limits the law cannot have"]),
        (["--set", "compare.case=[]"], ["compare.case: unknown key; did you mean 'cases'"]),
        (["--set", "uncertain.bit_rock.a1_factor.distribution=lognorm"],
         ["uncertain.bit_rock.a1_factor.distribution", "did you mean 'lognormal'"]),
        (["--set", "uncertain.bit_rock.a1_factor.cov=-1"],
         ["uncertain.bit_rock.a1_factor.cov: -1 is not allowed"]),
        (["--set", "uncertain.bit_rock.b1_factor={distribution='normal', cov=0.1}"],
         ["uncertain.bit_rock.b1_factor", "did you mean 'bit_rock.a1_factor'"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_and_leaves_nothing(call, arguments, messages):
    code, out, err = call("compare", SHIPPED, *arguments, "--json")
    assert (code, out) == (2, "")
    assert "--set " in err or f"{SHIPPED}.toml" in err
    for message in messages:
        assert message in err
    assert err.count("\n") == 1
    assert not list(Path().glob("runs/*"))


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("uncertain.bit_rock.b1_factor={distribution='normal', cov=0.1}", "no numeric parameter"),
        ("compare.cases=[{name = 'a', set = {'controller.kpp' = 3}}]", "compare.cases 'a'"),
        ("compare.cases=[{name='a'}, {name='b', set={'start.kind'='rest'}}]", "the same start"),
    ],
)
def test_validate_sees_draws_and_cases(call, setting, message):
    assert call("validate", SHIPPED)[0] == 0
    code, out, err = call("validate", SHIPPED, "--set", setting)
    assert (code, out) == (2, "")
    assert message in err
