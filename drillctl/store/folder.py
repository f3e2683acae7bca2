"""The folder of a run: claimed by one run, locked, resumed only by the same run, and checked.

`run.json` says what the run is and whether it is finished; its line in the journal is written
before it. So the moments at which a run may be killed differ from damage: a `run.json` that the
journal never had was changed by someone else.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import re
import shutil
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import drillctl
from drillctl.design import Design, to_toml
from drillctl.design.reading import to_tree
from drillctl.errors import InputError, StoreError, shown
from drillctl.provenance import merged, provenance
from drillctl.store.journal import NAME, Journal, reading, writing
from drillctl.store.json_files import PART, as_json, write_json
from drillctl.store.lock import ENDING, FolderLock

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
        if held.get(key) != here.get(key) and key not in ("units", *grown)
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


def refuse_other_machine(held: Mapping[str, str], where: str, allowed: bool) -> None:
    """Refuse (`InputError`) to resume a run of other packages or another processor."""
    here = provenance()
    other = [key for key in here if held.get(key) != here[key]]
    if other and not allowed:
        text = ", ".join(f"{key} {held.get(key)}, here {here[key]}" for key in other)
        raise InputError(
            "holds a run started with other packages or on another processor, whose bits would "
            f"differ; give another folder, or --allow-other-machine ({text})",
            where,
        )


RUNS = "runs"  # parent folder of runs without --out
LONGEST_NAME, LONGEST_PATH = 240, 3800  # bytes that leave room for the files of a run


def resolved(folder: str | Path, where: str = "--out") -> Path:
    """The place of a folder; `InputError` for what cannot be one.

    Parameters
    ----------
    folder : str or Path
        As it was given; `~` is the home of the user.
    where : str
        Option that named it, for a message.
    """
    text = os.fspath(folder)
    if "::" in text or "\0" in text or re.match(r"[\w+.-]{2,}:/", text):
        raise InputError(f"{shown(text)} is the address of something else than a folder", where)
    if text.startswith("--"):  # what followed is taken for the folder that was left out
        raise InputError(f"{shown(text)} is an option: name a folder before it", where)
    try:
        path = Path(os.path.realpath(Path(text).expanduser()))
    except RuntimeError as error:
        raise InputError(f"{shown(text)} cannot be a folder: {error}", where) from None
    name, whole = (len(os.fsencode(one)) for one in (path.name, path))
    if name > LONGEST_NAME or whole > LONGEST_PATH:
        raise InputError(
            f"{shown(text)} is too long: at most {LONGEST_NAME} bytes a name and {LONGEST_PATH} in "
            "all",
            where,
        )
    return path


def identity(verb: str, design: Design, **settings: Any) -> str:
    """Hash that identifies a run: command, resolved design, version, other settings."""
    # whatever units it is read in
    same = replace(design, tables=design.tables.model_copy(update={"units": None}))
    text = "\n".join([verb, drillctl.__version__, repr(settings), to_toml(same)])
    return hashlib.sha256(text.encode()).hexdigest()


RUN, DESIGN, SUMMARY, BLOCKS = "run.json", "design.toml", "summary.json", "blocks"
TREE, ARRAYS = "result.json", "data.zarr"
DATA = (DESIGN, SUMMARY, TREE, "cells.json", ARRAYS)
"""Files of a finished run without which it is not what it says, beside `run.json`."""
KEPT = ("blocks/sensitivity/", "blocks/realizations/string")
"""Blocks that a run needs again when draws are added to it."""


def _is_data(name: str) -> bool:
    return name.partition("/")[0] in DATA


@dataclass(frozen=True)
class Found:
    """What a folder holds of a run."""

    about: dict[str, Any]  # content of `run.json`
    journal: Journal
    # whether the run ended; None where it was killed as it began or ended, or `run.json` is old
    finished: bool | None


def found(path: Path) -> Found:
    """What a folder holds, read and compared with its journal.

    Raises
    ------
    InputError
        Not a run, or one of a version without a journal.
    StoreError
        `run.json` or the journal is missing or damaged.
    """
    journal, place = Journal(path), path / RUN
    known = journal.path.exists()
    if not known and not place.is_file():
        raise InputError("is not a saved run: run.json is missing", str(path))
    with reading(place):
        content = place.read_bytes()
    about = _parsed(content)
    version = about.get("provenance", {}).get("drillctl")
    if not known and version == drillctl.__version__:
        raise StoreError(f"{journal.path}: is missing")
    if not known and not isinstance(version, str):
        raise InputError("holds a run.json that drillctl did not write", str(path))
    if not known:
        raise InputError(
            f"holds a run of {about.get('verb')!r} by version {version}, in a format that this "
            f"version does not read; run the command again in a new folder, or read it with "
            f"drillctl {version}",
            str(path),
        )
    digest = hashlib.sha256(content).hexdigest()
    if digest not in journal.before.get(RUN, ()):
        raise StoreError(f"{place}: is damaged, or {NAME} is: they do not belong together")
    return Found(about, journal, about["finished"] if digest == journal.held[RUN] else None)


def _parsed(content: bytes) -> dict[str, Any]:
    """The content of `run.json`; nothing if it is not one."""
    try:
        about = json.loads(content)
    except (ValueError, RecursionError):
        return {}
    right = isinstance(about, dict) and isinstance(about.get("provenance"), dict)
    return about if right else {}


def finished_run(path: Path) -> Path:
    """The folder of a finished run with a result, every file of it as it was written."""
    here = found(path)
    if here.finished is None:
        raise StoreError(f"{path / RUN}: is older than {NAME} says; run the command again")
    if not here.finished:
        raise InputError("holds an unfinished run; run the command again", str(path))
    here.journal.verify(filter(_is_data, here.journal.held))
    if TREE not in here.journal.held:
        verb = here.about.get("verb")
        raise InputError(f"holds a run of {verb!r}, which is not opened from Python", str(path))
    return path


def finished_data(path: Path, journal: Journal) -> Any:
    """The result that a run ended with before it was begun again; None if it never ended."""
    if TREE not in journal.held:
        return None
    from drillctl.store.codec import read

    journal.verify(name for name in journal.held if _is_data(name) and name != DESIGN)
    return read(path)


@dataclass(frozen=True)
class RunFolder:
    """A folder that belongs to one run of this process, until it is released.

    Attributes
    ----------
    path : Path
        Where it is.
    verb : str
        Command that made it.
    finished : bool
        Whether it held the finished run when it was opened.
    about : dict
        Content of `run.json`.
    lock : FolderLock or None
        None for a finished run where nothing can be written.
    shown : Path
        The folder as it was named.
    made : tuple of Path
        Folders that this run created: its own, then those above it; empty if it was there.
    """

    path: Path
    verb: str
    finished: bool
    about: dict[str, Any]
    lock: FolderLock | None
    shown: Path
    made: tuple[Path, ...] = ()

    def __enter__(self) -> Self:
        """Nothing: it is held already."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        """Release it."""
        self.release()

    def release(self) -> None:
        """Let other processes have the folder."""
        if self.lock is not None:
            self.lock.release()

    def summary(self) -> dict[str, Any]:
        """The summary of a finished run; `StoreError` if it is damaged."""
        result: dict[str, Any] = json.loads(Journal(self.path).read(SUMMARY))
        return result

    def conclude(self, result: Any, summary: dict[str, Any]) -> None:
        """Write a result and its summary, mark the run finished and drop its blocks.

        Parameters
        ----------
        result : Result or None
            None for a run that has no arrays, or has written its files itself.
        summary : dict
            Strict JSON values.
        """
        with writing(self.path):
            self._conclude(result, summary)

    def _conclude(self, result: Any, summary: dict[str, Any]) -> None:
        about = dict(self.about)
        if hasattr(result, "write"):
            own = getattr(result, "provenance", None)
            origin = about["provenance"] = merged(about["provenance"], own or provenance())
            if own not in (None, origin):  # on several machines; a copy has nothing in its cache
                result = replace(result, provenance=origin)
            result.write(self.path)
        write_json(self.path / SUMMARY, summary)
        journal = Journal(self.path)
        names = {name for name in self._files() if _is_data(name)} - {DESIGN}
        journal.forget(name for name in [*journal.held] if _is_old(name, names))
        journal.note(sorted(names))
        journal.announce(RUN, as_json(about | {"finished": True}))
        self._drop_blocks(journal)

    def _files(self) -> Iterator[str]:
        for path in self.path.rglob("*"):
            if path.is_file():
                yield path.relative_to(self.path).as_posix()

    def _drop_blocks(self, journal: Journal) -> None:
        kept = KEPT if "count" in self.about else ()
        gone = [n for n in journal.held if n.startswith(f"{BLOCKS}/") and not n.startswith(kept)]
        journal.forget(gone)
        for name in gone:
            (self.path / name).unlink(missing_ok=True)
        for path in sorted(self.path.glob(f"{BLOCKS}/**/"), reverse=True):
            with suppress(OSError):  # what is kept lies in it
                path.rmdir()

    @contextmanager
    def beside(self) -> Iterator[None]:
        """Enter the pictures and tables that are written meanwhile in the journal."""
        before = self._beside()
        yield
        journal = Journal(self.path)
        now = self._beside()
        journal.note(name for name, time in now.items() if before.get(name) != time)

    def _beside(self) -> dict[str, int]:
        """Times of all files beside the data."""
        return {
            path.name: path.stat().st_mtime_ns
            for path in self.path.iterdir()
            if path.is_file() and path.name not in (*DATA, RUN, NAME, ENDING)
        }

    def changed(self) -> list[str] | None:
        """What is wrong with pictures and tables of a finished run; None if it has none yet."""
        journal = Journal(self.path)
        names = [n for n in journal.held if not (n == RUN or _is_data(n) or n.startswith(BLOCKS))]
        return journal.changed(names) if names else None

    def _has_work(self) -> bool:
        """Whether there are finished blocks, or a result that is to be extended."""
        return TREE in Journal(self.path).held or any(map(_is_block, self._files()))

    def discard(self) -> None:
        """Remove what `claim` wrote, for a run that failed; finished blocks are kept."""
        if not self.finished and not self._has_work():
            for name in (BLOCKS, ARRAYS):
                shutil.rmtree(self.path / name, ignore_errors=True)
            for name in (DESIGN, RUN, SUMMARY, TREE, NAME):
                (self.path / name).unlink(missing_ok=True)
            _take_back(self.made[:1])  # while it is held
        self.release()
        _take_back(self.made[1:])


@contextmanager
def _made(path: Path) -> Iterator[tuple[Path, ...]]:
    """Create a folder and those above it; yields which, and takes them back if nothing is begun."""
    new = tuple(one for one in (path, *path.parents) if not one.exists())
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield new
    except BaseException:
        _take_back(new)
        raise


def _take_back(folders: tuple[Path, ...]) -> None:
    for path in folders:
        with suppress(OSError):  # something else was added meanwhile
            path.rmdir()


def _is_old(name: str, names: set[str]) -> bool:
    """Whether a file is of an earlier end of the run: data that are gone, pictures and tables."""
    return name not in (RUN, DESIGN) and not name.startswith(BLOCKS) and name not in names


def _is_block(name: str) -> bool:
    """Whether a file holds what was computed of an unfinished run."""
    return name.startswith(f"{BLOCKS}/") and not Path(name).name.startswith("string")


def claim(
    verb: str,
    design: Design,
    folder: str | Path | None,
    growing: Growing | None = None,
    allow_other_machine: bool = False,
    **settings: Any,
) -> RunFolder:
    """Create and lock the folder of a run, or one that holds the same run.

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
    allow_other_machine : bool
        Whether an unfinished run may resume on another type of processor or with other packages.
    **settings
        Other settings that the result depends on.

    Returns
    -------
    RunFolder
        If unfinished, run or resume it; if finished, show its summary again. Release it in the end.

    Raises
    ------
    InputError
        The folder holds something else, is in use, or cannot be written.
    StoreError
        It is damaged.
    """
    same = design if growing is None else growing.like
    about: dict[str, Any] = {
        "verb": verb, "identity": identity(verb, same, **settings), "design": design.name,
        "finished": False, "provenance": provenance(),
    }  # fmt: skip
    if growing is not None:
        about["count"] = growing.count
    given = Path(RUNS) / f"{design.name}-{verb}-*" if folder is None else Path(folder)
    try:
        if folder is None:
            return _fresh(design, about)
        path = resolved(folder)
        with _made(path.parent) as above:
            lock = _locked(path, given)
            try:
                return _claimed(path, given, lock, about, design, same, allow_other_machine, above)
            except BaseException:
                if lock is not None:
                    lock.release()
                raise
    except StoreError:
        raise
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", f"--out {given}") from None


def _locked(path: Path, given: Path) -> FolderLock | None:
    """The lock of a folder; None where nothing can be written, as where a finished run is read."""
    try:
        return FolderLock(path, f"--out {given}")
    except PermissionError:
        if (path / RUN).is_file():
            return None
        raise


def _claimed(
    path: Path, given: Path, lock: FolderLock | None, about: dict[str, Any], design: Design,
    same: Design, allow_other_machine: bool, above: tuple[Path, ...],
) -> RunFolder:  # fmt: skip
    if path.exists() and not path.is_dir():
        raise InputError("is a file, not a folder", f"--out {given}")
    made = () if path.exists() else (path, *above)
    if not made and not _empty(path):
        run = _same_run(path, given, lock, about, same, allow_other_machine)
        return run if run.finished else _begun(run, design)
    path.mkdir(exist_ok=True)
    (path / NAME).unlink(missing_ok=True)
    return _begun(RunFolder(path, about["verb"], False, about, lock, given, made), design)


def _begun(run: RunFolder, design: Design) -> RunFolder:
    """The folder with what the run is; remains of writes that were killed are removed."""
    try:
        for path in list(run.path.rglob(f".*{PART}")):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        journal = Journal(run.path)
        journal.announce(RUN, as_json(run.about))
        journal.write(DESIGN, to_toml(design).encode())
    except BaseException:
        run.discard()
        raise
    return run


def _fresh(design: Design, about: dict[str, Any]) -> RunFolder:
    """A new folder; created at once, so that no other process takes the same name."""
    name, verb = re.sub("/|::+", "-", design.name), about["verb"]
    with _made(resolved(RUNS)) as above:
        for number in itertools.count(1):
            given = Path(RUNS) / f"{name}-{verb}-{number}"
            path = resolved(given, f"the name {design.name!r}")
            with suppress(FileExistsError):
                path.mkdir()
                break
        own = FolderLock(path, str(given))
        return _begun(RunFolder(path, verb, False, about, own, given, (path, *above)), design)


def _empty(path: Path) -> bool:
    """Whether a folder is empty, or holds only the remains of a run killed at its start."""
    return all(item.suffix == PART or item.name in (NAME, ENDING) for item in path.iterdir())


def _same_run(
    path: Path, given: Path, lock: FolderLock | None, about: dict[str, Any], same: Design,
    allow_other_machine: bool,
) -> RunFolder:  # fmt: skip
    where = f"--out {given}"
    if not (path / RUN).is_file() and not (path / NAME).is_file():
        raise InputError("holds other files than a run; give an empty or new folder", where)
    here = found(path)
    held = here.about
    if held.get("verb") != about["verb"]:
        raise InputError(f"holds a run of {held.get('verb')!r}, not {about['verb']!r}", where)
    if held.get("identity") != about["identity"]:
        came_from = held["provenance"].get("drillctl")
        reason = "another design or other settings"
        if drillctl.__version__ not in came_from.split(" + "):
            reason = f"version {came_from}, this is {drillctl.__version__}"
        else:
            grown = ("uncertainty.realizations",) if "count" in about else ()
            reason += difference(path / DESIGN, same, grown)
        raise InputError(f"holds a run of {reason}; give another folder", where)
    run = RunFolder(path, about["verb"], True, held, lock, given)
    more = about.get("count", 0) - held.get("count", 0)
    if here.finished and more < 0:
        raise InputError(
            f"holds a run of {held['count']} realizations, {about['count']} are requested: request "
            f"at least {held['count']}, or give another folder",
            where,
        )
    if here.finished and more == 0:
        return run
    if lock is None or not os.access(path, os.W_OK):
        raise InputError("cannot be written: permission denied", where)
    if here.finished:
        here.journal.verify(filter(_is_data, here.journal.held))
    refuse_other_machine(held["provenance"], where, allow_other_machine)
    origin = merged(held["provenance"], provenance())
    return replace(run, finished=False, about=about | {"provenance": origin})
