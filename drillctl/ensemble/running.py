"""Lanes into measures: every run of many lanes goes through here.

- `collect` runs lanes that were made from a grid, from draws, or from both, and puts what was
  measured of each in its place. It is the one caller of the batch engine.
- A `Job` is more of that than one wants to lose: rows of lanes, any block of which can be
  computed by anyone. `run` has the lacking blocks computed by `Workers` (threads of this
  process here, a cluster in `cluster.py`) and stored as `Blocks` (`storing.py`), from which a
  killed run resumes.

Jobs are the cells of a map (`sweeps.py`) and realizations of a map (`realizations.py`). Draws at
one setting (`draws.py`) and the search of gains call `collect` themselves: their lanes share the
step that the steepest of all draws asks for, where each realization of a job has its own.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from drillctl.progress import SILENT, Progress
from drillctl.provenance import provenance
from drillctl.simulation.batch import Prepared, run_batch, warm_up
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.measures import BATCH_MEASURES, STATUSES

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Scheme = tuple[float, int]

FAILED = STATUSES.index("failed")


class Run(NamedTuple):
    """Lanes that run together."""

    lanes: Lanes
    prepared: Prepared  # their string and scheme
    at: Index  # shape (lanes,): Where the results of each lane go


@dataclass(frozen=True, eq=False)
class Measured:
    """What was measured of any number of lanes."""

    # shape (size,): By the names of `BATCH_MEASURES`; NaN where undefined
    measures: dict[str, Array]
    status: NDArray[np.int8]  # shape (size,): Index into `STATUSES`; `failed` where nothing ran
    schemes: frozenset[Scheme]  # steps (s) and numbers of modes that were used
    seconds: float  # spent in the lanes alone, their kernels loaded


def collect(
    runs: Iterable[Run],
    size: int,
    names: tuple[str, ...] = BATCH_MEASURES,
    give_up: float = math.inf,
) -> Measured:
    """Run lanes, and stop those whose J1 passes a level (s)."""
    measures = {name: np.full(size, np.nan) for name in names}
    status = np.full(size, FAILED, dtype=np.int8)
    schemes, seconds = set[Scheme](), 0.0
    for lanes, prepared, at in runs:
        load_kernel(lanes, prepared)
        begin = time.perf_counter()
        batch = run_batch(lanes, prepared, give_up)
        seconds += time.perf_counter() - begin
        for name, values in measures.items():
            values[at] = batch.measures[name]
        status[at] = batch.status
        schemes.add((prepared.scheme.step, prepared.scheme.modes))
    return Measured(measures, status, frozenset(schemes), seconds)


def measured(
    lanes: Lanes,
    prepared: Prepared,
    names: tuple[str, ...] = BATCH_MEASURES,
    give_up: float = math.inf,
) -> Measured:
    """Run lanes that share a string; see `collect`."""
    return collect([Run(lanes, prepared, np.arange(len(lanes)))], len(lanes), names, give_up)


_loaded: set[tuple[type, ...]] = set()


def load_kernel(lanes: Lanes, prepared: Prepared) -> None:
    """Compile the kernel of such lanes, or read it from disk, once in a process."""
    laws = (lanes.friction, lanes.before, lanes.drive, lanes.weight, lanes.observer)
    kind = (type(prepared.stepper.string), *(type(law) for law in laws))
    if kind not in _loaded:
        warm_up(lanes, prepared)
        _loaded.add(kind)


@dataclass(frozen=True, eq=False)
class Block:
    """What was measured of some rows of a job."""

    first: int  # number of the first row
    # shape (rows, width): By the names of `BATCH_MEASURES`; NaN where undefined
    measures: dict[str, Array]
    status: NDArray[np.int8]  # shape (rows, width): Index into `STATUSES`
    schemes: frozenset[Scheme] = frozenset()
    seconds: float = 0.0  # spent in the lanes alone
    provenance: dict[str, str] = field(default_factory=provenance)  # where it was computed

    @classmethod
    def of(cls, first: int, width: int, found: Measured) -> Block:
        """A block from rows that were run."""
        measures = {name: values.reshape(-1, width) for name, values in found.measures.items()}
        status = found.status.reshape(-1, width)
        return cls(first, measures, status, found.schemes, found.seconds)


Make = Callable[[], Prepared]
Strings = Callable[[int, Make], Prepared]
"""Gives the string of a number as it was first made, that a resumed run has the same bits."""
Pieces = list[tuple[int, int]]  # first row and number of rows of blocks


class Job(Protocol):
    """Rows of lanes that anyone can run, block by block; it goes to workers by pickle."""

    @property
    def width(self) -> int:
        """Lanes of a row."""
        ...

    @property
    def measures(self) -> tuple[str, ...]:
        """What is kept of a lane, J1 first."""
        ...

    def pieces(self, done: NDArray[np.bool_]) -> Pieces:
        """Blocks of the rows that are not done."""
        ...

    def prepared(self, strings: Strings) -> Self:
        """The job with strings that were prepared once, and its first kernels loaded."""
        ...

    def run(self, first: int, count: int) -> Block:
        """Run some rows."""
        ...


def pieces(done: NDArray[np.bool_], size: int) -> Pieces:
    """Rows that are not done, cut at multiples of the size of a block."""
    results = []
    for begin in range(0, len(done), size):
        lacking = np.flatnonzero(~done[begin : begin + size])
        if lacking.size:  # from the first that is lacking on: those behind it lack with it
            results.append((begin + int(lacking[0]), int(lacking[-1] - lacking[0] + 1)))
    return results


class Blocks(Protocol):
    """Finished blocks of a job, and the strings that they were computed with."""

    def prepared(self, number: int, make: Make) -> Prepared:
        """The string of a number as it was first prepared."""
        ...

    def missing(self, rows: int) -> Pieces:
        """Blocks that the first `rows` rows still lack."""
        ...

    def keep(self, block: Block) -> None:
        """Keep a finished block."""
        ...

    def read(self, rows: int) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Measures and status of the first `rows` rows, shape (rows, width)."""
        ...

    @property
    def schemes(self) -> frozenset[Scheme]:
        """Steps (s) and numbers of modes of the blocks that are held in memory."""
        ...


class Workers(Protocol):
    """Who computes blocks."""

    def blocks(self, job: Job, pieces: Pieces) -> Iterator[Block]:
        """The blocks of a job, in whatever order they are finished."""
        ...


class ThisProcess:
    """Blocks one after the other, the lanes of each in threads."""

    def blocks(self, job: Job, pieces: Pieces) -> Iterator[Block]:
        """The blocks in order."""
        for first, count in pieces:
            yield job.run(first, count)


class Times(NamedTuple):
    """What blocks took (s)."""

    lanes: float  # in the lanes alone, added up over workers
    total: float  # on the clock, strings and storing included


def run(
    job: Job,
    rows: int,
    blocks: Blocks,
    workers: Workers | None = None,
    progress: Progress = SILENT,
    after: Callable[[], None] = lambda: None,
) -> Times:
    """Compute what the first rows of a job still lack."""
    begin, lanes = time.perf_counter(), 0.0
    pieces = blocks.missing(rows)
    progress.begin("simulating lanes", rows * job.width)
    progress.advance((rows - sum(count for _, count in pieces)) * job.width)
    for block in (workers or ThisProcess()).blocks(job, pieces):
        blocks.keep(block)
        lanes += block.seconds
        progress.advance(block.status.size)
        after()
    return Times(lanes, time.perf_counter() - begin)
