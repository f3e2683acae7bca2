"""Shipped models and designs by name.

In a wheel they lie inside the package, in a checkout beside it; both are searched.
"""

from __future__ import annotations

import difflib
import os
import stat
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from drillctl.errors import InputError, nearest, shown

Shelf = Literal["models", "designs"]
MOST_BYTES = 2**24  # of a file that is named: some hundred thousand samples
_PACKAGE = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Entry:
    """A shipped file.

    Attributes
    ----------
    name : str
        Name by which commands take it.
    title : str
        Its own title.
    path : Path
        Where it lies.
    """

    name: str
    title: str
    path: Path


def _folder(shelf: Shelf) -> Path:
    inside = _PACKAGE / shelf
    return inside if inside.is_dir() else _PACKAGE.parent / shelf


def names(shelf: Shelf) -> list[str]:
    """Names of the shipped models or designs, sorted."""
    return sorted(path.stem for path in _folder(shelf).glob("*.toml"))


def entries(shelf: Shelf) -> list[Entry]:
    """The shipped models or designs with their titles, sorted by name."""
    results = []
    for name in names(shelf):
        path = _folder(shelf) / f"{name}.toml"
        title = tomllib.loads(path.read_text(encoding="utf-8")).get("title", "")
        results.append(Entry(name, title, path))
    return results


def find(name_or_path: str, shelves: tuple[Shelf, ...] = ("designs", "models")) -> Path:
    """Where a design lies, given its name or a path to it.

    Parameters
    ----------
    name_or_path : str
        A shipped name, or a path (anything with a slash or a dot).
    shelves : tuple of {'models', 'designs'}
        Which shipped files to search, in this order.

    Raises
    ------
    InputError
        No such file, or no such name; the message lists the nearest.
    """
    if any(mark in name_or_path for mark in "./\\"):
        return regular_file(name_or_path)
    for shelf in shelves:
        if name_or_path in names(shelf):
            return _folder(shelf) / f"{name_or_path}.toml"
    with suppress(OSError):  # too long a name
        if name_or_path and Path(name_or_path).exists():
            return regular_file(name_or_path)
    if Path(f"{name_or_path[:200]}.toml").is_file():
        raise InputError(f"not a shipped name; did you mean '{name_or_path}.toml'?", name_or_path)
    known = [name for shelf in shelves for name in names(shelf)]
    raise InputError(
        f"not a shipped name ({nearest(name_or_path, known)}), nor a path to a .toml file",
        name_or_path or "design",
    )


def find_model(model: str, design: Path) -> Path:
    """Where the model of a design lies: one given as a path is searched beside the design first.

    Parameters
    ----------
    model : str
        A shipped name, or a path.
    design : Path
        The file that names it.

    Raises
    ------
    InputError
        No such file, or no such name.
    """
    beside = design.parent / model
    with suppress(OSError, ValueError):  # a name no file can have; `find` reports it
        if beside.suffix == ".toml" and beside.exists():
            return beside.resolve()
    return find(model, ("models", "designs")).resolve()


def regular_file(text: str) -> Path:
    """The file at a path (`InputError` says why there is none)."""
    with _reasons(shown(text)):  # unreadable, ~nobody, null byte
        path = Path(text).expanduser()
        if path.is_file():
            return path
        mode = path.stat().st_mode if path.exists() else None
        others = path.parent.iterdir() if path.parent.is_dir() else ()
        beside = {p.name for p in others if p.suffix in (path.suffix, ".toml")} - {path.name}
    if mode is not None:
        raise InputError(_not_regular(mode), text)
    close = difflib.get_close_matches(path.name, beside, n=1, cutoff=0.7)
    hint = f"; did you mean '{close[0]}'?" if close else ""
    raise InputError(f"no such file{hint}", text)


@contextmanager
def _reasons(where: str) -> Iterator[None]:
    """Report why a file cannot be read."""
    try:
        yield
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot be read: {reason}", where) from None


def _at_once(path: str, flags: int) -> int:
    """Open without waiting for somebody to write into a pipe."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _not_regular(mode: int) -> str:
    kind = "a folder" if stat.S_ISDIR(mode) else "a pipe or a device"
    return f"is {kind}, not a file"


def read_bytes(path: Path, where: str) -> bytes:
    """Content of a regular file that a user named.

    Parameters
    ----------
    path : Path
        Where it lies.
    where : str
        Named in messages.

    Raises
    ------
    InputError
        It cannot be read, is a folder, a pipe or a device, or is larger than 16 MiB.
    """
    with _reasons(where), open(path, "rb", opener=_at_once) as stream:
        mode = os.fstat(stream.fileno()).st_mode
        data = stream.read(MOST_BYTES + 1) if stat.S_ISREG(mode) else b""
    if not stat.S_ISREG(mode):
        raise InputError(_not_regular(mode), where)
    if len(data) > MOST_BYTES:
        raise InputError(f"is larger than {MOST_BYTES // 2**20} MiB", where)
    return data


def read(path: Path, where: str) -> str:
    """Text of a regular file that a user named.

    Parameters
    ----------
    path : Path
        Where it lies.
    where : str
        Named in messages.

    Raises
    ------
    InputError
        As with `read_bytes`, or it is not UTF-8.
    """
    try:
        # Some editors put a byte-order mark in front.
        return read_bytes(path, where).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"not UTF-8 text: {error.reason} at byte {error.start}", where) from None
