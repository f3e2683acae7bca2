"""Where the finished blocks of a long run are stored, so that a killed run resumes.

In memory; of a map as one small file a block; of realizations as a zarr store that grows. A file
or chunk is written beside its place and moved there. Of a row of realizations the status is
written last, and it counts as done once that is there: a run killed at any moment has lost a
block at most.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array
from drillctl.ensemble.grid import shape_of
from drillctl.ensemble.running import Block, Blocks, Job, Make, Pieces, Scheme
from drillctl.errors import StoreError
from drillctl.simulation.batch import Prepared
from drillctl.simulation.measures import MEASURES, STATUSES
from drillctl.simulation.propagator import StringStep
from drillctl.simulation.scheme import Scheme as StringScheme
from drillctl.store.codec import stored_name
from drillctl.store.json_files import picked

if TYPE_CHECKING:
    from drillctl.ensemble.realizations import Realizations

NOT_RUN = -1  # status of a lane that was not run yet
FILES = {"realizations": "data.zarr", "sensitivity": "sensitivity.zarr"}
"""Where the realizations of a study are, in the folder of its run."""


Store = Callable[[str, Any], Blocks]
"""Gives the blocks of a job by what they belong to: `map`, `realizations` or `sensitivity`."""


def in_memory(name: str, job: Job) -> Blocks:
    """Blocks of studies that live in memory only."""
    return MemoryBlocks(job)


@dataclass(frozen=True)
class Folder:
    """Blocks in the folder of a run."""

    path: Path

    def __call__(self, name: str, job: Any) -> Blocks:
        """Files of their own for a map, the result's own data for realizations."""
        if name in FILES:
            return ZarrBlocks(self.path, name, job)
        return FileBlocks(self.path / "blocks", job)


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
        more = rows - len(self._done)
        if more > 0:
            self._measures = {name: _longer(v, rows) for name, v in self._measures.items()}
            self._status = _longer(self._status, rows)
            self._done = np.append(self._done, np.zeros(more, dtype=bool))
        return self._job.pieces(self._done[:rows])

    def keep(self, block: Block) -> None:
        """Keep a finished block."""
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

    def __init__(self, folder: Path, job: Job) -> None:
        super().__init__(job)
        self._folder = folder
        folder.mkdir(exist_ok=True)

    def prepared(self, number: int, make: Make) -> Prepared:
        """The string of a number, read back if it was prepared before."""
        return stored_string(self._folder, number, make)

    def missing(self, rows: int) -> Pieces:
        """Blocks that neither memory nor the folder has."""
        for first, count in super().missing(rows):
            if (path := self._path(first)).is_file():
                with np.load(path, allow_pickle=False) as held:
                    if len(held["status"]) == count:
                        super().keep(self._read(first, held))
        return super().missing(rows)

    def keep(self, block: Block) -> None:
        """Write a finished block."""
        measures = np.stack([block.measures[name] for name in self._job.measures])
        used = np.array(sorted(block.schemes))
        arrays = {"measures": measures, "status": block.status, "schemes": used}
        write_npz(self._path(block.first), arrays)
        super().keep(block)

    def _path(self, first: int) -> Path:
        return self._folder / f"{first:06d}.npz"

    def _read(self, first: int, held: Any) -> Block:
        measures = dict(zip(self._job.measures, held["measures"], strict=True))
        used = frozenset((float(step), int(modes)) for step, modes in held["schemes"])
        return Block(first, measures, held["status"], used)


class ZarrBlocks:
    """Realizations in a zarr store that grows, a chunk of every array a block."""

    def __init__(self, folder: Path, name: str, job: Realizations) -> None:
        import zarr

        self._path, self._job = folder / FILES[name], job
        self._strings = folder / f"strings-{name}"
        with disk_errors(self._path):
            for left in self._path.rglob("*.partial"):  # of a write that was killed
                left.unlink(missing_ok=True)
            self._group = zarr.open_group(self._path, mode="a", zarr_format=3)
            for measure in job.measures:
                self._array(measure, float, np.nan, {"units": MEASURES[measure].unit})
            flags = {"flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
            self._array("status", np.int8, NOT_RUN, flags)

    def _array(self, name: str, dtype: Any, fill: Any, attributes: dict[str, Any]) -> None:
        if name in self._group:
            return
        shape = shape_of(self._job.axes)
        self._group.create_array(
            name, shape=(0, *shape), chunks=(self._job.block, *shape), dtype=dtype,
            fill_value=fill, compressors=None, attributes=attributes,
            dimension_names=["realization", *(stored_name(a.path) for a in self._job.axes)],
        )  # fmt: skip

    def prepared(self, number: int, make: Make) -> Prepared:
        """The string of a part of the map, read back if it was prepared before."""
        with disk_errors(self._strings):
            self._strings.mkdir(exist_ok=True)
            return stored_string(self._strings, number, make)

    def missing(self, rows: int) -> Pieces:
        """Blocks that the first `rows` realizations still lack; room is made for them."""
        with disk_errors(self._path):
            for name in (*self._job.measures, "status"):
                array = self._group[name]
                if array.shape[0] < rows:
                    array.resize((rows, *array.shape[1:]))
            done = self._group["status"][:rows].reshape(rows, -1)[:, 0] != NOT_RUN
        return self._job.pieces(done)

    def keep(self, block: Block) -> None:
        """Write a finished block."""
        rows = slice(block.first, block.first + len(block.status))
        with disk_errors(self._path):
            for name in (*self._job.measures, "status"):
                array = self._group[name]
                values = block.status if name == "status" else block.measures[name]
                array[rows] = values.reshape((len(values), *array.shape[1:]))

    def read(self, rows: int) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Measures and status of the first `rows` realizations."""
        with disk_errors(self._path):
            measures = {name: self._flat(name, rows) for name in self._job.measures}
            return measures, self._flat("status", rows)

    def _flat(self, name: str, rows: int) -> NDArray[Any]:
        values: NDArray[Any] = self._group[name][:rows]
        return values.reshape(rows, -1)

    @property
    def schemes(self) -> frozenset[Scheme]:
        """None: nothing is held in memory."""
        return frozenset()


@contextmanager
def disk_errors(path: Path) -> Iterator[None]:
    """Failures of the disk, reported with what has become of the run."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise StoreError(
            f"{path}: cannot be written: {reason}; finished blocks are kept, and the same command "
            "goes on from them"
        ) from None


def stored_string(folder: Path, number: int, make: Make) -> Prepared:
    """The string of a number, read back if it was prepared before."""
    path = folder / f"string-{number:06d}.npz"
    if not path.is_file():
        made = make()
        write_npz(path, _string_arrays(made))
        return made
    with np.load(path, allow_pickle=False) as held:
        return _string_from(dict(held))


def _string_arrays(prepared: Prepared) -> dict[str, Any]:
    stepper = prepared.stepper
    fields = {f"kernel.{k}": v for k, v in stepper.string._asdict().items()}
    return fields | {
        "kind": type(stepper.string).__name__,
        **picked(stepper, "angle_to_state", "speed_to_state", "rest"),
        **picked(prepared.scheme, "step", "steps", "modes", "sampling"),
        **picked(prepared, "duration", "j1_from"),
    }


def _string_from(held: dict[str, Any]) -> Prepared:
    from drillctl.simulation.kernels.string_step import BlockString, DenseString, UndampedString

    kinds = {kind.__name__: kind for kind in (UndampedString, BlockString, DenseString)}
    kind = kinds[str(held["kind"])]
    string = kind(**{name: _number(held[f"kernel.{name}"]) for name in kind._fields})
    scheme = StringScheme(
        float(held["step"]), int(held["steps"]), int(held["modes"]), int(held["sampling"])
    )
    to_state = held["angle_to_state"], held["speed_to_state"]
    stepper = StringStep(string, *to_state, held["rest"], scheme.modes, scheme.step)
    return Prepared(stepper, scheme, float(held["duration"]), float(held["j1_from"]))


def _number(array: Any) -> Any:
    return float(array) if array.ndim == 0 else array


def write_npz(path: Path, arrays: dict[str, Any]) -> None:
    """Write beside the target and move: a reader sees a whole file or none."""
    part = path.with_suffix(".part")
    with part.open("wb") as stream:
        np.savez(stream, **arrays)
        stream.flush()
        os.fsync(stream.fileno())
    part.replace(path)
