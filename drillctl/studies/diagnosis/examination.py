"""How a design is examined: what the batch engine does with it, how well and how fast.

A seeded sample of the cells of the design's map is simulated at the chosen scheme and at finer
ones, which gives an estimate of each lane's error from the engine alone; some of the lanes are
simulated again with the reference solver.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble import audit as auditing
from drillctl.ensemble.grid import Axis, Group, axes_of, cell_design, groups, shape_of
from drillctl.ensemble.running import measured
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.rig.bit_rock import PrintedThreeBranch
from drillctl.simulation.batch import Prepared, prepare
from drillctl.studies.diagnosis.engine_speed import Speed, engine_speed
from drillctl.studies.diagnosis.error_estimate import (
    PROMISES,
    REFINEMENTS,
    ErrorEstimate,
    errors_of,
    refined,
)
from drillctl.studies.diagnosis.result import Doctor
from drillctl.studies.diagnosis.scheme_reasons import SchemeReasons, explain

Array = NDArray[np.float64]

SEED = 20122
"""Seed of the sample: the same design is examined at the same cells."""
LANES = 256
"""Lanes in the sample; fewer if the map has fewer cells."""
AUDITED = 4
AUDIT_SECONDS = 10.0
"""After so long (s) no further run of the reference solver is begun."""
LEAST_ORDER = 1.0
"""Order under which a shorter step is no advice."""


def doctor(design: Design, audit_cells: int = AUDITED, progress: Progress = SILENT) -> Doctor:
    """Examine what the batch engine does with a design.

    Parameters
    ----------
    design : Design
        Its map, or the default one, gives the sample.
    audit_cells : int
        Lanes to simulate again with the reference solver; none is begun after some seconds.
    progress : Progress
        Told of what is being done.

    Returns
    -------
    Doctor
        A law that the batch engine does not take is told in it.

    Raises
    ------
    InputError
        A map that does not fit the design, or a given step too long for its friction or string.
    """
    begin = time.perf_counter()
    if isinstance(design.bit_rock, PrintedThreeBranch):
        return _refused(design, begin)
    axes, found = _cells_of(design)
    sample = _sample(axes, found)
    progress.begin("simulating lanes at three schemes", len(REFINEMENTS) * len(sample.cells))
    estimate, status = sample.examine(progress)
    main = min(sample.parts, key=lambda part: part.prepared.scheme.step)
    audited = _audited(design, axes, sample.cells, estimate.j1[0], audit_cells, progress)
    progress.begin("measuring the speed", 1)
    speed = _speed(main)
    promise = PROMISES[design.tables.simulation.accuracy]
    advice = None if promise.kept(estimate.of_lanes) else _advice(design, sample, estimate, main)
    return Doctor(
        design=design,
        axes=axes,
        cells=sample.cells,
        estimate=estimate,
        status=status,
        scheme=main.reasons().summary(),
        strings=len(sample.parts),
        audit=audited,
        asked=audit_cells,
        speed=speed.summary(),
        refused=None,
        advice=advice,
        total_seconds=time.perf_counter() - begin,
    )


def _refused(design: Design, begin: float) -> Doctor:
    """Of a rock that is no law of the batch engine."""
    none = np.empty(0)
    return Doctor(
        design=design,
        axes=(),
        cells=np.empty(0, dtype=np.int64),
        estimate=ErrorEstimate(np.empty((len(REFINEMENTS), 0))),
        status=np.empty(0, dtype=np.int8),
        scheme=None,
        strings=0,
        audit=auditing.Audit(np.empty(0, dtype=np.int64), none, none),
        asked=0,
        speed=None,
        refused="'printed-three-branch' is not a law of the batch engine: maps, regions and "
        "comparisons refuse it; single runs with the reference solver take it",
        advice="bit_rock.law = 'navarro-lopez-suarez', the set that it stands in for",
        total_seconds=time.perf_counter() - begin,
    )


def _cells_of(design: Design) -> tuple[tuple[Axis, ...], list[Group]]:
    """The map's axes and groups; of a design that the default map does not fit, itself alone."""
    try:
        axes = axes_of(design, design.tables.map.axes)
        return axes, list(groups(design, axes))
    except InputError:
        if "axes" in design.tree.get("map", {}):
            raise
        return (), list(groups(design, ()))


@dataclass(frozen=True, eq=False)
class _Part:
    """Lanes of the sample that share a string."""

    group: Group
    chosen: NDArray[np.int64]  # lanes of the group
    at: NDArray[np.int64]  # their places in the sample
    prepared: Prepared

    def reasons(self) -> SchemeReasons:
        table = self.group.design.tables.simulation
        return explain(self.group.telling, table, self.prepared)


@dataclass(frozen=True, eq=False)
class _Sample:
    cells: NDArray[np.int64]
    parts: list[_Part]

    def examine(self, progress: Progress) -> tuple[ErrorEstimate, NDArray[np.int8]]:
        """J1 at the scheme and at finer ones; status at the scheme."""
        j1 = np.full((len(REFINEMENTS), len(self.cells)), np.nan)
        status = np.empty(len(self.cells), dtype=np.int8)
        for part in self.parts:
            lanes, table = part.group.some(part.chosen), part.group.design.tables.simulation
            for row, parts in enumerate(REFINEMENTS):
                made = refined(lanes.string, table, part.prepared, parts)
                batch = measured(lanes, made)
                j1[row, part.at] = batch.measures["j1"]
                if parts == 1:
                    status[part.at] = batch.status
                progress.advance(len(lanes))
        return ErrorEstimate(j1), status

    def at_accuracy(self, name: str) -> tuple[Array, float]:
        """J1 of its lanes at a named accuracy, and the shortest step of it (s)."""
        j1, step = np.full(len(self.cells), np.nan), np.inf
        for part in self.parts:
            table = part.group.design.tables.simulation
            asked = table.model_copy(update={"accuracy": name, "step": None, "modes": None})
            made = prepare(part.group.telling, asked)
            j1[part.at] = measured(part.group.some(part.chosen), made).measures["j1"]
            step = min(step, made.scheme.step)
        return j1, step


def _sample(axes: tuple[Axis, ...], found: list[Group]) -> _Sample:
    """Cells drawn from all, and what they share."""
    count = int(np.prod(shape_of(axes), dtype=int))
    random = np.random.default_rng(SEED)
    cells = np.sort(random.choice(count, size=min(LANES, count), replace=False, shuffle=False))
    parts = []
    for group in found:
        # Few cells of many: each is looked for in the group, whose cells may be millions.
        chosen = group.lanes_at(cells)
        at = np.flatnonzero(chosen >= 0)
        if at.size:
            made = prepare(group.telling, group.design.tables.simulation)
            parts.append(_Part(group, chosen[at], at, made))
    return _Sample(cells, parts)


def _audited(
    design: Design,
    axes: tuple[Axis, ...],
    cells: NDArray[np.int64],
    j1: Array,
    count: int,
    progress: Progress,
) -> auditing.Audit:
    """Some lanes of the sample, spread over the levels; the lowest if all are beyond."""
    lanes = auditing.choose_cells(j1, design.tables.map.levels, count)
    if not len(lanes):
        known = np.flatnonzero(np.isfinite(j1))
        lanes = np.sort(known[np.argsort(j1[known])][:count])
    designs = [cell_design(design, axes, int(cell)) if axes else design for cell in cells[lanes]]
    reference = auditing.references(designs, progress, AUDIT_SECONDS)
    lanes = lanes[: len(reference)]
    return auditing.Audit(cells[lanes], j1[lanes], reference)


def _speed(part: _Part) -> Speed:
    lanes = part.group.some(part.chosen)
    return engine_speed(lanes, part.prepared)


def _advice(design: Design, sample: _Sample, estimate: ErrorEstimate, main: _Part) -> str:
    """A finer named accuracy that keeps what was promised, tried out; or a step."""
    table = design.tables.simulation
    promise, names = PROMISES[table.accuracy], list(PROMISES)
    explicit = table.step is not None or table.modes is not None
    if not np.isfinite(estimate.of_lanes).any():
        return "no lane of the sample gives a finite answer"
    for name in names[names.index(table.accuracy) + (not explicit) :]:
        j1, step = sample.at_accuracy(name)
        errors = estimate.of_other(j1)
        if promise.kept(errors):
            drop = " without simulation.step and simulation.modes" if explicit else ""
            return (
                f"simulation.accuracy = '{name}'{drop}: step {1e3 * step:.3g} ms, estimated 99th "
                f"percentile {errors_of(errors).p99:.1e}"
            )
    if estimate.order is not None and estimate.order < LEAST_ORDER:
        return (
            f"errors do not fall with the step (order seen: {estimate.order:.1f}): a shorter one "
            "will not help; look at the inertia at the bit and at the friction law"
        )
    half, step = estimate.of_lanes_at_half, main.prepared.scheme.step
    if promise.kept(half):
        p99 = errors_of(half).p99
        return f"simulation.step = '{500.0 * step:.4g} ms': estimated 99th percentile {p99:.1e}"
    known = estimate.errors
    short = min(1.0, (promise.p99 / known.p99) ** 0.5)
    if promise.median is not None:
        short = min(short, (promise.median / known.median) ** 0.5)
    return (
        f"simulation.step = '{1e3 * step * short:.2g} ms' if errors fall with its square; lanes on "
        "the verge of sticking fall slower"
    )
