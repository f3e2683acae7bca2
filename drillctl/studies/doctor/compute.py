"""How a design is examined: what the batch engine does with it, why, how well and how fast.

A seeded sample of the cells of the design's map is simulated at its scheme and at finer ones, which
gives an estimate of each lane's error from the engine alone; some of the lanes are simulated again
with the reference solver.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array, Index
from drillctl.design import Design
from drillctl.design.tables import SimulationTable
from drillctl.ensemble import audit as auditing
from drillctl.ensemble.grid import (
    Axis,
    Group,
    axes_of,
    cell_design,
    groups,
    place_of,
    shape_of,
    span,
)
from drillctl.ensemble.running import load_kernel, measured
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.rig.bit_rock import PrintedThreeBranch
from drillctl.rig.drillstring import Drillstring
from drillctl.simulation.batch import Prepared, bounds_of, prepare
from drillctl.simulation.kernels.string_step import (
    BlockString,
    DriftString,
    UndampedString,
    WallString,
)
from drillctl.simulation.lanes import Lanes
from drillctl.simulation.measures import STATUSES
from drillctl.simulation.scheme import (
    ACCURACIES,
    PROMISES,
    ROUNDING,
    SMALLEST,
    Bound,
    Scheme,
    plain_steps,
)
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.store.result import Timed, timed

SHORTENED = 1e-3
"""Share by which a step must be shorter than its bound for whole steps to be the reason."""
FORMS = {
    "undamped": "undamped modes", "blocks": "2 x 2 blocks", "dense": "a dense matrix",
    "wall": "2 x 2 blocks, with nodes at which the wall rubs",
}  # fmt: skip
"""Forms of the string, in words."""


def explain(lanes: Lanes, table: SimulationTable, prepared: Prepared) -> dict[str, Any]:
    """A scheme and why it was chosen, as strict JSON values; SI units."""
    scheme, string = prepared.scheme, lanes.string
    bounds = bounds_of(lanes, table)
    highest = float(string.undamped_modes[0][scheme.modes - 1])
    return {
        "accuracy": table.accuracy,
        **picked(scheme, "step", "steps", "modes", "sampling"),
        # A bound, or 'sampling' or 'program' where the step is shorter for whole steps to a period
        # of the controller, or to what changes by the clock.
        "decided_by": _decided(bounds, table.duration, scheme),
        "bounds": {bound.name: bound.step for bound in bounds},  # a given step stands alone
        "reasons": {bound.name: bound.reason for bound in bounds},
        # Modes that turn little enough in a step, all of the string, two, or as given.
        "modes_by": _modes_by(string, table, scheme),
        "highest_frequency_hz": highest / (2.0 * math.pi),
        "turn": highest * scheme.step,  # of that mode in a step (rad)
        # Modes that are not carried; their static share of the pipe torque is.
        "modes_left_out": string.nodes - scheme.modes,
        "string": form_of(prepared.stepper.string),
    }


def form_of(string: Any) -> str:
    """Name of the form of a string made ready: a key of `FORMS`."""
    if isinstance(string, UndampedString):
        return "undamped"
    if isinstance(string, (WallString, DriftString)):
        return "wall"
    return "blocks" if isinstance(string, BlockString) else "dense"


def _decided(bounds: tuple[Bound, ...], duration: float, scheme: Scheme) -> str:
    least = min(bounds, key=lambda bound: bound.step)
    if scheme.sampling and scheme.step < least.step * (1.0 - SHORTENED):
        return "sampling"
    if not scheme.sampling and scheme.steps > plain_steps(duration, least.step):
        return "program"
    return least.name


def _modes_by(string: Drillstring, table: SimulationTable, scheme: Scheme) -> str:
    if table.modes is not None:
        return "given"
    highest = string.undamped_modes[0][scheme.modes - 1]
    if highest * scheme.step > ACCURACIES[table.accuracy].phase:
        return "fewest"
    return "all" if scheme.modes == string.nodes else "turn"


REFINEMENTS = (1, 2, 4)  # parts into which the step of the scheme is divided
ORDER_TWO = 4.0 / 3.0
"""Error of a scheme of order 2 per difference to the same at half the step (Richardson)."""
ENOUGH = 8  # fewest lanes from which an order is computed


class Errors(NamedTuple):
    """Relative errors of J1 over a sample of lanes."""

    median: float
    p90: float
    p99: float
    worst: float


def errors_of(values: Array) -> Errors:
    """Percentiles of those relative errors that are numbers; all NaN if none is."""
    known = values[np.isfinite(values)]
    if not known.size:
        return Errors(np.nan, np.nan, np.nan, np.nan)
    median, p90, p99 = map(float, np.percentile(known, (50, 90, 99)))
    return Errors(median, p90, p99, float(known.max()))


@dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """J1 of a sample of lanes at a scheme and at finer ones."""

    # shape (3, lanes): At the scheme, at half and at a quarter of its step (s); NaN where a lane
    # failed
    j1: Array = label("refinement", "lane", unit="s")

    @cached_property
    def best(self) -> Array:
        """J1 extrapolated from the two finest, shape (lanes,) (s)."""
        return self.j1[2] + (ORDER_TWO - 1.0) * (self.j1[2] - self.j1[1])

    @cached_property
    def of_lanes(self) -> Array:
        """Estimated relative error of each lane at the scheme, shape (lanes,)."""
        return self._between(0)

    @property
    def errors(self) -> Errors:
        """At the scheme."""
        return errors_of(self.of_lanes)

    @property
    def of_lanes_at_half(self) -> Array:
        """At half its step, shape (lanes,)."""
        return self._between(1)

    def _between(self, row: int) -> Array:
        apart = ORDER_TWO * np.abs(self.j1[row] - self.j1[row + 1])
        return apart / np.maximum(np.abs(self.best), SMALLEST)

    def of_other(self, j1: Array) -> Array:
        """Errors of J1 by another scheme, shape (lanes,), beside the best known."""
        return np.abs(j1 - self.best) / np.maximum(np.abs(self.best), SMALLEST)

    @property
    def order(self) -> float | None:
        """Median over lanes of the order that three steps show; None where it cannot be seen."""
        first, second = np.abs(np.diff(self.j1, axis=0)) / np.maximum(np.abs(self.best), SMALLEST)
        seen = (first > ROUNDING) & (second > ROUNDING)
        if seen.sum() < ENOUGH:
            return None
        return float(np.median(np.log2(first[seen] / second[seen])))


SEED = 20122  # seed of the sample: the same design is examined at the same cells
LANES = 256  # lanes in the sample; fewer if the map has fewer cells
AUDITED = 4
AUDIT_SECONDS = 10.0  # after so long (s) no further run of the reference solver is begun
LEAST_ORDER = 1.0  # order under which a shorter step is no advice


CONFIRMED, REFERENCE = 3.0, 1e-6
"""An audited difference confirms an estimate up to so many times it, and what the reference
solver itself is good for."""
TIMED_SECONDS = 0.3  # least length of a timed run (s)
MOST_LANES = 65_536
REPEATS = 3  # runs of which the fastest counts: what others take of the machine is not the engine


@dataclass(frozen=True, eq=False)
class Doctor(Timed, kind="doctor"):
    """What the batch engine does with a design, on a sample of the cells of its map.

    The sample is the design alone where the default map does not fit it. `scheme` holds step,
    modes and the reasons for them, of the string with the shortest step if axes change the
    string.
    """

    design: Design = label(means="that was examined")
    axes: tuple[Axis, ...] = label(means="of the map that the sample is from")
    cells: Index = label("lane", name="cell", means="the sample, in the flattened map")
    estimate: ErrorEstimate = label(flat=True, means="J1 of the lanes at three schemes")
    status: NDArray[np.int8] = label("lane", flags=STATUSES, means="status at the scheme")
    scheme: dict[str, Any] | None = label(means="None if the engine refuses the design")
    strings: int = label(means="strings in the sample")
    audit: auditing.Audit = label(means="lanes simulated again with the reference solver")
    requested_audit: int = label(means="how many were requested")
    speed: dict[str, Any] | None = label(
        means="threads, lanes and seconds of a timed run, lanes per second, ns of a core per step"
    )
    refused: str | None = label(means="why the batch engine does not take this design")
    advice: str | None = label(means="what would keep the promise of the accuracy")

    @property
    def engine(self) -> str:
        """Engine that `simulate` uses for this design."""
        return self.design.tables.simulation.engine or "reference"

    @property
    def accuracy(self) -> str:
        """Accuracy that the design asks for; explicit steps and modes are held to it too."""
        return self.design.tables.simulation.accuracy

    @property
    def confirmed(self) -> bool | None:
        """Whether the audited differences are such as the estimate expects; None without any."""
        differences = self.audit.differences
        known = np.isfinite(differences)
        if not known.any():
            return None
        own = self.estimate.of_lanes[np.searchsorted(self.cells, self.audit.cells)]
        expected = np.fmax(own, self.estimate.errors.median)
        allowed = CONFIRMED * expected + REFERENCE
        return bool((differences[known] <= allowed[known]).all())

    @property
    def verdict(self) -> str:
        """`ok`, `not_reached`, `check` if the audit does not confirm the estimate, `refused`."""
        if self.refused is not None:
            return "refused"
        if not PROMISES[self.accuracy].kept(self.estimate.of_lanes):
            return "not_reached"
        return "check" if self.confirmed is False else "ok"

    def summary(self) -> dict[str, Any]:
        """Scheme and reasons, estimated and audited error, speed, verdict; SI units."""
        promise = PROMISES[self.accuracy]
        scheme = None if self.scheme is None else self.scheme | {"strings": self.strings}
        return {
            **picked(self, "verdict", "refused", "advice", "engine", "speed", "total_seconds"),
            "scheme": scheme,
            "estimate": {
                "lanes": len(self.cells),
                "failed": int((~np.isfinite(self.estimate.of_lanes)).sum()),
                **self.estimate.errors._asdict(),
                "order": self.estimate.order,
                "promised": {"median": promise.median, "p99": promise.p99},
            },
            "audit": {
                **self.audit.summary(),
                "asked": self.requested_audit,
                "confirms_estimate": self.confirmed,
                "lanes": [self._audited(i) for i in range(len(self.audit.cells))],
            },
            "axes": span(self.axes),
        }

    def _audited(self, number: int) -> dict[str, Any]:
        cell = int(self.audit.cells[number])
        lane = int(np.searchsorted(self.cells, cell))
        return {
            "at": place_of(self.axes, cell),
            "j1": float(self.audit.batch["j1"][number]),
            "reference_j1": float(self.audit.reference["j1"][number]),
            "relative_difference": float(self.audit.differences[number]),
            "estimated_error": float(self.estimate.of_lanes[lane]),
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """How many lanes were audited, where that is not usual."""
        audit = {} if self.requested_audit == AUDITED else {"audit": self.requested_audit}
        return self.design, audit


@timed
def doctor(design: Design, audit_cells: int = AUDITED, progress: Progress = SILENT) -> Doctor:
    """Examine what the batch engine does with a design.

    Parameters
    ----------
    design : Design
        Its map, or the default one, gives the sample.
    audit_cells : int
        Lanes to simulate again with the reference solver; none is begun after some seconds.
    progress : Progress
        Receives finished stages.

    Returns
    -------
    Doctor
        A law that the batch engine does not take is stated in it.

    Raises
    ------
    InputError
        A map that does not fit the design, or a given step too long for its friction or string.
    """
    if isinstance(design.bit_rock, PrintedThreeBranch):
        return _refused(design)
    axes, result = _cells_of(design)
    sample = _sample(axes, result)
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
        scheme=main.reasons(),
        strings=len(sample.parts),
        audit=audited,
        requested_audit=audit_cells,
        speed=speed,
        refused=None,
        advice=advice,
    )


def _refused(design: Design) -> Doctor:
    """Of a rock that is no law of the batch engine."""
    return Doctor(
        design=design,
        axes=(),
        cells=np.empty(0, dtype=np.int64),
        estimate=ErrorEstimate(np.empty((len(REFINEMENTS), 0))),
        status=np.empty(0, dtype=np.int8),
        scheme=None,
        strings=0,
        audit=auditing.unaudited(),
        requested_audit=0,
        speed=None,
        refused="'printed-three-branch' is not a law of the batch engine: maps, regions and "
        "comparisons refuse it; single runs with the reference solver take it",
        advice="bit_rock.law = 'navarro-lopez-suarez', the set that it stands in for",
    )


def _cells_of(design: Design) -> tuple[tuple[Axis, ...], list[Group]]:
    """The map's axes and groups; of a design that the default map does not fit, itself alone."""
    try:
        axes = axes_of(design)
        return axes, list(groups(design, axes))
    except InputError:
        if "axes" in design.tree.get("map", {}):
            raise
        return (), list(groups(design, ()))


@dataclass(frozen=True, eq=False)
class _Part:
    """Lanes of the sample that share a string."""

    group: Group
    chosen: Index  # lanes of the group
    at: Index  # their places in the sample
    prepared: Prepared

    def reasons(self) -> dict[str, Any]:
        table = self.group.design.tables.simulation
        return explain(self.group.telling, table, self.prepared)


@dataclass(frozen=True, eq=False)
class _Sample:
    cells: Index
    parts: list[_Part]

    def examine(self, progress: Progress) -> tuple[ErrorEstimate, NDArray[np.int8]]:
        """J1 at the scheme and at finer ones; status at the scheme."""
        j1 = np.full((len(REFINEMENTS), len(self.cells)), np.nan)
        status = np.empty(len(self.cells), dtype=np.int8)
        for part in self.parts:
            lanes, table = part.group.some(part.chosen), part.group.design.tables.simulation
            for row, parts in enumerate(REFINEMENTS):
                made = auditing.refined(lanes.string, table, part.prepared, parts, lanes.wall)
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


def _sample(axes: tuple[Axis, ...], result: list[Group]) -> _Sample:
    """Cells drawn from all, and what they share."""
    count = int(np.prod(shape_of(axes), dtype=int))
    random = np.random.default_rng(SEED)
    cells = np.sort(random.choice(count, size=min(LANES, count), replace=False, shuffle=False))
    parts = []
    for group in result:
        # Few cells of many: each is looked for in the group, whose cells may be millions.
        chosen = group.lanes_at(cells)
        at = np.flatnonzero(chosen >= 0)
        if at.size:
            made = prepare(group.telling, group.design.tables.simulation)
            parts.append(_Part(group, chosen[at], at, made))
    return _Sample(cells, parts)


def _audited(
    design: Design, axes: tuple[Axis, ...], cells: Index, j1: Array, count: int, progress: Progress
) -> auditing.Audit:
    """Some lanes of the sample, spread over the levels; the lowest if all are beyond."""
    lanes = auditing.choose_cells(j1, design.tables.map.levels, count)
    if not len(lanes):
        known = np.flatnonzero(np.isfinite(j1))
        lanes = np.sort(known[np.argsort(j1[known])][:count])
    designs = [cell_design(design, axes, int(cell)) for cell in cells[lanes]]
    batch = {"j1": j1[lanes]}
    return auditing.audited(cells[lanes], batch, designs, "cell", progress, AUDIT_SECONDS)


def _speed(part: _Part) -> dict[str, Any]:
    """Speed of the engine on lanes of a design, the kernel warm."""
    lanes, prepared = part.group.some(part.chosen), part.prepared
    load_kernel(lanes, prepared)
    many = lanes
    while (seconds := _best(many, prepared, 1)[0]) < TIMED_SECONDS and len(many) < MOST_LANES:
        # The first runs are slow for other reasons than their lanes: not too much at once.
        wanted = len(many) * min(10.0, max(1.5, 1.3 * TIMED_SECONDS / seconds))
        many = lanes[np.arange(min(MOST_LANES, int(wanted) + 1)) % len(lanes)]
    seconds, used = _best(many, prepared, REPEATS)
    return {
        "threads": numba.get_num_threads(),
        "lanes": len(many),
        "seconds": seconds,
        "lanes_per_second": len(many) / seconds,  # from their start to the end of their horizon
        "lane_step_ns": 1e9 * used / (len(many) * prepared.scheme.steps),
    }


def _best(lanes: Lanes, prepared: Prepared, repeats: int) -> tuple[float, float]:
    """Least time on the clock and of all threads (s)."""
    results = []
    for _ in range(repeats):
        begin, used = time.perf_counter(), time.process_time()
        measured(lanes, prepared)
        results.append((time.perf_counter() - begin, time.process_time() - used))
    clock, busy = zip(*results, strict=True)
    return min(clock), min(busy)


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
