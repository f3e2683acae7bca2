"""Save a result to a folder, and read it back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from drillctl.design import load
from drillctl.errors import InputError
from drillctl.store.codec import TREE, read
from drillctl.store.folder import about_run, claim
from drillctl.store.json_files import read_json
from drillctl.store.kind import Kind
from drillctl.store.result import Result


def _kinds() -> tuple[Kind, ...]:
    from drillctl.store.kinds import KINDS

    return KINDS


def write_data(result: Any, folder: Path) -> None:
    """Write a result's dataset as `data.zarr`."""
    _kind(result).write(result, folder)


def _kind(result: Any) -> Kind:
    return next(kind for kind in _kinds() if kind.of is type(result))


def save(result: Any, folder: str | Path) -> Path:
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
    if isinstance(result, Result):
        design, settings = result.requested()
        run = claim(result.kind, design, folder, result.growing(), **settings)
        result.write(run.path)
        run.finish(result.summary())
        return run.path
    kind = _kind(result)
    design, settings = kind.asked(result)
    run = claim(kind.verb, design, folder, kind.growing(design), **settings)
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
    Sweep, AdaptiveMap, Simulation, Modes, LoopAnalysis, LoopMap, Comparison, LimitCycle, ...
        Equal to what was saved, to the bit; a simulation without its events.

    Raises
    ------
    InputError
        Not a run, an unfinished one, or one that cannot be read back.
    """
    import xarray

    path = Path(folder)
    if not (path / "run.json").is_file():
        raise InputError("is not a saved run: run.json is missing", str(path))
    about = about_run(path)
    if not about.get("finished"):
        raise InputError("holds an unfinished run; run the command again", str(path))
    if (path / TREE).is_file():
        return read(path)
    kind = next((one for one in _kinds() if one.verb == about.get("verb")), None)
    if kind is None:
        raise InputError(f"results of {about.get('verb')!r} are not read back", str(path))
    design = replace(load(path / "design.toml"), name=str(about.get("design")))
    summary = read_json(path / "summary.json")
    try:
        with xarray.open_zarr(path / "data.zarr", consolidated=False) as data:
            return kind.read(design, data.load(), summary)
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"cannot be read back: {error}", str(path)) from None
