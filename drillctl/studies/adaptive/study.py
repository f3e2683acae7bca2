"""Adaptive maps: the contours of J1 at the resolution of a grid, from a fraction of its cells."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.provenance import provenance
from drillctl.simulation.batch import FLOATS, Batch
from drillctl.simulation.measures import STATUSES
from drillctl.studies import audit as auditing
from drillctl.studies.adaptive.checks import (
    CHECK_CELLS,
    FullAudit,
    SelfCheck,
    full_audit,
    self_check,
)
from drillctl.studies.adaptive.chosen_cells import ChosenCells
from drillctl.studies.adaptive.contour_search import INTERVALS, Bands, Cells, ContourSearch, Mask
from drillctl.studies.adaptive.lattices import nested_lattices
from drillctl.studies.blocks import Blocks
from drillctl.studies.grid import Axis, axes_of, shape_of
from drillctl.studies.memory import refuse_too_large
from drillctl.studies.regions import Region, region
from drillctl.studies.sweeps import UNITS

if TYPE_CHECKING:
    from pathlib import Path

    import xarray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class AdaptiveMap:
    """Regions of J1 over two parameters, from simulations near their contours alone.

    Attributes
    ----------
    design : Design
        What was varied.
    axes : tuple of Axis
        Two parameters and their values.
    levels : tuple of float
        Levels of J1 (s).
    cells : ndarray of int, shape (trajectories,)
        Simulated cells of the flattened map, in the order in which they were.
    measures : dict of ndarray, shape (trajectories,)
        By the names of `simulation.batch.FLOATS`; NaN where undefined.
    status : ndarray of int8, shape (trajectories,)
        Index into `simulation.measures.STATUSES`.
    bands : ndarray of int8, shape of the map
        Number of levels that each cell lies above, simulated or not; all of them if it failed.
    intervals : int
        Of the coarsest lattice along an axis, at least.
    audit : Audit
        Simulated cells that were simulated again with the reference solver.
    self_check : SelfCheck
        A random sample of the cells that the contours left out.
    full_audit : FullAudit or None
        The full grid, if it was asked for; its cells are not among the trajectories.
    step, modes : float and int, or None
        Scheme of the batch engine; None where it differs from string to string.
    seconds, total_seconds : float
        Spent in the lanes alone and from call to return (s), a full audit included.
    provenance : dict of str
        Versions and processor it came from.
    """

    design: Design
    axes: tuple[Axis, ...]
    levels: tuple[float, ...]
    cells: Cells
    measures: dict[str, Array]
    status: NDArray[np.int8]
    bands: Bands
    intervals: int
    audit: auditing.Audit
    self_check: SelfCheck
    full_audit: FullAudit | None
    step: float | None
    modes: int | None
    seconds: float
    total_seconds: float
    provenance: dict[str, str] = field(default_factory=provenance)

    @property
    def trajectories(self) -> int:
        """Number of cells that were simulated, those of the self-check included."""
        return len(self.cells)

    @property
    def share(self) -> float:
        """Trajectories over those of the full grid."""
        return len(self.cells) / self.bands.size

    @property
    def simulated(self) -> Mask:
        """Which cells of the map were simulated."""
        found = np.zeros(self.bands.shape, dtype=bool)
        found.ravel()[self.cells] = True
        return found

    @property
    def j1(self) -> np.ma.MaskedArray[Any, Any]:
        """J1 over the grid (s), masked where it was not simulated; NaN where a cell failed."""
        found = np.ma.masked_all(self.bands.shape)
        found[np.unravel_index(self.cells, found.shape)] = self.measures["j1"]
        return found

    @cached_property
    def values(self) -> Array:
        """J1 where it was simulated, a value of the cell's band elsewhere (s), shape of the map.

        For contours at the levels: they cross simulated cells alone. NaN where a cell failed.
        """
        return banded(self.bands, self.levels, self.cells, self.measures["j1"])

    @cached_property
    def regions(self) -> dict[float, Region]:
        """Region of each level, at the resolution of the grid."""
        return {level: region(self.values, self.axes, level) for level in self.levels}

    @property
    def minimum(self) -> tuple[float, dict[str, float]] | None:
        """Smallest J1 (s) of the simulated cells, and where (SI); None if every one failed.

        All cells around it were simulated, so it is a minimum of the grid, if not surely the
        smallest.
        """
        j1 = self.measures["j1"]
        if np.isnan(j1).all():
            return None
        best = int(np.nanargmin(j1))
        where = np.unravel_index(self.cells[best], self.bands.shape)
        at = {a.path: float(a.values[k]) for a, k in zip(self.axes, where, strict=True)}
        return float(j1[best]), at

    @property
    def data(self) -> xarray.Dataset:
        """Bands over the map, measures of the simulated cells, checks; units and provenance."""
        import xarray

        paths = [a.path for a in self.axes]
        coordinates = {a.path: (a.path, a.values, {"units": a.unit}) for a in self.axes}
        variables: dict[str, Any] = {
            name: ("trajectory", values, {"units": UNITS[name]})
            for name, values in self.measures.items()
        }
        flags = {"flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
        variables["status"] = ("trajectory", self.status, flags)
        variables["cell"] = ("trajectory", self.cells, {})
        variables["band"] = (paths, self.bands, {"levels": list(self.levels)})
        variables["simulated"] = (paths, self.simulated, {})
        variables["audited_cell"] = ("audited", self.audit.cells, {})
        variables["audited_j1"] = ("audited", self.audit.reference, {"units": "s"})
        variables["checked_cell"] = ("checked", self.self_check.cells, {})
        variables["said_band"] = ("checked", self.self_check.said, {})
        variables["found_band"] = ("checked", self.self_check.found, {})
        if self.full_audit is not None:
            variables["full_j1"] = (paths, self.full_audit.j1, {"units": "s"})
        return xarray.Dataset(variables, coordinates, dict(self.provenance))

    def summary(self) -> dict[str, Any]:
        """As of a map, with trajectories and their share of the full grid, and the checks."""
        minimum = self.minimum
        return {
            "axes": {
                a.path: {"min": float(a.values[0]), "max": float(a.values[-1]), "points": len(a)}
                for a in self.axes
            },
            "minimum": None if minimum is None else {"j1": minimum[0], "at": minimum[1]},
            "minimum_over": "simulated cells",
            "regions": {f"{level:g}": r.summary() for level, r in self.regions.items()},
            "trajectories": self.trajectories,
            "share": self.share,
            "intervals": self.intervals,
            "self_check": self.self_check.summary(),
            "full_audit": None if self.full_audit is None else self.full_audit.summary(),
            "audit": self.audit.summary(),
            "statuses": {
                name: int((self.status == code).sum())
                for code, name in enumerate(STATUSES)
                if (self.status == code).any()
            },
            "step": self.step,
            "modes": self.modes,
            "seconds": self.seconds,
            "total_seconds": self.total_seconds,
        }

    def save(self, folder: str | Path) -> Path:
        """Write design, dataset and summary into a folder; see `drillctl.store`."""
        from drillctl.store import save

        return save(self, folder)


def banded(bands: Bands, levels: tuple[float, ...], cells: Cells, j1: Array) -> Array:
    """Values in the bands of their cells, those of J1 where it is known."""
    between = [0.5 * (low + high) for low, high in pairwise(levels)]
    stand_in = np.array([0.5 * levels[0], *between, 2.0 * levels[-1]])
    values = stand_in[bands]
    values.ravel()[cells] = j1
    return values


def adaptive_map(
    design: Design,
    axes: tuple[Axis, ...] | None = None,
    intervals: int = INTERVALS,
    check_cells: int = CHECK_CELLS,
    audit_cells: int | None = None,
    full_grid: bool = False,
    progress: Progress = SILENT,
    blocks: Blocks | None = None,
) -> AdaptiveMap:
    """Find the regions of J1 over two parameters without simulating every cell.

    Each contour is that of the full grid to the bit, or was missed from end to end between the
    cells that were simulated (`contour_search`); a random sample of the cells left out tells how
    much that can be.

    Parameters
    ----------
    design : Design
        Its `[map]` table gives axes, levels and number of audited cells.
    axes : tuple of Axis, optional
        Instead of the design's own.
    intervals : int
        Of the coarsest lattice along an axis, at least. An island or a hole that is smaller than
        its spacing may be missed.
    check_cells : int
        Cells left out that are simulated after all, chosen at random; 0 for no check.
    audit_cells : int, optional
        Instead of the design's own, for the reference solver; 0 for no audit.
    full_grid : bool
        Whether the full grid is simulated too, and set beside the map.
    progress : Progress
        Told of lanes and audited cells.
    blocks : Blocks, optional
        Where finished blocks are kept and found again.

    Returns
    -------
    AdaptiveMap
        Failed cells carry the status `failed`, not an exception.

    Raises
    ------
    InputError
        An axis that does not fit the design, another number of axes than two, fewer than one
        interval or checked cells than none, or a grid too large for the memory.
    """
    begin = time.perf_counter()
    table = design.tables.map
    _refuse_counts(intervals, check_cells)
    axes = axes_of(design, table.axes) if axes is None else axes
    shape = _shape_of_two(axes)
    refuse_too_large(shape)
    lanes = _Lanes(ChosenCells(design, axes, progress, blocks))
    lattices = nested_lattices(shape, intervals)
    found = ContourSearch(lanes.look, shape, table.levels)
    found.run(lattices)
    checked = self_check(found, lattices[-1], check_cells)
    taken = lanes.collected()
    full = _whole(found, lanes) if full_grid else None
    count = table.audit_cells if audit_cells is None else audit_cells
    step, modes = lanes.source.scheme
    return AdaptiveMap(
        design=design,
        axes=axes,
        levels=table.levels,
        cells=np.concatenate(found.order),
        measures=taken.measures,
        status=taken.status,
        bands=found.bands,
        intervals=intervals,
        audit=auditing.audit(design, axes, found.values, table.levels, count, progress),
        self_check=checked,
        full_audit=full,
        step=step,
        modes=modes,
        seconds=lanes.source.seconds,
        total_seconds=time.perf_counter() - begin,
    )


def _whole(found: ContourSearch, lanes: _Lanes) -> FullAudit:
    """The full grid beside what a search found: the cells that it left out are simulated now."""
    cells, j1 = np.flatnonzero(found.seen.ravel()), found.values.copy()
    left = np.flatnonzero(~found.seen.ravel())
    if len(left):
        j1.ravel()[left] = lanes.look(left)
    adaptive = banded(found.bands, found.levels, cells, found.values.ravel()[cells])
    return full_audit(adaptive, j1, found.levels, len(left))


class _Lanes:
    """Batches of the cells as the search asks for them."""

    def __init__(self, source: ChosenCells) -> None:
        self.source = source
        self._batches: list[Batch] = []

    def look(self, cells: Cells) -> Array:
        """J1 of cells (s)."""
        batch = self.source.simulate(cells)
        self._batches.append(batch)
        return batch.measures["j1"]

    def collected(self) -> Batch:
        """What was simulated so far, in the order in which it was asked for."""
        parts = self._batches
        measures = {name: np.concatenate([p.measures[name] for p in parts]) for name in FLOATS}
        return Batch(measures, np.concatenate([p.status for p in parts]))


def _refuse_counts(intervals: int, check_cells: int) -> None:
    if intervals < 1:
        raise InputError(f"must be at least 1, got {intervals}", "intervals")
    if check_cells < 0:
        raise InputError(f"must not be negative, got {check_cells}", "check_cells")


def _shape_of_two(axes: tuple[Axis, ...]) -> tuple[int, int]:
    """Points along both axes."""
    shape = shape_of(axes)
    if len(shape) != 2:
        raise InputError(
            f"an adaptive map follows contours over 2 parameters, got {len(shape)}; "
            "a sweep (drillctl map without --adaptive) takes any number",
            "map.axes",
        )
    return shape
