"""A grid over parameters of a design, and the lanes that it stands for.

Lane numbers are held along the axes that they vary over and no others: a grid of ten million cells
over two parameters is two columns of some thousand numbers, and the lanes of a block are made from
them when the block is run. Grids that would not fit the memory are refused before anything is
computed.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array, Index
from drillctl.design import Design, axis_tables, parameter
from drillctl.design.tables import AxisTable
from drillctl.errors import InputError
from drillctl.rig.top_drive.law import tracking
from drillctl.simulation.lanes import Lanes, kinds, lane_numbers, lanes_of
from drillctl.simulation.measures import BATCH_MEASURES
from drillctl.store.codec import documented, label
from drillctl.store.tables import in_columns

SHARED = (
    "drillstring.", "top_drive.", "bha.", "axial.", "well.", "simulation.",
    "controller.drive.sampling_period", "weight_on_bit.observer_modes",
)  # fmt: skip
"""Paths under these change what all lanes share; the others differ from lane to lane."""


@dataclass(frozen=True, eq=False)
@documented
class Axis:
    """One axis of a grid."""

    path: str = label(means="dotted path of the parameter")
    unit: str = label(means="unit of the values, empty for factors and counts")
    values: Array = label("{path}", unit="{unit}", name="{path}", means="SI")

    @property
    def shared(self) -> bool:
        """Whether it changes the string or the scheme, which all lanes of a group share."""
        return self.path.startswith(SHARED)

    def __len__(self) -> int:
        return len(self.values)


def span(axes: tuple[Axis, ...]) -> dict[str, dict[str, float]]:
    """Ends and number of points of each axis by path (SI), for a summary."""
    return {
        a.path: {"min": float(a.values[0]), "max": float(a.values[-1]), "points": len(a)}
        for a in axes
    }


def over_axes(axes: tuple[Axis, ...], system: units.System = "si") -> dict[str, list[str]]:
    """Values of the axes at every cell of their grid, as texts by their head in a file."""
    columns = in_columns(((a.path, a.values, a.unit) for a in axes), system)
    grids = np.meshgrid(*(np.array(one, dtype=object) for one in columns.values()), indexing="ij")
    return {name: grid.ravel().tolist() for name, grid in zip(columns, grids, strict=True)}


OF_THE_ROCK = ("friction.", "before.", "variation.", "weight.", "weight_program.", "set_speed")
"""Names of numbers on which the steepest falling slope of the rock depends."""
OF_THE_PROGRAM = ("speed_program.", "weight_program.", "rock_until")
"""Names of numbers that say when something jumps or turns."""
TRACKING, TRACKED_BY = "drive.tracking", "controller.drive.tracking_time"
"""The one number that two usual axes have in common: it follows from both gains, unless given."""
SEARCHED = 4096  # lanes in which the steepest rock is looked for at a time


@dataclass(frozen=True, eq=False)
class Group:
    """The cells of a grid that share a string and the types of their laws."""

    base: Design  # with the values of the axes that all of the cells share
    axes: tuple[Axis, ...]  # the other axes, over which the cells run
    # where the group begins along each axis of the whole grid, and how far it goes
    begins: tuple[int, ...]
    shape: tuple[int, ...]
    whole: tuple[int, ...]  # shape of the whole grid

    @cached_property
    def design(self) -> Design:
        """The design of the first cell."""
        return self.at(0)

    @cached_property
    def numbers(self) -> NumberGrid:
        """Lane numbers over the axes that the lanes do not share."""
        return _numbers(self.base, self.axes)

    def at(self, corner: int) -> Design:
        """The design of the first cell (0) or of the last (-1)."""
        values = {a.path: a.values[corner] for a in self.axes}
        return replaced(self.base, values) if values else self.base

    def __len__(self) -> int:
        return len(self.numbers)

    def some(self, chosen: Index) -> Lanes:
        """Some of its lanes, by number."""
        return lanes_of(self.design, self.numbers.of(chosen))

    def cells_of(self, chosen: Index) -> Index:
        """Index in the flattened grid of some of its lanes."""
        if not self.whole:
            return chosen
        inside = np.unravel_index(chosen, self.shape)
        at = tuple(begin + i for begin, i in zip(self.begins, inside, strict=True))
        return np.ravel_multi_index(at, self.whole)

    def lanes_at(self, cells: Index) -> Index:
        """Lane of each cell of the flattened grid; -1 for cells of other groups."""
        if not self.whole:
            return cells
        at = np.array(np.unravel_index(cells, self.whole))
        inside = at - np.array(self.begins)[:, None]
        ends = np.array(self.shape)[:, None]
        mine = ((inside >= 0) & (inside < ends)).all(axis=0)
        return np.where(mine, np.ravel_multi_index(tuple(inside % ends), self.shape), -1)

    @cached_property
    def lanes(self) -> Lanes:
        """All of them at once, one a cell: mind the memory."""
        return self.some(np.arange(len(self)))

    @cached_property
    def cells(self) -> Index:
        """Index of each cell in the flattened grid, shape (lanes,)."""
        return self.cells_of(np.arange(len(self)))

    @cached_property
    def telling(self) -> Lanes:
        """Lanes that ask for the same scheme as all: the steepest rock, each turn of a program.

        Searched a part at a time, over those axes alone that matter.
        """
        numbers = self.numbers
        rock, program = numbers.varies(OF_THE_ROCK), numbers.varies(OF_THE_PROGRAM)
        steepest, cells = -1.0, np.empty(0, dtype=np.int64)
        for first in range(0, int(np.prod(numbers.along(rock), dtype=int)), SEARCHED):
            part = numbers.cells_along(rock, first, SEARCHED)
            fall = self.some(part).steepest_fall
            if fall > steepest:
                steepest, cells = fall, part
        turns = numbers.cells_along(program, 0, len(self))
        return self.some(np.union1d(cells, turns) if program else cells)


def axis(design: Design, table: AxisTable) -> Axis:
    """The axis that a table asks for."""
    where = f"map.axes {table.path}"
    try:
        result = parameter(design, table.path)
        low, high = result.parse(table.min), result.parse(table.max)
    except InputError as error:
        raise InputError(error.problem, where) from None
    if not low < high:
        raise InputError(f"min {table.min} must be less than max {table.max}", where)
    values = np.linspace(low, high, table.points)
    if result.whole and not np.array_equal(values, np.round(values)):
        first = next(v for v in values if v != round(v))
        raise InputError(f"{first:g} is not a whole number, and it takes no others", where)
    return Axis(table.path, result.si_unit, values)


def axes_of(
    design: Design, tables: tuple[AxisTable, ...] | None = None, kept: int = len(BATCH_MEASURES)
) -> tuple[Axis, ...]:
    """All axes of a grid, by default those of the map; `kept` measures are kept of each cell."""
    tables = axis_tables(design) if tables is None else tables
    refuse_too_large([table.points for table in tables], kept=kept)
    return tuple(axis(design, table) for table in tables)


def checked(design: Design, axes: Iterable[object]) -> tuple[Axis, ...]:
    """Axes that somebody wrote; refused (`InputError`) in units other than SI."""
    results = []
    for one in axes:
        if not isinstance(one, Axis):
            raise InputError(
                f"{one!r} is no axis; write drillctl.studies.Axis(path, unit, SI values)",
                "axes",
            )
        kind = parameter(design, one.path).kind
        if kind and one.unit and units.factor(one.unit, kind) != 1.0:
            raise InputError(f"values are SI, in {kind.si} and not in {one.unit}", one.path)
        results.append(Axis(one.path, one.unit, np.asarray(one.values, float)))
    return tuple(results)


def shape_of(axes: tuple[Axis, ...]) -> tuple[int, ...]:
    """Number of points along each axis."""
    return tuple(len(a) for a in axes)


def divisions(design: Design, axes: tuple[Axis, ...]) -> list[tuple[slice, ...]]:
    """How a grid falls into groups: the piece of each axis that every group takes."""
    slices = [
        [slice(k, k + 1) for k in range(len(a))] if a.shared else _by_kind(design, axes, a)
        for a in axes
    ]
    return list(itertools.product(*slices))


def group_of(design: Design, axes: tuple[Axis, ...], pieces: tuple[slice, ...]) -> Group:
    """One of the groups of a grid; its string is assembled when it is first asked for."""
    pairs = list(zip(axes, pieces, strict=True))
    base = replaced(design, {a.path: a.values[p.start] for a, p in pairs if a.shared})
    own = tuple(Axis(a.path, a.unit, a.values[p]) for a, p in pairs if not a.shared)
    begins = tuple(piece.start for piece in pieces)
    shape = tuple(piece.stop - piece.start for piece in pieces)
    result = Group(base, own, begins, shape, shape_of(axes))
    _ = result.numbers  # impossible cells are refused here, not when lanes are made
    return result


def groups(design: Design, axes: tuple[Axis, ...]) -> Iterator[Group]:
    """The cells of a grid, group by group."""
    for pieces in divisions(design, axes):
        yield group_of(design, axes, pieces)


def _by_kind(design: Design, axes: tuple[Axis, ...], a: Axis) -> list[slice]:
    """Runs of an axis along which the laws keep their types, the other axes at their lowest.

    A delay of zero is no delay, an infinite limit no limit, a drive that absorbs nothing a plain
    PI: such laws take other kernels.
    """
    changing = (
        "controller.drive.", "controller.absorption", "weight_on_bit.path.", "scenario.",
        "bit_rock.variation.",
    )  # fmt: skip
    if not a.path.startswith(changing):
        return [slice(0, len(a))]
    low = {other.path: other.values[0] for other in axes}
    kind = [kinds(replaced(design, low | {a.path: value})) for value in a.values]
    starts = [0, *(k for k in range(1, len(a)) if kind[k] != kind[k - 1])]
    return [slice(i, j) for i, j in itertools.pairwise([*starts, len(a)])]


def place_of(axes: tuple[Axis, ...], cell: int) -> dict[str, float]:
    """Values (SI) of the axes by path at a cell of the flattened grid."""
    where = np.unravel_index(cell, shape_of(axes)) if axes else ()
    return {a.path: float(a.values[k]) for a, k in zip(axes, where, strict=True)}


def cell_design(design: Design, axes: tuple[Axis, ...], cell: int) -> Design:
    """The design of one cell of the flattened grid."""
    return replaced(design, place_of(axes, cell)) if axes else design


def replaced(design: Design, values: dict[str, float]) -> Design:
    """The design with SI values put in; an impossible one is refused with its path and value."""
    try:
        return design.replace({path: units.SI(value) for path, value in values.items()})
    except InputError as error:
        at = ", ".join(f"{path} = {value:g}" for path, value in values.items())
        raise InputError(f"at {at}: {error}", "map.axes") from None


def cell_numbers(design: Design, axes: tuple[Axis, ...]) -> dict[str, Array]:
    """Lane numbers of every cell, flattened."""
    numbers = _numbers(design, axes)
    return numbers.of(np.arange(len(numbers)))


def _numbers(design: Design, axes: tuple[Axis, ...]) -> NumberGrid:
    """Lane numbers over a grid."""
    grid = _outer_product(design, axes)
    return _cell_by_cell(design, axes) if grid is None else grid


def _cell_by_cell(design: Design, axes: tuple[Axis, ...]) -> NumberGrid:
    """Lane numbers of every cell resolved by itself."""
    shape = shape_of(axes)
    results: dict[str, Array] = {}
    for cell in range(int(np.prod(shape, dtype=int))):
        for key, value in lane_numbers(cell_design(design, axes, cell)).items():
            results.setdefault(key, np.empty(shape)).ravel()[cell] = value
    return NumberGrid(shape, {key: _compact(array) for key, array in results.items()})


def _outer_product(design: Design, axes: tuple[Axis, ...]) -> NumberGrid | None:
    """Lane numbers over the grid, from each axis resolved alone; None if that does not hold.

    The other axes stand at their lowest values meanwhile, not at the design's: those may be
    impossible together with values of this axis, or the reason why it changes nothing.
    """
    low = {a.path: a.values[0] for a in axes}
    base = lane_numbers(replaced(design, low) if axes else design)
    results = {key: np.full((1,) * len(axes), value) for key, value in base.items()}
    taken: set[str] = set()
    tracked = {TRACKING} & set(base) if TRACKED_BY not in low else set()
    for dimension, a in enumerate(axes):
        column = [lane_numbers(replaced(design, low | {a.path: v})) for v in a.values]
        touched = {key for key in base if any(n[key] != base[key] for n in column)}
        if (touched & taken) - tracked:
            return None
        taken |= touched
        along = [-1 if d == dimension else 1 for d in range(len(axes))]
        for key in touched:
            results[key] = np.array([n[key] for n in column]).reshape(along)
    if tracked and results["drive.kp"].size > 1 and results["drive.ki"].size > 1:
        drive = design.tables.controller.drive
        results[TRACKING] = tracking(results["drive.kp"], results["drive.ki"], drive)
    grid = NumberGrid(shape_of(axes), results)
    return grid if _right_at_corners(design, axes, grid) else None


def _right_at_corners(design: Design, axes: tuple[Axis, ...], grid: NumberGrid) -> bool:
    """Whether every corner, resolved as a whole, is possible and what the grid gives."""
    for corner in itertools.product((0, -1), repeat=len(axes)):
        values = {a.path: a.values[k] for a, k in zip(axes, corner, strict=True)}
        numbers = lane_numbers(replaced(design, values) if axes else design)
        at = tuple(k % len(a) for a, k in zip(axes, corner, strict=True))
        cell = int(np.ravel_multi_index(at, grid.shape)) if axes else 0
        given = grid.of(np.array([cell]))
        if any(given[key][0] != value for key, value in numbers.items()):
            return False
    return True


@dataclass(frozen=True, eq=False)
class NumberGrid:
    """Every lane number over a grid."""

    shape: tuple[int, ...]  # of the grid; empty for a single cell
    # by the names of `simulation.lanes.lane_numbers`; as many dimensions as the grid, of length
    # one along those over which the number is the same
    numbers: dict[str, Array]

    def __len__(self) -> int:
        return int(np.prod(self.shape, dtype=int))

    def of(self, cells: Index) -> dict[str, Array]:
        """Numbers of some cells of the flattened grid, shape (cells,) each."""
        where = np.unravel_index(cells, self.shape) if self.shape else ()
        return {key: self._of(values, where, len(cells)) for key, values in self.numbers.items()}

    @staticmethod
    def _of(values: Array, where: tuple[Index, ...], count: int) -> Array:
        if values.size == 1:
            return np.full(count, values.item())
        taken: Array = values[
            tuple(at if n > 1 else 0 for at, n in zip(where, values.shape, strict=True))
        ]
        return taken

    def varies(self, names: tuple[str, ...]) -> tuple[int, ...]:
        """Dimensions along which a number varies whose name begins with one of these."""
        results = [v.shape for key, v in self.numbers.items() if key.startswith(names)]
        return tuple(d for d in range(len(self.shape)) if any(shape[d] > 1 for shape in results))

    def along(self, dimensions: tuple[int, ...]) -> tuple[int, ...]:
        """Shape of the part of the grid along some dimensions, the others at their first."""
        return tuple(n if d in dimensions else 1 for d, n in enumerate(self.shape))

    def cells_along(self, dimensions: tuple[int, ...], first: int, count: int) -> Index:
        """Cells `first` to `first + count` of that part, in the flattened grid."""
        part = self.along(dimensions)
        inside = np.arange(first, min(first + count, int(np.prod(part, dtype=int))))
        if not self.shape:
            return inside
        return np.ravel_multi_index(np.unravel_index(inside, part), self.shape)


def _compact(array: Array) -> Array:
    """A number over a whole grid without the dimensions along which it does not vary."""
    for dimension in range(array.ndim):
        first = array.take([0], axis=dimension)
        if np.array_equal(np.broadcast_to(first, array.shape), array):
            array = first
    return array


BYTES_PER_CELL, BYTES_PER_MEASURE = 80, 10
"""Memory that a cell takes in a sweep, its regions and its file, and each measure kept of it."""
MEMORY_SHARE = 0.5  # largest share of the free memory that a sweep may ask for


def refuse_too_large(
    points: Sequence[int], where: str = "map.axes", kept: int = len(BATCH_MEASURES)
) -> None:
    """Refuse (`InputError`) a grid of so many points along its axes, if memory falls short."""
    cells = math.prod(points)
    refuse_more_bytes(
        cells * (BYTES_PER_CELL + kept * BYTES_PER_MEASURE),
        f"{cells:,} cells",
        where,
        "fewer points",
    )


def refuse_more_bytes(needed: float, what: str, where: str, instead: str = "fewer of them") -> None:
    """Refuse (`InputError`) what needs more memory than may be used."""
    usable = MEMORY_SHARE * _free_memory()
    if needed > usable:
        raise InputError(
            f"{what} need about {needed / 2**30:,.1f} GiB; "
            f"{usable / 2**30:.1f} GiB may be used: {instead}",
            where,
        )


def _free_memory() -> float:
    """Memory that can be had (bytes); infinite where the system does not say."""
    info = Path("/proc/meminfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (ValueError, OSError, AttributeError):
        return float("inf")


def other_axes(
    result: Any, own: Callable[[Design], tuple[Axis, ...]] | None = None
) -> dict[str, Any]:
    """Axes of a result where they are not those that its design gives (`own`)."""
    axes = [[axis.path, axis.values.tolist()] for axis in result.axes]
    try:
        given = own(result.design) if own else axes_of(result.design)
    except InputError:  # the default ones do not fit every law
        return {"axes": axes}
    return {} if axes == [[axis.path, axis.values.tolist()] for axis in given] else {"axes": axes}
