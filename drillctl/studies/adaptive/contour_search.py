"""Where the contours of a function on a grid run, from as few of its values as can be.

The grid is searched from a coarse lattice to the finest, halving the spacing. Nothing is ever
claimed from an interpolated value: a cell that was not looked at lies between cells that were,
all in the same band. On each lattice:

1. points whose coarse neighbours lie in different bands are looked at, and so are those of quads
   in which a contour may be hidden, judged by curvature (`_may_hide`);
2. the other points are taken to be in the band that their coarse neighbours share;
3. every quad whose corners lie in different bands is looked at as a whole, again and again until
   there is no other: a contour that was met anywhere is followed to its end.

After the third step on the finest lattice each quad that a contour is known to cross was looked
at whole. A contour goes from quad to quad across sides whose ends lie in different bands, and a
side that was seen in one quad is known to the next: so a contour, closed or from rim to rim, is
that of the full grid to the bit, or it is missed from end to end. What can go wrong is an island,
a hole or a bite of the rim between the cells, and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.adaptive.lattices import (
    Lattice,
    around,
    corners,
    corners_of,
    in_quads,
    nested_lattices,
)

Array = NDArray[np.float64]
Cells = NDArray[np.int64]
Bands = NDArray[np.int8]
Mask = NDArray[np.bool_]

INTERVALS = 40
"""Of the coarsest lattice along an axis, at least: what a map has by default."""
BULGE = 0.5
"""Share of the second differences at its corners that a function may bulge beyond those of a
quad: four times what it does where they tell the curvature, as J1 is not smooth."""
BULGE_AT_EXTREMA = 1.0
"""The same at a least or greatest value among its neighbours, where islands and holes hide."""
UNKNOWN = -1
"""Band of a cell before the search has come to it."""


def bands_of(values: Array, levels: tuple[float, ...]) -> Bands:
    """Band of each value: how many levels it lies above; above all of them where it is NaN."""
    told = np.where(np.isnan(values), np.inf, values)
    return np.searchsorted(np.asarray(levels), told, side="left").astype(np.int8)


@dataclass(eq=False)
class ContourSearch:
    """What is known of a function on a grid; it grows while the contours are looked for."""

    # values of the function at cells of the flattened grid; NaN where there is none
    look: Callable[[Cells], Array]
    shape: tuple[int, int]  # of the grid
    levels: tuple[float, ...]  # whose contours are looked for, increasing
    values: Array = field(init=False)  # shape of the grid: Where it was looked, NaN elsewhere
    seen: Mask = field(init=False)  # shape of the grid: Where it was looked
    bands: Bands = field(init=False)  # shape of the grid: Number of levels that a cell lies above
    # cells as they were looked at, one array each time
    order: list[Cells] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        self.values = np.full(self.shape, np.nan)
        self.seen = np.zeros(self.shape, dtype=bool)
        self.bands = np.full(self.shape, UNKNOWN, dtype=np.int8)

    def run(self, lattices: tuple[Lattice, ...]) -> None:
        """Search from the first lattice to the last, which is the grid itself."""
        first = lattices[0]
        self.take(self._cells(first, np.ones(first.shape, dtype=bool)))
        self.follow(first)
        for coarse, fine in pairwise(lattices):
            self._refine(coarse, fine)
            self.follow(fine)

    def take(self, cells: Cells) -> None:
        """Look at cells, all at once."""
        if not len(cells):
            return
        found = self.look(cells)
        self.order.append(cells)
        self.values.ravel()[cells] = found
        self.seen.ravel()[cells] = True
        self.bands.ravel()[cells] = bands_of(found, self.levels)

    def follow(self, lattice: Lattice) -> None:
        """Look at every quad that a contour crosses, and around the least value, until done."""
        while len(cells := self._cells(lattice, self._crossed(lattice) | self._least(lattice))):
            self.take(cells)

    def _refine(self, coarse: Lattice, fine: Lattice) -> None:
        """From one lattice to the next: look where a contour may be, and fill the rest."""
        old, new = self.bands[coarse.points], self.bands[fine.points]
        near = np.stack([old[index] for index in around(coarse, fine)])
        doubtful = (near != near[0]).any(axis=0)
        doubtful |= in_quads(self._may_hide(coarse), coarse, fine)
        self.bands[fine.points] = np.where(new == UNKNOWN, near[0], new)
        self.take(self._cells(fine, doubtful))

    def _cells(self, lattice: Lattice, chosen: Mask) -> Cells:
        """Chosen points of a lattice that were not looked at yet, as cells of the grid."""
        row, column = np.nonzero(chosen & ~self.seen[lattice.points])
        return np.ravel_multi_index((lattice.rows[row], lattice.columns[column]), self.shape)

    def _crossed(self, lattice: Lattice) -> Mask:
        """Points of the quads that a contour crosses."""
        bands = corners(self.bands[lattice.points])
        return corners_of((bands != bands[0]).any(axis=0))

    def _least(self, lattice: Lattice) -> Mask:
        """Points around the least value that was seen: so it is a minimum of the grid in the end.

        It is the likeliest place for an island under the lowest level, too.
        """
        chosen = np.zeros(lattice.shape, dtype=bool)
        if np.isnan(self.values).all():
            return chosen
        row, column = np.unravel_index(int(np.nanargmin(self.values)), self.shape)
        i, j = np.searchsorted(lattice.rows, row), np.searchsorted(lattice.columns, column)
        chosen[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2] = True
        return chosen

    def _may_hide(self, lattice: Lattice) -> Mask:
        """Quads that no contour is known to cross, yet one may be hidden in.

        A smooth function strays from the bilinear one through the corners of a quad by an
        eighth of its second differences along both axes at most.
        """
        values = self.values[lattice.points]
        at = corners(values)
        share = np.where(corners(_extreme(values)).any(axis=0), BULGE_AT_EXTREMA, BULGE)
        bulge = share * corners(_bend(values) + _bend(values.T).T).max(axis=0)
        low, high = at.min(axis=0), at.max(axis=0)  # NaN where a corner was not seen
        found = np.zeros(low.shape, dtype=bool)
        for level in self.levels:
            hidden = (low - bulge <= level) & (level < high + bulge)
            found |= hidden & ~((low <= level) & (level < high))
        return found


def _bend(values: Array) -> Array:
    """Size of the second difference along the first axis; 0 where it cannot be told.

    The last interval of a lattice may be shorter than the others; the gradient that is then
    mistaken for curvature makes the search look there more closely.
    """
    found = np.zeros_like(values)
    if len(values) > 2:
        found[1:-1] = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
        found[0], found[-1] = found[1], found[-2]
    return np.nan_to_num(found)


def _extreme(values: Array) -> Mask:
    """Points where no neighbour that was seen is less, or none is greater."""
    from scipy.ndimage import maximum_filter, minimum_filter

    unseen = np.isnan(values)
    low = np.where(unseen, np.inf, values)
    high = np.where(unseen, -np.inf, values)
    found: Mask = (minimum_filter(low, 3) == low) | (maximum_filter(high, 3) == high)
    return found & ~unseen


def search(
    look: Callable[[Cells], Array],
    shape: tuple[int, int],
    levels: tuple[float, ...],
    intervals: int = INTERVALS,
) -> ContourSearch:
    """Look for the contours of a function on a grid."""
    found = ContourSearch(look, shape, levels)
    found.run(nested_lattices(shape, intervals))
    return found
