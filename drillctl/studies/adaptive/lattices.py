"""Nested lattices of a grid: every coarse point is a point of all finer ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Lattice:
    """Some rows and some columns of a grid, the first and the last of both among them."""

    # increasing indices along the first and the second axis of the grid
    rows: Indices
    columns: Indices
    steps: tuple[int, int]  # spacing along either axis; the last one may be shorter

    @property
    def points(self) -> tuple[Indices, Indices]:
        """Index of the lattice in an array of the grid."""
        rows, columns = np.ix_(self.rows, self.columns)
        return rows, columns

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        return len(self.rows), len(self.columns)


def nested_lattices(shape: tuple[int, int], intervals: int) -> tuple[Lattice, ...]:
    """The lattices of a grid, from the coarsest to the grid itself."""
    steps = [_coarsest_step(points, intervals) for points in shape]
    made = [_lattice(shape, steps)]
    while max(steps) > 1:
        steps = [max(1, step // 2) for step in steps]
        made.append(_lattice(shape, steps))
    return tuple(made)


def _coarsest_step(points: int, intervals: int) -> int:
    step = 1
    while (points - 1) // (2 * step) >= intervals:
        step *= 2
    return step


def _lattice(shape: tuple[int, int], steps: list[int]) -> Lattice:
    rows, columns = (
        np.append(np.arange(0, points - 1, step), points - 1)
        for points, step in zip(shape, steps, strict=True)
    )
    return Lattice(rows, columns, (steps[0], steps[1]))


def around(coarse: Lattice, fine: Lattice) -> tuple[tuple[Indices, Indices], ...]:
    """The coarse points around every fine one."""
    below, above = zip(
        *(
            (np.searchsorted(old, new, "right") - 1, np.searchsorted(old, new, "left"))
            for old, new in ((coarse.rows, fine.rows), (coarse.columns, fine.columns))
        ),
        strict=True,
    )
    sides = ((below[0], above[0]), (below[1], above[1]))
    return tuple(np.ix_(row, column) for row in sides[0] for column in sides[1])


def in_quads(quads: Mask, coarse: Lattice, fine: Lattice) -> Mask:
    """Fine points inside or on the rim of some quads of the coarse lattice."""
    ringed = np.pad(quads, 1)  # quad (i, j) stands at (i + 1, j + 1): no quads beyond the rim
    found = np.zeros(fine.shape, dtype=bool)
    sides = []
    for old, new in ((coarse.rows, fine.rows), (coarse.columns, fine.columns)):
        above = np.searchsorted(old, new, "right")  # the quad that begins at or under the point
        below = np.searchsorted(old, new, "left")  # the quad that ends at or over it
        sides.append((below, above))
    for row in sides[0]:
        for column in sides[1]:
            found |= ringed[np.ix_(row, column)]
    return found


def corners(values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Values at the corners of every quad of an array of points."""
    return np.stack([values[:-1, :-1], values[1:, :-1], values[:-1, 1:], values[1:, 1:]])


def corners_of(quads: Mask) -> Mask:
    """Points that are a corner of one of some quads, shape of the points."""
    rows, columns = quads.shape
    found = np.zeros((rows + 1, columns + 1), dtype=bool)
    for i in (0, 1):
        for j in (0, 1):
            found[i : rows + i, j : columns + j] |= quads
    return found
