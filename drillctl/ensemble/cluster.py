"""Blocks of realizations on dask.distributed: many machines, workers that come, go and die.

The job, with the strings that were prepared once, goes out with every block, some tens of kB;
what comes back is J1 and status. Nothing that only a worker holds is needed by another. The
scheduler gives the blocks of a worker that died to others. What a block holds follows from its
realizations alone, so that it does not matter who computed it, as long as all processors are of
one type.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING, Any

from drillctl.ensemble.running import Block, Job, Pieces
from drillctl.errors import InputError, SimulationError
from drillctl.provenance import provenance

if TYPE_CHECKING:
    from distributed import Client

WAITING = 4  # blocks that each thread of the cluster has before it: none idles, and few are lost
DEATHS = 20  # workers that may die over one block before it is taken to be the block's doing


class Cluster:
    """Blocks on the workers of a dask.distributed cluster."""

    def __init__(self, client: Client, allow_mixed: bool = False) -> None:
        self._client, self._allow_mixed = client, allow_mixed

    def blocks(self, job: Job, pieces: Pieces) -> Iterator[Block]:
        """The blocks, in the order in which they are finished."""
        from distributed import as_completed

        if not pieces:
            return
        for found in self._client.run(provenance).values():
            self._refuse_other(found)
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
            if result.get(key) == value or (key == "processor" and self._allow_mixed):
                continue
            hint = " (--allow-mixed lets it)" if key == "processor" else ""
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
    """Let a block be tried again whose workers died; anything else is told."""
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
    try:
        return Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{address} does not answer: {error}", "--scheduler") from None
