"""Where finished blocks of realizations are kept."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from drillctl.simulation.batch import Prepared
from drillctl.studies.uncertainty.job import Block

Array = NDArray[np.float64]

LANES = 2**17
"""Lanes of a block: some seconds' work at most."""
MOST = 4096
"""Realizations of a block at most."""


class Keeping(Protocol):
    """Finished realizations, and the strings they were computed with."""

    def prepared(self, number: int, prepare: Callable[[], Prepared]) -> Prepared:
        """The string of a part of the map as it was first prepared."""
        ...

    def missing(self, count: int) -> list[tuple[int, int]]:
        """Blocks, as (first, count), that the first `count` realizations still lack."""
        ...

    def keep(self, block: Block) -> None:
        """Keep a finished block."""
        ...

    def read(self, count: int) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Measures and status of the first `count` realizations, shape (count, cells)."""
        ...


def block_size(cells: int) -> int:
    """Realizations of a block."""
    return min(max(1, LANES // cells), MOST)


def pieces(done: NDArray[np.bool_], size: int) -> list[tuple[int, int]]:
    """What is not done, as (first, count), cut at multiples of the size of a block."""
    found = []
    for begin in range(0, len(done), size):
        lacking = np.flatnonzero(~done[begin : begin + size])
        if lacking.size:  # from the first that is lacking on: those behind it lack with it
            found.append((begin + int(lacking[0]), int(lacking[-1] - lacking[0] + 1)))
    return found


class InMemory:
    """For runs that live in memory only."""

    def __init__(self, cells: int, measures: tuple[str, ...]) -> None:
        self._cells, self._measures = cells, measures
        self._blocks: dict[int, Block] = {}

    def prepared(self, number: int, prepare: Callable[[], Prepared]) -> Prepared:
        """Prepared afresh."""
        return prepare()

    def missing(self, count: int) -> list[tuple[int, int]]:
        """Blocks that the first `count` realizations still lack."""
        done = np.zeros(count, dtype=bool)
        for first, block in self._blocks.items():
            done[first : first + len(block.status)] = True
        return pieces(done, block_size(self._cells))

    def keep(self, block: Block) -> None:
        """Keep a finished block."""
        self._blocks[block.first] = block

    def read(self, count: int) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Measures and status of the first `count` realizations."""
        blocks = [self._blocks[first] for first in sorted(self._blocks)]
        measures = {
            name: np.concatenate([block.measures[name] for block in blocks])[:count]
            for name in self._measures
        }
        return measures, np.concatenate([block.status for block in blocks])[:count]
