"""Lanes into measures: every run of many lanes goes through here.

- `collect` runs lanes that were made from a grid, from draws, or from both, and puts what was
  measured of each in its place. It is the one caller of the batch engine.
- A `Job` is more of that than one wants to lose: rows of lanes, any block of which can be
  computed by anyone. `run` has the lacking blocks computed by `Workers` (threads of this
  process, or a dask cluster) and stored as `Blocks` (`storing.py`), from which a
  killed run resumes.

Jobs are the cells of a map (`sweeps.py`) and realizations of a map (`realizations.py`). Draws at
one setting (`draws.py`) and the search of gains call `collect` themselves: their lanes share the
step that the steepest of all draws asks for, where each realization of a job has its own.

On a cluster workers come, go and die. The job, with the strings that were prepared once, goes out
with every block, some tens of kB; what comes back is J1 and status. Nothing that only a worker
holds is needed by another. The scheduler gives the blocks of a worker that died to others. What a
block holds follows from its rows alone, so that it does not matter who computed it, as long as all
processors are of one type.
"""

from __future__ import annotations

import math
import pickle
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array, Index, Mask
from drillctl.errors import InputError, SimulationError
from drillctl.progress import SILENT, Progress
from drillctl.provenance import merged, provenance
from drillctl.simulation.batch import Prepared, run_batch, warm_up
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.measures import BATCH_MEASURES, STATUSES

if TYPE_CHECKING:
    from distributed import Client

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


Steps = Callable[[list[Run], tuple[str, ...], float, Callable[[], Measured]], Measured]
_STEPS: ContextVar[Steps | None] = ContextVar("steps", default=None)


@contextmanager
def kept(steps: Steps | None) -> Iterator[None]:
    """Keep what is collected meanwhile, each time in its turn, so that a search resumes.

    A search asks for the same runs in the same order whenever it begins with the same design: what
    lies between them is computed again, and they are read.
    """
    token = _STEPS.set(steps)
    try:
        yield
    finally:
        _STEPS.reset(token)


def collect(
    runs: Iterable[Run],
    size: int,
    names: tuple[str, ...] = BATCH_MEASURES,
    give_up: float = math.inf,
) -> Measured:
    """Run lanes, and stop those whose J1 passes a level (s)."""
    steps = _STEPS.get()
    if steps is None:
        return _collected(runs, size, names, give_up)
    runs = list(runs)
    return steps(runs, names, give_up, lambda: _collected(runs, size, names, give_up))


def _collected(runs: Iterable[Run], size: int, names: tuple[str, ...], give_up: float) -> Measured:
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
    def of(cls, first: int, width: int, ran: Measured) -> Block:
        """A block from rows that were run."""
        measures = {name: values.reshape(-1, width) for name, values in ran.measures.items()}
        status = ran.status.reshape(-1, width)
        return cls(first, measures, status, ran.schemes, ran.seconds)


Make = Callable[[], Prepared]
Strings = Callable[[int, Make], Prepared]
"""Gives the string of a number as it was first made, that a resumed run has the same bits."""
Pieces = list[tuple[int, int]]  # first row and number of rows of blocks


class Job(Protocol):
    """Rows of lanes that anyone can run, block by block; it goes to workers by pickle."""

    @property
    def width(self) -> int:
        """Lanes of a row."""

    @property
    def measures(self) -> tuple[str, ...]:
        """What is kept of a lane, J1 first."""

    def pieces(self, done: Mask) -> Pieces:
        """Blocks of the rows that are not done."""

    def prepared(self, strings: Strings) -> Self:
        """The job with strings that were prepared once, and its first kernels loaded."""

    def run(self, first: int, count: int) -> Block:
        """Run some rows."""


def pieces(done: Mask, size: int) -> Pieces:
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

    def missing(self, rows: int) -> Pieces:
        """Blocks that the first `rows` rows still lack."""

    def keep(self, block: Block) -> None:
        """Keep a finished block."""

    def read(self, rows: int) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Measures and status of the first `rows` rows, shape (rows, width)."""

    @property
    def schemes(self) -> frozenset[Scheme]:
        """Steps (s) and numbers of modes of the blocks that are held in memory."""


Workers = Callable[[Job, Pieces], Iterator[Block]]
"""Computes the blocks of a job, in whatever order they are finished."""


def this_process(job: Job, pieces: Pieces) -> Iterator[Block]:
    """Blocks one after the other, the lanes of each in threads."""
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
    for block in (workers or this_process)(job, pieces):
        blocks.keep(block)
        lanes += block.seconds
        progress.advance(block.status.size)
        after()
    return Times(lanes, time.perf_counter() - begin)


WAITING = 4  # blocks that each thread of the cluster has before it: none idles, and few are lost
DEATHS = 20  # workers that may die over one block before it is taken to be the block's doing


class Cluster:
    """Blocks on the workers of a dask.distributed cluster."""

    def __init__(self, client: Client, allow_other_machine: bool = False) -> None:
        self._client, self._allow_other_machine = client, allow_other_machine
        self.origin = provenance()  # versions and processors of all workers so far

    def __call__(self, job: Job, pieces: Pieces) -> Iterator[Block]:
        """The blocks, in the order in which they are finished."""
        from distributed import as_completed

        if not pieces:
            return
        for theirs in self._client.run(provenance).values():
            self._refuse_other(theirs)
            self.origin = merged(self.origin, theirs)
        sent = pickle.dumps(job)
        left = iter(pieces)
        running: dict[str, tuple[int, int]] = {}
        deaths: dict[tuple[int, int], int] = {}

        def submit(piece: tuple[int, int]) -> Any:
            future = self._client.submit(_run, sent, *piece, pure=False, retries=DEATHS)
            running[future.key] = piece
            return future

        threads = sum(self._client.nthreads().values())
        started = [submit(piece) for piece in islice(left, WAITING * threads)]
        waiting = as_completed(started, loop=self._client.loop)
        for future in waiting:
            piece = running.pop(future.key)
            error = future.exception()
            if error is None:
                block: Block = future.result()
                self._refuse_other(block.provenance)
                self.origin = merged(self.origin, block.provenance)
                future.release()
                yield block
                more = next(left, None)
            else:
                deaths[piece] = deaths.get(piece, 0) + 1
                _refuse_more(error, deaths[piece])
                more = piece
            if more is not None:
                waiting.add(submit(more))

    def _refuse_other(self, result: dict[str, str]) -> None:
        here = provenance()
        for key, value in here.items():
            if result.get(key) == value or (key != "drillctl" and self._allow_other_machine):
                continue
            hint = "" if key == "drillctl" else " (--allow-other-machine lets it)"
            raise InputError(
                f"a worker has {key} {result.get(key)}, this process {value}: results would differ "
                f"in the last bits{hint}",
                "--scheduler",
            )


@lru_cache(maxsize=4)
def _job(sent: bytes) -> Job:
    """The job, with what a worker derived from it for earlier blocks."""
    result: Job = pickle.loads(sent)
    return result


def _run(sent: bytes, first: int, count: int) -> Block:
    return _job(sent).run(first, count)


def _refuse_more(error: BaseException, times: int) -> None:
    """Let a block be tried again whose workers died; anything else is raised."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker) and times <= DEATHS:
        return
    if isinstance(error, KilledWorker):
        raise SimulationError(f"workers died {times} times over one block: {error}") from None
    raise error


ANSWER = 10.0  # how long a scheduler may take to answer (s)


def connect(address: str) -> Client:
    """A client of a scheduler."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            'needs dask.distributed: pip install "drillctl[distributed]"', "--scheduler"
        ) from None

    class Connected(Client):
        def __init__(self) -> None:
            try:
                super().__init__(address, timeout=ANSWER, set_as_default=False)
            except BaseException:
                self.status = "closed"  # or its end would wait for an answer, and complain
                raise

    try:
        return Connected()
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{address} does not answer: {error}", "--scheduler") from None
    except Exception as error:  # what the words of another server are taken for, such as a length
        raise InputError(f"{address} is no scheduler: {error}", "--scheduler") from error
