"""Results on disk: what is saved is what is read, and what is read runs again."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
import xarray

import drillctl
from drillctl.ensemble.audit import Audit
from drillctl.ensemble.storing import Folder
from drillctl.errors import InputError, StoreError
from drillctl.store import claim, identity
from drillctl.studies import Axis, sweep
from tests.alike import TIMES, same

GAINS = [
    {"path": "controller.kp", "min": 0.0, "max": 900.0, "points": 4},
    {"path": "controller.ki", "min": 0.0, "max": 500.0, "points": 3},
]


@pytest.fixture(scope="module")
def design():
    return drillctl.load(
        "monteiro-trindade-140kn",
        **{"simulation.duration": "10 s", "map.axes": GAINS, "map.audit_cells": 0},
    )


@pytest.fixture(scope="module")
def result(design):
    return sweep(design)


@pytest.fixture(scope="module")
def bistable():
    return drillctl.load("navarro-lopez-2dof-bistable", **{"simulation.duration": "10 s"})


# --- there and back --------------------------------------------------------------------------


def test_sweep_there_and_back_and_run_again(result, tmp_path):
    assert result.save(tmp_path / "run") == tmp_path / "run"
    back = drillctl.open(tmp_path / "run")
    same(result, back)
    assert back.design.name == result.design.name
    assert back.summary() == result.summary()
    same(result, sweep(back.design), TIMES)


def test_audited_sweep_there_and_back(bistable, tmp_path):
    axis = {"path": "start.speed", "min": "9 rad/s", "max": "14 rad/s", "points": 3}
    one = sweep(bistable.replace({"map.axes": [axis], "map.audit_cells": 1}))
    back = drillctl.open(one.save(tmp_path / "run"))
    assert len(one.audit.cells) == 1
    same(one, back)
    assert back.audit.summary() == one.audit.summary()


def test_failed_cells_there_and_back(result, tmp_path):
    measures = {name: values.copy() for name, values in result.measures.items()}
    for values in measures.values():
        values[1, 2] = np.nan
    status = result.status.copy()
    status[1, 2] = 5
    holed = dataclasses.replace(result, measures=measures, status=status)
    same(holed, drillctl.open(holed.save(tmp_path / "run")))


@pytest.mark.parametrize("engine", ["reference", "batch"])
def test_simulation_there_and_back_and_run_again(bistable, tmp_path, engine):
    """Also when the engine was chosen in Python and is not in the design."""
    run = drillctl.simulate(bistable, engine=engine)
    back = drillctl.open(run.save(tmp_path / "run"))
    same(run, back, ("design",))
    same(back, drillctl.simulate(back.design), TIMES)


def test_undefined_measures_there_and_back(tmp_path):
    stuck = drillctl.load(
        "navarro-lopez-2dof-bistable",
        **{"start.kind": "rest", "controller.torque": "1 kN*m", "simulation.duration": "5 s"},
    )
    run = drillctl.simulate(stuck)
    assert run.measures.stick_slip_index is None
    back = drillctl.open(run.save(tmp_path / "run"))
    same(run, back)
    assert back.measures.settling_time is None


def test_modes_back(bistable, tmp_path, monkeypatch):
    from drillctl.cli import run

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("drillctl.cli.verb.draw", lambda figure, path: None)
    assert run(["modes", "navarro-lopez-4dof", "--out", "m"]) == 0
    back = drillctl.open("m")
    fresh = drillctl.modes(drillctl.load("navarro-lopez-4dof"))
    assert back.summary() == fresh.summary()
    for support in ("free_free", "fixed_top"):
        for one, other in zip(getattr(back, support), getattr(fresh, support), strict=True):
            assert one.shape.tobytes() == other.shape.tobytes()
            assert one.torque_shape.tobytes() == other.torque_shape.tobytes()


# --- what lies there -------------------------------------------------------------------------


def test_zarr_holds_units_and_provenance(result, bistable, tmp_path):
    result.save(tmp_path / "map")
    with xarray.open_zarr(tmp_path / "map/data.zarr") as data:
        assert set(data["j1"].dims) == {"controller.kp", "controller.ki"}
        assert data["controller.kp"].attrs["units"] == "N*m*s/rad"
        assert data["j1"].attrs["units"] == "s"
        assert data["peak_pipe_torque"].attrs["units"] == "N*m"
        assert data["status"].attrs["flag_meanings"].split()[-1] == "failed"
        about_map = dict(data.attrs)
    drillctl.simulate(bistable, engine="batch").save(tmp_path / "run")
    with xarray.open_zarr(tmp_path / "run/data.zarr") as data:
        assert data["bit_speed"].attrs["units"] == "rad/s"
        assert data["time"].attrs["units"] == "s"
        about_run = dict(data.attrs)
    for about in (
        about_map,
        about_run,
        json.loads((tmp_path / "run/run.json").read_text())["provenance"],
    ):
        assert about["drillctl"] == drillctl.__version__
        assert set(about) == {
            "drillctl",
            "python",
            "numpy",
            "scipy",
            "numba",
            "llvmlite",
            "processor",
        }
        assert all(isinstance(value, str) and value for value in about.values())


def test_nothing_is_pickled_and_nothing_is_left_half_written(result, tmp_path):
    folder = result.save(tmp_path / "run")
    paths = [path for path in folder.rglob("*") if path.is_file()]
    assert paths
    for path in paths:
        assert path.suffix not in (".part", ".lock")
        # An opcode of a pickle's beginning (protocols 2 to 5), and of an object array's header.
        content = path.read_bytes()
        assert not content.startswith((b"\x80\x02", b"\x80\x03", b"\x80\x04", b"\x80\x05"))
        assert b"pickle" not in content
    assert {path.name for path in folder.iterdir()} == {
        "run.json", "design.toml", "summary.json", "data.zarr", "result.json", "journal.jsonl",
    }  # fmt: skip
    for name in ("run.json", "summary.json"):
        json.loads((folder / name).read_text(), parse_constant=pytest.fail)


def test_blocks_hold_no_pickle(design, tmp_path):
    folder = claim("map", design, tmp_path / "run")
    sweep(design, store=Folder(folder.path))
    held = sorted(path.name for path in (tmp_path / "run/blocks/map").iterdir())
    assert held == ["000000.npz", "string-000000.npz"]
    for name in held:
        with np.load(tmp_path / "run/blocks/map" / name, allow_pickle=False) as arrays:
            assert all(arrays[key].dtype != object for key in arrays)


def test_kept_strings_and_blocks_give_the_same_bits(design, result, tmp_path, monkeypatch):
    folder = claim("map", design, tmp_path / "run")
    same(sweep(design, store=Folder(folder.path)), result, TIMES)
    (tmp_path / "run/blocks/map/000000.npz").unlink()
    monkeypatch.setattr("drillctl.ensemble.sweeps.prepare", pytest.fail)  # the string is kept
    same(sweep(design, store=Folder(folder.path)), result, TIMES)
    monkeypatch.setattr("drillctl.ensemble.running.run_batch", pytest.fail)  # and so is the block
    same(sweep(design, store=Folder(folder.path)), result, TIMES)


def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    from drillctl.store.json_files import write_json

    target = tmp_path / "summary.json"
    write_json(target, {"a": 1})

    def fail(*arguments):
        raise OSError("disk full")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        write_json(target, {"a": 2})
    assert json.loads(target.read_text()) == {"a": 1}


def test_strict_json():
    from drillctl.store.json_files import strict

    messy = {"a": np.float64("nan"), 2: (np.int64(3), [float("inf")]), "c": np.array([1.0, np.nan])}
    assert strict(messy) == {"a": None, "2": [3, [None]], "c": [1.0, None]}
    assert strict({"t": True, "n": None, "s": "x"}) == {"t": True, "n": None, "s": "x"}


# --- whose folder it is ----------------------------------------------------------------------


def test_identity(design):
    same = identity("map", design)
    assert same == identity("map", design.replace({}))
    others = [
        identity("simulate", design),
        identity("map", design.replace({"controller.kp": 1.0})),
        identity("map", design.replace({"map.audit_cells": 1})),
        identity("map", design, count=3),
    ]
    assert len({same, *others}) == 5


def test_identity_changes_with_the_version(design, monkeypatch):
    before = identity("map", design)
    monkeypatch.setattr(drillctl, "__version__", "99")
    assert identity("map", design) != before


def test_saving_twice_is_the_same(result, tmp_path):
    result.save(tmp_path / "run")
    result.save(tmp_path / "run")
    same(result, drillctl.open(tmp_path / "run"))


def test_another_version_is_refused(result, design, tmp_path, monkeypatch):
    result.save(tmp_path / "run")
    monkeypatch.setattr(drillctl, "__version__", "99")
    with pytest.raises(InputError, match=r"version 0\..*, this is 99"):
        claim("map", design, tmp_path / "run")


def test_results_of_python_are_not_taken_for_the_designs_own(design, result, bistable, tmp_path):
    """Axes, audit and engine given in Python: the command with that design computes afresh."""
    uneven = (Axis("controller.kp", "N*m*s/rad", np.array([1.0, 10.0, 100.0])),)
    other = sweep(design, axes=uneven)
    other.save(tmp_path / "axes")
    same(other, drillctl.open(tmp_path / "axes"))
    audited = dataclasses.replace(
        result, audit=Audit(np.array([1]), {"j1": np.array([2.0])}, {"j1": np.array([2.0])})
    )
    audited.save(tmp_path / "audit")
    for name in ("axes", "audit"):
        with pytest.raises(InputError, match="other settings"):
            claim("map", design, tmp_path / name)
    drillctl.simulate(bistable, engine="batch").save(tmp_path / "engine")
    with pytest.raises(InputError, match="another design"):
        claim("simulate", bistable, tmp_path / "engine")
    drillctl.simulate(bistable).save(tmp_path / "default")
    assert claim("simulate", bistable, tmp_path / "default").finished


def test_axes_that_do_not_fit_the_law_do_not_stop_saving(tmp_path):
    rig = drillctl.load("navarro-lopez-2dof", **{"simulation.duration": "5 s"})
    axes = (Axis("operating_point.speed", "rad/s", np.array([1.0, 2.0])),)
    one = sweep(rig, axes=axes, audit_cells=0)  # its default axes are the gains of a PI law
    same(one, drillctl.open(one.save(tmp_path / "run")))


def test_default_folders_are_never_shared(design, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    paths = [claim("map", design, None).path for _ in range(3)]
    assert not list(tmp_path.glob("runs/*.part"))
    assert [path.name[-5:] for path in paths] == ["map-1", "map-2", "map-3"]


def test_discard_takes_back_only_its_own(design, tmp_path, monkeypatch):
    folder = claim("map", design, tmp_path / "new")
    folder.discard()
    assert not (tmp_path / "new").exists()
    (tmp_path / "old").mkdir()
    monkeypatch.chdir(tmp_path / "old")
    claim("map", design, None).discard()
    for place in ("old/a/b/c", "old/a"):
        claim("map", design, tmp_path / place).discard()
    with pytest.raises(InputError, match="too long"):
        claim("map", dataclasses.replace(design, name="x" * 300), None)
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert not list((tmp_path / "old").iterdir())
    folder = claim("map", design, tmp_path / "old")
    (tmp_path / "old/notes.txt").write_text("")
    folder.discard()
    assert [path.name for path in (tmp_path / "old").iterdir()] == ["notes.txt"]
    folder = claim("map", design, tmp_path / "worked")
    sweep(design, store=Folder(folder.path))
    folder.discard()
    assert (tmp_path / "worked/blocks/map/000000.npz").is_file()


# --- what is not a run -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "content", [None, "", "[]", "{}", '{"finished": true}', '{"provenance": {}, "finished": true}']
)
def test_open_refuses_junk(tmp_path, content):
    if content is not None:
        (tmp_path / "run.json").write_text(content)
    with pytest.raises(InputError, match=str(tmp_path)):
        drillctl.open(tmp_path)


def test_open_refuses_what_is_not_there(tmp_path):
    with pytest.raises(InputError, match=r"run\.json is missing"):
        drillctl.open(tmp_path / "nothing")


@pytest.mark.parametrize("gone", ["data.zarr/j1", "data.zarr", "summary.json", "design.toml"])
def test_open_refuses_a_run_with_parts_missing(result, tmp_path, gone):
    import shutil

    folder = result.save(tmp_path / "run")
    victim = folder / gone
    shutil.rmtree(victim) if victim.is_dir() else victim.unlink()
    with pytest.raises(StoreError, match=Path(gone).name):
        drillctl.open(folder)


@pytest.mark.parametrize("content", ["{", "[]", '{"$": "object"}'])
def test_open_refuses_a_damaged_result(result, tmp_path, content):
    folder = result.save(tmp_path / "run")
    (folder / "result.json").write_text(content)
    with pytest.raises(StoreError, match=r"result\.json"):
        drillctl.open(folder)


def test_folders_of_an_earlier_version_are_refused_by_name(result, design, tmp_path):
    folder = result.save(tmp_path / "run")
    (folder / "journal.jsonl").unlink()  # 0.1 had none
    about = json.loads((folder / "run.json").read_text())
    about["provenance"]["drillctl"] = "0.1.0"
    (folder / "run.json").write_text(json.dumps(about))
    told = "a run of 'map' by version 0.1.0, .* run the command again in a new folder"
    with pytest.raises(InputError, match=told):
        drillctl.open(folder)
    with pytest.raises(InputError, match=told):
        claim("map", design, folder)


def test_open_refuses_an_unfinished_run(design, tmp_path):
    claim("map", design, tmp_path / "run")
    with pytest.raises(InputError, match="unfinished"):
        drillctl.open(tmp_path / "run")


def test_results_save_themselves(bistable, tmp_path):
    modes = drillctl.modes(bistable, count=2)
    back = drillctl.open(modes.save(tmp_path / "modes"))
    assert back.summary() == modes.summary()
    assert back.design == bistable
    run = drillctl.simulate(bistable, engine="batch")
    assert drillctl.open(run.save(tmp_path / "run")).measures == run.measures


def test_modes_of_a_bare_string_have_no_design_to_be_saved_with(bistable, tmp_path):
    with pytest.raises(InputError, match="bare string"):
        drillctl.modes(bistable.string).save(tmp_path / "modes")


def test_every_name_has_a_file_of_its_own(tmp_path):
    from drillctl.store.codec import stored_name

    long = ["x" * 300, "x" * 299 + "y", "ü" * 200]
    names = ["", ".", "..", "a/b", "a%2Fb", "a\\b", "__a", "%", "a\nb", "a", *long]
    stored = [stored_name(name) for name in names]
    assert len(set(stored)) == len(names)
    for one in stored:
        (tmp_path / one).write_text("")
        assert (tmp_path / one).parent == tmp_path
    assert stored_name("controller.kp") == "controller.kp"
