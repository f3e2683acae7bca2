"""Damage to result folders: the undamaged result, or an error that names the file; no number else.

Each file of a small folder meets each damage. A finished folder refuses; an unfinished one
computes a damaged block again.
"""

from __future__ import annotations

import contextlib
import errno
import itertools
import os
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import drillctl
from drillctl.cli import run
from drillctl.ensemble.running import kept
from drillctl.ensemble.storing import Folder
from drillctl.errors import InputError, StoreError
from drillctl.store import claim, growing_realizations
from drillctl.store.journal import Journal
from drillctl.studies import sweep
from drillctl.studies.base import studies
from tests.logs.synthetic import Rig, sampled, write

GAINS = [
    {"path": "controller.kp", "min": 0.0, "max": 900.0, "points": 3},
    {"path": "controller.ki", "min": 0.0, "max": 500.0, "points": 2},
]
SHORT = {"simulation.duration": "10 s", "map.axes": GAINS, "map.audit_cells": 0}


@pytest.fixture(scope="module")
def design():
    return drillctl.load("monteiro-trindade-140kn", **SHORT)


# --- each damage -----------------------------------------------------------------------------


def delete(path, other, older):
    path.unlink()


def truncate(path, other, older):
    os.truncate(path, path.stat().st_size // 2)


def empty(path, other, older):
    path.write_bytes(b"")


def flip(path, other, older):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def zero(path, other, older):
    path.write_bytes(bytes(path.stat().st_size))


def swap(path, other, older):
    own = path.read_bytes()
    path.write_bytes(other.read_bytes())
    other.write_bytes(own)


def older_version(path, other, older):
    path.write_bytes(older.read_bytes() if older.exists() else b"{}")


def forbid(path, other, older):
    path.chmod(0)


DAMAGES = (delete, truncate, empty, flip, zero, swap, older_version, forbid)


def files(folder):
    """Files of a run: all but those that are of a block."""
    return sorted(p.relative_to(folder) for p in folder.rglob("*") if p.is_file())


def survives(folder, older):
    """Try each damage to each file: what is read is the same, or the error names the file."""
    same, names, silent = drillctl.open(folder).summary(), files(folder), []
    for (name, following), damage in itertools.product(
        zip(names, [*names[1:], names[0]], strict=True), DAMAGES
    ):
        path, other = folder / name, folder / following
        before = path.read_bytes(), other.read_bytes()
        damage(path, other, older / name)
        try:
            if drillctl.open(folder).summary() != same:
                silent.append((damage.__name__, str(name)))
        except StoreError as error:
            if name.name not in str(error) and following.name not in str(error):
                silent.append((damage.__name__, str(name), str(error)))
        if damage is forbid:
            path.chmod(0o600)
        for one, content in zip((path, other), before, strict=True):
            one.write_bytes(content)
    assert not silent
    assert drillctl.open(folder).summary() == same
    return len(names)


def run_twice(verb, options, tmp_path):
    """A finished folder, and one of the same command that was asked for something else."""
    folders = []
    more_given = {}
    if verb in ("log", "identify"):
        path = write(tmp_path / "log.csv", sampled(Rig(parts=200).run(130.0), 10.0, 15.0, 130.0))
        options = [str(path) if one == "log.csv" else one for one in options]
        more_given = {"files": [str(path)]} if verb == "log" else {}
    for place, more in (("run", []), ("older", ["--set", "bha.inertia=400 kg*m^2"])):
        if studies()[verb].command:
            arguments = [*options, *more, "--out", str(tmp_path / place)]
            assert run([verb, *arguments, "--json"]) in (0, 1)
        else:
            given = {"bha.inertia": "400 kg*m^2"} if more else {}
            design = drillctl.load(options[0], **(SHORT | given))
            studies()[verb].run(design, **more_given).save(tmp_path / place)
        folders.append(tmp_path / place)
    return folders


def settings(*texts):
    return [word for text in texts for word in ("--set", text)]


SMALL = ["--set", "simulation.duration=10 s"]
MAP = [*SMALL, "--axis", "controller.kp=0:900:3", "--axis", "controller.ki=0:500:2"]
KINDS = {
    "log": ["monteiro-trindade-140kn"],  # its command takes files
    "simulate": ["monteiro-trindade-140kn", *SMALL],
    "map": ["monteiro-trindade-140kn", *MAP, "--audit", "0", "--measure", "sticks"],
}
SLOW_KINDS = {
    "identify": ["monteiro-trindade-140kn", "--log", "log.csv"],
    "modes": ["monteiro-trindade-140kn"],
    "torque-drag": ["well-a-off-bottom"],
    "export": ["monteiro-trindade-140kn"],
    "loop": ["monteiro-trindade-140kn"],
    "loop-map": ["monteiro-trindade-140kn"],  # no command of its own
    "cycle": ["navarro-lopez-2dof-bistable"],
    "uncertainty": ["monteiro-trindade-140kn", *MAP, "--realizations", "8"],
    "regions": ["monteiro-trindade-140kn", *MAP],
    "regularisation": ["monteiro-trindade-140kn", *MAP],
    "doctor": ["monteiro-trindade-140kn", *MAP],
    "compare": ["pi-vs-dynamic-wob-140kn", *SMALL, "--realizations", "3"],
    "delay": ["pi-vs-delayed-wob-140kn", *SMALL, "--realizations", "3"],
    "tune": ["robust-gains-140kn", *SMALL, "--realizations", "8", "--certificate", "20"],
    "recommend": [
        "robust-gains-140kn",
        *SMALL,
        *settings(
            "tune.realizations=8",
            "tune.certificate.realizations=20",
            "recommend.laws=['pi']",
        ),
    ],
    "schedule": [
        "monteiro-trindade-140kn",
        *SMALL,
        "--depth",
        "2000 m:3000 m:2",
        *settings("schedule.realizations=20"),
    ],
    "advantage": [
        "pi-vs-pi-dynamic-wob",
        *SMALL,
        *settings(
            "tune.realizations=8",
            "advantage.realizations=8",
            "advantage.sweep_realizations=8",
            "advantage.region_points=3",
            "advantage.region_realizations=8",
            "advantage.weights=['140 kN']",
            "advantage.speeds=['100 rpm']",
            "advantage.delays=['0 s', '0.5 s']",
        ),
    ],
}


@pytest.fixture
def no_pictures(monkeypatch):
    monkeypatch.setattr("drillctl.cli.verb.draw", lambda figure, path: path.write_text("drawn"))


@pytest.mark.parametrize("verb", [
    *KINDS, *(pytest.param(verb, marks=pytest.mark.slow) for verb in SLOW_KINDS)
])  # fmt: skip
def test_no_damage_is_taken_for_data(verb, tmp_path, no_pictures, permissions_count):
    folder, older = run_twice(verb, (KINDS | SLOW_KINDS)[verb], tmp_path)
    assert survives(folder, older) > 5


def test_the_matrix_has_every_kind_of_result():
    assert studies().keys() == KINDS.keys() | SLOW_KINDS.keys()


@pytest.fixture(scope="module")
def finished(design, tmp_path_factory):
    return sweep(design).save(tmp_path_factory.mktemp("finished") / "run")


@pytest.fixture
def folder(finished, tmp_path):
    return Path(shutil.copytree(finished, tmp_path / "run"))


def test_a_damaged_run_is_not_shown_again(folder, design, capsys):
    for name, code in (("design.toml", 1), ("result.json", 1), ("data.zarr/j1/c/0/0", 1)):
        kept_ = (folder / name).read_bytes()
        (folder / name).write_bytes(kept_.replace(b"1", b"2") + b"#")
        arguments = ["map", "monteiro-trindade-140kn", "--out", str(folder), "--audit", "0"]
        for path, value in (("controller.kp", "0:900:3"), ("controller.ki", "0:500:2")):
            arguments += ["--axis", f"{path}={value}"]
        assert run([*arguments, *SMALL]) == code
        assert f"{name}: is damaged" in capsys.readouterr().err
        (folder / name).write_bytes(kept_)
    assert drillctl.open(folder).j1.shape == (3, 2)


def test_changed_pictures_are_noted_and_foreign_files_left_alone(tmp_path, no_pictures, capsys):
    arguments = ["map", *KINDS["map"], "--out", str(tmp_path / "run")]
    assert run(arguments) == 0
    (tmp_path / "run/notes.txt").write_text("mine")
    (tmp_path / "run/map.png").unlink()
    (tmp_path / "run/regions.csv").write_text("edited")
    capsys.readouterr()
    assert run(arguments) == 0
    told = capsys.readouterr().err
    assert "map.png: is missing" in told
    assert "regions.csv: is damaged" in told
    assert "notes.txt" not in told
    assert (tmp_path / "run/notes.txt").read_text() == "mine"


def test_what_a_kill_left_undrawn_is_drawn(tmp_path, monkeypatch, no_pictures):
    arguments = ["map", *KINDS["map"], "--out", str(tmp_path / "run")]
    with monkeypatch.context() as patch:
        patch.setattr("drillctl.cli.verb._write_beside", lambda *given: None)
        assert run(arguments) == 0
    assert not (tmp_path / "run/map.csv").exists()
    assert run(arguments) == 0
    assert {"map.csv", "map.png"} <= {path.name for path in (tmp_path / "run").iterdir()}


# --- blocks of an unfinished run -------------------------------------------------------------


def damaged_blocks(folder, pattern):
    """Every damage to every file of a kind in turn, the folder as it was in between."""
    whole = {path: path.read_bytes() for path in folder.rglob(pattern)}
    paths = sorted(whole)
    for path, damage in itertools.product(paths, DAMAGES[:-2]):
        damage(path, paths[paths.index(path) - 1], path)
        yield path, damage
        for one, content in whole.items():
            one.write_bytes(content)


def test_damaged_blocks_are_computed_again(design, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("drillctl.ensemble.sweeps.CHUNK", 3)
    whole = sweep(design)
    run_ = claim("map", design, tmp_path / "run")
    sweep(design, store=Folder(run_.path))
    count = 0
    for path, damage in damaged_blocks(tmp_path / "run/blocks", "*.npz"):
        caplog.clear()
        journal = (run_.path / "journal.jsonl").read_bytes()
        again = sweep(design, store=Folder(run_.path))
        assert again.j1.tobytes() == whole.j1.tobytes(), (path, damage)
        assert again.status.tobytes() == whole.status.tobytes()
        assert f"{path}: is " in caplog.text, (path, damage)
        assert "computed again" in caplog.text
        (run_.path / "journal.jsonl").write_bytes(journal)
        count += 1
    assert count == 3 * 6


@pytest.mark.parametrize("damage", DAMAGES[1:5])
def test_a_damaged_journal_of_an_unfinished_run_costs_blocks_alone(
    design, tmp_path, damage, monkeypatch
):
    monkeypatch.setattr("drillctl.ensemble.sweeps.CHUNK", 3)
    run_ = claim("map", design, tmp_path / "run")
    whole = sweep(design, store=Folder(run_.path))
    run_.release()
    damage(tmp_path / "run/journal.jsonl", None, None)
    if damage in (empty, zero):  # nothing says any more that run.json is its own
        with pytest.raises(StoreError, match=r"journal\.jsonl"):
            claim("map", design, tmp_path / "run")
        return
    with claim("map", design, tmp_path / "run") as again:
        assert sweep(design, store=Folder(again.path)).j1.tobytes() == whole.j1.tobytes()
        assert Journal(again.path).intact


def test_steps_of_a_search_are_read_and_damaged_ones_run_again(design, tmp_path, monkeypatch):
    run_ = claim("tune", design, tmp_path / "run")

    def searched():
        with kept(Folder(run_.path).steps):
            return [sweep(design.replace({"bha.inertia": f"{x} kg*m^2"})).j1 for x in (300, 400)]

    first = searched()
    ran = []
    from drillctl.ensemble import running

    real = running.run_batch
    monkeypatch.setattr(running, "run_batch", lambda *given: ran.append(1) or real(*given))
    assert [one.tobytes() for one in searched()] == [one.tobytes() for one in first]
    assert not ran
    flip(tmp_path / "run/blocks/steps/000001.npz", None, None)
    assert [one.tobytes() for one in searched()] == [one.tobytes() for one in first]
    assert len(ran) == 1


def test_more_draws_begin_with_those_of_the_result(tmp_path, monkeypatch):
    uncertain = drillctl.load("monteiro-trindade-140kn", **SHORT)
    few, more = (uncertain.replace({"uncertainty.realizations": n}) for n in (4, 6))
    saved = drillctl.uncertainty(few).save(tmp_path / "run")
    before, growing = drillctl.open(saved), growing_realizations(more)
    with claim("uncertainty", more, saved, growing) as run_:
        again = drillctl.uncertainty(more, store=Folder(run_.path))
        run_.conclude(again, again.summary())
    assert again.j1[:4].tobytes() == before.j1.tobytes()
    assert drillctl.open(saved).j1.tobytes() == again.j1.tobytes()
    growing = growing_realizations(more := more.replace({"uncertainty.realizations": 8}))
    flip(saved / "data.zarr/j1/c/0/0/0", None, None)
    with pytest.raises(StoreError, match="c/0/0/0: is damaged"):
        claim("uncertainty", more, saved, growing)


# --- two processes ---------------------------------------------------------------------------

HOLD = """
import sys
from pathlib import Path
from drillctl.store.lock import FolderLock
lock = FolderLock(Path(sys.argv[1]), "")
print("held", flush=True)
sys.stdin.read()
"""


def test_a_folder_belongs_to_one_process_until_that_is_dead(design, tmp_path):
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLD, tmp_path / "run"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    try:
        assert holder.stdout.readline() == b"held\n"
        told = f"in use by process {holder.pid} on {socket.gethostname()}"
        with pytest.raises(InputError, match=told):
            claim("map", design, tmp_path / "run")
        assert not (tmp_path / "run").exists()
    finally:
        holder.kill()
        holder.communicate()
    with claim("map", design, tmp_path / "run") as run_:
        assert (tmp_path / "run.lock").read_text() == f"process {os.getpid()} on " + (
            f"{socket.gethostname()}\n"
        )
        with pytest.raises(InputError, match="in use by process"):
            claim("map", design, tmp_path / "run")
        run_.discard()
    assert not list(tmp_path.iterdir())


def test_the_lock_lies_in_a_folder_that_nothing_can_lie_beside(design, tmp_path, permissions_count):
    (tmp_path / "above/run").mkdir(parents=True)
    (tmp_path / "above").chmod(0o500)
    with claim("map", design, tmp_path / "above/run"):
        assert (tmp_path / "above/run/.lock").is_file()
        with pytest.raises(InputError, match="in use"):
            claim("map", design, tmp_path / "above/run")
    assert not (tmp_path / "above/run/.lock").exists()
    (tmp_path / "above").chmod(0o700)


def test_a_place_without_files_is_not_called_in_use(design):
    if not Path("/proc/self").is_dir():
        pytest.skip("needs a file system that takes no files")
    with pytest.raises(InputError, match="takes no lock: nothing can be written there"):
        claim("map", design, "/proc/self/run")


def test_a_finished_run_is_shown_where_nothing_can_be_written(
    finished, design, tmp_path, permissions_count
):
    shutil.copytree(finished, tmp_path / "above/run")
    for path in (tmp_path / "above/run", tmp_path / "above"):
        path.chmod(0o500)
    with claim("map", design, tmp_path / "above/run") as run_:
        assert run_.finished
        assert run_.lock is None
    assert drillctl.open(tmp_path / "above/run").j1.shape == (3, 2)
    (tmp_path / "above").chmod(0o700)


def test_a_failure_leaves_no_folder(monkeypatch, tmp_path, capsys):
    def fail(*given):
        raise FloatingPointError("overflow")

    monkeypatch.setattr("drillctl.ensemble.running.run_batch", fail)
    assert run(["map", *KINDS["map"], "--out", str(tmp_path / "new/run")]) == 1
    assert "overflow" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@contextlib.contextmanager
def files_of_at_most(size):
    """What a full disk does, to files alone that grow beyond some bytes."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(("size", "verb", "file"), [
    (100, "map", "journal.jsonl"), (2_000, "map", "design.toml"), (5_000, "map", "blocks"),
    (5_000, "simulate", "data.zarr"),
])  # fmt: skip
def test_a_full_disk_is_named_and_leaves_no_folder(size, verb, file, tmp_path, no_pictures, capsys):
    arguments = [verb, *KINDS[verb], "--out", str(tmp_path / "run")]
    with files_of_at_most(size):
        assert run(arguments) == 1
    output = capsys.readouterr()
    assert f"{tmp_path}/run/{file}" in output.err
    assert "cannot be written: File too large" in output.err
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_full_at_the_end_costs_no_blocks(tmp_path, no_pictures, monkeypatch):
    def full(*given):
        raise OSError(errno.ENOSPC, "No space left on device")

    arguments = ["map", *KINDS["map"], "--out", str(tmp_path / "run")]
    with monkeypatch.context() as patch:
        patch.setattr("drillctl.store.folder.write_json", full)
        assert run(arguments) == 1
    monkeypatch.setattr("drillctl.ensemble.running.run_batch", pytest.fail)
    assert run(arguments) == 0


SLOWLY = """
import sys, time
from drillctl.ensemble import running, sweeps
real, sweeps.CHUNK = running.run_batch, 1
def slowly(lanes, prepared, give_up):
    time.sleep(0.05)
    return real(lanes, prepared, give_up)
running.run_batch = slowly
from importlib import import_module
import_module("drillctl.cli.verb").draw = lambda figure, path: path.touch()
from drillctl.cli import run
sys.exit(run(sys.argv[1:]))
"""


@pytest.mark.slow
def test_two_processes_and_twenty_kills_on_one_folder(tmp_path):
    """Of two that begin together one is refused; killed ones lose a block at most."""
    axes = [*SMALL, "--axis", "controller.kp=0:900:8", "--axis", "controller.ki=0:500:5"]
    arguments = ["map", "monteiro-trindade-140kn", *axes, "--audit", "0", "--out"]
    command = [sys.executable, "-c", SLOWLY, *arguments, tmp_path / "run"]
    random, done = np.random.default_rng(17), 0
    for _ in range(20):
        both = [
            subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
            for _ in range(2)
        ]
        while not (tmp_path / "run.lock").exists() and any(p.poll() is None for p in both):
            time.sleep(0.01)
        time.sleep(random.uniform(0.0, 2.5))
        for process in both:
            process.send_signal(signal.SIGKILL)
        told = [process.communicate()[1] for process in both]
        for process, text in zip(both, told, strict=True):
            assert process.returncode in (0, 2, -signal.SIGKILL), text
            # by process N; by another process as long as that one has not signed yet
            assert process.returncode != 2 or "is in use by" in text
        blocks = len(list((tmp_path / "run/blocks/map").glob("[0-9]*.npz")))
        assert blocks >= done or (tmp_path / "run/summary.json").exists()
        done = blocks
    assert run([*arguments, str(tmp_path / "run")]) == 0
    assert run([*arguments, str(tmp_path / "whole")]) == 0
    one, other = (drillctl.open(tmp_path / name) for name in ("run", "whole"))
    assert one.j1.tobytes() == other.j1.tobytes()
    assert one.status.tobytes() == other.status.tobytes()
