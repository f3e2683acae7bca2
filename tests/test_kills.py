"""Runs that are killed again and again end in the bits of one that was left alone."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import pytest
import xarray

from drillctl.cli import run
from tests.test_damage import KINDS, SLOW_KINDS

KILLS = int(os.environ.get("DRILLCTL_KILLS", "100"))  # of each command
TICKS = os.sysconf("SC_CLK_TCK")
VERBS = ("map", "uncertainty", "tune", "advantage")


def processor_time(pid):
    """What a process has taken so far (s); None if it has ended."""
    text = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return None if text[0] == "Z" else (int(text[11]) + int(text[12])) / TICKS


def begun(arguments):
    """The command in a process of its own, with all that is imported here."""
    pid = os.fork()
    if pid == 0:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        os._exit(run(arguments))
    return pid


def killed_after(pid, moment):
    """Whether a process was killed after so much of its own time, or had ended before."""
    while (taken := processor_time(pid)) is not None and taken < moment:
        time.sleep(0.01)
    os.kill(pid, signal.SIGKILL)
    _, status = os.waitpid(pid, 0)
    assert os.WIFSIGNALED(status) or os.waitstatus_to_exitcode(status) in (0, 1)
    return os.WIFSIGNALED(status)


def content(folder):
    """Bits of a result, and its summary without times."""
    with xarray.open_zarr(folder / "data.zarr") as data:
        arrays = {
            name: (one.dtype, one.shape, one.values.tobytes())
            for name, one in data.variables.items() if "seconds" not in str(name)
        }  # fmt: skip
    summary = json.loads((folder / "summary.json").read_text())
    return arrays, without_times(summary)


def digest(folder):
    """The hash of that, from a process of its own: readers start threads, which no fork takes."""
    end, begin = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.write(begin, hashlib.sha256(repr(content(folder)).encode()).digest())
        os._exit(0)
    assert os.waitpid(pid, 0)[1] == 0
    return os.read(end, 32)


def finished(arguments):
    """Processor time (s) of a command that is left alone."""
    _, status, used = os.wait4(begun(arguments), 0)
    assert os.waitstatus_to_exitcode(status) in (0, 1)
    return used.ru_utime + used.ru_stime


def without_times(tree):
    if isinstance(tree, dict):
        return {k: without_times(v) for k, v in tree.items() if "seconds" not in k}
    return [without_times(one) for one in tree] if isinstance(tree, list) else tree


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
def test_kills_cost_no_bits(verb, tmp_path, monkeypatch, figure):
    monkeypatch.setattr("drillctl.cli.verb.draw", lambda figure, path: path.touch())
    monkeypatch.setattr("drillctl.ensemble.sweeps.CHUNK", 1)
    arguments = [verb, *(KINDS | SLOW_KINDS)[verb], "--json", "--threads", "1", "--out"]
    finished([*arguments, str(tmp_path / "compiled")])
    whole = finished([*arguments, str(tmp_path / "whole")])
    due = digest(tmp_path / "whole")
    random, kills, runs = np.random.default_rng(17), 0, 0
    while kills < KILLS or not runs:
        while killed_after(begun([*arguments, str(tmp_path / "run")]), random.uniform(0, whole)):
            kills += 1
        assert digest(tmp_path / "run") == due, (kills, runs)
        shutil.rmtree(tmp_path / "run")
        runs += 1
    figure(f"kills of {verb}", kills)
