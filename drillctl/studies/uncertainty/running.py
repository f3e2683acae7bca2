"""The lacking blocks of a run, one after the other, by whoever works."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Protocol

from drillctl.progress import SILENT, Progress
from drillctl.studies.uncertainty.job import Block, Job
from drillctl.studies.uncertainty.keeping import Keeping


class Workers(Protocol):
    """Who computes blocks."""

    def blocks(self, job: Job, pieces: list[tuple[int, int]]) -> Iterator[Block]:
        """The blocks of a job, in whatever order they are finished."""
        ...


class ThisProcess:
    """Blocks one after the other, the lanes of each in threads."""

    def blocks(self, job: Job, pieces: list[tuple[int, int]]) -> Iterator[Block]:
        """The blocks in order."""
        for first, count in pieces:
            yield job.run(first, count)


def run(
    job: Job,
    count: int,
    kept: Keeping,
    workers: Workers,
    progress: Progress = SILENT,
    after: Callable[[], None] = lambda: None,
) -> float:
    """Compute what the first `count` realizations still lack."""
    begin = time.perf_counter()
    pieces = kept.missing(count)
    lacking = sum(size for _, size in pieces)
    progress.begin("simulating lanes", count * job.cells)
    progress.advance((count - lacking) * job.cells)
    for block in workers.blocks(job, pieces):
        kept.keep(block)
        progress.advance(block.status.size)
        after()
    return time.perf_counter() - begin
