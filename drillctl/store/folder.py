"""Differences between a run and the run that a folder was made for.

The folder of a run: claimed by one run, resumed only by the same run.
"""

from __future__ import annotations

import hashlib
import itertools
import os
import shutil
import tomllib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import drillctl
from drillctl.design import Design, to_toml
from drillctl.design.reading import to_tree
from drillctl.errors import InputError, shown
from drillctl.provenance import provenance
from drillctl.store.json_files import read_json, write_json, write_text

MOST = 3  # largest number of keys in a message
LONGEST = 57  # longest list printed in full (characters)


def difference(path: Path, design: Design, grown: tuple[str, ...] = ()) -> str:
    """The keys in which a design differs from a resolved one on disk, for a message."""
    try:
        held = _leaves(tomllib.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return ""
    here = _leaves(to_tree(design.tables))
    keys = [
        key for key in dict.fromkeys((*held, *here))
        if held.get(key) != here.get(key) and key not in grown
    ]  # fmt: skip
    if not keys:
        return ""
    named = [f"{key} is {_value(held, key)}, here {_value(here, key)}" for key in keys[:MOST]]
    more = f" and {len(keys) - MOST} more" if len(keys) > MOST else ""
    return f": {'; '.join(named)}{more}"


def _value(leaves: dict[str, Any], key: str) -> str:
    if key not in leaves:
        return "not given"
    value = leaves[key]
    if isinstance(value, list):
        text = ", ".join(map(str, value))
        return f"[{text}]" if len(text) <= LONGEST else f"[{text[:LONGEST]}...]"
    return shown(value)


def _leaves(tree: Any, prefix: str = "") -> dict[str, Any]:
    """Values by dotted path; those of named tables in a list by their names."""
    results: dict[str, Any] = {}
    for key, value in tree.items():
        path = f"{prefix}{key}"
        if isinstance(value, dict):
            results |= _leaves(value, f"{path}.")
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            for number, item in enumerate(value, start=1):
                name = item.get("name") or item.get("path") or number
                results |= _leaves(item, f"{path}.{name}.")
        else:
            results[path] = value
    return results


@dataclass(frozen=True)
class Growing:
    """A count of draws to which a finished run may be extended."""

    count: int  # requested
    # the design with a fixed count in place of the requested one: it identifies the run
    like: Design


def growing_realizations(design: Design) -> Growing | None:
    """The extension of a run under uncertainty; None for samplings of fixed size.

    Parameters
    ----------
    design : Design
        Of the run.
    """
    table = design.tables.uncertainty
    if table.sampling == "latin-hypercube":
        return None
    return Growing(
        table.realizations, design.replace({"uncertainty.realizations": table.replicates})
    )


def refuse_other_machine(held: dict[str, str], where: str, allow_mixed: bool) -> None:
    """Refuse (`InputError`) to resume a run of other packages or another processor."""
    here = provenance()
    other = [key for key in here if held.get(key) != here[key]]
    if allow_mixed and other == ["processor"]:
        return
    if other:
        text = ", ".join(f"{key} {held.get(key)}, here {here[key]}" for key in other)
        raise InputError(
            "holds a run started with other packages or on another processor, whose bits would "
            f"differ; give another folder ({text})",
            where,
        )


RUNS = Path("runs")  # parent folder of runs without --out


def identity(verb: str, design: Design, **settings: Any) -> str:
    """Hash that identifies a run: command, resolved design, version, other settings."""
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
        Whether this run created the folder.
    """

    path: Path
    verb: str
    finished: bool
    made: bool = False

    def summary(self) -> dict[str, Any]:
        """The summary of a finished run."""
        result: dict[str, Any] = read_json(self.path / "summary.json")
        return result

    def finish(self, summary: dict[str, Any]) -> None:
        """Write the summary, mark the run finished and drop its blocks."""
        write_json(self.path / "summary.json", summary)
        about = read_json(self.path / "run.json")
        write_json(self.path / "run.json", about | {"finished": True})
        shutil.rmtree(self.path / "blocks", ignore_errors=True)

    def discard(self) -> None:
        """Remove what `claim` wrote, for a run that proved invalid."""
        if any((self.path / "blocks").glob("[0-9]*.npz")) or (self.path / "data.zarr").exists():
            return  # never delete computed blocks
        shutil.rmtree(self.path / "blocks", ignore_errors=True)
        for name in ("design.toml", "run.json"):
            (self.path / name).unlink(missing_ok=True)
        if self.made:
            with suppress(OSError):  # something else was added meanwhile
                self.path.rmdir()


def claim(
    verb: str,
    design: Design,
    folder: str | Path | None,
    growing: Growing | None = None,
    allow_mixed: bool = False,
    **settings: Any,
) -> RunFolder:
    """Create the folder of a run, or reuse one that holds the same run.

    Parameters
    ----------
    verb : str
        Command.
    design : Design
        Resolved design; with verb and version it identifies the run.
    folder : str or Path, optional
        By default a new folder under `runs`.
    growing : Growing, optional
        Count of draws to which a finished run may be extended.
    allow_mixed : bool
        Whether an unfinished run may resume on another type of processor.
    **settings
        Other settings that the result depends on.

    Returns
    -------
    RunFolder
        If unfinished, run or resume it; if finished, show its summary again.

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
    """Create a new folder; at once, so that no other process takes the same name."""
    RUNS.mkdir(parents=True, exist_ok=True)
    for number in itertools.count(1):
        path = RUNS / f"{design.name}-{verb}-{number}"
        with suppress(FileExistsError):
            path.mkdir()
            break
    return path


def _empty(path: Path) -> bool:
    """Whether a folder is empty, or holds only the remains of a run killed at its start."""
    return all(item.name == "run.part" for item in path.iterdir())


def _same_run(path: Path, about: dict[str, Any], same: Design, allow_mixed: bool) -> RunFolder:
    where = f"--out {path}"
    if not (path / "run.json").is_file():
        raise InputError("holds other files than a run; give an empty or new folder", where)
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
            f"holds a run of {held['count']} realizations, {about['count']} are requested: request "
            f"at least {held['count']}, or give another folder",
            where,
        )
    if held.get("finished") and more == 0:
        return RunFolder(path, about["verb"], finished=True)
    if not os.access(path, os.W_OK):
        raise InputError("cannot be written: permission denied", where)
    refuse_other_machine(held["provenance"], where, allow_mixed)
    return RunFolder(path, about["verb"], finished=False)


def about_run(path: Path) -> dict[str, Any]:
    """The content of `run.json`, checked to be that of a run."""
    held = read_json(path / "run.json")
    if not isinstance(held, dict) or not isinstance(held.get("provenance"), dict):
        raise InputError("holds a run.json that drillctl did not write", str(path))
    return held
