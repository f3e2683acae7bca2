"""Sweeps over any parameters of a design; the J1 map over the gains is one of them."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble import audit as auditing
from drillctl.ensemble.grid import (
    Axis,
    Group,
    axes_of,
    divisions,
    group_of,
    other_axes,
    refuse_too_large,
    shape_of,
    span,
)
from drillctl.ensemble.regions import Region, region
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
from drillctl.ensemble.storing import Memory, Store
from drillctl.errors import InputError, nearest
from drillctl.progress import SILENT, Progress
from drillctl.provenance import provenance
from drillctl.simulation.batch import CHUNK, Prepared, prepare
from drillctl.simulation.measures import BATCH_MEASURES, MEASURES, STATUSES
from drillctl.store.codec import label
from drillctl.store.result import Result

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Sweep(Result):
    """Measures over a grid of parameters."""

    kind: ClassVar[str] = "map"

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
    total_seconds: float = label(unit="s", means="from call to return")
    provenance: dict[str, str] = label(
        means="versions and processor it came from", default_factory=provenance
    )

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
        where = np.unravel_index(int(np.nanargmin(self.j1)), self.j1.shape)
        at = {a.path: float(a.values[k]) for a, k in zip(self.axes, where, strict=True)}
        return float(self.j1[where]), at

    def summary(self) -> dict[str, Any]:
        """Axes, minimum, regions, audit, failures, times; SI units, parameters by path."""
        minimum = self.minimum
        return {
            "axes": span(self.axes),
            "minimum": None if minimum is None else {"j1": minimum[0], "at": minimum[1]},
            "regions": {f"{level:g}": r.summary() for level, r in self.regions.items()},
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

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Axes, audited cells and measures that the design does not give."""
        settings = other_axes(self)
        cells = auditing.choose_cells(self.j1, self.levels, self.design.tables.map.audit_cells)
        if not np.array_equal(cells, self.audit.cells):
            settings["audited"] = self.audit.cells.tolist()
        if tuple(self.measures) != BATCH_MEASURES:
            settings["measure"] = [name for name in self.measures if name != "j1"]
        return self.design, settings


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
        Told of blocks and audited cells.
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
    begin = time.perf_counter()
    table, kept = design.tables.map, kept_measures(measures)
    axes = axes_of(design, table.axes, len(kept)) if axes is None else axes
    refuse_too_large(shape_of(axes), kept=len(kept))
    job = Cells(design, axes, kept)
    blocks = (store or Memory()).blocks("map", job)
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
        audit=auditing.audit(design, axes, result["j1"], table.levels, count, progress),
        step=step,
        modes=modes,
        seconds=times.lanes,
        total_seconds=time.perf_counter() - begin,
    )


def kept_measures(asked: Sequence[str] | None) -> tuple[str, ...]:
    """Names of the measures to keep, in the order of the table; all if none are requested."""
    if asked is None:
        return BATCH_MEASURES
    for name in asked:
        if name not in BATCH_MEASURES:
            raise InputError(f"no measure {name!r}; {nearest(name, BATCH_MEASURES)}", "measures")
    return tuple(name for name in BATCH_MEASURES if name == "j1" or name in asked)


def stability_map(design: Design, **options: Any) -> Sweep:
    """The J1 map of a design over the two parameters of its `[map]` table.

    Parameters
    ----------
    design : Design
        By default the map runs over the gains, kp 0-1000 and ki 0-500.
    **options
        As for `sweep`.

    Raises
    ------
    InputError
        The map does not run over exactly two parameters.
    """
    kept = len(kept_measures(options.get("measures")))
    axes = options.pop("axes", None) or axes_of(design, design.tables.map.axes, kept)
    if len(axes) != 2:
        raise InputError(f"a map runs over 2 parameters, got {len(axes)}; use sweep", "map.axes")
    return sweep(design, axes, **options)


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

    def pieces(self, done: NDArray[np.bool_]) -> Pieces:
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
    def _begins(self) -> NDArray[np.int64]:
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
