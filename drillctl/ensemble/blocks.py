"""Where the finished blocks of a long run are kept, so that a killed run can go on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from drillctl.simulation.batch import Batch, Prepared


class Blocks(Protocol):
    """Finished blocks, and the strings they were computed with, by number."""

    def prepared(self, number: int, prepare: Callable[[], Prepared]) -> Prepared:
        """The string of a group as it was first prepared: a resumed run takes the same bits."""
        ...

    def find(self, number: int) -> Batch | None:
        """The block if it was finished before."""
        ...

    def keep(self, number: int, batch: Batch) -> None:
        """Keep a finished block."""
        ...


class KeepNothing:
    """For runs that live in memory only."""

    def prepared(self, number: int, prepare: Callable[[], Prepared]) -> Prepared:
        """Prepared afresh."""
        return prepare()

    def find(self, number: int) -> Batch | None:
        """Nothing was finished before."""
        return None

    def keep(self, number: int, batch: Batch) -> None:
        """The block is not kept."""
