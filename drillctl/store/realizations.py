"""Realizations of a study on disk: a zarr store that grows block by block.

A chunk of every array holds the realizations of a block and is written beside its place and
moved there. The status goes last: a realization counts as done once its status is there, so that
a run killed at any moment has lost a block at most.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.grid import shape_of
from drillctl.ensemble.sweeps import UNITS
from drillctl.errors import StoreError
from drillctl.simulation.batch import Prepared
from drillctl.simulation.measures import STATUSES
from drillctl.store.blocks import FolderBlocks
from drillctl.store.names import stored_name
from drillctl.studies.uncertainty import Uncertainty
from drillctl.studies.uncertainty.job import Block, Drawn, Job
from drillctl.studies.uncertainty.keeping import block_size, pieces
from drillctl.studies.uncertainty.labels import dataset, lanes

Array = NDArray[np.float64]

NOT_RUN = -1
"""Status of a lane that was not run yet."""
FILES = {"realizations": "data.zarr", "sensitivity": "sensitivity.zarr"}
"""Where the parts of a study are, in the folder of its run."""


class StoredRealizations:
    """Finished blocks in a zarr store; see `studies.uncertainty.keeping.Keeping`."""

    def __init__(self, folder: Path, name: str, job: Job) -> None:
        import zarr

        self._path, self._job = folder / FILES[name], job
        self._strings = folder / f"strings-{name}"
        with _told(self._path):
            for left in self._path.rglob("*.partial"):  # of a write that was killed
                left.unlink(missing_ok=True)
            self._group = zarr.open_group(self._path, mode="a", zarr_format=3)
            for measure in job.measures:
                self._array(measure, float, np.nan, {"units": UNITS[measure]})
            flags = {"flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
            self._array("status", np.int8, NOT_RUN, flags)

    def _array(self, name: str, dtype: Any, fill: Any, attributes: dict[str, Any]) -> None:
        if name in self._group:
            return
        shape = shape_of(self._job.axes)
        self._group.create_array(
            name, shape=(0, *shape), chunks=(block_size(self._job.cells), *shape), dtype=dtype,
            fill_value=fill, compressors=None, attributes=attributes,
            dimension_names=["realization", *(stored_name(a.path) for a in self._job.axes)],
        )  # fmt: skip

    def prepared(self, number: int, prepare: Callable[[], Prepared]) -> Prepared:
        """The string of a part of the map, read back if it was prepared before."""
        with _told(self._strings):
            self._strings.mkdir(exist_ok=True)
            return FolderBlocks(self._strings).prepared(number, prepare)

    def missing(self, count: int) -> list[tuple[int, int]]:
        """Blocks that the first `count` realizations still lack; room is made for them."""
        with _told(self._path):
            for name in (*self._job.measures, "status"):
                array = self._group[name]
                if array.shape[0] < count:
                    array.resize((count, *array.shape[1:]))
            status = self._group["status"]
            done = status[:count].reshape(count, -1)[:, 0] != NOT_RUN
        return pieces(done, status.chunks[0])

    def keep(self, block: Block) -> None:
        """Write a finished block."""
        rows = slice(block.first, block.first + len(block.status))
        with _told(self._path):
            for name in (*self._job.measures, "status"):
                array = self._group[name]
                values = block.status if name == "status" else block.measures[name]
                array[rows] = values.reshape((len(values), *array.shape[1:]))

    def read(self, count: int) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Measures and status of the first `count` realizations."""
        with _told(self._path):
            measures = {name: self._flat(name, count) for name in self._job.measures}
            return measures, self._flat("status", count)

    def _flat(self, name: str, count: int) -> NDArray[Any]:
        values: NDArray[Any] = self._group[name][:count]
        return values.reshape(count, -1)


class FolderShelf:
    """The parts of a study in the folder of its run."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def keeping(self, name: str, job: Job) -> StoredRealizations:
        """The store of one part."""
        return StoredRealizations(self._folder, name, job)


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Failures of the disk, told with what has become of the run."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise StoreError(
            f"{path}: cannot be written: {reason}; finished blocks are kept, and the same command "
            "goes on from them"
        ) from None


def write_uncertainty(result: Uncertainty, folder: Path) -> None:
    """Write a study under uncertainty: lanes that are not there yet, and what follows from them."""
    import zarr

    job = Job(result.design, result.axes, Drawn(result.seed), tuple(result.measures), None)
    stored = StoredRealizations(folder, "realizations", job)
    size = block_size(job.cells)
    for first, count in stored.missing(result.realizations):
        for begin in range(first, first + count, size):
            rows = slice(begin, min(begin + size, first + count))
            flat = {k: v[rows].reshape(-1, job.cells) for k, v in result.measures.items()}
            status = result.status[rows].reshape(-1, job.cells)
            stored.keep(Block(begin, flat, status, result.provenance))
    path = folder / FILES["realizations"]
    own = set(lanes(result))
    with _told(path):
        group = zarr.open_group(path, mode="a")
        for name in list(group.array_keys()):
            if name not in own:  # of fewer realizations
                del group[name]
        data = dataset(result).drop_vars(own)
        names = {str(n): stored_name(str(n)) for n in (*data.variables, *data.dims)}
        data.rename(names).to_zarr(path, mode="a", consolidated=False)
