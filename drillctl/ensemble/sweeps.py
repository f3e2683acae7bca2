"""Sweeps over any parameters of a design, the J1 map among them, and their regions."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.arrays import Array, Index, Mask, own_errstate
from drillctl.design import Design
from drillctl.ensemble import audit as auditing
from drillctl.ensemble.grid import (
    Axis,
    Group,
    axes_of,
    cell_design,
    checked,
    divisions,
    group_of,
    other_axes,
    over_axes,
    place_of,
    refuse_too_large,
    shape_of,
    span,
)
from drillctl.ensemble.running import (
    Block,
    Pieces,
    Strings,
    Workers,
    load_kernel,
    measured,
    pieces,
    run,
)
from drillctl.ensemble.storing import Store, in_memory
from drillctl.errors import InputError, nearest
from drillctl.progress import SILENT, Progress
from drillctl.simulation.batch import CHUNK, Prepared, prepare
from drillctl.simulation.measures import BATCH_MEASURES, MEASURES, STATUSES, status_counts
from drillctl.store.codec import documented, label
from drillctl.store.json_files import picked
from drillctl.store.result import Timed, timed
from drillctl.store.tables import in_columns, write_columns

if TYPE_CHECKING:
    import shapely

    from drillctl.simulation import Simulation


@dataclass(frozen=True, eq=False)
@documented
class Region:
    """The part of a map at or under one level."""

    level: float = label(unit="s", means="level of J1")
    mask: Mask = label(means="cells in the region, shape of the map; a cell that failed is not")
    cells: int = label(means="number of them")
    area_fraction: float = label(means="their share of all cells")
    bounds: dict[str, tuple[float, float]] = label(
        means="path to (lowest, highest) cell centre in the region (SI); empty without any cell"
    )
    polygons: shapely.MultiPolygon | None = label(
        means="outline by linear interpolation, in SI; only for maps over two parameters"
    )

    def summary(self) -> dict[str, Any]:
        """Cells, share and bounds."""
        return {
            "cells": self.cells,
            "area_fraction": self.area_fraction,
            "bounds": {path: list(pair) for path, pair in self.bounds.items()},
        }


def region(values: Array, axes: tuple[Axis, ...], level: float) -> Region:
    """The region of a map at or under a level.

    Parameters
    ----------
    values : ndarray, shape of the map
        J1 (s); NaN where a cell failed.
    axes : tuple of Axis
        Of the map.
    level : float
        Level (s).
    """
    mask = np.nan_to_num(values, nan=np.inf) <= level
    bounds = {}
    for dimension, axis in enumerate(axes):
        others = tuple(d for d in range(mask.ndim) if d != dimension)
        inside = axis.values[mask.any(axis=others)]
        if inside.size:
            bounds[axis.path] = (float(inside[0]), float(inside[-1]))
    cells = int(mask.sum())
    polygons = outline(values, axes, level) if len(axes) == 2 else None
    return Region(level, mask, cells, cells / mask.size, bounds, polygons)


def outline(values: Array, axes: tuple[Axis, ...], level: float) -> shapely.MultiPolygon:
    """Outline of {J1 <= level} of a two-parameter map, interpolated linearly between cells."""
    import contourpy
    import shapely

    first, second = axes
    # contourpy masks NaN: a failed cell is left out of the region, and so are its neighbours'
    # shares of the quads around it.
    generator = contourpy.contour_generator(
        first.values, second.values, np.ma.masked_invalid(values.T),
        fill_type=contourpy.FillType.OuterOffset,
    )  # fmt: skip
    points, offsets = generator.filled(-np.inf, level)
    polygons = [
        shapely.Polygon(p[o[0] : o[1]], [p[a:b] for a, b in itertools.pairwise(o[1:])])
        for p, o in zip(points, offsets, strict=True)
    ]
    valid = [part for polygon in polygons for part in _parts(shapely.make_valid(polygon))]
    return shapely.MultiPolygon(valid)


def _parts(geometry: Any) -> list[Any]:
    """The polygons in a geometry; a cell that touches the level in a point alone has none."""
    if geometry.geom_type == "Polygon":
        return [geometry] if geometry.area > 0.0 else []
    return [p for g in getattr(geometry, "geoms", []) for p in _parts(g)]


@dataclass(frozen=True, eq=False)
class Sweep(Timed, kind="map"):
    """Measures over a grid of parameters."""

    design: Design = label(means="what was varied")
    axes: tuple[Axis, ...] = label(means="parameters and their values")
    levels: tuple[float, ...] = label(unit="s", means="levels of J1")
    measures: dict[str, Array] = label(
        "axes", unit=lambda name: MEASURES[name].unit, flat=True,
        means=lambda name: MEASURES[name].meaning,
    )  # fmt: skip
    status: NDArray[np.int8] = label("axes", flags=STATUSES, means="how the run ended")
    audit: auditing.Audit = label(flat=True, means="cells simulated again by the reference solver")
    step: float | None = label(unit="s", means="of the batch engine; None where it differs")
    modes: int | None = label(means="of the batch engine; None where it differs")
    seconds: float = label(unit="s", means="in the lanes alone")
    section_torque: dict[str, float] = label(
        unit="N*m", default_factory=dict,
        means="largest in each section whose torsional yield is known, at the cells of the largest "
        "torque of the uppermost pipe",
    )  # fmt: skip

    @property
    def j1(self) -> Array:
        """J1 over the grid (s)."""
        return self.measures["j1"]

    @cached_property
    def regions(self) -> dict[float, Region]:
        """Region of each level."""
        return {level: region(self.j1, self.axes, level) for level in self.levels}

    @property
    def minimum(self) -> tuple[float, dict[str, float]] | None:
        """Smallest J1 (s) and where it is (SI); None if every cell failed."""
        if np.isnan(self.j1).all():
            return None
        cell = int(np.nanargmin(self.j1))
        return float(self.j1.flat[cell]), place_of(self.axes, cell)

    @property
    def over_yield(self) -> dict[str, dict[str, float]]:
        """Sections whose yield is known: it (N m), the largest share of it, and cells above it.

        A cell counts by the peak of its uppermost pipe, times what the section has over that at
        the cells of the largest peaks; where no such peaks are kept, no section is named.
        """
        peaks = self.measures.get("peak_pipe_torque")
        largest = 0.0 if peaks is None else float(np.nanmax(peaks, initial=0.0))
        known = (one for one in self.design.string.parts.sections if one.yield_torque < math.inf)
        if peaks is None or largest == 0.0:
            return {}
        result = {}
        for one in known:
            ratio = self.section_torque.get(one.name, largest) / largest
            result[one.name] = {
                "torsional_yield": one.yield_torque,
                "largest_share": ratio * largest / one.yield_torque,
                "cells": int((ratio * np.nan_to_num(peaks) > one.yield_torque).sum()),
            }
        return result

    def summary(self) -> dict[str, Any]:
        """Axes, minimum, regions, audit, failures, times; SI units, parameters by path."""
        minimum = self.minimum
        return {
            "axes": span(self.axes),
            "minimum": minimum and {"j1": minimum[0], "at": minimum[1]},
            "regions": {f"{level:g}": r.summary() for level, r in self.regions.items()},
            "audit": self.audit.summary(),
            "statuses": status_counts(self.status),
            "yield": self.over_yield,
            **picked(self, "step", "modes", "seconds", "total_seconds"),
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Axes, audited cells and measures that the design does not give."""
        settings = other_axes(self)
        cells = auditing.choose_cells(self.j1, self.levels, self.design.tables.map.audit_cells)
        if not np.array_equal(cells, self.audit.cells):
            settings["audited"] = self.audit.cells.tolist()
        if tuple(self.measures) != BATCH_MEASURES:
            settings["measure"] = [name for name in self.measures if name != "j1"]
        return self.design, settings


@timed
def sweep(
    design: Design,
    axes: tuple[Axis, ...] | None = None,
    audit_cells: int | None = None,
    progress: Progress = SILENT,
    store: Store | None = None,
    measures: Sequence[str] | None = None,
    workers: Workers | None = None,
) -> Sweep:
    """Simulate a design over a grid of its parameters with the batch engine.

    Lanes are made, run and forgotten block by block: the memory is that of what is kept.

    Parameters
    ----------
    design : Design
        Its `[map]` table gives axes, levels and number of audited cells.
    axes : tuple of Axis, optional
        Instead of the design's own.
    audit_cells : int, optional
        Instead of the design's own; 0 for no audit.
    progress : Progress
        Receives finished blocks and audited cells.
    store : Store, optional
        Where finished blocks are stored, for a run that resumes; in memory by default.
    measures : sequence of str, optional
        Measures to keep of each cell, by the names of `simulation.measures.MEASURES`; J1 and
        the status always are. All by default.
    workers : Workers, optional
        Who computes blocks; the threads of this process by default.

    Returns
    -------
    Sweep
        Failed cells carry the status `failed`, not an exception.

    Raises
    ------
    InputError
        An axis that does not fit the design, no measure of that name, or a grid too large for
        the memory.
    """
    table, kept = design.tables.map, kept_measures(measures)
    axes = axes_of(design, kept=len(kept)) if axes is None else checked(design, axes)
    refuse_too_large(shape_of(axes), kept=len(kept))
    job = Cells(design, axes, kept)
    blocks = (store or in_memory)("map", job)
    progress.begin("loading kernels", 1)
    cells = math.prod(shape_of(axes))
    times = run(job.prepared(blocks.prepared), cells, blocks, workers, progress)
    result, status = blocks.read(cells)
    result, status = {name: job.over_grid(v) for name, v in result.items()}, job.over_grid(status)
    count = table.audit_cells if audit_cells is None else audit_cells
    step, modes = next(iter(blocks.schemes)) if len(blocks.schemes) == 1 else (None, None)
    return Sweep(
        design=design,
        axes=axes,
        levels=table.levels,
        measures=result,
        status=status,
        audit=_audit(design, axes, result, status, count, progress),
        step=step,
        modes=modes,
        section_torque=_section_torque(design, axes, result),
        seconds=times.lanes,
    )


STRAINED = 3  # cells of the largest torque of the uppermost pipe: other sections are looked at


def _section_torque(
    design: Design, axes: tuple[Axis, ...], measures: dict[str, Array]
) -> dict[str, float]:
    """Largest torque (N m) by section at some cells; nothing where only one has a known yield."""
    peaks = measures.get("peak_pipe_torque")
    known = [one for one in design.string.parts.sections if one.yield_torque < math.inf]
    if peaks is None or not any(one is not design.string.parts.sections[0] for one in known):
        return {}
    from drillctl.simulation import simulate  # a map without yields waits for no integrator

    cells = [int(cell) for cell in np.argsort(-peaks, axis=None) if np.isfinite(peaks.flat[cell])]
    runs = [simulate(cell_design(design, axes, cell), "batch") for cell in cells[:STRAINED]]
    names = {name for run in runs for name in run.section_torque}
    return {name: max(run.section_torque[name] for run in runs) for name in sorted(names)}


def _audit(
    design: Design, axes: tuple[Axis, ...], measures: dict[str, Array], status: NDArray[np.int8],
    count: int, progress: Progress,
) -> auditing.Audit:  # fmt: skip
    """Some cells of the map again."""
    cells = auditing.choose_cells(measures["j1"], design.tables.map.levels, count)
    designs = [cell_design(design, axes, int(cell)) for cell in cells]
    batch = auditing.kept(measures, status, cells)
    return auditing.audited(cells, batch, designs, progress=progress)


def kept_measures(asked: Sequence[str] | None, where: str = "measures") -> tuple[str, ...]:
    """Names of the measures to keep, in the order of the table; all if none are requested."""
    if asked is None:
        return BATCH_MEASURES
    for name in asked:
        if name not in BATCH_MEASURES:
            raise InputError(f"no measure {name!r}; {nearest(name, BATCH_MEASURES)}", where)
    return tuple(name for name in BATCH_MEASURES if name == "j1" or name in asked)


def stability_map(
    design: Design,
    axes: tuple[Axis, ...] | None = None,
    audit_cells: int | None = None,
    progress: Progress = SILENT,
    store: Store | None = None,
    measures: Sequence[str] | None = None,
    workers: Workers | None = None,
) -> Sweep:
    """Map J1 of a design over two of its parameters, with the batch engine.

    J1 is the integral of the deviation of the bit speed from its set speed, over that speed (s):
    small where the bit turns steadily, large where it sticks and slips. The result knows the
    regions under the levels of `[map]`, is audited by the reference solver, and draws itself:
    `stability_map(design).plot()`.

    Parameters
    ----------
    design : Design
        Without `[map]` axes the map runs over what its drive law is tuned by, in the ranges that
        fit the rig.
    axes : tuple of Axis, optional
        Two parameters with their values (SI), instead of the design's own.
    audit_cells : int, optional
        Cells that the reference solver runs again, instead of `map.audit_cells`; 0 for no audit.
    progress : Progress
        Receives finished blocks and audited cells.
    store : Store, optional
        Where finished blocks are stored, for a run that resumes; in memory by default.
    measures : sequence of str, optional
        Measures to keep of each cell, by the names of `simulation.measures.MEASURES`; J1 and
        the status always are. All by default.
    workers : Workers, optional
        Who computes blocks; the threads of this process by default.

    Returns
    -------
    Sweep
        `j1`, shape (first axis, second axis) in s, `regions`, `minimum`, `audit`. Failed cells
        carry the status `failed`, not an exception.

    Raises
    ------
    InputError
        The map does not run over exactly two parameters; else as for `sweep`.

    Examples
    --------
    >>> found = drillctl.stability_map(drillctl.load("monteiro-trindade-140kn"))
    >>> found.minimum
    >>> found.plot().savefig("map.png")
    """
    if axes is None:
        axes = axes_of(design, kept=len(kept_measures(measures)))
    if len(axes) != 2:
        raise InputError(f"a map runs over 2 parameters, got {len(axes)}; use sweep", "map.axes")
    return sweep(design, axes, audit_cells, progress, store, measures, workers)


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of a grid, one a row, group by group: lanes are made, run and forgotten by blocks."""

    design: Design
    axes: tuple[Axis, ...]
    measures: tuple[str, ...]  # what is kept of a cell, J1 first
    strings: Strings | None = None  # gives strings in this process; workers prepare their own

    width = 1

    def __getstate__(self) -> dict[str, Any]:
        # What is derived is derived again by whoever takes the job.
        return {"design": self.design, "axes": self.axes, "measures": self.measures}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, strings=None)

    def pieces(self, done: Mask) -> Pieces:
        """Blocks of the cells that are not done; none reaches over two groups."""
        results = []
        for begin, end in itertools.pairwise([*self._begins.tolist(), len(done)]):
            results += [(begin + at, n) for at, n in pieces(done[begin:end], CHUNK)]
        return results

    def prepared(self, strings: Strings) -> Cells:
        """The job that takes its strings from elsewhere, with the kernel of the first loaded."""
        job = replace(self, strings=strings)
        group, ready = job._group(0)
        load_kernel(group.telling, ready)
        return job

    def run(self, first: int, count: int) -> Block:
        """Simulate some cells of one group."""
        number = int(np.searchsorted(self._begins, first, side="right")) - 1
        group, ready = self._group(number)
        begin = first - int(self._begins[number])
        return Block.of(first, 1, measured(group.some(np.arange(begin, begin + count)), ready,
                                           self.measures))  # fmt: skip

    def over_grid(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Values of all rows, shape (rows, 1), over the grid."""
        shape = shape_of(self.axes)
        if len(self._divisions) == 1:  # of millions of cells, no copy
            return rows.reshape(shape)
        over = np.empty(shape, dtype=rows.dtype)
        for number, where in enumerate(self._divisions):
            part = over[where]
            begin = self._begins[number]
            part[...] = rows[begin : begin + part.size].reshape(part.shape)
        return over

    @cached_property
    def _divisions(self) -> list[tuple[slice, ...]]:
        return divisions(self.design, self.axes)

    @cached_property
    def _begins(self) -> Index:
        """First row of each group."""
        sizes = [math.prod(p.stop - p.start for p in where) for where in self._divisions]
        return np.concatenate([[0], np.cumsum(sizes[:-1])]).astype(np.int64)

    def _group(self, number: int) -> tuple[Group, Prepared]:
        """A group and its string; the last one stays, of thousands there would not be room."""
        held = self.__dict__.get("_held")
        if held is None or held[0] != number:
            group = group_of(self.design, self.axes, self._divisions[number])
            make = partial(prepare, group.telling, group.design.tables.simulation)
            ready = make() if self.strings is None else self.strings(number, make)
            held = self.__dict__["_held"] = (number, group, ready)
        return held[1], held[2]


@own_errstate()
def responses(result: Sweep, count: int = 4) -> list[Simulation]:
    """Simulate some cells of growing J1, by the batch engine.

    Parameters
    ----------
    result : Sweep
        The map.
    count : int
        How many cells, at most: the minimum, then the cells nearest to values of J1 spread
        evenly in logarithm up to twice the highest level.

    Returns
    -------
    list of Simulation
        By growing J1; without repeats.
    """
    from drillctl.simulation import simulate  # a map waits for no integrator

    if result.minimum is None:
        return []
    flat = result.j1.ravel()
    high = 2.0 * result.levels[-1]
    low = max(result.minimum[0], 1e-6 * high)  # a rig that never leaves its set speed has J1 = 0
    targets = np.geomspace(low, max(low, high), count)
    cells = dict.fromkeys(int(np.nanargmin(np.abs(flat - target))) for target in targets)
    designs = [cell_design(result.design, result.axes, cell) for cell in cells]
    return [simulate(design, engine="batch", interval=0.05) for design in designs]


def write_cells(result: Sweep, path: Path, system: units.System = "si") -> None:
    """Write a row a cell: parameters, measures and status."""
    figures = ((name, v, MEASURES[name].unit) for name, v in result.measures.items())
    columns = over_axes(result.axes, system) | in_columns(figures, system)
    columns["status"] = np.array(STATUSES, dtype=object)[result.status.ravel()].tolist()
    write_columns(path, columns)
