"""Clocks, and runs in turn: what is compared is measured in the same minutes."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.job import Array, Job
from benchmarks.peers import Peer

SLOW = 1.0
"""A peer whose call takes longer (s) is let off after `FEWEST` calls, each cell's done once."""
FEWEST = 3


@dataclass(frozen=True, eq=False)
class Call:
    """One timed call.

    Attributes
    ----------
    seconds : float
        On the wall.
    core_seconds : float
        Processor time, of all threads: what others take of the machine is not in it.
    value : object
        What it returned.
    """

    seconds: float
    core_seconds: float
    value: Any


def timed(function: Callable[[], Any]) -> Call:
    """Call a function with the collector of garbage at rest and BLAS on one core."""
    gc.collect()
    gc.disable()
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            begin, used = time.perf_counter(), time.process_time()
            value = function()
            seconds = time.perf_counter() - begin
            used = time.process_time() - used
    finally:
        gc.enable()
    return Call(seconds, used, value)


@dataclass(eq=False)
class Timed:
    """A peer and its calls so far."""

    peer: Peer
    calls: list[Call] = field(default_factory=list)
    of_cells: dict[tuple[int, ...], list[Call]] = field(default_factory=dict)
    j1: dict[int, float] = field(default_factory=dict)

    @property
    def done(self) -> bool:
        """Whether a slow peer has done enough."""
        slow = self.calls and max(call.seconds for call in self.calls) > SLOW
        return bool(slow) and len(self.calls) >= max(FEWEST, len(self.peer.jobs))

    def run(self, round_: int) -> None:
        cells = self.peer.jobs[round_ % len(self.peer.jobs)]
        call = timed(lambda: self.peer.run(cells))
        self.calls.append(call)
        self.of_cells.setdefault(cells, []).append(call)
        self.j1.update(zip(cells, (float(v) for v in call.value), strict=True))


def interleave(
    peers: list[Peer], rounds: int, told: Callable[[str], None] = lambda text: None
) -> list[Timed]:
    """Round after round every peer once, in an order that turns; slow ones a few times."""
    rows = [Timed(peer) for peer in peers]
    for round_ in range(rounds):
        first = round_ % len(rows)
        for row in rows[first:] + rows[:first]:
            if not row.done:
                row.run(round_)
                told(f"round {round_ + 1}: {row.peer.name} {row.calls[-1].seconds:.3f} s")
    return rows


def in_turn(jobs: dict[Any, Callable[[], Any]], repeats: dict[Any, int]) -> dict[Any, list[Call]]:
    """Calls of each job, all taken in turn, some more often than others."""
    calls: dict[Any, list[Call]] = {name: [] for name in jobs}
    for round_ in range(max(repeats.values())):
        for name, job in jobs.items():
            if round_ < repeats[name]:
                calls[name].append(timed(job))
    return calls


def row_of(row: Timed, job: Job, machine_cores: int) -> dict[str, Any]:
    """What the table shows of a peer, by name.

    All seconds are of one trajectory, medians over rounds and then over cells. `core_s`: processor
    time. `as_run_s`: on the clock, with the cores that the row has. `low_s`, `high_s`: range of
    that over all calls. `machine_s`: on the clock with all cores busy; a peer of one core is taken
    to run on all of them without loss. `j1_error`: worst relative one over the cells whose J1 is
    known: simulated, and not given up on the way.
    """
    as_run, core = (_median(row, attribute) for attribute in ("seconds", "core_seconds"))
    every = [c.seconds / len(cells) for cells, calls in row.of_cells.items() for c in calls]
    known = np.array([
        [row.j1[c], job.exact[c]] for c in job.cells if np.isfinite(row.j1.get(c, np.nan))
    ])  # fmt: skip
    return {
        "name": row.peer.name,
        "solves": row.peer.solves,
        "cores": row.peer.cores,
        "cores_used": statistics.median(c.core_seconds / c.seconds for c in row.calls),
        "trajectories_a_call": len(row.peer.jobs[0]),
        "calls": len(row.calls),
        "as_run_s": as_run,
        "low_s": min(every),
        "high_s": max(every),
        "core_s": core,
        "machine_s": as_run * row.peer.cores / machine_cores,
        "j1_error": worst_error(known),
        "cells_compared": len(known),
    }


def _median(row: Timed, attribute: str) -> float:
    """Of a trajectory: over calls, then over cells."""
    return statistics.median(
        statistics.median(getattr(call, attribute) for call in calls) / len(cells)
        for cells, calls in row.of_cells.items()
    )


def worst_error(known: Array) -> float:
    """Largest relative error; rows of J1 and its exact value."""
    return float(np.abs(known[:, 0] / known[:, 1] - 1.0).max())
