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
"""A peer whose call takes longer (s) does each of its calls once, others once a round."""


@dataclass(frozen=True, eq=False)
class Call:
    """One timed call.

    Attributes
    ----------
    seconds : float
        On the wall.
    cores : float
        Processor time over that: cores that were really used.
    value : object
        What it returned.
    """

    seconds: float
    cores: float
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
    return Call(seconds, used / seconds, value)


@dataclass(eq=False)
class Timed:
    """A peer and its calls so far."""

    peer: Peer
    calls: list[Call] = field(default_factory=list)
    costs: dict[tuple[int, ...], list[float]] = field(default_factory=dict)
    j1: dict[int, float] = field(default_factory=dict)

    @property
    def done(self) -> bool:
        """Whether a slow peer has done all its calls."""
        slow = self.calls and max(call.seconds for call in self.calls) > SLOW
        return bool(slow) and len(self.calls) >= len(self.peer.jobs)

    def run(self, round_: int) -> None:
        cells = self.peer.jobs[round_ % len(self.peer.jobs)]
        call = timed(lambda: self.peer.run(cells))
        self.calls.append(call)
        self.costs.setdefault(cells, []).append(call.seconds / len(cells))
        self.j1.update(zip(cells, (float(v) for v in call.value), strict=True))


def interleave(
    peers: list[Peer], rounds: int, told: Callable[[str], None] = lambda text: None
) -> list[Timed]:
    """Round after round every peer once, in an order that turns; slow ones each call once."""
    rows = [Timed(peer) for peer in peers]
    for round_ in range(rounds):
        first = round_ % len(rows)
        for row in rows[first:] + rows[:first]:
            if not row.done:
                row.run(round_)
                told(f"round {round_ + 1}: {row.peer.name} {row.calls[-1].seconds:.3f} s")
    return rows


def in_turn(jobs: dict[Any, Callable[[], Any]], repeats: dict[Any, int]) -> dict[Any, list[float]]:
    """Seconds of each job, all taken in turn, some more often than others."""
    seconds: dict[Any, list[float]] = {name: [] for name in jobs}
    for round_ in range(max(repeats.values())):
        for name, job in jobs.items():
            if round_ < repeats[name]:
                seconds[name].append(timed(job).seconds)
    return seconds


def row_of(row: Timed, job: Job, machine_cores: int) -> dict[str, Any]:
    """What the table shows of a peer, by name.

    `one_core_s`: seconds of one core that a trajectory takes, median over cells and rounds.
    `machine_s`: the same of the whole machine. A peer of one core is taken to run on all cores
    at once without loss. `as_run_s`: seconds on the wall over trajectories, with the cores that
    the row has. `low_s`, `high_s`: range of the last over all calls. `j1_error`: worst relative
    one over the cells whose J1 is known.
    """
    medians = [statistics.median(costs) for costs in row.costs.values()]
    every = [cost for costs in row.costs.values() for cost in costs]
    as_run, cores = statistics.median(medians), row.peer.cores
    known = np.array([[row.j1[c], job.exact[c]] for c in job.cells if c in row.j1])
    return {
        "name": row.peer.name,
        "solves": row.peer.solves,
        "cores": cores,
        "cores_used": statistics.median(call.cores for call in row.calls),
        "trajectories_a_call": len(row.peer.jobs[0]),
        "calls": len(row.calls),
        "as_run_s": as_run,
        "low_s": min(every),
        "high_s": max(every),
        "one_core_s": as_run * cores,
        "machine_s": as_run * cores / machine_cores,
        "j1_error": worst_error(known),
        "cells_compared": len(known),
    }


def worst_error(known: Array) -> float:
    """Largest relative error; rows of J1 and its exact value."""
    return float(np.abs(known[:, 0] / known[:, 1] - 1.0).max())
