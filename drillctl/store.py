"""Results on disk: one folder a run.

    run.json       verb, version, identity, provenance; whether the run is finished
    design.toml    the resolved design
    blocks/        finished blocks of a map that is not, written atomically
    data.zarr      the dataset, labelled by parameter path; under uncertainty it grows by blocks
    summary.json   what the command printed
    *.png, *.csv   figures and tables

No pickle anywhere; a folder that holds anything else is never written to.
"""

from __future__ import annotations

import hashlib
import itertools
import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import drillctl
from drillctl.design import Design, load, to_toml
from drillctl.errors import InputError
from drillctl.json_files import read_json, write_json, write_text
from drillctl.linear.modal import Modes
from drillctl.provenance import provenance
from drillctl.simulation.batch import FLOATS
from drillctl.simulation.limit_cycle import LimitCycle
from drillctl.simulation.trajectory import Simulation
from drillctl.store_blocks import FolderBlocks
from drillctl.store_differences import (
    Growing,
    difference,
    growing_realizations,
    refuse_other_machine,
)
from drillctl.store_reading import READERS, stored_name
from drillctl.store_realizations import FolderShelf, write_uncertainty
from drillctl.studies.adaptive import AdaptiveMap
from drillctl.studies.adaptive_checks import CHECK_CELLS
from drillctl.studies.audit import choose_cells
from drillctl.studies.cases import case_designs
from drillctl.studies.comparison import Comparison
from drillctl.studies.contour_search import INTERVALS
from drillctl.studies.diagnosis import Doctor
from drillctl.studies.grid import Axis, axes_of
from drillctl.studies.loop_maps import LoopMap
from drillctl.studies.regularisation import WIDTHS, Regularisation
from drillctl.studies.sweeps import Sweep
from drillctl.studies.three_regions import PAPER_LEVEL, ThreeRegions
from drillctl.studies.uncertainty import Uncertainty
from drillctl.studies.uncertainty.study import map_axes

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
    made : bool
        Whether the folder was not there before.
    """

    path: Path
    verb: str
    finished: bool
    made: bool = False

    def summary(self) -> dict[str, Any]:
        """The summary of a finished run."""
        found: dict[str, Any] = read_json(self.path / "summary.json")
        return found

    def finish(self, summary: dict[str, Any]) -> None:
        """Write the summary, mark the run finished and drop its blocks."""
        write_json(self.path / "summary.json", summary)
        about = read_json(self.path / "run.json")
        write_json(self.path / "run.json", about | {"finished": True})
        shutil.rmtree(self.path / "blocks", ignore_errors=True)

    def discard(self) -> None:
        """Take back what `claim` wrote, for a run that turned out to be impossible."""
        if any((self.path / "blocks").glob("[0-9]*.npz")) or (self.path / "data.zarr").exists():
            return  # hours of work, perhaps
        shutil.rmtree(self.path / "blocks", ignore_errors=True)
        for name in ("design.toml", "run.json"):
            (self.path / name).unlink(missing_ok=True)
        if self.made:
            with suppress(OSError):  # something else was put in meanwhile
                self.path.rmdir()

    def blocks(self) -> FolderBlocks:
        """Blocks kept in this folder."""
        folder = self.path / "blocks"
        folder.mkdir(exist_ok=True)
        return FolderBlocks(folder)

    def shelf(self) -> FolderShelf:
        """Realizations kept in this folder."""
        return FolderShelf(self.path)


def claim(
    verb: str,
    design: Design,
    folder: str | Path | None,
    growing: Growing | None = None,
    allow_mixed: bool = False,
    **settings: Any,
) -> RunFolder:
    """Make the folder of a run, or take up one that holds the very same run.

    Parameters
    ----------
    verb : str
        Command.
    design : Design
        Resolved design; with verb and version it identifies the run.
    folder : str or Path, optional
        Where to; by default a new folder under `runs`.
    growing : Growing, optional
        A count that a finished run may be taken on to.
    allow_mixed : bool
        Whether an unfinished run may go on on another type of processor.
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
    same = design if growing is None else growing.like
    about: dict[str, Any] = {
        "verb": verb, "identity": identity(verb, same, **settings), "design": design.name
    }  # fmt: skip
    if growing is not None:
        about["count"] = growing.count
    path = RUNS / f"{design.name}-{verb}-*" if folder is None else Path(folder)
    try:
        if folder is None:
            path = _fresh(verb, design)
            run = RunFolder(path, verb, finished=False, made=True)
        elif path.exists() and not path.is_dir():
            raise InputError("is a file, not a folder", f"--out {path}")
        elif path.is_dir() and not _empty(path):
            run = _same_run(path, about, same, allow_mixed)
        else:
            run = RunFolder(path, verb, finished=False, made=not path.exists())
            path.mkdir(parents=True, exist_ok=True)
        begun = (path / "run.json").exists()
        if not begun:
            write_json(path / "run.json", about | {"finished": False, "provenance": provenance()})
        elif not run.finished:
            held = _about(path)
            write_json(path / "run.json", held | about | {"finished": False})
        if not run.finished:
            write_text(path / "design.toml", to_toml(design))
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", f"--out {path}") from None
    return run


def _fresh(verb: str, design: Design) -> Path:
    """A new folder; made at once, lest another process take the same."""
    RUNS.mkdir(parents=True, exist_ok=True)
    for number in itertools.count(1):
        path = RUNS / f"{design.name}-{verb}-{number}"
        with suppress(FileExistsError):
            path.mkdir()
            break
    return path


def _empty(path: Path) -> bool:
    """Whether a folder holds nothing, or only what a run leaves that was killed at its birth."""
    return all(item.name == "run.part" for item in path.iterdir())


def _same_run(path: Path, about: dict[str, Any], same: Design, allow_mixed: bool) -> RunFolder:
    where = f"--out {path}"
    if not (path / "run.json").is_file():
        raise InputError("holds something that is not a run; give an empty or new folder", where)
    held = _about(path)
    if held.get("verb") != about["verb"]:
        raise InputError(f"holds a run of {held.get('verb')!r}, not {about['verb']!r}", where)
    if held.get("identity") != about["identity"]:
        came_from = held["provenance"].get("drillctl")
        reason = "another design or other settings"
        if came_from != drillctl.__version__:
            reason = f"version {came_from}, this is {drillctl.__version__}"
        else:
            grown = ("uncertainty.realizations",) if "count" in about else ()
            reason += difference(path / "design.toml", same, grown)
        raise InputError(f"holds a run of {reason}; give another folder", where)
    more = about.get("count", 0) - held.get("count", 0)
    if held.get("finished") and more < 0:
        raise InputError(
            f"holds a run of {held['count']} realizations, {about['count']} are asked for: ask for "
            "as many or more, or give another folder",
            where,
        )
    if held.get("finished") and more == 0:
        return RunFolder(path, about["verb"], finished=True)
    if not os.access(path, os.W_OK):
        raise InputError("cannot be written: permission denied", where)
    refuse_other_machine(held["provenance"], where, allow_mixed)
    return RunFolder(path, about["verb"], finished=False)


def _about(path: Path) -> dict[str, Any]:
    """What `run.json` says, if it is one of ours."""
    held = read_json(path / "run.json")
    if not isinstance(held, dict) or not isinstance(held.get("provenance"), dict):
        raise InputError("holds a run.json that is not of a run", str(path))
    return held


def write_data(result: Any, folder: Path) -> None:
    """Write a result's dataset as `data.zarr`, with its provenance, whole or not at all."""
    if isinstance(result, Uncertainty):
        write_uncertainty(result, folder)
        return
    part, target = folder / "data.part", folder / "data.zarr"
    shutil.rmtree(part, ignore_errors=True)
    data = result.data
    data = data.rename({name: stored_name(str(name)) for name in (*data.variables, *data.dims)})
    data.attrs = provenance() | data.attrs
    data.to_zarr(part, mode="w", consolidated=False)
    shutil.rmtree(target, ignore_errors=True)
    part.rename(target)


VERBS = {
    "AdaptiveMap": "adaptive-map",
    "Doctor": "doctor",
    "Sweep": "map",
    "Simulation": "simulate",
    "Modes": "modes",
    "Comparison": "compare",
    "LimitCycle": "cycle",
    "LoopAnalysis": "loop",
    "LoopMap": "loop-map",
    "Regularisation": "regularisation",
    "ThreeRegions": "regions",
    "WeightDelay": "delay",
    "Uncertainty": "uncertainty",
}


def save(result: Any, folder: str | Path) -> Path:
    """Write a result into a folder of its own.

    Parameters
    ----------
    result : Sweep, Simulation, Modes, LoopAnalysis, LoopMap, ...
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
        The folder holds something else, or cannot be written; or the result is of a bare
        string and has no design to go with it.
    """
    if result.design is None:
        raise InputError("modes of a bare string have no design to be saved with", "save")
    design, settings = _asked(result)
    growing = growing_realizations(design) if isinstance(result, Uncertainty) else None
    run = claim(VERBS[type(result).__name__], design, folder, growing, **settings)
    write_data(result, run.path)
    run.finish(result.summary())
    return run.path


def _asked(result: Any) -> tuple[Design, dict[str, Any]]:
    """The design that gives this result again, and what was asked for beside it.

    Python takes an engine, axes and audited cells that the design does not hold; a command
    that runs the design itself must not take such a result for its own.
    """
    design: Design = result.design
    tables = design.tables
    settings: dict[str, Any] = {}
    if isinstance(result, Simulation):
        if result.engine != (tables.simulation.engine or "reference"):
            design = design.replace({"simulation.engine": result.engine})
    elif isinstance(result, Sweep):
        axes = [[a.path, a.values.tolist()] for a in result.axes]
        cells = choose_cells(result.j1, result.levels, tables.map.audit_cells)
        if axes != _own_axes(design):
            settings["axes"] = axes
        if not np.array_equal(cells, result.audit.cells):
            settings["audited"] = result.audit.cells.tolist()
        settings |= asked_measures(tuple(result.measures))
    elif isinstance(result, AdaptiveMap):
        settings = _asked_of_adaptive(result)
    elif isinstance(result, Uncertainty):
        axes = [[a.path, a.values.tolist()] for a in result.axes]
        if axes != _own_axes(design, map_axes):
            settings["axes"] = axes
        if len(result.audit.cells) != tables.map.audit_cells:
            settings["audited"] = result.audit.cells.tolist()
    elif isinstance(result, Doctor):
        settings["audited"] = result.asked
    elif isinstance(result, LoopMap):
        axes = [[a.path, a.values.tolist()] for a in result.axes]
        settings = {"quantities": list(result.values)} | (
            {"axes": axes} if axes != _own_axes(design) else {}
        )
    elif isinstance(result, ThreeRegions):
        axes = [[a.path, a.values.tolist()] for a in result.axes]
        if axes != _own_axes(design):
            settings["axes"] = axes
        if result.level != PAPER_LEVEL:
            settings["level"] = result.level
    elif isinstance(result, Regularisation):
        axes = [[a.path, a.values.tolist()] for a in result.axes]
        if axes != _own_axes(design):
            settings["axes"] = axes
        if tuple(result.widths) != WIDTHS:
            settings["widths"] = result.widths.tolist()
    elif isinstance(result, Comparison):
        cases = {case.name: case.design for case in result.cases}
        if list(cases.items()) != _own_cases(design):
            settings["cases"] = {name: to_toml(case) for name, case in cases.items()}
    elif isinstance(result, LimitCycle):
        settings["duration"] = result.simulated.duration
    elif isinstance(result, Modes):
        settings["count"] = max(len(result.free_free), len(result.fixed_top))
    return design, settings


def asked_measures(kept: tuple[str, ...]) -> dict[str, Any]:
    """What a map that keeps some measures alone was asked for, for `claim`."""
    return {} if kept == FLOATS else {"measures": list(kept)}


def _asked_of_adaptive(result: AdaptiveMap) -> dict[str, Any]:
    """What the command says of an adaptive map, and what only Python can ask for."""
    settings: dict[str, Any] = {"full_grid": result.full_audit is not None}
    axes = [[a.path, a.values.tolist()] for a in result.axes]
    if axes != _own_axes(result.design):
        settings["axes"] = axes
    if result.intervals != INTERVALS:
        settings["intervals"] = result.intervals
    check = result.self_check
    left = result.bands.size - result.trajectories + len(check.cells) + check.followed
    if len(check.cells) != min(CHECK_CELLS, left):
        settings["checked"] = len(check.cells)
    count = result.design.tables.map.audit_cells
    cells = choose_cells(result.j1.filled(np.nan), result.levels, count)
    if not np.array_equal(cells, result.audit.cells):
        settings["audited"] = result.audit.cells.tolist()
    return settings


def _own_cases(design: Design) -> list[Any] | None:
    try:
        return list(case_designs(design).items())
    except InputError:  # cases given one by one need not be those of their first
        return None


def _own_axes(
    design: Design, axes: Callable[[Design], tuple[Axis, ...]] | None = None
) -> list[Any] | None:
    try:
        own = axes_of(design, design.tables.map.axes) if axes is None else axes(design)
    except InputError:  # the default ones do not fit every law
        return None
    return [[a.path, a.values.tolist()] for a in own]


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
        raise InputError("is not a saved run: there is no run.json", str(path))
    about = _about(path)
    if not about.get("finished"):
        raise InputError("holds a run that is not finished; run the command again", str(path))
    if about.get("verb") not in READERS:
        raise InputError(f"results of {about.get('verb')!r} are not read back", str(path))
    design = replace(load(path / "design.toml"), name=str(about.get("design")))
    summary = read_json(path / "summary.json")
    try:
        with xarray.open_zarr(path / "data.zarr", consolidated=False) as data:
            return READERS[about["verb"]](design, data.load(), summary)
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"cannot be read back: {error}", str(path)) from None
