"""A grid over parameters of a design, and the lanes that it stands for."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design, parameter
from drillctl.design.tables import AxisTable
from drillctl.errors import InputError
from drillctl.simulation.lanes import Lanes, kinds, lane_numbers, lanes_of
from drillctl.studies.memory import refuse_too_large

Array = NDArray[np.float64]

SHARED = (
    "drillstring.", "top_drive.", "bha.", "simulation.", "controller.drive.sampling_period",
    "weight_on_bit.observer_modes",
)  # fmt: skip
"""Paths under these change what all lanes share; the others differ from lane to lane."""


@dataclass(frozen=True, eq=False)
class Axis:
    """One axis of a grid.

    Attributes
    ----------
    path : str
        Dotted path of the parameter.
    unit : str
        Unit of `values`, empty for factors and counts.
    values : ndarray, shape (points,)
        In SI.
    """

    path: str
    unit: str
    values: Array

    @property
    def shared(self) -> bool:
        """Whether it changes the string or the scheme, which all lanes of a group share."""
        return self.path.startswith(SHARED)

    def __len__(self) -> int:
        return len(self.values)


@dataclass(frozen=True, eq=False)
class Part:
    """The cells of a grid that share a string and the types of their laws.

    Attributes
    ----------
    design : Design
        With the values of the axes that all of the cells share.
    axes : tuple of Axis
        The other axes, over which the cells run.
    cells : ndarray of int, shape (cells,)
        Index of each cell in the flattened grid.
    """

    design: Design
    axes: tuple[Axis, ...]
    cells: NDArray[np.int64]

    def at(self, corner: int) -> Design:
        """The design of the first cell (0) or of the last (-1)."""
        values = {a.path: a.values[corner] for a in self.axes}
        return replaced(self.design, values) if values else self.design


@dataclass(frozen=True, eq=False)
class Group:
    """The cells of a grid that share a string and the types of their laws.

    Attributes
    ----------
    design : Design
        Of the first cell.
    lanes : Lanes
        One a cell.
    cells : ndarray of int, shape (lanes,)
        Index of each cell in the flattened grid.
    """

    design: Design
    lanes: Lanes
    cells: NDArray[np.int64]


def axis(design: Design, table: AxisTable) -> Axis:
    """The axis that a table asks for.

    Raises
    ------
    InputError
        Unknown path, a wrong unit, or an axis that does not increase.
    """
    where = f"map.axes {table.path}"
    try:
        found = parameter(design, table.path)
        low, high = found.parse(table.min), found.parse(table.max)
    except InputError as error:
        raise InputError(error.problem, where) from None
    if not low < high:
        raise InputError(f"min {table.min} must be less than max {table.max}", where)
    values = np.linspace(low, high, table.points)
    if found.whole and not np.array_equal(values, np.round(values)):
        first = next(v for v in values if v != round(v))
        raise InputError(f"{first:g} is not a whole number, and it takes no others", where)
    return Axis(table.path, found.si_unit, values)


def axes_of(design: Design, tables: tuple[AxisTable, ...]) -> tuple[Axis, ...]:
    """All axes of a grid; see `axis`.

    Raises
    ------
    InputError
        An axis that does not fit the design, or a grid too large for the memory.
    """
    refuse_too_large([table.points for table in tables])
    return tuple(axis(design, table) for table in tables)


def shape_of(axes: tuple[Axis, ...]) -> tuple[int, ...]:
    """Number of points along each axis."""
    return tuple(len(a) for a in axes)


def parts(design: Design, axes: tuple[Axis, ...]) -> Iterator[Part]:
    """The cells of a grid, string by string and kind by kind.

    Raises
    ------
    InputError
        A value on the grid is impossible; the message says which.
    """
    cells = np.arange(np.prod(shape_of(axes), dtype=int)).reshape(shape_of(axes))
    slices = [_singly(a) if a.shared else _by_kind(design, axes, a) for a in axes]
    for chosen in itertools.product(*slices):
        pairs = list(zip(axes, chosen, strict=True))
        variant = replaced(design, {a.path: a.values[p.start] for a, p in pairs if a.shared})
        own = tuple(Axis(a.path, a.unit, a.values[p]) for a, p in pairs if not a.shared)
        yield Part(variant, own, cells[chosen].ravel())


def groups(design: Design, axes: tuple[Axis, ...]) -> Iterator[Group]:
    """The cells of a grid, group by group; the string is assembled once a group.

    Raises
    ------
    InputError
        A value on the grid is impossible; the message says which.
    """
    for part in parts(design, axes):
        like = part.at(0)
        yield Group(like, lanes_of(like, cell_numbers(part.design, part.axes)), part.cells)


def _singly(a: Axis) -> list[slice]:
    return [slice(k, k + 1) for k in range(len(a))]


def _by_kind(design: Design, axes: tuple[Axis, ...], a: Axis) -> list[slice]:
    """Runs of an axis along which the laws keep their types, the other axes at their lowest.

    A delay of zero is no delay, an infinite limit no limit: such laws take other kernels.
    """
    if not a.path.startswith(("controller.drive.", "weight_on_bit.path.", "scenario.")):
        return [slice(0, len(a))]
    low = {other.path: other.values[0] for other in axes}
    kind = [kinds(replaced(design, low | {a.path: value})) for value in a.values]
    starts = [0, *(k for k in range(1, len(a)) if kind[k] != kind[k - 1])]
    return [slice(i, j) for i, j in itertools.pairwise([*starts, len(a)])]


def cell_design(design: Design, axes: tuple[Axis, ...], cell: int) -> Design:
    """The design of one cell of the flattened grid."""
    where = np.unravel_index(cell, shape_of(axes))
    return replaced(design, {a.path: a.values[k] for a, k in zip(axes, where, strict=True)})


def replaced(design: Design, values: dict[str, float]) -> Design:
    """The design with SI values put in; an impossible one is told with its path and value.

    Parameters
    ----------
    design : Design
        To be changed.
    values : dict
        Dotted path to value (SI).
    """
    try:
        return design.replace({path: units.SI(value) for path, value in values.items()})
    except InputError as error:
        at = ", ".join(f"{path} = {value:g}" for path, value in values.items())
        raise InputError(f"at {at}: {error}", "map.axes") from None


def cell_numbers(design: Design, axes: tuple[Axis, ...]) -> dict[str, Array]:
    """Lane numbers of every cell, flattened.

    Parameters
    ----------
    design : Design
        With whatever the axes do not say.
    axes : tuple of Axis
        Over which the cells run.
    """
    grid = _outer_product(design, axes)
    if grid is None:
        cells = [
            lane_numbers(cell_design(design, axes, cell))
            for cell in range(int(np.prod(shape_of(axes), dtype=int)))
        ]
        grid = {key: np.array([c[key] for c in cells]) for key in cells[0]}
    return {key: values.ravel() for key, values in grid.items()}


def _outer_product(design: Design, axes: tuple[Axis, ...]) -> dict[str, Array] | None:
    """Lane numbers over the grid, from each axis resolved alone; None if that does not hold.

    The other axes stand at their lowest values meanwhile, not at the design's: those may be
    impossible together with values of this axis, or the reason why it changes nothing.
    """
    low = {a.path: a.values[0] for a in axes}
    base = lane_numbers(replaced(design, low) if axes else design)
    grid = {key: np.full(shape_of(axes), value) for key, value in base.items()}
    taken: set[str] = set()
    for dimension, a in enumerate(axes):
        column = [lane_numbers(replaced(design, low | {a.path: v})) for v in a.values]
        touched = {key for key in base if any(n[key] != base[key] for n in column)}
        if touched & taken:
            return None
        taken |= touched
        along = [-1 if d == dimension else 1 for d in range(len(axes))]
        for key in touched:
            grid[key][:] = np.array([n[key] for n in column]).reshape(along)
    return grid if _right_at_corners(design, axes, grid) else None


def _right_at_corners(design: Design, axes: tuple[Axis, ...], grid: dict[str, Array]) -> bool:
    """Whether every corner, resolved as a whole, is possible and what the grid says it is."""
    for corner in itertools.product((0, -1), repeat=len(axes)):
        values = {a.path: a.values[k] for a, k in zip(axes, corner, strict=True)}
        numbers = lane_numbers(replaced(design, values) if axes else design)
        if any(grid[key][corner] != value for key, value in numbers.items()):
            return False
    return True
