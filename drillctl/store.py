"""Results on disk: one folder a run.

    run.json       verb, version, identity, provenance; whether the run is finished
    design.toml    the resolved design
    blocks/        finished blocks of a run that is not, written atomically
    data.zarr      the dataset, labelled by parameter path
    summary.json   what the command printed
    *.png, *.csv   figures and tables

No pickle anywhere; a folder that holds anything else is never written to.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import drillctl
from drillctl.design import Design, load, to_toml
from drillctl.errors import InputError
from drillctl.provenance import provenance
from drillctl.simulation.batch import FLOATS, Batch, Prepared
from drillctl.simulation.kernels.string_step import BlockString, DenseString
from drillctl.simulation.propagator import StringStep
from drillctl.simulation.scheme import Scheme

RUNS = Path("runs")
"""Where runs go that were given no folder."""


def identity(verb: str, design: Design, **settings: Any) -> str:
    """What makes two runs the same run: verb, resolved design, version, other settings."""
    text = "\n".join([verb, drillctl.__version__, repr(settings), to_toml(design)])
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class RunFolder:
    """A folder that belongs to one run.

    Attributes
    ----------
    path : Path
        Where it is.
    verb : str
        Command that made it.
    finished : bool
        Whether it held the finished run when it was opened.
    """

    path: Path
    verb: str
    finished: bool

    def summary(self) -> dict[str, Any]:
        """The summary of a finished run."""
        found: dict[str, Any] = _read_json(self.path / "summary.json")
        return found

    def finish(self, summary: dict[str, Any]) -> None:
        """Write the summary, mark the run finished and drop its blocks."""
        write_json(self.path / "summary.json", summary)
        about = _read_json(self.path / "run.json")
        write_json(self.path / "run.json", about | {"finished": True})
        shutil.rmtree(self.path / "blocks", ignore_errors=True)

    def blocks(self) -> FolderBlocks:
        """Blocks kept in this folder."""
        folder = self.path / "blocks"
        folder.mkdir(exist_ok=True)
        return FolderBlocks(folder)


def claim(verb: str, design: Design, folder: str | Path | None, **settings: Any) -> RunFolder:
    """Make the folder of a run, or take up one that holds the very same run.

    Parameters
    ----------
    verb : str
        Command.
    design : Design
        Resolved design; with verb and version it identifies the run.
    folder : str or Path, optional
        Where to; by default a new folder under `runs`.
    **settings
        Whatever else the result depends on.

    Returns
    -------
    RunFolder
        Unfinished, it is to be run or resumed; finished, its summary can be shown again.

    Raises
    ------
    InputError
        The folder holds something else, or cannot be written.
    """
    path = _fresh(verb, design) if folder is None else Path(folder)
    about = {"verb": verb, "identity": identity(verb, design, **settings), "design": design.name}
    if path.exists() and not path.is_dir():
        raise InputError("is a file, not a folder", f"--out {path}")
    if path.is_dir() and any(path.iterdir()):
        return _same_run(path, about)
    try:
        path.mkdir(parents=True, exist_ok=True)
        (path / "design.toml").write_text(to_toml(design), encoding="utf-8")
        write_json(path / "run.json", about | {"finished": False, "provenance": provenance()})
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", f"--out {path}") from None
    return RunFolder(path, verb, finished=False)


def _fresh(verb: str, design: Design) -> Path:
    number = 1
    while (path := RUNS / f"{design.name}-{verb}-{number}").exists():
        number += 1
    return path


def _same_run(path: Path, about: dict[str, str]) -> RunFolder:
    where = f"--out {path}"
    if not (path / "run.json").is_file():
        raise InputError("holds something that is not a run; give an empty or new folder", where)
    held = _read_json(path / "run.json")
    if held.get("verb") != about["verb"]:
        raise InputError(f"holds a run of {held.get('verb')!r}, not {about['verb']!r}", where)
    if held.get("identity") != about["identity"]:
        came_from = held.get("provenance", {}).get("drillctl")
        reason = "another design or other settings"
        if came_from != drillctl.__version__:
            reason = f"version {came_from}, this is {drillctl.__version__}"
        raise InputError(f"holds a run of {reason}; give another folder", where)
    if not os.access(path, os.W_OK):
        raise InputError("cannot be written: permission denied", where)
    if held["provenance"] != provenance() and not held["finished"]:
        raise InputError(
            "holds an unfinished run begun with other packages or on another processor; the "
            "rest would differ in the last bits: give another folder",
            where,
        )
    return RunFolder(path, about["verb"], held["finished"])


@dataclass(frozen=True)
class FolderBlocks:
    """Finished blocks as files; see `studies.blocks.Blocks`.

    Attributes
    ----------
    folder : Path
        Where they lie.
    """

    folder: Path

    def prepared(self, number: int, prepare: Callable[[], Prepared]) -> Prepared:
        """The string of a group, read back if it was prepared before."""
        path = self.folder / f"string-{number:06d}.npz"
        if not path.is_file():
            made = prepare()
            _write_npz(path, _string_arrays(made))
            return made
        with np.load(path, allow_pickle=False) as held:
            return _string_from(dict(held))

    def find(self, number: int) -> Batch | None:
        """The block if it was finished before."""
        path = self.folder / f"{number:06d}.npz"
        if not path.is_file():
            return None
        with np.load(path, allow_pickle=False) as held:
            values = held["measures"]
            measures = {name: values[i] for i, name in enumerate(FLOATS)}
            return Batch(measures, held["status"])

    def keep(self, number: int, batch: Batch) -> None:
        """Keep a finished block."""
        values = np.stack([batch.measures[name] for name in FLOATS])
        path = self.folder / f"{number:06d}.npz"
        _write_npz(path, {"measures": values, "status": batch.status})


def _string_arrays(prepared: Prepared) -> dict[str, Any]:
    stepper = prepared.stepper
    fields = {f"kernel.{k}": v for k, v in stepper.string._asdict().items()}
    return fields | {
        "blocks": isinstance(stepper.string, BlockString),
        "angle_to_state": stepper.angle_to_state,
        "speed_to_state": stepper.speed_to_state,
        "rest": stepper.rest,
        "step": prepared.scheme.step,
        "steps": prepared.scheme.steps,
        "modes": prepared.scheme.modes,
        "duration": prepared.duration,
        "j1_from": prepared.j1_from,
    }


def _string_from(held: dict[str, Any]) -> Prepared:
    kind = BlockString if held["blocks"] else DenseString
    string = kind(**{name: _number(held[f"kernel.{name}"]) for name in kind._fields})
    scheme = Scheme(float(held["step"]), int(held["steps"]), int(held["modes"]))
    stepper = StringStep(
        string,
        held["angle_to_state"],
        held["speed_to_state"],
        held["rest"],
        scheme.modes,
        scheme.step,
    )
    return Prepared(stepper, scheme, float(held["duration"]), float(held["j1_from"]))


def _number(array: Any) -> Any:
    return float(array) if array.ndim == 0 else array


def _write_npz(path: Path, arrays: dict[str, Any]) -> None:
    """Write beside the target and move: a reader sees a whole file or none."""
    part = path.with_suffix(".part")
    with part.open("wb") as stream:
        np.savez(stream, **arrays)
        stream.flush()
        os.fsync(stream.fileno())
    part.replace(path)


def write_json(path: Path, content: Any) -> None:
    """Write strict JSON (null, never NaN), atomically."""
    part = path.with_suffix(".part")
    part.write_text(json.dumps(strict(content), indent=2, allow_nan=False) + "\n", "utf-8")
    part.replace(path)


def strict(content: Any) -> Any:
    """The same with None for every number that is not finite, and plain Python types."""
    if isinstance(content, dict):
        return {str(key): strict(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [strict(value) for value in content]
    if isinstance(content, (np.generic, np.ndarray)):
        return strict(content.tolist())
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", str(path)) from None


def write_data(result: Any, folder: Path) -> None:
    """Write a result's dataset as `data.zarr`, whole or not at all."""
    part, target = folder / "data.part", folder / "data.zarr"
    shutil.rmtree(part, ignore_errors=True)
    result.data.to_zarr(part, mode="w", consolidated=False)
    shutil.rmtree(target, ignore_errors=True)
    part.rename(target)


VERBS = {"Sweep": "map", "Simulation": "simulate", "Modes": "modes"}


def save(result: Any, folder: str | Path) -> Path:
    """Write a result into a folder of its own.

    Parameters
    ----------
    result : Sweep or Simulation
        Anything with `.design`, `.data` and `.summary()`.
    folder : str or Path
        New, empty, or holding the very same run.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        The folder holds something else, or cannot be written.
    """
    run = claim(VERBS[type(result).__name__], result.design, folder)
    write_data(result, run.path)
    run.finish(result.summary())
    return run.path


def open(folder: str | Path) -> Any:
    """Read a saved result back.

    Parameters
    ----------
    folder : str or Path
        As written by `save` or by a command.

    Returns
    -------
    Sweep or Simulation
        Equal to what was saved, to the bit.

    Raises
    ------
    InputError
        Not a run, an unfinished one, or one that cannot be read back.
    """
    import xarray

    from drillctl.store_reading import READERS

    path = Path(folder)
    if not (path / "run.json").is_file():
        raise InputError("is not a saved run: there is no run.json", str(path))
    about = _read_json(path / "run.json")
    if not about.get("finished"):
        raise InputError("holds a run that is not finished; run the command again", str(path))
    if about["verb"] not in READERS:
        raise InputError(f"results of {about['verb']!r} are not read back", str(path))
    design = load(path / "design.toml")
    with xarray.open_zarr(path / "data.zarr", consolidated=False) as data:
        return READERS[about["verb"]](design, data.load(), _read_json(path / "summary.json"))
