"""A block of realizations as work for anyone: this process or a worker elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.design.validation import validated
from drillctl.ensemble.draws import beyond_the_table
from drillctl.ensemble.grid import Axis, parts, shape_of
from drillctl.ensemble.parameters import drawing
from drillctl.provenance import provenance
from drillctl.simulation.batch import Prepared, prepare, warm_up
from drillctl.simulation.lanes import lane_numbers, lanes_of
from drillctl.simulation.measures import STATUSES
from drillctl.studies.uncertainty.engine import simulate
from drillctl.studies.uncertainty.realizations import PartOfMap
from drillctl.studies.uncertainty.strings import Strings

Array = NDArray[np.float64]

FAILED = STATUSES.index("failed")


Drawing = Callable[[int, int], dict[str, Array]]


class Source(Protocol):
    """Where the values of realizations come from."""

    def drawing(self, design: Design) -> Drawing:
        """A function of count and first: values of what is uncertain (SI), (count,), by path."""
        ...


@dataclass(frozen=True)
class Drawn:
    """Realizations drawn as the design says."""

    seed: int  # what they follow from

    def drawing(self, design: Design) -> Drawing:
        """Draws by their numbers."""
        drawn = drawing(design, self.seed)
        return lambda count, first: drawn(count, first).values


@dataclass(frozen=True, eq=False)
class Listed:
    """Realizations given one by one."""

    columns: dict[str, Array]  # shape (realizations,): Values (SI) by path

    def drawing(self, design: Design) -> Drawing:
        """Rows by their numbers."""
        return lambda count, first: {
            path: column[first : first + count] for path, column in self.columns.items()
        }


@dataclass(frozen=True, eq=False)
class Block:
    """What was measured of some realizations."""

    first: int  # number of the first of them
    # shape (realizations, cells): By the names of `simulation.batch.FLOATS`; NaN where undefined
    measures: dict[str, Array]
    # shape (realizations, cells): Index into `simulation.measures.STATUSES`
    status: NDArray[np.int8]
    provenance: dict[str, str]  # versions and processor it came from


@dataclass(frozen=True, eq=False)
class Job:
    """Realizations of a design over a map; any block of them is work for anyone."""

    design: Design  # with what is uncertain, named or by default
    axes: tuple[Axis, ...]  # of the map
    source: Source  # of the realizations
    measures: tuple[str, ...]  # what is kept of a lane, J1 first
    # level (s) from which on a lane need not be known; None for all to their end
    censor: float | None
    # strings of the design itself by part of the map, prepared once and shipped
    strings: dict[int, Prepared] = field(default_factory=dict)

    def __getstate__(self) -> dict[str, Any]:
        # What is derived is derived again by whoever takes the job.
        return {name: getattr(self, name) for name in self.__dataclass_fields__}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    @property
    def cells(self) -> int:
        """Cells of the map."""
        return int(np.prod(shape_of(self.axes), dtype=int))

    def run(self, first: int, count: int) -> Block:
        """Simulate some realizations at every cell."""
        values = self._drawn(count, first)
        shape = (count, self.cells)
        measures = {name: np.full(shape, np.nan) for name in self.measures}
        status = np.full(shape, FAILED, dtype=np.int8)
        for part in self._parts:
            for lanes, ready, rows, cells in part.runs(values):
                batch = simulate(lanes, ready, self.censor)
                for name, kept in measures.items():
                    kept[rows, cells] = batch.measures[name]
                status[rows, cells] = batch.status
        return Block(first, measures, status, provenance())

    @cached_property
    def _drawn(self) -> Drawing:
        return self.source.drawing(self.design)

    @cached_property
    def _parts(self) -> list[PartOfMap]:
        paths = tuple(self._drawn(1, 0))
        design = beyond_the_table(_rig(self.design), paths)
        found = [PartOfMap(part, paths, Strings()) for part in parts(design, self.axes)]
        for number, prepared in self.strings.items():
            _give(found[number], prepared)
        return found

    def prepare(self, kept: Callable[[int, Callable[[], Prepared]], Prepared]) -> Job:
        """The job with the strings of the design itself, and its kernels loaded."""
        strings = {}
        warm: set[Any] = set()
        for number, part in enumerate(self._parts):
            like = part.first
            lanes = lanes_of(like, part.nominal)
            ready = kept(number, partial(prepare, lanes, like.tables.simulation))
            kind = (type(ready.stepper.string), type(lanes.drive), type(lanes.weight))
            if kind not in warm:
                warm.add(kind)
                warm_up(lanes, ready)
            if not part.own_strings:
                strings[number] = ready
        return Job(self.design, self.axes, self.source, self.measures, self.censor, strings)


STUDIES = ("map", "uncertain", "uncertainty", "compare", "weight_delay", "tune", "advantage")
"""Tables of a design that say what is to be computed of a rig, not what it is."""


def _rig(design: Design) -> Design:
    """The design without them: thousands of variants are validated, samples and all."""
    tree = {key: table for key, table in design.tree.items() if key not in STUDIES}
    return Design(design.name, validated(tree, design.origin), tree, design.origin)


def _give(part: PartOfMap, prepared: Prepared) -> None:
    lanes = lanes_of(part.first, part.nominal)
    key = part.string_key(part.first, lane_numbers(part.first))
    part.strings.give(key, lanes.steepest_fall, prepared)
