"""Stability regions under uncertainty: realizations over a map, from design to result."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design, parameter
from drillctl.design.uncertain_tables import SensitivityTable
from drillctl.ensemble import audit as auditing
from drillctl.ensemble.draws import Failures, beyond_the_table, by_reason
from drillctl.ensemble.envelopes import envelope
from drillctl.ensemble.grid import Axis, cell_design, over_axes, refuse_more_bytes, shape_of
from drillctl.ensemble.parameters import drawing, sampling_of, uncertain_parameters
from drillctl.ensemble.probability import Scatter
from drillctl.ensemble.realizations import Realizations
from drillctl.ensemble.running import Blocks, Cluster, Workers, run
from drillctl.ensemble.storing import Store, in_memory
from drillctl.ensemble.sweeps import kept_measures, sweep
from drillctl.errors import InputError, nearest
from drillctl.progress import SILENT, Progress
from drillctl.store.json_files import replaced
from drillctl.store.result import timed
from drillctl.store.tables import headed, in_columns, write_columns
from drillctl.studies.uncertainty import sensitivity as indices
from drillctl.studies.uncertainty.result import (
    Look,
    Uncertainty,
    level_of,
    look,
    map_axes,
    schedule,
)

if TYPE_CHECKING:
    from distributed import Client

SoFar = Callable[[], Uncertainty | None]

COPIES = 4  # of what is kept of a lane, that are held at one time at most


@timed
def uncertainty(
    design: Design,
    axes: tuple[Axis, ...] | None = None,
    realizations: int | None = None,
    seed: int | None = None,
    audit_cells: int | None = None,
    client: Client | None = None,
    progress: Progress = SILENT,
    store: Store | None = None,
    workers: Workers | None = None,
    interim: Callable[[SoFar], None] | None = None,
) -> Uncertainty:
    """Simulate a map at every realization of what is uncertain in a design.

    Parameters
    ----------
    design : Design
        Its `[uncertain]` tables, or the rock by 5 %; `[uncertainty]`; axes, levels and number of
        audited lanes of `[map]`.
    axes : tuple of Axis, optional
        Instead of the design's own.
    realizations, seed : int, optional
        Instead of those of the design.
    audit_cells : int, optional
        Lanes simulated again with the reference solver, instead of the design's own.
    client : distributed.Client, optional
        Cluster that computes blocks, instead of threads of this process.
    progress : Progress
        Receives finished lanes.
    store : Store, optional
        Where finished blocks are stored, for a run that resumes; in memory by default.
    workers : Workers, optional
        Who computes blocks, instead of `client` or this process.
    interim : callable, optional
        Called after every block with a function that gives the result of all realizations
        that are finished up to the first that is not; None if that is the very first.

    Returns
    -------
    Uncertainty
        The same bits for any number of threads, blocks and workers of one type of processor.

    Raises
    ------
    InputError
        Impossible distributions or correlations, a parameter that is an axis too, an axis that
        does not fit the design, unknown measures, or more than fits the memory.
    """
    given = {"uncertainty.realizations": realizations, "uncertainty.seed": seed}
    asked = {path: value for path, value in given.items() if value is not None}
    design = design.replace(asked) if asked else design
    axes = map_axes(design) if axes is None else axes
    workers = Cluster(client) if client is not None and workers is None else workers
    study = _Study(design, axes, progress, store or in_memory, workers, interim)
    return study.result(audit_cells)


class _Study:
    """What the steps of a study have in common."""

    def __init__(
        self, design: Design, axes: tuple[Axis, ...], progress: Progress, store: Store,
        workers: Workers | None, interim: Callable[[SoFar], None] | None,
    ) -> None:  # fmt: skip
        self.design, self.axes, self.progress = design, axes, progress
        self.store, self.workers, self.interim = store, workers, interim
        self.table = design.tables.uncertainty
        self.levels = design.tables.map.levels
        refuse_impossible(design, axes)
        self.measures = kept_measures(self.table.keep, "uncertainty.keep")
        self.draw = drawing(design, self.table.seed)
        cells = int(np.prod(shape_of(axes)))
        refuse_more_bytes(
            COPIES * 8 * self.table.realizations * cells * len(self.measures),
            f"{self.table.realizations:,} realizations of {cells:,} cells",
            "uncertainty.realizations",
        )

    def result(self, audit_cells: int | None) -> Uncertainty:
        """All of it."""
        nominal = sweep(self.design, self.axes, audit_cells=0, progress=self.progress).j1
        job = self._job(self.table.seed, None if self.table.full else self.levels[-1])
        kept = self.store("realizations", job)
        job = job.prepared(kept.prepared)
        count, looks, seconds = self._run(job, kept, nominal)
        made = self._made(kept, count, nominal)
        sensitivity = None
        if self.table.sensitivity is not None:
            sensitivity, more = self._sensitivity(self.table.sensitivity)
            seconds += more
        wanted = self.design.tables.map.audit_cells if audit_cells is None else audit_cells
        return replace(
            made,
            audit=self._audit(made, wanted),
            failures=self._failures(made),
            looks=looks,
            sensitivity=sensitivity,
            envelope=envelope(self.design, self.draw, made.realizations),
            seconds=seconds,
        )

    def _made(self, kept: Blocks, count: int, nominal: Array) -> Uncertainty:
        """The first `count` realizations, as yet without what follows from them."""
        measures, status = kept.read(count)
        shape = (count, *shape_of(self.axes))
        return Uncertainty(
            design=self.design,
            axes=self.axes,
            levels=self.levels,
            drawn=self.draw(count, 0).values,
            measures={name: values.reshape(shape) for name, values in measures.items()},
            status=status.reshape(shape),
            nominal=nominal,
            audit=auditing.unaudited("lane"),
            failures=(),
            looks=(),
            sensitivity=None,
            envelope=None,
            seconds=0.0,
        )

    def _job(self, source: int | dict[str, Array], censor: float | None) -> Realizations:
        return Realizations(self.design, self.axes, source, self.measures, censor)

    def _run(
        self, job: Realizations, kept: Blocks, nominal: Array
    ) -> tuple[int, tuple[Look, ...], float]:
        """Realizations that were run, what was seen at each look, and the time (s)."""
        most, until = self.table.realizations, self.table.until

        def so_far(asked: int) -> Uncertainty | None:
            left = kept.missing(asked)
            done = left[0][0] if left else asked
            return self._made(kept, done, nominal) if done else None

        def after(asked: int) -> None:
            if self.interim is not None:
                self.interim(partial(so_far, asked))

        if until is None:
            seconds = run(job, most, kept, self.workers, self.progress, lambda: after(most)).total
            return most, (), seconds
        level, seconds = level_of(until, self.levels), 0.0
        scatter = Scatter(sampling_of(self.table).replicates)
        counts, looks = schedule(until.first_look, most), []
        for count in counts:
            spent = run(job, count, kept, self.workers, self.progress, partial(after, count))
            seconds += spent.total
            j1 = kept.read(count)[0]["j1"]
            looks.append(look(j1, until, level, len(counts), scatter, self.table.seed))
            if looks[-1].enough(until.half_width):
                break
        return looks[-1].realizations, tuple(looks), seconds

    def _sensitivity(self, table: SensitivityTable) -> tuple[indices.Sensitivity, float]:
        columns = indices.points(self.design, table.samples, self.table.seed)
        job = self._job(columns, None)  # a variance is of all that J1 may be
        kept = self.store("sensitivity", job)
        job = job.prepared(kept.prepared)
        count = len(next(iter(columns.values())))
        seconds = run(job, count, kept, self.workers, self.progress).total
        measures, status = kept.read(count)
        cells = _cells(self.design, self.axes, table)
        result = indices.sensitivity(
            tuple(columns), table.samples, measures["j1"], status, cells, self.levels,
            self.table.seed,
        )  # fmt: skip
        return result, seconds

    def _audit(self, result: Uncertainty, count: int) -> auditing.Audit:
        lanes = result.to_audit(count)
        rig = beyond_the_table(self.design, tuple(result.drawn))
        designs = []
        for lane in lanes:
            row, cell = divmod(int(lane), result.nominal.size)
            designs.append(cell_design(rig, self.axes, cell).replace(_of(result.drawn, row)))
        batch = auditing.kept(result.measures, result.status, lanes)
        return auditing.audited(lanes, batch, designs, "lane", self.progress)

    def _failures(self, result: Uncertainty) -> tuple[Failures, ...]:
        """Realizations that failed in every cell, by reason."""
        rig = beyond_the_table(self.design, tuple(result.drawn))
        first = cell_design(rig, self.axes, 0)
        errors, broken = [], 0
        for row in np.flatnonzero(~result.possible):
            try:
                first.replace(_of(result.drawn, int(row)))
                broken += 1
            except InputError as error:
                errors.append(error)
        reasons = by_reason(errors)
        if broken:
            reasons = (*reasons, Failures("no finite answer", broken, "in any cell"))
        return reasons


def _of(drawn: dict[str, Array], row: int) -> dict[str, units.SI]:
    return {path: units.SI(column[row]) for path, column in drawn.items()}


def refuse_impossible(design: Design, axes: tuple[Axis, ...]) -> None:
    """Refuse (`InputError`) what a study under uncertainty cannot be asked for."""
    table = design.tables.uncertainty
    for a in axes:
        if a.path in design.tables.uncertain:
            raise InputError(
                "is an axis of the map, which gives it its values, and cannot be drawn",
                design.where(f"uncertain.{a.path}"),
            )
    drawing(design, table.seed)
    kept_measures(table.keep, "uncertainty.keep")
    if table.until is not None:
        level_of(table.until, design.tables.map.levels)
    if table.sensitivity is not None:
        _cells(design, axes, table.sensitivity)
        indices.refuse_correlated(design)


def _cells(design: Design, axes: tuple[Axis, ...], table: SensitivityTable) -> dict[int, str]:
    """Cells nearest to what was asked for, with what they are called."""
    where = "uncertainty.sensitivity.cells"
    known = {a.path: a for a in axes}
    results: dict[int, str] = {}
    for given in table.cells or ({},):
        for path in given:
            if path not in known:
                raise InputError(f"{path!r} is no axis of the map; {nearest(path, known)}", where)
        place = []
        for a in axes:
            target = parameter(design, a.path)
            value = target.parse(given[a.path]) if a.path in given else target.value
            middle = 0.5 * (float(a.values[0]) + float(a.values[-1]))
            place.append(int(np.argmin(np.abs(a.values - (middle if value is None else value)))))
        cell = int(np.ravel_multi_index(place, shape_of(axes)))
        results[cell] = ", ".join(
            f"{a.path} {a.values[k]:g} {a.unit}".rstrip() for a, k in zip(axes, place, strict=True)
        )
    return results


class Interim:
    """Pictures of what is finished, from time to time."""

    def __init__(self, every: float, path: Path, system: units.System) -> None:
        self._every, self._path, self._system = every, path, system
        self._next = time.monotonic() + every

    def __call__(self, so_far: SoFar) -> None:
        """Draw what is finished if it is time."""
        if time.monotonic() < self._next:
            return
        from drillctl import plots

        result = so_far()
        if result is not None and len(result.axes) == 2:
            with replaced(self._path) as part:
                plots.probability_map(result, system=self._system).savefig(part, format="png")
        self._next = time.monotonic() + self._every


def write_columns_of(result: Uncertainty, folder: Path, system: units.System) -> None:
    """Write what has many rows: `cells.csv`, `draws.csv`, and `contours.csv` on request."""
    figures: list[tuple[str, Array, str]] = []
    for level, one in result.maps.items():
        ends = dict(zip(("", "_low", "_high"), (one.probability, *one.interval), strict=True))
        figures += [(f"probability_{level:g}{end}", share, "1") for end, share in ends.items()]
    figures += [(f"j1_{name}", values, "s") for name, values in result.known.items()]
    figures.append(("nominal_j1", result.nominal, "s"))
    cells = over_axes(result.axes, system) | in_columns(figures, system)
    write_columns(folder / "cells.csv", cells)
    unit_of = {one.path: one.unit for one in uncertain_parameters(result.design)}
    drawn = ((path, values, unit_of.get(path, "1")) for path, values in result.drawn.items())
    write_columns(folder / "draws.csv", in_columns(drawn, system))
    if result.design.tables.uncertainty.contours:
        heads = {"level": "s", "realization": "1", "polygon": "1", "ring": "1"}
        heads |= {axis.path: axis.unit for axis in result.axes}
        rows = list(_contours(result))
        columns = zip(*rows, strict=True) if rows else [[] for _ in heads]
        written = {
            headed(name, unit, system): [f"{units.filed(one, unit, system)[0]}" for one in values]
            for (name, unit), values in zip(heads.items(), columns, strict=True)
        }
        write_columns(folder / "contours.csv", written)


def _contours(result: Uncertainty) -> Iterator[tuple[Any, ...]]:
    for level in result.levels:
        for number in range(result.realizations):
            outline = result.contours(level, number)
            for k, polygon in enumerate(outline.geoms):
                for ring, line in enumerate((polygon.exterior, *polygon.interiors)):
                    for x, y in line.coords:
                        yield level, number, k, ring, x, y
