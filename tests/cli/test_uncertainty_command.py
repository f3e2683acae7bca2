"""The command `uncertainty`: its answers, files, resumption, messages and options."""

from __future__ import annotations

import dataclasses
import errno
import itertools
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from strict_json import strict

import drillctl
from drillctl.design.reading import parse_axis, parse_setting
from drillctl.ensemble import realizations as realizations_module
from drillctl.ensemble import running as cluster_module
from drillctl.errors import InputError
from drillctl.studies.uncertainty import indices
from tests.alike import TIMES, rows_of, same

HOLDS = {
    "runs under uncertainty": "killed, interrupted, extended, disk full: the same bits",
}

PAPER = "monteiro-trindade-140kn"
AXES = ["--axis", "controller.kp=500:700:3", "--axis", "controller.ki=100:150:2"]
SHORT = [*AXES, "--set", "simulation.duration=20 s", "--set", "simulation.accuracy=fast",
         "--set", "map.levels=[12, 15, 18]", "--audit", "0"]  # fmt: skip
FEW = [*SHORT, "--realizations", "12"]


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch):
    """Blocks are of 4 draws."""
    monkeypatch.setattr(realizations_module, "LANES", 24)


# --- answers -----------------------------------------------------------------------------------


def test_json_has_the_keys_of_the_contract(call):
    code, out, err = call("uncertainty", PAPER, *FEW, "--seed", "7", "--json", "--out", "run")
    assert (code, err.splitlines()) == (0, ["results: run"])
    found = strict(out)
    assert (found["realizations"], found["seed"]) == (12, 7)
    assert list(found["levels"]) == ["12", "15", "18"]
    for level in found["levels"].values():
        low, high = level["interval_95"]
        assert 0.0 <= low <= level["area_p95"] <= high <= 1.0
        assert level["area_p95"] <= level["area_p50"] <= level["area_p05"]
        assert level["area_always"] <= level["area_p95"]
        assert level["area_p05"] <= level["area_ever"]
        assert 0.0 <= level["nominal_area"] <= 1.0
    for name in ("mean", "q95"):
        best = found["best"][name]
        assert set(best["at"]) == {"controller.kp", "controller.ki"}
        assert best["interval_95"][0] is None or best["interval_95"][0] <= best["value"]
    assert found["trajectories"] == 12 * 6 + 6
    assert found["seconds"] > 0.0
    assert strict(Path("run/summary.json").read_text()) == found


def test_folder_holds_dataset_tables_pictures(call):
    wanted = ["--set", "uncertainty.keep=['stuck_time']", "--set", "uncertainty.contours=true"]
    code, _, _ = call("uncertainty", PAPER, *FEW, *wanted, "--sensitivity", "4", "--full",
                      "--out", "run")  # fmt: skip
    assert code == 0
    assert {
        "regions.png", "probability.png", "sampling-error.png", "convergence.png",
        "distributions.png", "sensitivity.png", "cells.csv", "areas.csv", "convergence.csv",
        "draws.csv", "sensitivity.csv", "contours.csv", "design.toml", "data.zarr", "summary.json",
    } <= {path.name for path in Path("run").iterdir()}  # fmt: skip
    result = drillctl.open("run")
    assert result.j1.shape == (12, 3, 2)
    assert list(result.measures) == ["j1", "stuck_time"]
    cells = rows_of("run/cells.csv")
    assert len(cells) == 6
    assert float(cells[3]["probability_15"]) == result.maps[15.0].probability.ravel()[3]
    assert float(cells[3]["j1_mean (s)"]) == pytest.approx(result.mean().ravel()[3], rel=1e-15)
    draws = rows_of("run/draws.csv")
    assert [float(row["bit_rock.a1_factor"]) for row in draws] == list(
        result.drawn["bit_rock.a1_factor"]
    )
    areas = rows_of("run/areas.csv")
    assert float(areas[1]["area_p50"]) == result.areas[15.0][0.5].value
    assert {row["of"] for row in rows_of("run/sensitivity.csv")} == {
        one.of for one in result.sensitivity.indices
    }
    assert rows_of("run/contours.csv")


def test_what_is_saved_is_what_is_read(call):
    arguments = [*FEW, "--sensitivity", "4", "--set", "uncertainty.until.first_look=4"]
    code, out, _ = call("uncertainty", PAPER, *arguments, "--json", "--out", "run")
    assert code == 0
    result = drillctl.open("run")
    again = result.summary()
    told = strict(out)
    assert told.pop("warnings") == []
    assert strict(json.dumps(again, default=float).replace("NaN", "null")) == told
    assert told["looks"]
    same(drillctl.open(result.save("saved")), result)


def test_a_result_of_python_is_saved_and_shown_by_the_command(call):
    pairs = list(itertools.pairwise(FEW))
    values = dict(parse_setting(value) for flag, value in pairs if flag == "--set")
    axes = [parse_axis(value) for flag, value in pairs if flag == "--axis"]
    design = drillctl.load(PAPER, **values, **{
        "map.axes": axes, "map.audit_cells": 0, "uncertainty.realizations": 12,
    })  # fmt: skip
    drillctl.uncertainty(design).save("run")
    code, _, err = call("uncertainty", PAPER, *FEW, "--out", "run")
    assert (code, err.splitlines()) == (0, ["already done: run"])


def test_tables_for_people(call):
    code, out, err = call("uncertainty", PAPER, *FEW, "--sensitivity", "4")
    assert code == 0
    for text in ("share of the map by probability (95 % interval)", "P ≥ 95 %", "best cells",
                 "Sobol indices from 4 points", "least 95 % quantile of J1",
                 "12 draws (monte-carlo, seed 2012): bit_rock.a1_factor, bit_rock.a2_factor",
                 "results: runs/monteiro-trindade-140kn-uncertainty-1"):  # fmt: skip
        assert text in out
    assert "audit" not in out  # nothing was audited
    assert "nan" not in out.lower().replace("dominant", "")
    assert "Traceback" not in err


def test_an_index_whose_error_is_not_known_says_so(call):
    """Of equal values in a resample there is no error; a figure that does not vary has no index."""
    code, _, _ = call("uncertainty", PAPER, *FEW, "--sensitivity", "4", "--out", "run")
    assert code == 0
    result = drillctl.open("run")
    unknown = np.full(2, np.nan)
    (first, *others) = result.sensitivity.indices
    one = dataclasses.replace(first, first=np.array([0.5, np.nan]), first_error=unknown)
    changed = dataclasses.replace(result.sensitivity, indices=(one, *others))
    shown = indices(dataclasses.replace(result, sensitivity=changed))
    texts = [
        [column.text(cell, "si") for column, cell in zip(shown.columns, row, strict=True)]
        for row in shown.rows
    ]
    assert texts[0][2:4] == ["0.5", "–"]
    assert texts[1][2:4] == ["–", "–"]


def test_maps_over_one_parameter_and_over_three(call):
    one = [*FEW[4:], "--axis", "controller.kp=500:700:3"]
    assert call("uncertainty", PAPER, *one, "--out", "one")[0] == 0
    assert not Path("one/regions.png").exists()
    assert drillctl.open("one").j1.shape == (12, 3)
    three = [*FEW, "--axis", "operating_point.weight_on_bit=120 kN:140 kN:2"]
    code, out, _ = call("uncertainty", PAPER, *three, "--json", "--out", "three")
    assert code == 0
    assert {"regions-1.png", "regions-2.png"} <= {p.name for p in Path("three").iterdir()}
    slices = strict(out)["slices"]["operating_point.weight_on_bit"]
    assert [one["value"] for one in slices] == [120e3, 140e3]


@pytest.mark.parametrize("sampling", ["sobol", "latin-hypercube"])
def test_other_samplings(call, sampling):
    arguments = [*SHORT, "--sampling", sampling, "--realizations", "16", "--json"]
    if sampling == "latin-hypercube":  # both options are put in one after the other
        arguments = [*SHORT, "--set", f"uncertainty.sampling={sampling}", "--realizations", "16",
                     "--json"]  # fmt: skip
    code, out, _ = call("uncertainty", PAPER, *arguments, "--out", "run")
    assert code == 0
    assert (strict(out)["sampling"], strict(out)["replicates"]) == (sampling, 8)
    code, _, err = call("uncertainty", PAPER, *[a.replace("16", "24") for a in arguments],
                        "--out", "run")  # fmt: skip
    assert code == (0 if sampling == "sobol" else 2), err
    if code:
        assert "uncertainty.realizations is 16, here 24" in err


# --- going on ----------------------------------------------------------------------------------


def test_more_realizations_add_the_missing_ones_only(call, monkeypatch):
    whole = drillctl.open(folder_of(call, "whole", 21))
    folder_of(call, "run", 10)
    before = drillctl.open("run")
    ran = []
    from drillctl.ensemble.realizations import Realizations

    run_block = Realizations.run
    monkeypatch.setattr(
        Realizations, "run", lambda self, *piece: ran.append(piece) or run_block(self, *piece)
    )
    folder_of(call, "run", 21)
    assert ran == [(10, 2), (12, 4), (16, 4), (20, 1)]
    after = drillctl.open("run")
    assert after.j1[:10].tobytes() == before.j1.tobytes()
    assert after.j1.tobytes() == whole.j1.tobytes()
    assert after.summary()["levels"] == whole.summary()["levels"]
    code, _, err = call("uncertainty", PAPER, *SHORT, "--realizations", "12", "--out", "run")
    assert code == 2
    assert "holds a run of 21 realizations, 12 are requested" in err
    ran.clear()
    code, _, err = call("uncertainty", PAPER, *SHORT, "--realizations", "21", "--out", "run")
    assert (code, err.splitlines(), ran) == (0, ["already done: run"], [])


def folder_of(call, name, realizations):
    code, _, err = call("uncertainty", PAPER, *SHORT, "--realizations", realizations, "--out", name)
    assert code == 0, err
    return name


@pytest.mark.parametrize("after", [0, 1, 2])
def test_an_interrupted_run_goes_on_to_the_same_bits(call, monkeypatch, after):
    whole = drillctl.open(folder_of(call, "whole", 12))
    from drillctl.ensemble.storing import FileBlocks

    keep, kept = FileBlocks.keep, []

    def interrupted(self, block):
        if len(kept) == after:
            raise KeyboardInterrupt
        kept.append(block)
        keep(self, block)

    monkeypatch.setattr(FileBlocks, "keep", interrupted)
    code, _, err = call("uncertainty", PAPER, *FEW, "--out", "run")
    assert code == 130
    assert "finished blocks are kept; to resume, repeat with --out run" in err
    monkeypatch.setattr(FileBlocks, "keep", keep)
    with pytest.raises(InputError, match="unfinished run"):
        drillctl.open("run")
    code, _, _ = call("uncertainty", PAPER, *FEW, "--resume", "--out", "run")
    assert code == 0
    same(drillctl.open("run"), whole, TIMES)


def test_interim_pictures_show_what_is_finished(call, monkeypatch):
    from drillctl import plots

    draws, picture = [], plots.probability_map

    def noted(result, **options):
        draws.append(result.realizations)
        return picture(result, **options)

    monkeypatch.setattr(plots, "probability_map", noted)
    begun(call, monkeypatch, "--interim", "0")
    assert draws == [4]
    assert Path("run/interim.png").stat().st_size > 3000
    assert call("uncertainty", PAPER, *FEW, "--interim", "0", "--out", "run")[0] == 0
    assert draws == [4, 8, 12, 12]
    assert not Path("run/interim.png").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--resume"], "--resume: requires --out"),
        (["--resume", "--out", "nothing"], "nothing holds no run to resume"),
    ],
)
def test_there_must_be_something_to_go_on_with(call, arguments, message):
    code, out, err = call("uncertainty", PAPER, *FEW, *arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert not Path("nothing").exists()


def begun(call, monkeypatch, *options):
    """A folder with one finished block of three."""
    from drillctl.ensemble.storing import FileBlocks

    keep, kept = FileBlocks.keep, []

    def first_only(self, block):
        if kept:
            raise KeyboardInterrupt
        kept.append(block)
        keep(self, block)

    with monkeypatch.context() as patch:
        patch.setattr(FileBlocks, "keep", first_only)
        assert call("uncertainty", PAPER, *FEW, *options, "--out", "run")[0] == 130


def test_another_design_or_version_is_refused_with_the_difference(call, rewritten, monkeypatch):
    begun(call, monkeypatch)
    for other, told in (
        (["--set", "controller.kp=600"], "controller.kp is '625 N*m*s/rad', here '600 N*m*s/rad'"),
        (["--seed", "3"], "uncertainty.seed is 2012, here 3"),
        (["--full"], "uncertainty.full is false, here true"),
        (["--set", "map.levels=[12, 15]"], "map.levels is [12.0, 15.0, 18.0], here [12.0, 15.0]"),
    ):
        code, out, err = call("uncertainty", PAPER, *FEW, *other, "--out", "run")
        assert (code, out) == (2, "")
        assert told in err
    rewritten("run", drillctl="0.0.9")
    monkeypatch.setattr("drillctl.__version__", "99")
    code, _, err = call("uncertainty", PAPER, *FEW, "--out", "run")
    assert code == 2
    assert "version 0.0.9, this is 99" in err


def test_another_machine_is_refused_unless_allowed(call, rewritten, monkeypatch):
    begun(call, monkeypatch)
    rewritten("run", processor="Abacus", numba="0.1")
    code, _, err = call("uncertainty", PAPER, *FEW, "--out", "run")
    assert code == 2
    assert "--allow-other-machine (" in err
    assert "numba 0.1, here" in err
    assert "processor Abacus, here" in err
    assert call("uncertainty", PAPER, *FEW, "--allow-other-machine", "--out", "run")[0] == 0
    origin = drillctl.open("run").provenance
    assert origin["processor"].startswith("Abacus + ")
    assert origin["numba"].startswith("0.1 + ")
    assert drillctl.open("run").data.attrs == origin
    rewritten("run")  # unfinished again, under the name of the option in 0.1
    assert call("uncertainty", PAPER, *FEW, "--allow-mixed", "--out", "run")[0] == 0


def test_a_full_disk_is_told_and_loses_no_finished_block(call, monkeypatch):
    whole = drillctl.open(folder_of(call, "whole", 12))
    from drillctl.store import journal

    write, written = journal.write_bytes, []

    def full(path, content):
        if "realizations/0" in str(path) and len(written) == 1:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        write(path, content)
        if "realizations/0" in str(path):
            written.append(path)

    with monkeypatch.context() as patch:
        patch.setattr(journal, "write_bytes", full)
        code, out, err = call("uncertainty", PAPER, *FEW, "--out", "run")
    assert (code, out) == (1, "")
    assert "No space left on device; finished blocks are kept" in err
    assert "Traceback" not in err
    assert blocks() == 1
    assert call("uncertainty", PAPER, *FEW, "--out", "run")[0] == 0
    same(drillctl.open("run"), whole, TIMES)


def test_a_read_only_folder_is_told(call, permissions_count):
    Path("run").mkdir(mode=0o555)
    code, out, err = call("uncertainty", PAPER, *FEW, "--out", "run/here")
    assert (code, out) == (2, "")
    assert "cannot be written: Permission denied" in err


# --- killed ------------------------------------------------------------------------------------

SCRIPT = """
import sys
from drillctl.ensemble import realizations
realizations.LANES = 24
from importlib import import_module
import_module("drillctl.cli.verb").draw = lambda figure, path: path.touch()
from drillctl.cli import run
from drillctl.design.reading import parse_axis, parse_setting
sys.exit(run(sys.argv[1:]))
"""


def command(folder, realizations):
    arguments = ["uncertainty", PAPER, *SHORT, "--realizations", realizations, "--out", folder]
    return [sys.executable, "-c", SCRIPT, *map(str, arguments)]


def kill_and_go_on(times, realizations, seed):
    """Kill a run at random moments of its blocks, then let it end; the folder."""
    random = np.random.default_rng(seed)
    for _ in range(times):
        process = subprocess.Popen(
            command("run", realizations), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        before = blocks()
        while process.poll() is None and blocks() == before:
            time.sleep(0.002)
        if process.poll() is None:
            time.sleep(random.uniform(0.0, 0.05))
            process.send_signal(signal.SIGKILL)
        assert process.wait() in (0, -signal.SIGKILL), process.stderr.read()
        process.stderr.close()
        # Nothing that counts as finished goes away again, nor is it half there.
        assert blocks() >= before
    subprocess.run(command("run", realizations), check=True, capture_output=True)
    return drillctl.open("run")


def blocks():
    """Finished blocks of a run."""
    return len([*Path("run/blocks/realizations").glob("[0-9]*.npz")])


def test_a_killed_run_goes_on_to_the_same_bits(call):
    whole = drillctl.open(folder_of(call, "whole", 200))
    same(kill_and_go_on(1, 200, seed=1), whole, TIMES)


@pytest.mark.slow
def test_a_run_killed_thirty_times_goes_on_to_the_same_bits(call):
    whole = drillctl.open(folder_of(call, "whole", 2000))
    same(kill_and_go_on(30, 2000, seed=2), whole, TIMES)


# --- bad input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "messages"),
    [
        (["--realizations", "0"], ["uncertainty.realizations: 0 is not allowed"]),
        (["--set", "uncertain={'bit_rock.a1_fact' = {distribution = 'normal', cov = 0.1}}"],
         ["uncertain.bit_rock.a1_fact", "did you mean 'bit_rock.a1_factor'"]),
        (["--set", "uncertain={'operating_point.weight_on_bit' = {distribution = 'uniform', "
                   "min = '-1 kN', max = '9 kN'}}"],
         ["uncertain.operating_point.weight_on_bit.min: -1 kN reaches impossible values"]),
        (["--set", "uncertainty.correlations=[{between = ['bit_rock.a1_factor', "
                   "'bit_rock.beta_factor'], value = 0.5}]"],
         ["'bit_rock.beta_factor' is not uncertain"]),
        (["--set", "uncertain={'controller.kp' = {distribution = 'normal', cov = 0.1}}"],
         ["uncertain.controller.kp: is an axis of the map"]),
        (["--sampling", "sobol", "--realizations", "12"], ["must be a multiple of the 8"]),
        (["--sampling", "halton"], ["halton"]),
        (["--sensitivity", "100"], ["100 is not a power of two"]),
        (["--scheduler", "tcp://127.0.0.1:1"], ["--scheduler"]),
    ],
)  # fmt: skip
def test_bad_input_is_told_in_one_message(call, arguments, messages, monkeypatch):
    monkeypatch.setattr(cluster_module, "ANSWER", 0.5)
    code, out, err = call("uncertainty", PAPER, *FEW, *arguments, "--out", "run")
    assert (code, out) == (2, "")
    for message in messages:
        assert message in err
    assert "Traceback" not in err
    assert not Path("run/data.zarr").exists()


def test_a_cluster_needs_its_extra(call, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    code, out, err = call("uncertainty", PAPER, *FEW, "--scheduler", "tcp://node1:8786")
    assert (code, out) == (2, "")
    assert '--scheduler: needs dask.distributed: pip install "drillctl[distributed]"' in err


def test_validate_tells_what_uncertainty_would(call):
    correlations = ("uncertainty.correlations=[{between = ['bit_rock.a1_factor', "
                    "'bit_rock.a3_factor'], value = 0.5}]")  # fmt: skip
    code, _, err = call("validate", PAPER, "--set", correlations)
    assert code == 2
    assert "'bit_rock.a3_factor' is not uncertain" in err
