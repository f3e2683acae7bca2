"""Realizations of a design over the cells of a map, as lanes of the batch engine.

What a realization changes in a lane is resolved once, at the first cell of the map; what a cell
changes is resolved once for all realizations. A lane has the numbers of both. That this is so is
checked at the last cell for every realization; where it is not, or where a rig is impossible at
some cells only, each cell is resolved by itself.

Step and modes of each realization follow from that one alone. The step is bounded by the steepest
friction among the lanes that share it: were that all lanes of a block, the bits of a lane would
depend on its company. What comes out the same is prepared once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from drillctl import units
from drillctl.arrays import Array, Index, Mask
from drillctl.design import Design
from drillctl.design.tables import SimulationTable
from drillctl.design.validation import validated
from drillctl.ensemble.draws import beyond_the_table
from drillctl.ensemble.grid import SHARED, Axis, Group, cell_numbers, groups, replaced, shape_of
from drillctl.ensemble.parameters import drawing
from drillctl.ensemble.running import Block, Pieces, Run, Strings, collect, load_kernel, pieces
from drillctl.errors import InputError
from drillctl.simulation.batch import Prepared, prepare
from drillctl.simulation.lanes import TIMED, Lanes, kinds, lane_numbers, lanes_of, timed

LANES = 2**17  # lanes of a block: some seconds' work at most
MOST = 4096  # realizations of a block at most

Drawing = Callable[[int, int], dict[str, Array]]


@dataclass(frozen=True, eq=False)
class Realizations:
    """Realizations of a design, a row of lanes each: one lane a cell of a map."""

    design: Design  # with what is uncertain, named or by default
    axes: tuple[Axis, ...]  # of the map; none for the design's own setting alone
    source: int | dict[str, Array]  # seed of the draws; or values (SI) by path, one by one
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
    def width(self) -> int:
        """Cells of the map."""
        return int(np.prod(shape_of(self.axes), dtype=int))

    @property
    def block(self) -> int:
        """Realizations of a block."""
        return min(max(1, LANES // self.width), MOST)

    def pieces(self, done: Mask) -> Pieces:
        """Blocks of the realizations that are not done."""
        return pieces(done, self.block)

    def run(self, first: int, count: int) -> Block:
        """Simulate some realizations at every cell."""
        values = self._drawn(count, first)
        runs = itertools.chain.from_iterable(part.runs(values) for part in self._parts)
        censor = math.inf if self.censor is None else self.censor
        result = collect(runs, count * self.width, self.measures, censor)
        return Block.of(first, self.width, result)

    @cached_property
    def _drawn(self) -> Drawing:
        """A function of count and first: values of what is uncertain (SI), (count,), by path."""
        source = self.source
        if isinstance(source, dict):
            return lambda count, first: {k: v[first : first + count] for k, v in source.items()}
        drawn = drawing(self.design, source)
        return lambda count, first: drawn(count, first).values

    @cached_property
    def _parts(self) -> list[_Part]:
        paths = tuple(self._drawn(1, 0))
        design = beyond_the_table(_rig(self.design), paths)
        results = [_Part(group, paths) for group in groups(design, self.axes)]
        for number, prepared in self.strings.items():
            results[number].give(prepared)
        return results

    def prepared(self, strings: Strings) -> Realizations:
        """The job with the strings of the design itself, and its kernels loaded."""
        results = {}
        for number, part in enumerate(self._parts):
            lanes = part.nominal_lanes
            ready = strings(number, partial(prepare, lanes, part.group.design.tables.simulation))
            load_kernel(lanes, ready)
            if not part.own_strings:
                results[number] = ready
        return replace(self, strings=results)


STUDIES = ("map", "uncertain", "uncertainty", "compare", "weight_delay", "tune", "advantage")
"""Tables of a design that say what is to be computed of a rig, not what it is."""


def _rig(design: Design) -> Design:
    """The design without them: thousands of variants are validated, samples and all."""
    tree = {key: table for key, table in design.tree.items() if key not in STUDIES}
    return Design(design.name, validated(tree, design.origin), tree, design.origin)


@dataclass
class _Known:
    """A prepared string, and between which slopes of the friction it is right (N m s/rad)."""

    gentlest: float
    steepest: float
    prepared: Prepared


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
    places: Index


@dataclass(frozen=True, eq=False)
class _Part:
    """Realizations over the cells of a map that share a string and the types of their laws."""

    group: Group  # which cells, and their design
    paths: tuple[str, ...]  # what is uncertain
    known: dict[Hashable, list[_Known]] = field(default_factory=dict)  # strings so far

    @cached_property
    def nominal(self) -> dict[str, Array]:
        """Numbers of every cell of the design itself, by name."""
        return self.group.numbers.of(np.arange(len(self.group)))

    @property
    def nominal_lanes(self) -> Lanes:
        """Lanes of the design itself."""
        return lanes_of(self.group.design, self.nominal)

    @cached_property
    def moved(self) -> dict[str, Array]:
        """Those of them that differ from cell to cell."""
        return {key: v for key, v in self.nominal.items() if np.any(v != v[0])}

    @cached_property
    def last(self) -> Design:
        """The design of the last cell."""
        return self.group.at(-1)

    @property
    def own_strings(self) -> bool:
        """Whether every realization has a string of its own."""
        return any(path.startswith(SHARED) for path in self.paths)

    def runs(self, values: dict[str, Array]) -> Iterator[Run]:
        """Lanes of realizations."""
        alike: dict[tuple[Any, ...], list[_Resolved]] = {}
        for row in range(len(next(iter(values.values())))):
            drawn = {path: units.SI(column[row]) for path, column in values.items()}
            result = self._resolved(row, drawn)
            if isinstance(result, list):
                yield from (self._apart(one) for one in result)
            elif self.own_strings:
                lanes = lanes_of(result.design, self._columns([result], slice(None)))
                yield self._run([result], lanes, prepare(lanes, _simulation(result.design)))
            else:
                alike.setdefault(kinds(result.design), []).append(result)
        for group in alike.values():
            yield from self._by_string(group)

    def _by_string(self, group: list[_Resolved]) -> Iterator[Run]:
        """Lanes of realizations whose laws are of the same types, scheme by scheme."""
        like = group[0].design  # without strings of their own they need none assembled
        telling = lanes_of(like, self._columns(group, self._telling))
        together: dict[int, tuple[Prepared, list[_Resolved]]] = {}
        for place, one in enumerate(group):
            lanes = telling[place :: len(group)]
            key = self._string_key(one.design, one.numbers)
            ready = self._string(key, lanes, _simulation(like))
            together.setdefault(id(ready), (ready, []))[1].append(one)
        for ready, some in together.values():
            yield self._run(some, lanes_of(like, self._columns(some, slice(None))), ready)

    def _resolved(self, row: int, drawn: dict[str, Any]) -> _Resolved | list[_CellByCell]:
        """A realization's own numbers, or its cells by themselves where those do not suffice."""
        try:
            design = self.group.design.replace(drawn)
            numbers = lane_numbers(design)
            here = all(numbers[key] == column[0] for key, column in self.moved.items())
            if here and len(self.group.cells) > 1:
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
        for corner in itertools.product((0, -1), repeat=len(self.group.axes)):
            values = {a.path: a.values[k] for a, k in zip(self.group.axes, corner, strict=True)}
            designs.append(replaced(self.group.base, values) if values else self.group.base)
        return designs

    def _cell_by_cell(self, row: int, drawn: dict[str, Any]) -> list[_CellByCell]:
        axes: tuple[Axis, ...] = self.group.axes
        try:
            design = self.group.base.replace(drawn)
            numbers = cell_numbers(design, axes)
        except InputError:
            pass  # some cells may be possible
        else:
            like = self.group.design.replace(drawn)
            return [_CellByCell(row, like, numbers, np.arange(len(self.group.cells)))]
        shape = tuple(len(a) for a in axes)
        results: dict[Hashable, tuple[Design, list[int], list[dict[str, float]]]] = {}
        for place in range(len(self.group.cells)):
            where = np.unravel_index(place, shape)
            at = {a.path: units.SI(a.values[k]) for a, k in zip(axes, where, strict=True)}
            try:
                design = self.group.base.replace(at | drawn)
                lane = lane_numbers(design)
            except InputError:
                continue
            _, places, rows = results.setdefault(kinds(design), (design, [], []))
            places.append(place)
            rows.append(lane)
        return [
            _CellByCell(
                row, design, {key: np.array([lane[key] for lane in rows]) for key in rows[0]},
                np.array(places),
            )
            for design, places, rows in results.values()
        ]  # fmt: skip

    def _apart(self, result: _CellByCell) -> Run:
        lanes = lanes_of(result.design, result.numbers)
        ready = prepare(lanes, _simulation(result.design))
        return Run(lanes, ready, result.row * self._width + self.group.cells[result.places])

    @property
    def _width(self) -> int:
        """Cells of the whole map."""
        return int(np.prod(self.group.whole, dtype=int))

    @cached_property
    def _telling(self) -> slice:
        """Cells with every friction that a realization meets: one, where gains alone differ."""
        gains = all(key.startswith("drive.") and not key.startswith(TIMED) for key in self.moved)
        return slice(0, 1) if gains else slice(None)

    def _string_key(self, design: Design, numbers: dict[str, float]) -> Hashable:
        """What the strings of realizations depend on, beside the friction."""
        return kinds(design), timed(numbers)

    def _run(self, group: list[_Resolved], lanes: Lanes, ready: Prepared) -> Run:
        rows = np.array([one.row for one in group])
        return Run(lanes, ready, (self.group.cells[:, None] + rows * self._width).ravel())

    def _columns(self, group: list[_Resolved], chosen: slice) -> dict[str, Array]:
        """Numbers of the lanes of some realizations at chosen cells, by name.

        Cell after cell: realizations of one cell pass the highest level at about the same time,
        so that blocks of lanes that are given up end together.
        """
        cells = len(self.group.cells[chosen])
        columns = {}
        for key in group[0].numbers:
            if key in self.moved:
                columns[key] = np.repeat(self.moved[key][chosen], len(group))
            else:
                columns[key] = np.tile([one.numbers[key] for one in group], cells)
        return columns

    def give(self, prepared: Prepared) -> None:
        """Take the string of the design itself, lest it be prepared again."""
        like, steepest = self.group.design, self.nominal_lanes.steepest_fall
        key = self._string_key(like, lane_numbers(like))
        self.known.setdefault(key, []).append(_Known(steepest, steepest, prepared))

    def _string(self, key: Hashable, lanes: Lanes, table: SimulationTable) -> Prepared:
        """The string of a realization, from those that were prepared if one of them is right."""
        fall = lanes.steepest_fall
        known = self.known.setdefault(key, [])
        for one in known:
            # The longest step falls with the slope: between two slopes of one step lies no other.
            if one.gentlest <= fall <= one.steepest:
                return one.prepared
        made = prepare(lanes, table)
        for one in known:
            if one.prepared.scheme == made.scheme:
                one.gentlest, one.steepest = min(fall, one.gentlest), max(fall, one.steepest)
                return one.prepared
        known.append(_Known(fall, fall, made))
        return made


def _simulation(design: Design) -> SimulationTable:
    return design.tables.simulation
