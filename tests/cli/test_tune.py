"""The command `tune`: its answers, files, messages and exit codes."""

import ctypes
import os
import subprocess
import sys
from pathlib import Path

import pytest
from strict_json import strict

import drillctl
from drillctl.cli import run
from drillctl.errors import InputError
from drillctl.studies.tune import compute
from tests.alike import rows_of

HOLDS = {
    "the command `tune`": "messages and exit codes; the tuned design in `simulate` and `map`; "
    "IPOPT in a process of its own",
}

SHIPPED = "robust-gains-140kn"
SMALL = [
    "--realizations", "24", "--certificate", "150", "--set", "tune.starts=1",
    "--set", "tune.certificate.audit=1", "--set", "simulation.accuracy=fast",
]  # fmt: skip


@pytest.fixture
def quick(call):
    """The command with what follows it."""
    return lambda *arguments: call("tune", *arguments)


def test_json_has_the_keys_of_the_contract_and_the_folder_all_files(quick, call):
    code, out, err = quick(SHIPPED, *SMALL, "--set", "tune.probability=0.8", "--json", "--out", "r")
    assert (code, err.splitlines()[-1]) == (0, "results: r")
    found = strict(out)
    assert list(found["gains"]) == ["controller.kp", "controller.ki"]
    assert 600 < found["gains"]["controller.kp"] < 660
    assert {"objective", "value", "trajectories", "seconds"} <= set(found)
    certificate = found["certificate"]
    assert (certificate["level"], certificate["required_probability"]) == (33.0, 0.8)
    assert certificate["realizations"] == 150
    low, high = certificate["interval_95"]
    assert 0.8 <= low < certificate["probability"] < high
    assert certificate["passed"] is True
    assert set(certificate["tolerance"]) == set(found["gains"])
    assert certificate["margins"]["slope_margin"] > certificate["margins"]["slope"]
    assert strict(Path("r/summary.json").read_text()) == found
    again = quick(SHIPPED, *SMALL, "--set", "tune.probability=0.8", "--json", "--out", "r")
    assert (again[0], strict(again[1]), again[2]) == (0, found, "already done: r\n")
    # A design ready to run, tables and pictures.
    code, out, _ = quick(SHIPPED, *SMALL, "--set", "tune.probability=0.8", "--out", "r")
    assert code == 0
    assert "certificate passed: J1 <= 33 s" in out
    assert "largest slope margin" in out
    assert {
        "tuned.toml", "design.toml", "data.zarr", "summary.json", "baselines.csv", "tolerance.csv",
        "neighbourhood.csv", "draws.csv", "baselines.png", "neighbourhood.png",
    } <= {path.name for path in Path("r").iterdir()}  # fmt: skip
    result = drillctl.open("r")
    tuned = drillctl.load("r/tuned.toml")
    assert tuned.top_drive.kp == result.gains["controller.kp"]
    assert result.design.top_drive.kp == 625.0  # as it was asked for
    rows = {row["name"]: row for row in rows_of("r/baselines.csv")}
    assert float(rows["tuned"]["probability"]) == result.certificate.runs.probability
    assert float(rows["paper's gains"]["controller.ki (N*m/rad)"]) == 100.0
    assert float(rows_of("r/tolerance.csv")[0]["low"]) == result.certificate.tolerances[0].low
    assert len(rows_of("r/draws.csv")) == 150
    short = ["--set", "simulation.duration=5 s"]
    assert call("simulate", "r/tuned.toml", *short, "--out", "s")[0] == 0
    assert call("map", "r/tuned.toml", *short, "--audit", "0", "--out", "m")[0] == 0
    assert call("validate", "r/tuned.toml")[0] == 0
    shown = quick(
        SHIPPED, *SMALL, "--set", "tune.probability=0.8", "--out", "r", "--units", "field"
    )
    assert shown[0] == 0
    assert "already done: r" in shown[2]
    assert "klbf ft/rpm" in shown[1]
    assert "tuned" in shown[1]


def test_a_level_that_no_gains_reach_exits_1_with_all_results(quick):
    asked = (SHIPPED, *SMALL, "--set", "tune.level=12", "--json", "--out", "r")
    code, out, err = quick(*asked)
    assert code == 1
    found = strict(out)
    assert found["certificate"]["passed"] is found["passed"] is False
    assert found["certificate"]["verdict"] == "failed"
    told = err.splitlines()
    assert (len(told), told[0]) == (2, "results: r")
    assert told[1].startswith(
        "drillctl: no gains between these bounds have J1 <= 12 s with probability 0.95: at the "
        "best gains, controller.kp = "
    )
    assert Path("r/tuned.toml").is_file()
    assert found["certificate"]["tolerance"]["controller.kp"]["low_at_bound"] is False
    again = quick(*asked)
    assert (again[0], strict(again[1])) == (1, found)
    assert again[2].splitlines()[-1] == told[1]


def test_a_certificate_that_shows_nothing_says_that_more_would(quick):
    code, _, err = quick(SHIPPED, "--realizations", "24", "--certificate", "20",
                         "--set", "tune.starts=1", "--set", "tune.certificate.audit=0")  # fmt: skip
    assert code == 1
    assert "certificate not shown" in err
    assert "more realizations would decide; the closest is controller.kp" in err


def test_requirements_that_cannot_be_met_exit_1_with_the_closest_point(quick):
    code, out, err = quick(
        SHIPPED, *SMALL, "--set", "tune.constraints.mean_weight_on_bit=150 kN", "--json"
    )
    assert code == 1
    found = strict(out)
    assert found["feasible"] is False
    assert found["violations"]["mean_weight_on_bit"] == pytest.approx(1 - 140 / 150)
    message = err.splitlines()[-1]
    assert "the requirements cannot all be met between these bounds: at the closest" in message
    assert "mean_weight_on_bit is missed" in message
    for dump in ("Ipopt", "EXIT:", "Traceback"):
        assert dump not in out + err


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["tune.parameters.controller.kp.min=900"],
         "tune.parameters.controller.kp: min 900.0 must be less than max 800.0: the bounds are "
         "reversed"),
        (["tune.parameters.controller.kq.min=1", "tune.parameters.controller.kq.max=2"],
         "did you mean 'controller.kp'"),
        (["tune.certificate.seed=2012"], "certificate.seed 2012 is that of the search"),
        (["tune.parameters.bha.inertia.min=-5 kg*m^2", "tune.parameters.bha.inertia.max=5 kg*m^2"],
         "tune.parameters.bha.inertia.min"),
        (["tune.certificate.realizations=0"], "greater than 0"),
        (["tune.certificat.realizations=10"], "did you mean 'certificate'"),
        (["uncertain.controller.kp.distribution=uniform", "uncertain.controller.kp.min=500",
          "uncertain.controller.kp.max=600"], "cannot be tuned as well"),
        (["tune.constraints.peak_sensitivity=1"], "more than 1"),
    ],
)  # fmt: skip
def test_wrong_input_is_one_message_and_exit_2(quick, settings, told):
    code, out, err = quick(SHIPPED, *(a for s in settings for a in ("--set", s)), "--json")
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert told in err
    assert not list(Path().glob("runs/*"))


def test_a_law_without_anything_to_tune_is_told(quick):
    changed = ["--set", "controller.law=constant-torque", "--set", "controller.torque=0 N*m"]
    code, out, err = quick("monteiro-trindade-140kn", *changed)
    assert (code, out) == (2, "")
    assert "a torque of 0 has no bounds about it" in err
    assert not list(Path().glob("runs/*"))


@pytest.mark.slow
def test_the_options_make_the_design(quick):
    quick(SHIPPED, *SMALL, "--seed", "8", "--out", "r")
    tables = drillctl.load("r/design.toml").tables.tune
    assert (tables.realizations, tables.seed, tables.certificate.realizations) == (24, 8, 150)
    assert drillctl.open("r").certificate.seed == 8 + 1_000_003


def test_validate_reads_what_is_tuned(call):
    code, _, err = call("validate", SHIPPED, "--set", "tune.parameters.controller.kp.min=900")
    assert code == 2
    assert "reversed" in err


@pytest.mark.slow
def test_the_solver_speaks_on_stderr_and_only_if_asked():
    """In a process of its own: IPOPT prints past Python."""
    short = ["--set", "simulation.duration=10 s"]
    command = [sys.executable, "-m", "drillctl", "tune", SHIPPED, *SMALL, *short, "--json"]
    loud, quiet = (
        subprocess.run(
            [*command, *more], capture_output=True, text=True, check=False, timeout=300,
            env=os.environ,
        )
        for more in (["-v"], [])
    )  # fmt: skip
    assert strict(loud.stdout)["gains"] == strict(quiet.stdout)["gains"]
    assert "Ipopt" in loud.stderr
    assert "Ipopt" not in quiet.stderr


def test_what_a_library_prints_by_c_goes_to_stderr_too(capfd, monkeypatch):
    def loud(*arguments, **options):
        ctypes.CDLL(None).puts(b"a solver speaks")
        os.write(1, b"so does another\n")
        print("and Python")  # noqa: T201
        raise InputError("enough")

    monkeypatch.setattr(compute, "tune", loud)
    assert run(["tune", SHIPPED, "--json"]) == 2
    said = capfd.readouterr()
    assert said.out == ""
    for words in ("a solver speaks", "so does another", "and Python", "enough"):
        assert words in said.err
