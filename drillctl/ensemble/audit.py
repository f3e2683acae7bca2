"""Audit of the batch engine: some of its runs again, by the reference solver and at a finer step.

One comparison with one verdict for every study. Each measure is compared within its own tolerance,
the status must be the same. Where a quarter of the step moves J1 by a good part of its tolerance,
one stick more or less decides it: a cell on the *verge*. Such cells are listed, and the verdict is
of the others. A measure that jumps, such as a settling time by one swing, is excused in the same
way where it moves as far. Where that is frequent, the step is too long, and nothing is excused.
"""

from __future__ import annotations

import math
import time
from collections.abc import Hashable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import islice, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array, Index, Mask
from drillctl.design import Design
from drillctl.design.tables import SimulationTable
from drillctl.errors import SimulationError
from drillctl.progress import SILENT, Progress, Silent
from drillctl.rig.drillstring import Drillstring
from drillctl.rig.well.wall import Wall
from drillctl.simulation.batch import Prepared, new_watch, prepare, run_batch
from drillctl.simulation.lanes import kinds, lane_numbers, lanes_of, timed
from drillctl.simulation.measures import BATCH_MEASURES, MEASURES, STATUSES
from drillctl.simulation.propagator import string_step
from drillctl.simulation.scheme import ACCURACIES, Scheme
from drillctl.store.codec import label

SEED = 20121  # seed of the choice of cells: the same map is audited at the same cells
TOLERANCE = 1e-7  # tolerance of the reference solver in an audit: J1 to some 1e-7
PARTS = 4  # of the step, at the other accuracy
RICHARDSON = PARTS**2 / (PARTS**2 - 1.0)
"""Error of a scheme of order 2 per difference to the same at the finer step."""
MOVED = 0.2
"""Share of a tolerance by which the finer step moves what is excused. Where runs follow the step
smoothly it moves them by their error; where a stick decides, one more or less at either step."""
MOST_EXCUSED = 0.25  # largest share of cells that are excused; one always may be
AT_LEVELS = 0.25  # share of the audited cells that are those nearest to the levels

Values = dict[str, Array]
"""Measures of cells by name, NaN where undefined, and their `status`, an index into `STATUSES`."""


class Compared(NamedTuple):
    """A measure over the audited cells."""

    name: str
    tolerance: float  # share of the value, or of what it counts for at least
    worst: float | None  # largest difference that is not excused, in the same way; None without
    beyond: int  # cells that differ by more and are not excused
    excused: int  # those that are


@dataclass(frozen=True, eq=False)
class Audit:
    """Batch engine against reference solver at some cells."""

    cells: Index = label("audited_{of}s", name="audited_{of}", means="index in the flattened map")
    batch: Values = label(
        "audited_{of}s", name="audited_{of}_by_batch", means="by the batch engine, SI"
    )
    reference: Values = label(
        "audited_{of}s", name="audited_{of}_by_reference",
        means="by the reference solver, SI; NaN where that failed",
    )  # fmt: skip
    finer: Values = label(
        "audited_{of}s", name="audited_{of}_at_finer_step", default_factory=dict,
        means="by the batch engine at a quarter of its step, SI",
    )  # fmt: skip
    speed: Array = label(
        "audited_{of}s", name="audited_{of}_speed", unit="rad/s", means="set speed",
        default_factory=lambda: np.empty(0),
    )  # fmt: skip
    duration: float = label(unit="s", means="length of the runs", default=math.inf)
    of: str = "cell"  # what was audited: cells of a map, lanes of realizations, draws

    @property
    def differences(self) -> Array:
        """Relative differences in J1, shape (audited,); NaN where the reference solver failed."""
        return self._apart("j1", self.reference)

    @property
    def worst(self) -> float | None:
        """Largest of them; None if no cell was audited or none could be."""
        return _largest(self.differences)

    @property
    def estimates(self) -> Array:
        """Relative errors of J1 by the engine's own account, shape (audited,)."""
        return RICHARDSON * self._apart("j1", self.finer) if self.finer else np.empty(0)

    @property
    def median(self) -> float | None:
        """Median of them; None without any."""
        known = self.estimates[np.isfinite(self.estimates)]
        return float(np.median(known)) if known.size else None

    @cached_property
    def failed(self) -> Mask:
        """Cells that the reference solver could not finish."""
        return ~np.isfinite(self.reference["j1"])

    @cached_property
    def verge(self) -> Mask:
        """Cells in which one stick more or less decides J1."""
        return self._excused("j1")

    @property
    def beyond(self) -> Mask:
        """Cells in which a measure or the status differs from the reference solver's, or all do."""
        results = [self._apart(n, self.reference) > _tolerance(n) for n in self.batch]
        return np.logical_or.reduce([self.failed, *results])

    @property
    def verdict(self) -> str:
        """`ok`, `check` when a cell differs too much or failed, `none` without audited cells."""
        if not len(self.cells):
            return "none"
        return "check" if self.failed.any() or self.wrong or self.unsettled else "ok"

    @cached_property
    def compared(self) -> tuple[Compared, ...]:
        """Every measure that was compared, and the status."""
        results = []
        for name in self.batch:
            excused = self.verge | self._excused(name)
            apart, tolerance = self._apart(name, self.reference), _tolerance(name)
            kept, beyond = np.where(excused, np.nan, apart), apart > tolerance
            counts = int((beyond & ~excused).sum()), int((beyond & excused).sum())
            results.append(Compared(name, tolerance, _largest(kept), *counts))
        return tuple(results)

    def sentence(self, what: str) -> str:
        """The verdict, how far the engines differ at most, and where the verge decides."""
        text = f"audit: {self.verdict}, {len(self.cells)} {what}"
        if self.worst is not None:
            text += f", worst relative difference in J1 {self.worst:.2g}"
        if self.median is not None:
            text += f", estimated median error {self.median:.1g}"
        if self.verge.any():
            text += f", {self.verge.sum()} on the verge of another stick"
        if self.wrong:
            text += f"; beyond tolerance: {', '.join(self.wrong)}"
        if self.unsettled:
            text += f"; another at a finer step too often: {', '.join(self.unsettled)}"
        return text

    @property
    def wrong(self) -> list[str]:
        """What differs by more than its tolerance and is not excused."""
        return [measure_label(one.name) for one in self.compared if one.beyond]

    @property
    def unsettled(self) -> list[str]:
        """What differs and is excused, where that is too many cells for one stick in some."""
        if self.beyond.sum() <= max(1.0, MOST_EXCUSED * len(self.cells)):
            return []
        return [measure_label(one.name) for one in self.compared if one.excused]

    def summary(self) -> dict[str, Any]:
        """Verdict, number of cells, differences by measure, estimated errors, the verge."""
        return {
            "cells": len(self.cells),
            "worst_relative_difference": self.worst,
            "verdict": self.verdict,
            "failed": int(self.failed.sum()),
            "estimated_error": {"median": self.median, "worst": _largest(self.estimates)},
            "verge": self.cells[self.verge].tolist(),
            "beyond": self.cells[self.beyond].tolist(),
            "measures": {one.name: one._asdict() for one in self.compared},
        }

    def _apart(self, name: str, other: Values) -> Array:
        """Differences from other runs, shape (audited,), in the way of the tolerance."""
        one, other_one = self.batch[name], other[name]
        if name == "status":
            return np.where(np.isnan(other_one), np.nan, np.abs(one - other_one))
        undefined = np.isnan(one) & np.isnan(other_one)
        scale = np.maximum(np.abs(other_one), self._least(name))
        apart = np.where(undefined, 0.0, np.abs(one - other_one) / scale)
        # Defined in one of them alone; of a run that failed nothing is.
        return np.where(np.isnan(other["j1"]), np.nan, np.where(np.isnan(apart), np.inf, apart))

    def _least(self, name: str) -> Any:
        least = MEASURES[name].least
        if isinstance(least, float):
            return least
        return self.duration if least == "duration" else np.abs(self.speed)

    def _excused(self, name: str) -> Mask:
        """Cells in which the finer step moves a measure by a good part of its tolerance."""
        if not self.finer:
            return np.zeros(len(self.cells), dtype=bool)
        return self._apart(name, self.finer) > MOVED * _tolerance(name)


def measure_label(name: str) -> str:
    """A measure or the status as people call it."""
    return MEASURES[name].label if name in MEASURES else name


def _tolerance(name: str) -> float:
    return 0.0 if name == "status" else MEASURES[name].tolerance


def _largest(values: Array) -> float | None:
    """Largest of the values that are numbers."""
    known = values[np.isfinite(values)]
    return float(known.max()) if known.size else None


def unaudited(of: str = "cell") -> Audit:
    """No cells."""
    none = {"j1": np.empty(0)}
    return Audit(np.empty(0, dtype=np.int64), none, none, of=of)


def choose_cells(values: Array, levels: tuple[float, ...], count: int) -> Index:
    """Cells to audit: those nearest to the levels, and a seeded sample spread between them."""
    flat = np.nan_to_num(values.ravel(), nan=np.inf)
    near = _nearest(flat, levels, int(AT_LEVELS * count))
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
    spread = (int(bands[band][-1 - turn]) for turn, band in turns)
    chosen = [*near, *islice((cell for cell in spread if cell not in near), count - len(near))]
    return np.array(sorted(chosen), dtype=np.int64)


def _nearest(flat: Array, levels: tuple[float, ...], count: int) -> list[int]:
    """Cells nearest to the levels, as many to each; none beyond twice the highest level."""
    chosen = list[int]()
    for number, level in enumerate(reversed(levels)):
        share = -(-(count - len(chosen)) // (len(levels) - number))
        if share:
            away = np.where(flat <= 2.0 * levels[-1], np.abs(flat - level), np.inf)
            away[chosen] = np.inf
            near = np.argpartition(away, min(share, away.size) - 1)[:share]
            chosen += near[np.isfinite(away[near])].tolist()
    return chosen


def kept(measures: Values, status: NDArray[Any] | None, cells: Index) -> Values:
    """What a study knows of some cells of its flattened map."""
    known = {name: measures[name].ravel()[cells] for name in BATCH_MEASURES if name in measures}
    return known if status is None else known | {"status": status.ravel()[cells].astype(float)}


def audited(
    cells: Index,
    batch: Values,
    designs: list[Design],
    of: str = "cell",
    progress: Progress = SILENT,
    seconds: float = math.inf,
) -> Audit:
    """Compare cells of a study, of which it knows some measures, on all cores.

    Neither engine holds the interpreter's lock, so that threads are enough. After so many seconds
    no further cell is begun.
    """
    if not designs:
        return unaudited(of)

    import numba

    progress.begin(f"auditing {of}s", len(designs))
    end, runs = time.perf_counter() + seconds, list[tuple[dict[str, float], ...]]()
    batches = by_batch(designs)
    until = _UntilStopped()

    def in_time(design: Design) -> dict[str, float] | None:
        if time.perf_counter() >= end:
            return None
        return by_reference(design, until)

    # As many as the lanes may use, which is what `--threads` sets.
    with ThreadPoolExecutor(min(len(designs), numba.get_num_threads())) as pool:
        try:
            for ran, one in zip(batches, pool.map(in_time, designs), strict=True):
                if one is None:
                    break
                runs.append((*ran, one))
                progress.advance(1)
        finally:  # interrupted, or out of time
            until.watch[0] = 1
            pool.shutdown(cancel_futures=True)
    done = len(runs)
    own, finer, reference = (
        {name: np.array([one[k][name] for one in runs]) for name in (*BATCH_MEASURES, "status")}
        for k in range(3)
    )
    # What the study did not keep is from its cell run alone.
    own |= {name: values[:done] for name, values in batch.items()}
    speed = np.array([design.speed for design in designs[:done]])
    duration = designs[0].tables.simulation.duration
    return Audit(cells[:done], own, reference, finer, speed, duration, of)


class _UntilStopped(Silent):
    """Progress of runs in threads that no interruption reaches: it ends them when told to."""

    def __init__(self) -> None:
        self.watch = new_watch()

    def advance(self, done: int) -> None:
        if self.watch[0]:
            raise SimulationError("stopped")


def by_batch(designs: Sequence[Design]) -> list[tuple[dict[str, float], ...]]:
    """Measures and status of designs by the batch engine, at their step and at a quarter of it.

    Those that can share a string run together: a block of lanes costs as much as one.
    """
    groups: dict[Hashable, list[int]] = {}
    for place, design in enumerate(designs):
        groups.setdefault(_in_common(design), []).append(place)
    results: list[tuple[dict[str, float], ...]] = [()] * len(designs)
    for places in groups.values():
        design = designs[places[0]]
        numbers = [lane_numbers(designs[place]) for place in places]
        lanes = lanes_of(design, {k: np.array([one[k] for one in numbers]) for k in numbers[0]})
        table = design.tables.simulation
        own = prepare(lanes, table)
        for prepared in (own, refined(design.string, table, own, PARTS, design.wall)):
            ran = run_batch(lanes, prepared)
            for lane, place in enumerate(places):
                values = {name: float(column[lane]) for name, column in ran.measures.items()}
                results[place] += (values | {"status": float(ran.status[lane])},)
    return results


def _in_common(design: Design) -> Hashable:
    """What designs agree on whose lanes run together: all but numbers of laws and of the start."""
    tables = design.tables
    numbered: Any = dict.fromkeys(("controller", "operating_point", "bit_rock", "scenario"), True)
    others = tables.model_dump_json(exclude=numbered | {"start": {"speed"}})
    return kinds(design), design.string.parts, timed(lane_numbers(design)), others


def by_reference(design: Design, progress: Progress = SILENT) -> dict[str, float]:
    """The same by the reference solver; all NaN if that fails, be it by overflow."""
    from drillctl.simulation.reference import solve
    from drillctl.simulation.run import sample

    try:
        with np.errstate(all="ignore"):  # a run that grows without bound counts as failed
            ran = sample(solve(design, TOLERANCE, progress))
    except (SimulationError, ArithmeticError, np.linalg.LinAlgError):
        return dict.fromkeys((*BATCH_MEASURES, "status"), math.nan)
    values = {k: math.nan if v is None else float(v) for k, v in ran.measures.as_dict().items()}
    return values | {"status": float(STATUSES.index(ran.status))}


def refined(
    string: Drillstring, table: SimulationTable, prepared: Prepared, parts: int,
    wall: Wall | None = None,
) -> Any:  # fmt: skip
    """The same run with each step in parts, and as many times the modes."""
    if parts == 1:
        return prepared
    old = prepared.scheme
    step = old.step / parts
    followed = int((string.undamped_modes[0] * step <= ACCURACIES[table.accuracy].phase).sum())
    modes = min(string.nodes, max(parts * old.modes, followed))
    scheme = Scheme(step, parts * old.steps, modes, parts * old.sampling)
    stepper = string_step(string, step, modes, wall)
    return Prepared(stepper, scheme, prepared.duration, prepared.j1_from)
