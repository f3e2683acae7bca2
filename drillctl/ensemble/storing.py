"""Where the finished blocks of a long run are stored, so that a killed run resumes.

In memory, or in the folder of the run as one small file a block, with a line in its journal. A
block counts as done once the line is there: a run killed at any moment has lost a block at most.
A block that is not what its line says is computed again.
"""

from __future__ import annotations

import hashlib
import io
import json
import logging
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array
from drillctl.ensemble.running import Block, Blocks, Job, Make, Measured, Pieces, Run, Scheme, kept
from drillctl.errors import StoreError
from drillctl.simulation.batch import Prepared
from drillctl.store.codec import decoded, encoded, stored_name
from drillctl.store.folder import finished_data
from drillctl.store.journal import Journal, reading

LOG = logging.getLogger("drillctl")

Store = Callable[[str, Any], Blocks]
"""Gives the blocks of a job by what they belong to: `map`, `realizations` or `sensitivity`."""


def in_memory(name: str, job: Job) -> Blocks:
    """Blocks of studies that live in memory only."""
    return MemoryBlocks(job)


class Folder:
    """What was computed so far in the folder of a run."""

    def __init__(self, path: Path) -> None:
        self._path, self._journal = path, Journal(path)

    def __call__(self, name: str, job: Any) -> Blocks:
        """The blocks of a job; those of draws that more are added to come from their result."""
        blocks = FileBlocks(Files(self._path, self._journal, f"blocks/{name}"), job)
        if name == "realizations":
            self._take(blocks, job)
        return blocks

    @property
    def steps(self) -> Steps:
        """The runs of a search."""
        return Steps(Files(self._path, self._journal, "blocks/steps"))

    def _take(self, blocks: FileBlocks, job: Job) -> None:
        try:
            before = finished_data(self._path, self._journal)
        except StoreError as error:
            LOG.warning("%s; computed again", error)
            return
        if before is None:
            return
        status = before.status.reshape(len(before.status), -1)
        for first, count in blocks.missing(len(status)):
            rows = slice(first, first + count)
            measures = {k: before.measures[k][rows].reshape(count, -1) for k in job.measures}
            blocks.keep(Block(first, measures, status[rows]))


def kept_in(path: Path | None) -> AbstractContextManager[None]:
    """While it lasts, what a search runs is kept in the folder of its run, if there is one."""
    return kept(None if path is None else Folder(path).steps)


class Files:
    """Blocks, strings and steps in files of a folder that its journal knows."""

    def __init__(self, path: Path, journal: Journal, folder: str) -> None:
        self._path, self._journal, self._folder = path, journal, folder
        (path / folder).mkdir(parents=True, exist_ok=True)

    def numbers(self) -> list[int]:
        """Of the files that are called by a number."""
        names = [n for n in self._journal.held if n.startswith(f"{self._folder}/")]
        return sorted(int(stem) for n in names if (stem := Path(n).stem).isdigit())

    def write(self, name: str, value: Any) -> None:
        """Write anything that the codec of results takes."""
        tree, variables = encoded(value)
        arrays: dict[str, Any] = {stored_name(k): one.values for k, one in variables.items()}
        content = io.BytesIO()
        np.savez(content, **arrays, tree=json.dumps(tree))
        self._journal.write(f"{self._folder}/{name}.npz", content.getvalue())

    def read(self, name: str) -> Any:
        """The same again; None if there is none, or a note if it is damaged."""
        place = f"{self._folder}/{name}.npz"
        if place not in self._journal.held:
            return None
        try:
            content = self._journal.read(place)
            with reading(self._path / place), np.load(io.BytesIO(content)) as held:
                return decoded(json.loads(str(held["tree"])), held)
        except StoreError as error:
            LOG.warning("%s; computed again", error)
            return None


class MemoryBlocks:
    """Blocks in memory."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._measures = {name: np.empty((0, job.width)) for name in job.measures}
        self._status = np.empty((0, job.width), dtype=np.int8)
        self._done = np.empty(0, dtype=bool)
        self._schemes = frozenset[Scheme]()

    def prepared(self, number: int, make: Make) -> Prepared:
        """Prepared afresh."""
        return make()

    def missing(self, rows: int) -> Pieces:
        """Blocks that the first `rows` rows still lack; room is made for them."""
        self._make_room(rows)
        return self._job.pieces(self._done[:rows])

    def _make_room(self, rows: int) -> None:
        more = rows - len(self._done)
        if more > 0:
            self._measures = {name: _longer(v, rows) for name, v in self._measures.items()}
            self._status = _longer(self._status, rows)
            self._done = np.append(self._done, np.zeros(more, dtype=bool))

    def keep(self, block: Block) -> None:
        """Keep a finished block."""
        self._make_room(block.first + len(block.status))
        rows = slice(block.first, block.first + len(block.status))
        for name, values in self._measures.items():
            values[rows] = block.measures[name]
        self._status[rows] = block.status
        self._done[rows] = True
        self._schemes |= block.schemes

    def read(self, rows: int) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Measures and status of the first `rows` rows."""
        return {name: v[:rows] for name, v in self._measures.items()}, self._status[:rows]

    @property
    def schemes(self) -> frozenset[Scheme]:
        """Of all blocks."""
        return self._schemes


def _longer(values: NDArray[Any], rows: int) -> NDArray[Any]:
    result = np.empty((rows, values.shape[1]), dtype=values.dtype)
    result[: len(values)] = values
    return result


class FileBlocks(MemoryBlocks):
    """Blocks in memory and as files, one a block, by the number of its first row."""

    def __init__(self, files: Files, job: Job) -> None:
        super().__init__(job)
        self._files = files
        for first in files.numbers():
            if (held := files.read(f"{first:06d}")) is not None:
                super().keep(held)

    def prepared(self, number: int, make: Make) -> Prepared:
        """The string of a number, read back if it was prepared before."""
        name = f"string-{number:06d}"
        held: Prepared | None = self._files.read(name)
        if held is None:
            held = make()
            self._files.write(name, held)
        return held

    def keep(self, block: Block) -> None:
        """Write a finished block."""
        self._files.write(f"{block.first:06d}", block)
        super().keep(block)


class Steps:
    """Runs of a search in files by their number: the search repeats itself up to where it was."""

    def __init__(self, files: Files) -> None:
        self._files, self._number = files, 0

    def __call__(
        self, runs: list[Run], names: tuple[str, ...], give_up: float, run: Callable[[], Measured]
    ) -> Measured:
        """What was measured of runs, read back if they were run before."""
        name = f"{self._number:06d}"
        self._number += 1
        key = _key(runs, names, give_up)
        held: tuple[str, Measured] | None = self._files.read(name)
        if held is None or held[0] != key:
            held = key, run()
            self._files.write(name, held)
        return held[1]


def _key(runs: list[Run], names: tuple[str, ...], give_up: float) -> str:
    """Hash of the numbers of all lanes; another machine may prepare other bits of a string."""
    result = hashlib.sha256(repr((names, give_up)).encode())
    for lanes, prepared, at in runs:
        laws = (lanes.friction, lanes.drive, lanes.weight, lanes.before, *lanes.program[:2])
        result.update(repr((prepared.scheme, prepared.duration, *map(type, laws))).encode())
        wall = () if lanes.wall is None else lanes.wall.torque
        own = (at, lanes.set_speed, lanes.turning_speed, *wall)
        for column in (*own, *(c for law in laws for c in law)):
            result.update(np.asarray(column).tobytes())
    return result.hexdigest()
