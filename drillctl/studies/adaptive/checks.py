"""How an adaptive map proves itself: a random sample of what it left out, or all of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.adaptive.contour_search import Bands, Cells, ContourSearch
from drillctl.studies.adaptive.lattices import Lattice
from drillctl.studies.draws.intervals import Interval, share_interval
from drillctl.studies.grid import Axis
from drillctl.studies.regions import Region, region

if TYPE_CHECKING:
    import shapely

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SEED = 20122
"""Seed of the sample: the same map is checked at the same cells."""
CHECK_CELLS = 300
"""Cells of the sample: without a mismatch, at most 1.2 % of the cells left out are in another
band than said, at 95 %."""
ONE_CELL = 1.0 + 1e-9
"""Distance (cells) that the same outline may be off; the rest is rounding."""


@dataclass(frozen=True, eq=False)
class SelfCheck:
    """A random sample of the cells that were left out, simulated after all."""

    cells: Cells  # shape (checked,): In the flattened map
    # shape (checked,): Band of each cell, as the contours said and as it turned out
    said: Bands
    found: Bands
    followed: int  # cells simulated to follow the contours that a mismatch had betrayed

    @property
    def mismatches(self) -> Cells:
        """Cells that were in another band than said, in the flattened map."""
        return self.cells[self.said != self.found]

    @property
    def interval(self) -> Interval | None:
        """Clopper-Pearson interval of the share of mismatches among the cells left out.

        Before the mismatches that were found were mended; None where nothing was checked.
        """
        if not len(self.cells):
            return None
        return share_interval(len(self.mismatches), len(self.cells))

    @property
    def verdict(self) -> str:
        """`ok`, `look` if a cell was in another band than said, `none` without a sample."""
        if not len(self.cells):
            return "none"
        return "look" if len(self.mismatches) else "ok"

    def summary(self) -> dict[str, Any]:
        """Cells, mismatches, interval, cells that mended them, verdict."""
        interval = self.interval
        return {
            "cells": len(self.cells),
            "mismatches": len(self.mismatches),
            "interval_95": None if interval is None else list(interval),
            "followed": self.followed,
            "seed": SEED,
            "verdict": self.verdict,
        }


def self_check(found: ContourSearch, lattice: Lattice, count: int) -> SelfCheck:
    """Simulate a sample of the cells that a search left out, and follow what it missed."""
    left = np.flatnonzero(~found.seen.ravel())
    random = np.random.default_rng(SEED)
    cells = np.sort(random.choice(left, min(count, len(left)), replace=False)).astype(np.int64)
    said = found.bands.ravel()[cells]
    found.take(cells)
    before = int(found.seen.sum())
    found.follow(lattice)
    followed = int(found.seen.sum()) - before
    return SelfCheck(cells, said, found.bands.ravel()[cells], followed)


@dataclass(frozen=True)
class Mismatch:
    """An adaptive region beside that of the full grid."""

    cells: int  # in one region and not in the other
    area_fraction: float  # their share of the map
    # largest distance of one of them from the edge of the full grid's region (cells along the
    # axis where it is larger): 1 for a cell next to one of the other side; 0 without any,
    # infinite where that region has no edge
    farthest: float
    # distance of the outlines from each other (cells): no point of either is farther from the
    # other. 0 where both are empty, infinite where one is.
    hausdorff: float

    @property
    def to_one_cell(self) -> bool:
        """Whether both are the same to one cell."""
        return self.farthest <= ONE_CELL and self.hausdorff <= ONE_CELL

    def summary(self) -> dict[str, Any]:
        """Cells, share of the map, distances (null where infinite), same to one cell."""
        return {
            "cells": self.cells,
            "area_fraction": self.area_fraction,
            "farthest": self.farthest,
            "hausdorff": self.hausdorff,
            "same_to_one_cell": self.to_one_cell,
        }


@dataclass(frozen=True, eq=False)
class FullAudit:
    """The full grid beside an adaptive map."""

    j1: Array  # shape of the map: Of every cell (s); NaN where it failed
    mismatches: dict[float, Mismatch]  # by level
    trajectories: int  # cells that were simulated for it

    @property
    def verdict(self) -> str:
        """`ok` where every region is that of the full grid to one cell, or `look`."""
        return "ok" if all(one.to_one_cell for one in self.mismatches.values()) else "look"

    def summary(self) -> dict[str, Any]:
        """Mismatch of each level, trajectories, verdict."""
        return {
            "regions": {f"{level:g}": one.summary() for level, one in self.mismatches.items()},
            "trajectories": self.trajectories,
            "verdict": self.verdict,
        }


def full_audit(values: Array, j1: Array, levels: tuple[float, ...], trajectories: int) -> FullAudit:
    """Set the regions of an adaptive map beside those of the full grid."""
    # Over the indices of the grid, where a cell is 1 by 1.
    axes = tuple(Axis(str(n), "", np.arange(k, dtype=float)) for n, k in enumerate(j1.shape))
    compared = {
        level: mismatch(region(values, axes, level), region(j1, axes, level)) for level in levels
    }
    return FullAudit(j1, compared, trajectories)


def mismatch(found: Region, full: Region) -> Mismatch:
    """Set a region beside that of the full grid."""
    wrong = found.mask != full.mask
    return Mismatch(
        cells=int(wrong.sum()),
        area_fraction=float(wrong.mean()),
        farthest=_farthest(wrong, full.mask),
        hausdorff=_hausdorff(found.polygons, full.polygons),
    )


def _farthest(wrong: Mask, full: Mask) -> float:
    """Largest distance of the wrong cells from the edge of a region (cells).

    Cells that touch one of the other side are the first along the edge.
    """
    from scipy.ndimage import binary_erosion, distance_transform_cdt

    if not wrong.any():
        return 0.0
    inner = binary_erosion(full, border_value=1)
    outer = binary_erosion(~full, border_value=1)
    edge = ~(inner | outer)
    if not edge.any():
        return float("inf")
    return 1.0 + float(distance_transform_cdt(~edge, metric="chessboard")[wrong].max())


def _hausdorff(one: shapely.MultiPolygon | None, other: shapely.MultiPolygon | None) -> float:
    """Distance between two outlines (cells)."""
    if one is None or other is None or one.equals_exact(other):
        return 0.0
    if one.is_empty or other.is_empty:
        return float("inf")
    return float(one.boundary.hausdorff_distance(other.boundary))
