"""Save a result to a folder, and read it back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drillctl.errors import InputError, StoreError
from drillctl.store.codec import TREE, read
from drillctl.store.folder import about_run, claim
from drillctl.store.result import Result


def save(result: Result, folder: str | Path) -> Path:
    """Write a result into a folder of its own.

    Parameters
    ----------
    result : Sweep, Simulation, Modes, LoopAnalysis, LoopMap, ...
        Anything with `.design`, `.data` and `.summary()`.
    folder : str or Path
        New, empty, or holding the same run.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        The folder holds other files, or cannot be written; or the result was computed from a
        string without a design.
    """
    design, settings = result.requested()
    run = claim(result.kind, design, folder, result.growing(), **settings)
    result.write(run.path)
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
    Sweep, Simulation, Modes, LoopAnalysis, LoopMap, Comparison, LimitCycle, ...
        Equal to the saved result, to the bit.

    Raises
    ------
    InputError
        Not a run, an unfinished one, or one in the format of another version.
    StoreError
        A file is missing or damaged.
    """
    path = Path(folder)
    if not (path / "run.json").is_file():
        raise InputError("is not a saved run: run.json is missing", str(path))
    about = about_run(path)
    if not about.get("finished"):
        raise InputError("holds an unfinished run; run the command again", str(path))
    if (path / TREE).is_file():
        for name in ("design.toml", "summary.json"):  # not needed here, but the folder is damaged
            if not (path / name).is_file():
                raise StoreError(f"{path}: {name} is missing")
        return read(path)
    raise InputError(
        f"holds results of {about.get('verb')!r} in a format that this version does not read; run "
        "the command again in a new folder",
        str(path),
    )
