"""The folder of a run: claimed for one run, taken up again by the very same one alone."""

from __future__ import annotations

import hashlib
import itertools
import os
import shutil
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import drillctl
from drillctl.design import Design, to_toml
from drillctl.errors import InputError
from drillctl.provenance import provenance
from drillctl.store.differences import Growing, difference, refuse_other_machine
from drillctl.store.json_files import read_json, write_json, write_text

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
            held = about_run(path)
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
    held = about_run(path)
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


def about_run(path: Path) -> dict[str, Any]:
    """What `run.json` says, if it is one of ours."""
    held = read_json(path / "run.json")
    if not isinstance(held, dict) or not isinstance(held.get("provenance"), dict):
        raise InputError("holds a run.json that is not of a run", str(path))
    return held
