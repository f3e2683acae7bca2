"""The certificate of gains: runs at fresh draws, and what else an engineer asks.

A search has seen its realizations, and its optimum is better at them than at others. Here the
gains are run at draws of another seed, by the batch engine at the accuracy of the design, a
sample of them by the reference solver. How often J1 keeps the level is then a binomial count,
whose interval (Clopper & Pearson 1934) is exact.

`passed` means *shown*: the lower end of the 95 % interval is at or above what is required. An
estimate above it whose interval reaches below is no proof, and the verdict says `not shown`: more
realizations decide.

A gain may drift until too few realizations stay under the level, all at the draws of the
certificate. A line from the optimum to a bound is looked at close by first, then ever further
apart, so that the nearest place where the probability falls below what is required is reported and
not one behind it; bisection then refines it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from drillctl.arrays import Array
from drillctl.design import Design, parameter
from drillctl.ensemble.audit import Audit, audited, choose_cells
from drillctl.ensemble.cases import Interval, share_interval
from drillctl.ensemble.draws import Failures, drawn_designs
from drillctl.ensemble.grid import Axis
from drillctl.errors import InputError
from drillctl.linear import loop
from drillctl.progress import SILENT, Progress
from drillctl.simulation.scheme import ACCURACIES
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.studies.tune.problem import GainProblem, GainRuns, Point, rank_weights, weighted
from drillctl.studies.tune.tuned import Tuned

MARGINS = (
    "stable", "slope", "slope_margin", "deciding_frequency_hz", "disk_margin", "peak_sensitivity",
    "delay_margin",
)  # fmt: skip
"""Of `drillctl.loop`."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 0.99)  # of J1, as they are reported
LOOKED_AT = 24
"""Points on the line from the optimum to a bound, at distances that grow with their square."""
AT_A_TIME = 6  # of them, run at a time: none behind the first below
HALVINGS = 8  # of the step in which it falls
POINTS = 21  # along each axis of the neighbourhood
LINE_POINTS = 81  # of the neighbourhood of a single parameter
FEW = 500  # draws of the neighbourhood, the first ones: its probabilities are for the eye
DEAR = 0.5
"""Share of the usual step below which a light bit makes every run dear: the tolerances are then
`fast`, of the first `FEW` draws, and the neighbourhood is coarser."""
DEAR_POINTS, DEAR_FEW = 11, 200  # of that neighbourhood
AROUND = 0.6  # how far the neighbourhood goes on behind the tolerance, over the tolerance's width
LEAST_HALF = 0.02  # its least half width, over that of the bounds


@dataclass(frozen=True, eq=False)
class FreshRuns:
    """J1 of one rig at the fresh draws."""

    j1: Array = label(
        "realization", unit="s",
        means="J1; infinite for a run without an answer, NaN for a draw that no rig has",
    )  # fmt: skip
    value: float = label(unit="s", means="objective of `[tune]` over the draws of possible rigs")
    level: float = label(unit="s", means="level of J1")

    @property
    def hits(self) -> int:
        """Draws with J1 at or under the level; one that no rig has is not."""
        return int(np.count_nonzero(self.j1 <= self.level))

    @property
    def probability(self) -> float:
        """Their share of all draws."""
        return self.hits / len(self.j1)

    @property
    def interval(self) -> Interval:
        """Clopper-Pearson interval of that probability, 95 %."""
        return share_interval(self.hits, len(self.j1))

    @property
    def quantiles(self) -> dict[str, float]:
        """Quantiles of J1 (s) over the draws that a rig can have, by name; infinite ones too."""
        possible = self.j1[~np.isnan(self.j1)]
        return {
            f"q{round(100 * q):02d}": float(
                weighted(possible, rank_weights("quantile", q, len(possible)))
            )
            for q in QUANTILES
        }


def fresh_design(design: Design) -> Design:
    """The design with the draws of its certificate in place of those of the search."""
    # They are independent draws, whatever the sampling of the search: the interval is exact for
    # these alone.
    table = design.tables.tune
    return design.replace(
        {
            "tune.realizations": table.certificate.realizations,
            "tune.seed": table.fresh_seed,
            # The seed of the certificate must differ from that of a search, which this is not.
            "tune.certificate.seed": table.seed,
            "uncertainty.sampling": "monte-carlo",
        }
    )


class FreshDraws:
    """Runs of any gains and any law at the fresh draws of a design."""

    def __init__(self, design: Design, tuned: tuple[Tuned, ...]) -> None:
        self.design = fresh_design(design)
        self.problem = GainProblem(self.design, tuned)
        self.count = len(self.problem.runs.draws)  # those that no rig has included
        self.drawn = self.problem.runs.draws.values  # by path (SI), shape (draws,)
        self._others = 0
        simulation = self.design.tables.simulation
        usual = DEAR * ACCURACIES[simulation.accuracy].step
        schemes = [ready.prepared.scheme for ready in self.problem.runs.groups]
        self.dear = simulation.step is None and any(one.step < usual for one in schemes)

    @cached_property
    def _around(self) -> GainRuns:
        """Runs of other gains than those that are certified."""
        return self.problem.runs.faster() if self.dear else self.problem.runs

    @property
    def trajectories(self) -> int:
        """Runs so far."""
        around = self._around.trajectories if self.dear else 0
        return self.problem.trajectories + self._others + around

    def of_gains(self, values: Array) -> tuple[Point, FreshRuns]:
        """Tuned values (SI), shape (parameters,), as they are judged, and their J1."""
        (point,) = self.problem.points(values[None, :], len(self.problem))
        return point, self._spread(self.problem.runs, point.measures["j1"], point.value)

    def of_design(self, design: Design) -> FreshRuns:
        """A design of any law, at the same draws."""
        table, objective = self.problem.table, self.problem.objective
        sampled = design.replace({"uncertainty.sampling": "monte-carlo"})
        runs = GainRuns(sampled, (), table.realizations, table.seed)
        measures = runs.measures(np.empty((1, 0)), objective.needs)
        self._others += runs.trajectories
        value = float(objective.value({k: v[0] for k, v in measures.items()}))
        return self._spread(runs, measures["j1"][0], value)

    def shares(self, points: Array, realizations: int | None = None) -> Array:
        """Share of the first draws, all by default or `FEW` dear ones, at or under the level."""
        level, runs = self.problem.table.level, self._around
        most = FEW if self.dear else self.count
        count = min(most if realizations is None else realizations, self.count)
        possible = int(np.searchsorted(runs.numbers, count))
        j1 = runs.measures(points, ("j1",), 0, possible, give_up=level)["j1"]
        return np.asarray((j1 <= level).sum(axis=1) / count)

    def _spread(self, runs: GainRuns, j1: Array, value: float) -> FreshRuns:
        """Over all draws, those that no rig has included."""
        whole = np.full(self.count, np.nan)
        whole[runs.numbers] = j1
        return FreshRuns(whole, value, self.problem.table.level)


@dataclass(frozen=True, eq=False)
class Tolerance:
    """How far one parameter may drift alone."""

    path: str = label(means="of the parameter")
    unit: str = label(means="of its values")
    value: float = label(means="at the optimum (SI)")
    # Between these the probability is never below the required one; both the value itself where it
    # is so at the optimum already.
    low: float = label(means="least value that keeps the probability (SI)")
    high: float = label(means="largest value that keeps it (SI)")
    low_at_bound: bool = label(means="whether the bound of the search is the lower end")
    high_at_bound: bool = label(means="whether it is the upper end")
    values: Array = label(
        "line {path}", unit="{unit}", name="line {path}", means="points that were run, increasing"
    )
    probability: Array = label(
        "line {path}", name="probability {path}", means="share of the draws at or under the level"
    )

    def summary(self) -> dict[str, Any]:
        """As strict JSON values, SI."""
        return picked(self, "value", "low", "high", "low_at_bound", "high_at_bound")


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """Probability about the optimum over the first one or two parameters."""

    axes: tuple[Axis, ...] = label(flat=True, means="one or two")
    probability: Array = label(
        "axes", name="probability", means="share of the draws with J1 at or under the level"
    )
    realizations: int = label(means="how many draws")


def tolerances(
    fresh: FreshDraws, values: Array, probability: float, progress: Progress
) -> tuple[Tolerance, ...]:
    """Tolerance of each parameter."""
    progress.begin("tolerance of the gains", len(values))
    results = []
    for k in range(len(values)):
        results.append(_tolerance(fresh, values, k, probability))
        progress.advance(1)
    return tuple(results)


def _tolerance(fresh: FreshDraws, values: Array, k: int, probability: float) -> Tolerance:
    tuned = fresh.problem.tuned[k]
    seen = {float(values[k]): probability}
    kept, own = probability >= fresh.problem.table.probability, float(values[k])
    bounds = (tuned.low, tuned.high)
    ends = [_end(fresh, values, k, one, seen) if kept else (own, False) for one in bounds]
    at = np.array(sorted(seen))
    (low, low_at_bound), (high, high_at_bound) = ends
    return Tolerance(
        tuned.path, tuned.unit, own, low, high, low_at_bound, high_at_bound,
        at, np.array([seen[x] for x in at]),
    )  # fmt: skip


def _end(
    fresh: FreshDraws, values: Array, k: int, bound: float, seen: dict[float, float]
) -> tuple[float, bool]:
    """Where the probability falls below what is required, and whether that is the bound."""
    required = fresh.problem.table.probability
    start = float(values[k])
    line = start + (bound - start) * (np.arange(1, LOOKED_AT + 1) / LOOKED_AT) ** 2
    if start == bound:
        return bound, True
    inside = start
    for first in range(0, LOOKED_AT, AT_A_TIME):
        some = line[first : first + AT_A_TIME]
        shares = fresh.shares(_moved(values, k, some))
        seen.update(zip(some.tolist(), shares.tolist(), strict=True))
        below = np.flatnonzero(shares < required)
        if len(below):
            inside = inside if below[0] == 0 else float(some[below[0] - 1])
            return _halved(fresh, values, k, inside, float(some[below[0]]), seen), False
        inside = float(some[-1])
    return bound, True


def _halved(
    fresh: FreshDraws, values: Array, k: int, inside: float, outside: float,
    seen: dict[float, float],
) -> float:  # fmt: skip
    """The last value that keeps the probability, by bisection."""
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        (share,) = fresh.shares(_moved(values, k, np.array([middle])))
        seen[middle] = float(share)
        if share < fresh.problem.table.probability:
            outside = middle
        else:
            inside = middle
    return inside


def _moved(values: Array, k: int, others: Array) -> Array:
    """Points that differ from the optimum in one parameter."""
    points = np.tile(values, (len(others), 1))
    points[:, k] = others
    return points


def neighbourhood(fresh: FreshDraws, values: Array, ends: tuple[Tolerance, ...]) -> Neighbourhood:
    """Probability over the first two parameters, or the only one, about the optimum."""
    some = min(2, len(values))
    points = LINE_POINTS if some == 1 else DEAR_POINTS if fresh.dear else POINTS
    axes = []
    for tuned, one in zip(fresh.problem.tuned[:some], ends[:some], strict=True):
        wide = AROUND * (one.high - one.low) + LEAST_HALF * (tuned.high - tuned.low)
        low, high = max(tuned.low, one.low - wide), min(tuned.high, one.high + wide)
        axes.append(Axis(tuned.path, tuned.unit, np.linspace(low, high, points)))
    grid = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
    cells = np.tile(values, (grid[0].size, 1))
    for k, column in enumerate(grid):
        cells[:, k] = column.ravel()
    count = min(DEAR_FEW if fresh.dear else FEW, fresh.count)
    shares = fresh.shares(cells, count)
    return Neighbourhood(tuple(axes), shares.reshape(grid[0].shape), count)


@dataclass(frozen=True, eq=False)
class Drawn:
    """Values drawn for one parameter."""

    path: str = label(means="of the parameter")
    unit: str = label(means="of its values")
    values: Array = label("realization", unit="{unit}", name="drawn {path}", means="drawn values")


@dataclass(frozen=True, eq=False)
class Certificate:
    """What fresh draws say of gains."""

    runs: FreshRuns = label(flat=True, means="J1 at each draw")
    required: float = label(means="required probability")
    seed: int = label(means="of the draws")
    draws: tuple[Drawn, ...] = label(means="what was drawn")
    failures: tuple[Failures, ...] = label(means="draws that no rig has; over the level")
    violations: dict[str, float] = label(means="requirements that are missed, over their limits")
    margins: dict[str, Any] = label(means="figures of the linear loop, empty where there is none")
    no_margins: str = label(means="why there are none")
    audit: Audit = label(means="a sample of the draws by the reference solver, by their numbers")
    tolerances: tuple[Tolerance, ...] = label(means="how far each parameter may drift alone")
    neighbourhood: Neighbourhood = label(flat=True, means="probability about the optimum")
    trajectories: int = label(means="runs of the batch engine")
    seconds: float = label(unit="s", means="time that it took")

    @property
    def drawn(self) -> dict[str, Array]:
        """Drawn values by path (SI), shape (draws,)."""
        return {one.path: one.values for one in self.draws}

    @property
    def passed(self) -> bool:
        """Whether it is shown that the probability is at or above what is required."""
        return self.runs.interval[0] >= self.required

    @property
    def verdict(self) -> str:
        """`passed`, `failed` if the contrary is shown, `not shown` if neither is."""
        if self.passed:
            return "passed"
        return "failed" if self.runs.interval[1] < self.required else "not shown"

    @cached_property
    def worst(self) -> int | None:
        """Number of the draw with the largest J1; None if no rig has any."""
        possible = np.flatnonzero(~np.isnan(self.runs.j1))
        return int(possible[np.argmax(self.runs.j1[possible])]) if len(possible) else None

    @property
    def other_side(self) -> int:
        """Audited draws that the two solvers put on different sides of the level."""
        audit = self.audit
        one, other = (values["j1"] <= self.runs.level for values in (audit.batch, audit.reference))
        return int(np.count_nonzero((one != other) & ~audit.failed))

    @property
    def message(self) -> str:
        """The verdict in a sentence."""
        low, high = self.runs.interval
        result = (
            f"J1 <= {self.runs.level:g} s with probability {self.runs.probability:.4f} "
            f"({low:.4f} to {high:.4f}, 95 %) over {len(self.runs.j1)} fresh realizations, "
            f"{self.required:g} required"
        )
        if self.verdict == "not shown":
            return f"certificate not shown: {result}; more realizations would decide"
        return f"certificate {self.verdict}: {result}"

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        runs, number = self.runs, self.worst
        worst = number is not None and {
            "realization": number,
            "j1": float(runs.j1[number]),
            "drawn": {path: float(column[number]) for path, column in self.drawn.items()},
        }
        return {
            "level": runs.level,
            "required_probability": self.required,
            "realizations": len(runs.j1),
            "interval_95": list(runs.interval),
            **picked(runs, "probability", "value", "quantiles"),
            **picked(self, "seed", "passed", "verdict", "message", "violations"),
            "failures": [vars(one) for one in self.failures],
            "margins": self.margins or None,
            "no_margins": self.no_margins or None,
            "worst": worst or None,
            "audit": {**self.audit.summary(), "other_side_of_level": self.other_side},
            "tolerance": {one.path: one.summary() for one in self.tolerances},
            "neighbourhood": {
                "parameters": [axis.path for axis in self.neighbourhood.axes],
                "realizations": self.neighbourhood.realizations,
            },
            **picked(self, "trajectories", "seconds"),
        }


def certified(
    design: Design, fresh: FreshDraws, values: Array, progress: Progress = SILENT
) -> Certificate:
    """Certify gains."""
    begin, before = time.perf_counter(), fresh.trajectories
    table, problem = design.tables.tune, fresh.problem
    point, runs = fresh.of_gains(values)
    margins, no_margins = {}, ""
    try:
        summary = loop(design).summary()
        margins = {key: summary[key] for key in MARGINS}
    except InputError as error:
        no_margins = str(error)
    audit = _audit(design, fresh, runs, table.certificate.audit, progress)
    drifts = tolerances(fresh, values, runs.probability, progress)
    return Certificate(
        runs=runs,
        required=table.probability,
        seed=table.fresh_seed,
        draws=tuple(
            Drawn(path, parameter(design, path).si_unit, values)
            for path, values in fresh.drawn.items()
        ),
        failures=problem.runs.failures,
        violations=problem.violations(point),
        margins=margins,
        no_margins=no_margins,
        audit=audit,
        tolerances=drifts,
        neighbourhood=neighbourhood(fresh, values, drifts),
        trajectories=fresh.trajectories - before,
        seconds=time.perf_counter() - begin,
    )


def _audit(
    design: Design, fresh: FreshDraws, runs: FreshRuns, count: int, progress: Progress
) -> Audit:
    """Some draws by the reference solver, spread over what lies under the level and beyond."""
    numbers = choose_cells(runs.j1, (runs.level,), count)
    designs = drawn_designs(design, fresh.drawn, numbers)
    return audited(numbers, {"j1": runs.j1[numbers]}, designs, "draw", progress)
