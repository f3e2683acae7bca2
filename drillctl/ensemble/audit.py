"""Self-audit of a map: some of its cells, simulated again by the reference solver."""

from __future__ import annotations

import math
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from drillctl.arrays import Array, Index
from drillctl.design import Design
from drillctl.ensemble.grid import Axis, cell_design, shape_of
from drillctl.errors import SimulationError
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import label

SEED = 20121  # seed of the choice of cells: the same map is audited at the same cells
WORST_ALLOWED = 1e-2  # relative difference in J1 above which the verdict is `check`
TOLERANCE = 1e-7  # tolerance of the reference solver in an audit: J1 to some 1e-7


@dataclass(frozen=True, eq=False)
class Audit:
    """Batch engine against reference solver at some cells."""

    cells: Index = label("audited", name="audited_{of}", means="index in the flattened map")
    batch: Array = label("audited", unit="s", name="audited_{of}_by_batch", means="J1 of the map")
    reference: Array = label(
        "audited", unit="s", name="audited_j1",
        means="J1 by the reference solver; NaN where that failed",
    )  # fmt: skip
    of: str = "cell"  # what was audited: cells of a map, lanes of realizations

    @property
    def differences(self) -> Array:
        """Relative differences, shape (audited,); NaN where the reference solver failed."""
        # A rig that never leaves its set speed has J1 = 0, known to the tolerance alone.
        return np.abs(self.batch - self.reference) / np.maximum(np.abs(self.reference), TOLERANCE)

    @property
    def worst(self) -> float | None:
        """Largest relative difference; None if no cell was audited or none could be."""
        result = self.differences[np.isfinite(self.differences)]
        return float(result.max()) if result.size else None

    @property
    def verdict(self) -> str:
        """`ok`, `check` when a cell differs too much or failed, `none` without audited cells."""
        if not len(self.cells):
            return "none"
        fine = np.isfinite(self.reference).all() and (self.worst or 0.0) <= WORST_ALLOWED
        return "ok" if fine else "check"

    def sentence(self, what: str) -> str:
        """The verdict, and how far the engines differ at most."""
        text = f"audit: {self.verdict}, {len(self.cells)} {what}"
        if self.worst is None:
            return text
        return f"{text}, worst relative difference in J1 {self.worst:.2g}"

    def summary(self) -> dict[str, Any]:
        """Number of cells, worst difference, verdict."""
        return {
            "cells": len(self.cells),
            "worst_relative_difference": self.worst,
            "verdict": self.verdict,
        }


def unaudited(of: str = "cell") -> Audit:
    """No cells."""
    return Audit(np.empty(0, dtype=np.int64), np.empty(0), np.empty(0), of)


def choose_cells(values: Array, levels: tuple[float, ...], count: int) -> Index:
    """Cells to audit: a seeded random sample, spread over the levels."""
    flat = np.nan_to_num(values.ravel(), nan=np.inf)
    random = np.random.default_rng(SEED)
    edges = [-np.inf, *levels, 2.0 * levels[-1]]
    bands = [
        random.permutation(np.flatnonzero((flat > low) & (flat <= high)))
        for low, high in pairwise(edges)
    ]
    # A band gives its last cells first; of a large map they stay in arrays.
    turns = sorted(
        (turn, band) for band, cells in enumerate(bands) for turn in range(min(len(cells), count))
    )
    chosen = [int(bands[band][-1 - turn]) for turn, band in turns[:count]]
    return np.array(sorted(chosen), dtype=np.int64)


def audit(
    design: Design,
    axes: tuple[Axis, ...],
    values: Array,
    levels: tuple[float, ...],
    count: int,
    progress: Progress = SILENT,
) -> Audit:
    """Simulate some cells of a map again with the reference solver, on all cores."""
    cells = choose_cells(values.reshape(shape_of(axes)), levels, count)
    designs = [cell_design(design, axes, int(cell)) for cell in cells]
    reference = references(designs, progress)
    return Audit(cells, values.ravel()[cells], reference)


def references(
    designs: list[Design], progress: Progress = SILENT, seconds: float = math.inf
) -> Array:
    """J1 of designs by the reference solver (s), on all cores; NaN for those that fail.

    The solver does not hold the interpreter's lock, so that threads are enough.
    """
    if not designs:
        return np.empty(0)

    import numba

    progress.begin("auditing cells", len(designs))
    end, result = time.perf_counter() + seconds, list[float]()

    def in_time(design: Design) -> float | None:
        return reference_j1(design) if time.perf_counter() < end else None

    # As many as the lanes may use, which is what `--threads` sets.
    with ThreadPoolExecutor(min(len(designs), numba.get_num_threads())) as pool:
        try:
            for value in pool.map(in_time, designs):
                if value is None:
                    break
                result.append(value)
                progress.advance(1)
        finally:  # interrupted: the others end what they have begun
            pool.shutdown(cancel_futures=True)
    return np.array(result)


def reference_j1(design: Design) -> float:
    """J1 of a design by the reference solver (s); NaN if that fails, be it by overflow."""
    from drillctl.simulation.reference import solve
    from drillctl.simulation.run import deviation

    table = design.tables.simulation
    try:
        with np.errstate(all="ignore"):  # a run that grows without bound counts as failed
            motion = solve(design, tolerance=TOLERANCE)
    except (SimulationError, ArithmeticError, np.linalg.LinAlgError):
        return float("nan")
    return deviation(motion, table.j1_from, table.duration) / design.speed
