"""The journal of a folder: what every file of the run was when it was written.

`journal.jsonl` has a line a file: a hash over the line and all before it, the SHA-256 of the file
(null where it was removed), its path. Lines are added and never changed; the last line of a path
counts. A path holds the number of its block. A file that was changed, cut, swapped with another
or put back from an earlier time is recognised, and so is a line.

A kill may cut the last line: what it says is then not known, and nothing else is lost.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from drillctl.errors import StoreError
from drillctl.store.json_files import write_bytes

NAME = "journal.jsonl"
CHAIN = 16  # characters of the hash of a line


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Report whatever is wrong with a file, of which readers raise many kinds, with its name."""
    try:
        yield
    except (StoreError, MemoryError):
        raise
    except FileNotFoundError:
        raise StoreError(f"{path}: is missing") from None
    except Exception as error:
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise StoreError(f"{path}: cannot be read: {reason}") from None


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Report a failure of the disk with what has become of the run."""
    try:
        yield
    except StoreError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        raise StoreError(
            f"{path}: cannot be written: {reason}; finished blocks are kept, and the same command "
            "goes on from them"
        ) from None


class Journal:
    """Files of a folder by their hashes."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / NAME
        self.held: dict[str, str] = {}  # hash by path
        self.before: dict[str, set[str]] = {}  # every hash that a path has had
        self.intact = True  # whether every line is as it was written
        self._folder, self._chain, self._size = folder, "", 0
        with reading(self.path):
            content = self.path.read_bytes() if self.path.exists() else b""
        for line in content.splitlines(keepends=True):
            if not self._takes(line):
                self.intact = False
                break

    def _takes(self, line: bytes) -> bool:
        """Take a line, if it is one and follows those before."""
        try:
            _, digest, name = json.loads(line)
        except (ValueError, TypeError):
            return False
        if line != self._line(name, digest):
            return False
        self._follow(line, name, digest)
        return True

    def _line(self, name: str, digest: str | None) -> bytes:
        content = json.dumps([digest, name])
        chain = hashlib.sha256(f"{self._chain}{content}".encode()).hexdigest()[:CHAIN]
        return (json.dumps([chain, digest, name]) + "\n").encode()

    def _follow(self, line: bytes, name: str, digest: str | None) -> None:
        self._chain, self._size = json.loads(line)[0], self._size + len(line)
        if digest is None:
            self.held.pop(name, None)
        else:
            self.held[name] = digest
            self.before.setdefault(name, set()).add(digest)

    def _add(self, entries: Iterable[tuple[str, str | None]]) -> None:
        with writing(self.path), self.path.open("r+b" if self.path.exists() else "xb") as stream:
            stream.seek(self._size)
            stream.truncate()  # of a line that a kill has cut
            for name, digest in entries:
                line = self._line(name, digest)
                stream.write(line)
                self._follow(line, name, digest)
            stream.flush()
            os.fsync(stream.fileno())

    def write(self, name: str, content: bytes) -> None:
        """Write a file, then its line: it counts once the line is there."""
        path = self._folder / name
        with writing(path):
            write_bytes(path, content)
        self._add([(name, _digest(content))])

    def announce(self, name: str, content: bytes) -> None:
        """Write a line, then its file: the file is known from the moment that it is there."""
        self._add([(name, _digest(content))])
        with writing(self._folder / name):
            write_bytes(self._folder / name, content)

    def note(self, names: Iterable[str]) -> None:
        """Add lines of files that are there."""
        self._add([(name, self._found(name)) for name in names])

    def forget(self, names: Iterable[str]) -> None:
        """Add lines of files that are removed."""
        self._add([(name, None) for name in names])

    def read(self, name: str) -> bytes:
        """A file as it was written; `StoreError` if it is not."""
        path = self._folder / name
        with reading(path):
            content = path.read_bytes()
        self._compare(name, _digest(content))
        return content

    def verify(self, names: Iterable[str]) -> None:
        """Refuse (`StoreError`) files that are not what was written."""
        for name in names:
            self._compare(name, self._found(name))

    def changed(self, names: Iterable[str]) -> list[str]:
        """What is wrong with files of which that is no error."""
        problems = []
        for name in names:
            try:
                self.verify([name])
            except StoreError as error:
                problems.append(str(error))
        return problems

    def _compare(self, name: str, digest: str) -> None:
        if self.held.get(name) != digest:
            raise StoreError(f"{self._folder / name}: is damaged: it is not what was written")

    def _found(self, name: str) -> str:
        path = self._folder / name
        with reading(path), path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
