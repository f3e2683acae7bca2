"""Lane numbers over a grid, each held along the axes that it varies over and no others.

A grid of ten million cells over two parameters is two columns of some thousand numbers: the lanes
of a block are made from them when the block is run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


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
        found = [v.shape for key, v in self.numbers.items() if key.startswith(names)]
        return tuple(d for d in range(len(self.shape)) if any(shape[d] > 1 for shape in found))

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


def compact(values: dict[str, Array]) -> dict[str, Array]:
    """Numbers over a whole grid, with the dimensions taken out along which they do not vary."""
    return {key: _compact(array) for key, array in values.items()}


def _compact(array: Array) -> Array:
    for dimension in range(array.ndim):
        first = array.take([0], axis=dimension)
        if np.array_equal(np.broadcast_to(first, array.shape), array):
            array = first
    return array
