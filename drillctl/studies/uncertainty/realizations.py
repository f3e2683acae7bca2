"""Realizations of a design over the cells of a map, as lanes of the batch engine.

What a realization changes in a lane is resolved once, at the first cell of the map; what a cell
changes is resolved once for all realizations. A lane has the numbers of both. That this is so is
checked at the last cell for every realization; where it is not, or where a rig is impossible at
some cells only, each cell is resolved by itself.
"""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.design.tables import SimulationTable
from drillctl.ensemble.grid import SHARED, Axis, Part, cell_numbers, replaced
from drillctl.errors import InputError
from drillctl.simulation.batch import Prepared, prepare
from drillctl.simulation.lanes import Lanes, kinds, lane_numbers, lanes_of
from drillctl.studies.uncertainty.strings import Strings

Array = NDArray[np.float64]

TIMED = ("speed_program.begin", "speed_program.end", "weight_program.begin",
         "weight_program.end", "speed_program.first", "weight_program.first", "rock_until",
         "drive.period")  # fmt: skip
"""Numbers of a lane that the moments at which steps end follow from."""


class Run(NamedTuple):
    """Lanes that run together."""

    lanes: Lanes  # realization by realization
    prepared: Prepared  # their string and scheme
    rows: NDArray[np.int64]  # shape (lanes,): Position of the realization of each lane
    cells: NDArray[np.int64]  # shape (lanes,): Cell of each lane, in the flattened map


class _Resolved(NamedTuple):
    """A realization whose lanes are its own numbers and those of the cells."""

    row: int
    design: Design
    numbers: dict[str, float]


class _CellByCell(NamedTuple):
    """A realization whose cells were resolved one by one; those that are possible."""

    row: int
    design: Design
    numbers: dict[str, Array]
    places: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PartOfMap:
    """The cells of a map that share a string and the types of their laws."""

    part: Part  # which cells, and their design
    paths: tuple[str, ...]  # what is uncertain
    strings: Strings  # prepared so far

    @cached_property
    def nominal(self) -> dict[str, Array]:
        """Numbers of every cell of the design itself, by name."""
        return cell_numbers(self.part.design, self.part.axes)

    @cached_property
    def moved(self) -> dict[str, Array]:
        """Those of them that differ from cell to cell."""
        return {key: v for key, v in self.nominal.items() if np.any(v != v[0])}

    @cached_property
    def first(self) -> Design:
        """The design of the first cell."""
        return self.part.at(0)

    @cached_property
    def last(self) -> Design:
        """The design of the last cell."""
        return self.part.at(-1)

    @property
    def own_strings(self) -> bool:
        """Whether every realization has a string of its own."""
        return any(path.startswith(SHARED) for path in self.paths)

    def runs(self, values: dict[str, Array]) -> Iterator[Run]:
        """Lanes of realizations."""
        alike: dict[tuple[Any, ...], list[_Resolved]] = {}
        for row in range(len(next(iter(values.values())))):
            drawn = {path: units.SI(column[row]) for path, column in values.items()}
            found = self._resolved(row, drawn)
            if isinstance(found, list):
                yield from (self._apart(one) for one in found)
            elif self.own_strings:
                lanes = lanes_of(found.design, self._columns([found], slice(None)))
                yield self._run([found], lanes, prepare(lanes, _simulation(found.design)))
            else:
                alike.setdefault(kinds(found.design), []).append(found)
        for group in alike.values():
            yield from self._by_string(group)

    def _by_string(self, group: list[_Resolved]) -> Iterator[Run]:
        """Lanes of realizations whose laws are of the same types, scheme by scheme."""
        like = group[0].design  # without strings of their own they need none assembled
        telling = lanes_of(like, self._columns(group, self._telling))
        together: dict[int, tuple[Prepared, list[_Resolved]]] = {}
        for place, one in enumerate(group):
            lanes = telling[place :: len(group)]
            key = self.string_key(one.design, one.numbers)
            ready = self.strings.prepared(key, lanes, _simulation(like))
            together.setdefault(id(ready), (ready, []))[1].append(one)
        for ready, some in together.values():
            yield self._run(some, lanes_of(like, self._columns(some, slice(None))), ready)

    def _resolved(self, row: int, drawn: dict[str, Any]) -> _Resolved | list[_CellByCell]:
        """A realization's own numbers, or its cells by themselves where those do not tell all."""
        try:
            design = self.first.replace(drawn)
            numbers = lane_numbers(design)
            here = all(numbers[key] == column[0] for key, column in self.moved.items())
            if here and len(self.part.cells) > 1:
                there = lane_numbers(self.last.replace(drawn))
                here = there == numbers | {key: float(v[-1]) for key, v in self.moved.items()}
            if here:
                return _Resolved(row, design, numbers)
        except InputError:
            if self._impossible_at_corners(drawn):
                return []
        return self._cell_by_cell(row, drawn)

    def _impossible_at_corners(self, drawn: dict[str, Any]) -> bool:
        for design in self._corners:
            try:
                lane_numbers(design.replace(drawn))
            except InputError:
                continue
            return False
        return True

    @cached_property
    def _corners(self) -> list[Design]:
        designs = []
        for corner in itertools.product((0, -1), repeat=len(self.part.axes)):
            values = {a.path: a.values[k] for a, k in zip(self.part.axes, corner, strict=True)}
            designs.append(replaced(self.part.design, values) if values else self.part.design)
        return designs

    def _cell_by_cell(self, row: int, drawn: dict[str, Any]) -> list[_CellByCell]:
        axes: tuple[Axis, ...] = self.part.axes
        try:
            design = self.part.design.replace(drawn)
            numbers = cell_numbers(design, axes)
        except InputError:
            pass  # some cells may be possible
        else:
            like = self.first.replace(drawn)
            return [_CellByCell(row, like, numbers, np.arange(len(self.part.cells)))]
        shape = tuple(len(a) for a in axes)
        found: dict[Hashable, tuple[Design, list[int], list[dict[str, float]]]] = {}
        for place in range(len(self.part.cells)):
            where = np.unravel_index(place, shape)
            at = {a.path: units.SI(a.values[k]) for a, k in zip(axes, where, strict=True)}
            try:
                design = self.part.design.replace(at | drawn)
                lane = lane_numbers(design)
            except InputError:
                continue
            _, places, rows = found.setdefault(kinds(design), (design, [], []))
            places.append(place)
            rows.append(lane)
        return [
            _CellByCell(
                row, design, {key: np.array([lane[key] for lane in rows]) for key in rows[0]},
                np.array(places),
            )
            for design, places, rows in found.values()
        ]  # fmt: skip

    def _apart(self, found: _CellByCell) -> Run:
        lanes = lanes_of(found.design, found.numbers)
        rows = np.full(len(found.places), found.row)
        ready = prepare(lanes, _simulation(found.design))
        return Run(lanes, ready, rows, self.part.cells[found.places])

    @cached_property
    def _telling(self) -> slice:
        """Cells with every friction that a realization meets: one, where gains alone differ."""
        gains = all(key.startswith("drive.") and key not in TIMED for key in self.moved)
        return slice(0, 1) if gains else slice(None)

    def string_key(self, design: Design, numbers: dict[str, float]) -> Hashable:
        """What tells the strings of realizations apart, beside the friction."""
        return (kinds(design), tuple(numbers.get(key, 0.0) for key in TIMED))

    def _run(self, group: list[_Resolved], lanes: Lanes, ready: Prepared) -> Run:
        rows = np.tile([one.row for one in group], len(self.part.cells))
        return Run(lanes, ready, rows, np.repeat(self.part.cells, len(group)))

    def _columns(self, group: list[_Resolved], chosen: slice) -> dict[str, Array]:
        """Numbers of the lanes of some realizations at chosen cells, by name.

        Cell after cell: realizations of one cell pass the highest level at about the same time,
        so that blocks of lanes that are given up end together.
        """
        cells = len(self.part.cells[chosen])
        columns = {}
        for key in group[0].numbers:
            if key in self.moved:
                columns[key] = np.repeat(self.moved[key][chosen], len(group))
            else:
                columns[key] = np.tile([one.numbers[key] for one in group], cells)
        return columns


def _simulation(design: Design) -> SimulationTable:
    return design.tables.simulation
