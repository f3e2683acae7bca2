"""Cells of a grid simulated as they are asked for, by the batch engine."""

from __future__ import annotations

import time
from functools import partial

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.progress import SILENT, Progress
from drillctl.simulation.batch import CHUNK, FLOATS, Batch, Prepared, prepare, run_batch, warm_up
from drillctl.simulation.lanes import Lanes
from drillctl.studies.blocks import Blocks, KeepNothing
from drillctl.studies.grid import Axis, Group, groups, shape_of

Array = NDArray[np.float64]
Cells = NDArray[np.int64]


class ChosenCells:
    """The lanes of a grid, simulated when they are asked for.

    A cell has the same bits as in a sweep of the whole grid: string, step and modes are those of
    all its lanes.
    """

    def __init__(
        self,
        design: Design,
        axes: tuple[Axis, ...],
        progress: Progress = SILENT,
        blocks: Blocks | None = None,
    ) -> None:
        self.seconds = 0.0
        self._progress = progress
        self._blocks = blocks or KeepNothing()
        self._groups: list[Group] = list(groups(design, axes))
        self._prepared: dict[int, Prepared] = {}
        self._warm: set[tuple[type, ...]] = set()
        self._block = 0
        count = int(np.prod(shape_of(axes), dtype=int))
        self._group = np.empty(count, dtype=np.int32)
        self._lane = np.empty(count, dtype=np.int64)
        for number, group in enumerate(self._groups):
            lanes = np.arange(len(group))
            cells = group.cells_of(lanes)
            self._group[cells], self._lane[cells] = number, lanes

    @property
    def scheme(self) -> tuple[float, int] | tuple[None, None]:
        """Step and modes, if they were the same in all that was simulated."""
        found = {(made.scheme.step, made.scheme.modes) for made in self._prepared.values()}
        return next(iter(found)) if len(found) == 1 else (None, None)

    def simulate(self, cells: Cells) -> Batch:
        """Simulate cells."""
        measures = {name: np.full(len(cells), np.nan) for name in FLOATS}
        status = np.empty(len(cells), dtype=np.int8)
        numbers = [int(number) for number in np.unique(self._group[cells])]
        strings = [self._ready(number) for number in numbers]
        self._progress.begin("simulating lanes", len(cells))
        for number, prepared in zip(numbers, strings, strict=True):
            mine = np.flatnonzero(self._group[cells] == number)
            for first in range(0, len(mine), CHUNK):
                part = mine[first : first + CHUNK]
                lanes = self._groups[number].some(self._lane[cells[part]])
                batch = self._block_of(lanes, prepared)
                for name, values in batch.measures.items():
                    measures[name][part] = values
                status[part] = batch.status
                self._progress.advance(len(part))
        return Batch(measures, status)

    def _block_of(self, lanes: Lanes, prepared: Prepared) -> Batch:
        """The next block: found, if it was finished before, or simulated."""
        batch = self._blocks.find(self._block)
        if batch is None:
            begin = time.perf_counter()
            batch = run_batch(lanes, prepared)
            self.seconds += time.perf_counter() - begin
            self._blocks.keep(self._block, batch)
        self._block += 1
        return batch

    def _ready(self, number: int) -> Prepared:
        """The string of a group, prepared when its first lane is asked for."""
        if number not in self._prepared:
            group = self._groups[number]
            table = group.design.tables.simulation
            lanes = group.telling
            made = self._blocks.prepared(number, partial(prepare, lanes, table))
            kind = tuple(
                map(type, (made.stepper.string, lanes.friction, lanes.drive, lanes.weight))
            )
            if kind not in self._warm:  # another kind of string or law takes another kernel
                self._warm.add(kind)
                self._progress.begin("loading kernels", 1)
                warm_up(lanes, made)
            self._prepared[number] = made
        return self._prepared[number]
