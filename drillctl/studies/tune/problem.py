r"""What a search of gains lowers, from runs of many gains at the same draws by the batch engine.

It is a statistic of J1 over the realizations, and what is added to it.

Every statistic here is a weighted sum of the sorted values, weights :math:`w_i \ge 0` that sum to
one: mean 1/n each; the worst alone; CVaR the mean of the largest share 1 - q; a quantile the
values next to it.

What a search compares is a smooth quantile, over more of its neighbours by a kernel on their
ranks (after Sheather & Marron, J. Am. Stat. Assoc. 85 (1990) 410-416). The plain one turns from
realization to realization; its least value, besides, lies where just under a share 1 - q of the
realizations has begun to stick, next to a cliff that other realizations put elsewhere. The kernel
feels the cliff from two hundredths away. It ends well before the largest values: runs that stick
to the end are several times the quantile, and no smoothing may let them in. What is reported is
always the plain statistic.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from drillctl.arrays import Array, Index
from drillctl.design import Design, parameter
from drillctl.ensemble.draws import DrawnGroup, Failures, draw_all, drawn_lanes
from drillctl.ensemble.running import measured
from drillctl.errors import InputError
from drillctl.linear.operating_point import at_speed
from drillctl.simulation.batch import Prepared, prepare, trace
from drillctl.simulation.lanes import Lanes
from drillctl.studies.tune.loops import Loops, loops_of, refuse_not_linear
from drillctl.studies.tune.settings import TuneTable
from drillctl.studies.tune.tuned import (
    StringNumbers,
    Tuned,
    controller_paths,
    designs_at,
    drive_numbers,
    middle,
    put,
    string_numbers,
    tracked,
)

SAMPLED = 0.1  # distance of the samples that an effort is read from (s)
TOGETHER = 20_000  # lanes made at a time: bounds the memory


@dataclass(frozen=True, eq=False)
class Ready:
    """A group of realizations that share a string, ready to run."""

    group: DrawnGroup
    prepared: Prepared
    string: StringNumbers


Batch = tuple[Index, Index, Lanes, Prepared]  # rows and columns of the results, and what to run


class GainRuns:
    """Measures of gains at the realizations of a design."""

    # The realizations are the first of one sequence, the same for all gains: what is compared is
    # compared under the same conditions, and more of them begin with the same ones.

    def __init__(
        self, design: Design, tuned: tuple[Tuned, ...], realizations: int, seed: int
    ) -> None:
        self.design, self.tuned = middle(design, tuned), tuned
        self.draws = draw_all(self.design, realizations, seed)
        self.trajectories = 0
        self._at_once = _at_once(self.design, tuned)
        drawn = drawn_lanes(self.design, self.draws)
        self.failures: tuple[Failures, ...] = drawn.failures
        self.groups = []
        for one in drawn.groups:
            prepared = prepare(one.lanes, one.design.tables.simulation)
            self.groups.append(Ready(one, prepared, string_numbers(one.design.string)))
        self.numbers = np.sort(np.concatenate([g.group.numbers for g in self.groups]))

    def __len__(self) -> int:
        return len(self.numbers)

    def faster(self) -> GainRuns:
        """The same realizations at the accuracy `fast`; their lanes are not made again."""
        result = copy(self)
        result.design = self.design.replace({"simulation.accuracy": "fast"})
        table = result.design.tables.simulation
        result.groups = [replace(x, prepared=prepare(x.group.lanes, table)) for x in self.groups]
        result.trajectories = 0
        return result

    def measures(
        self, points: Array, names: tuple[str, ...], first: int = 0, last: int | None = None,
        give_up: float = math.inf,
    ) -> dict[str, Array]:  # fmt: skip
        """Measures of points at realizations."""
        chosen = self.numbers[first:last]
        results = {name: np.full((len(points), len(chosen)), np.nan) for name in names}
        most = TOGETHER // (20 if "effort" in names else 1)  # traces take more room
        for rows, columns, lanes, prepared in self._batches(points, chosen, most):
            for name, values in _run(lanes, prepared, names, give_up).items():
                results[name][np.ix_(rows, columns)] = values.reshape(len(rows), len(columns))
        self.trajectories += len(points) * len(chosen)
        if "j1" in results:
            results["j1"] = np.where(np.isnan(results["j1"]), math.inf, results["j1"])
        return results

    def _batches(self, points: Array, chosen: Index, most: int) -> Iterator[Batch]:
        """Lanes of points at chosen realizations that share a string, point by point."""
        for ready in self.groups if self._at_once else ():
            members = np.flatnonzero(np.isin(ready.group.numbers, chosen))
            columns = np.searchsorted(chosen, ready.group.numbers[members])
            size = max(1, most // max(1, len(members)))
            for begin in range(0, len(points) if len(members) else 0, size):
                rows = np.arange(begin, min(begin + size, len(points)))
                yield rows, columns, self._lanes(points[rows], ready, members), ready.prepared
        # Any other parameter may be tuned: lanes are made anew from the design.
        for row, point in enumerate(() if self._at_once else points):
            try:
                drawn = drawn_lanes(put(self.design, self.tuned, point), self.draws)
            except InputError:  # no rig at all
                continue
            for group in drawn.groups:
                members = np.flatnonzero(np.isin(group.numbers, chosen))
                if len(members):
                    lanes = group.lanes[members]
                    columns = np.searchsorted(chosen, group.numbers[members])
                    prepared = prepare(lanes, group.design.tables.simulation)
                    yield np.array([row]), columns, lanes, prepared

    def _lanes(self, points: Array, ready: Ready, members: Index) -> Lanes:
        """Every point at every member, point by point."""
        lanes = ready.group.lanes[np.tile(members, len(points))]
        columns = {t.path: np.repeat(points[:, k], len(members)) for k, t in enumerate(self.tuned)}
        numbers: dict[str, Any] = {}
        if any(path.startswith("controller.") for path in columns):
            numbers = drive_numbers(ready.group.design, columns, ready.string)
            numbers = tracked(ready.group.design, numbers)
        known = {k: v for k, v in numbers.items() if k in lanes.drive._fields}
        whole = {k: np.full(len(lanes), v, dtype=float) for k, v in known.items()}
        weight = lanes.weight
        if "weight_on_bit.gain" in columns:
            weight = weight._replace(gain=columns["weight_on_bit.gain"])
        return replace(lanes, drive=lanes.drive._replace(**whole), weight=weight)


def _at_once(design: Design, tuned: tuple[Tuned, ...]) -> bool:
    """Whether lanes differ in numbers of drive and weight law alone, which are known."""
    known = [*controller_paths(design)]
    if hasattr(design.weight_on_bit, "gain"):
        known.append("weight_on_bit.gain")
    drawn = any(path.startswith("controller.") for path in design.tables.uncertain)
    return all(t.path in known for t in tuned) and not drawn


def _run(
    lanes: Lanes, prepared: Prepared, names: tuple[str, ...], give_up: float
) -> dict[str, Array]:
    kept = tuple(name for name in names if name != "effort")
    result = measured(lanes, prepared, kept, give_up).measures
    if "effort" in names:
        result["effort"] = _effort(lanes, prepared)
    return result


def _effort(lanes: Lanes, prepared: Prepared) -> Array:
    """Root mean square of the top torque less its steady value (N m)."""
    from drillctl.linear.operating_point import rock_at

    _, signals = trace(lanes, prepared, SAMPLED)
    steady, _ = rock_at(lanes.friction, lanes.weight, lanes.set_speed)
    drag = float(lanes.string.ground_damping.sum()) * lanes.set_speed
    return np.asarray(np.sqrt(np.mean((signals["top_torque"] - steady - drag) ** 2, axis=0)))


PRICE = 1000.0  # of a requirement missed by all of itself, in seconds of J1

KERNEL = 0.02  # half width of the kernel of a smooth quantile, as a share of the realizations


def rank_weights(kind: str, quantile: float, count: int) -> Array:
    """Weights of sorted values, lowest first."""
    weights = np.zeros(count)
    if kind == "mean":
        weights[:] = 1.0 / count
    elif kind == "worst":
        weights[-1] = 1.0
    elif kind == "cvar":
        # The last `beyond` values, the first of them in part.
        beyond = (1.0 - quantile) * count
        held = np.arange(count, 0, -1) - 1.0  # values above each
        weights = np.clip(beyond - held, 0.0, 1.0) / beyond
    else:
        place = quantile * (count - 1)
        low = min(math.floor(place), count - 2) if count > 1 else 0
        weights[low] = 1.0 - (place - low)
        weights[min(low + 1, count - 1)] += place - low
    return weights


def smooth_weights(kind: str, quantile: float, count: int) -> Array:
    """The same for a model: of a quantile those of a triangular kernel on the ranks."""
    if kind != "quantile":
        return rank_weights(kind, quantile, count)
    reach = min(KERNEL, 0.5 * quantile, 0.5 * (1.0 - quantile)) * count
    away = np.abs(np.arange(count) - quantile * (count - 1))
    weights = np.maximum(1.0 - away / max(reach, 1.0), 0.0)
    return np.asarray(weights / weights.sum())


def weighted(values: Array, weights: Array) -> Array:
    """Weighted sum of the sorted values, over the last axis."""
    used = weights > 0.0  # no weight on what is infinite
    return np.asarray(np.sort(values, axis=-1)[..., used] @ weights[used])


@dataclass(frozen=True, eq=False)
class Objective:
    """Statistic of J1, weights of other measures, and limits of the runs."""

    table: TuneTable  # as the design has it
    static: float  # static torque of the bit (N m), the measure of torques
    nominal: float  # nominal weight on bit (N), the measure of weights

    @property
    def needs(self) -> tuple[str, ...]:
        """Measures that it reads."""
        weights, asked = self.table.weights, self.table.constraints
        names = ["j1"]
        if weights.effort > 0.0:
            names.append("effort")
        if weights.peak_top_torque > 0.0 or asked.peak_top_torque is not None:
            names.append("peak_top_torque")
        if weights.lost_weight > 0.0 or asked.mean_weight_on_bit is not None:
            names.append("mean_weight_on_bit")
        return tuple(names)

    def value(self, measures: Mapping[str, Array], smooth: bool = False) -> Array:
        """The objective (s), over the last axis of the measures, the realizations."""
        # A realization without an answer has an infinite J1.
        table = self.table
        result = self._statistic(measures["j1"], smooth)
        weights = table.weights
        if weights.effort > 0.0:
            result = result + weights.effort * measures["effort"].mean(axis=-1) / self.static
        if weights.peak_top_torque > 0.0:
            peak = measures["peak_top_torque"].mean(axis=-1)
            result = result + weights.peak_top_torque * peak / self.static
        if weights.lost_weight > 0.0:
            lost = 1.0 - measures["mean_weight_on_bit"].mean(axis=-1) / self.nominal
            result = result + weights.lost_weight * np.maximum(lost, 0.0)
        return np.asarray(result)

    def violations(self, measures: Mapping[str, Array], smooth: bool = False) -> dict[str, Array]:
        """By how much each limit of the runs is missed, over the limit; not negative."""
        asked, result = self.table.constraints, {}
        if asked.peak_top_torque is not None:
            count = measures["peak_top_torque"].shape[-1]
            make = smooth_weights if smooth else rank_weights
            weights = make("quantile", self.table.quantile, count)
            peak = np.sort(measures["peak_top_torque"], axis=-1) @ weights
            result["peak_top_torque"] = np.maximum(peak / asked.peak_top_torque - 1.0, 0.0)
        if asked.mean_weight_on_bit is not None:
            mean = measures["mean_weight_on_bit"].mean(axis=-1)
            result["mean_weight_on_bit"] = np.maximum(1.0 - mean / asked.mean_weight_on_bit, 0.0)
        return result

    def merit(self, measures: Mapping[str, Array], smooth: bool = False) -> Array:
        """The objective with what limits are missed by (s): what a search compares."""
        missed = self.violations(measures, smooth)
        return np.asarray(self.value(measures, smooth) + PRICE * sum(missed.values()))

    def share(self, measures: Mapping[str, Array]) -> Array:
        """Share of the realizations with J1 at or under the level."""
        return np.asarray((measures["j1"] <= self.table.level).mean(axis=-1))

    def _statistic(self, j1: Array, smooth: bool) -> Array:
        make = smooth_weights if smooth else rank_weights
        return weighted(j1, make(self.table.objective, self.table.quantile, j1.shape[-1]))


def objective_of(design: Design) -> Objective:
    """The objective of a design's `[tune]` table."""
    weight = design.tables.operating_point.weight_on_bit
    point = at_speed(design, design.speed)
    static = float(design.bit_rock.static_torque(weight)) or abs(point.bit_torque) or 1.0
    return Objective(design.tables.tune, static, weight or 1.0)


STRINGS = 16  # realizations at which requirements of the linear loop are checked
ROUNDING = 1e-6  # A violation of less is none


@dataclass(frozen=True, eq=False)
class Point:
    """Evaluated gains."""

    values: Array  # shape (parameters,): SI
    measures: dict[str, Array]  # shape (realizations,): SI
    value: float  # objective (s)
    # what a search compares (s): the objective, a quantile smoothed, with what requirements are
    # missed by
    merit: float
    share: float  # share of realizations with J1 at or under the level

    @property
    def realizations(self) -> int:
        """At how many it was evaluated."""
        return len(self.measures["j1"])


ALIKE = 1e-5
"""Share of the objective under which gains are the same: that of J1 which a step of the batch
engine leaves open is several times as large."""


def alike(points: Sequence[Point]) -> bool:
    """Whether what sets points apart changes nothing: the top of a rig may turn as it likes."""
    merits = [point.merit for point in points]
    return max(merits) - min(merits) <= ALIKE * min(merits)


class GainProblem:
    """Objective, limits and requirements of gains at the realizations of a design."""

    def __init__(self, design: Design, tuned: tuple[Tuned, ...]) -> None:
        self.design, self.tuned, self.table = design, tuned, design.tables.tune
        self.runs = GainRuns(design, tuned, self.table.realizations, self.table.seed)
        self.objective = objective_of(design)
        self.low = np.array([t.low for t in tuned])
        self.width = np.array([t.high - t.low for t in tuned])
        _ = self.loops  # requirements that do not apply to these parameters are refused now

    def __len__(self) -> int:
        return len(self.runs)

    @property
    def trajectories(self) -> int:
        """Runs so far."""
        return self.runs.trajectories

    def shares(self, values: Array) -> Array:
        """Values over the width of their bounds."""
        return np.asarray((values - self.low) / self.width)

    def values(self, shares: Array) -> Array:
        """Values (SI) of shares, kept within the bounds."""
        return np.asarray(self.low + self.width * np.clip(shares, 0.0, 1.0))

    def own(self, design: Design) -> Array | None:
        """The design's own values, where it has them and they lie within the bounds."""
        results = [parameter(design, t.path).value for t in self.tuned]
        if any(value is None for value in results):
            return None
        values = np.array(results, dtype=float)
        inside = np.all((values >= self.low) & (values <= self.low + self.width))
        return values if inside else None

    @cached_property
    def loops(self) -> Loops | None:
        """Linear loops, where something is required of them."""
        asked = self.table.constraints
        linear = (asked.slope_reserve, asked.peak_sensitivity, asked.damping_ratio, asked.delay)
        if all(one is None for one in linear):
            return None
        try:
            refuse_not_linear(self.design, self.tuned)
        except InputError as error:
            raise InputError(
                f"requirements of the linear loop: {error}", "tune.constraints"
            ) from None
        some = self.runs.draws
        designs = [self.design, *list(designs_at(self.design, some))[:STRINGS]]
        return Loops(self.tuned, loops_of(designs, self.tuned), asked)

    def points(self, values: Array, count: int, first: int = 0) -> list[Point]:
        """Points at the first realizations, `values` of shape (points, parameters)."""
        measures = self.runs.measures(values, self.objective.needs, first, first + count)
        return [
            self._point(one, {name: column[row] for name, column in measures.items()})
            for row, one in enumerate(values)
        ]

    def at_all(self, point: Point) -> Point:
        """A point at all realizations; those that it met already are not run again."""
        done = point.realizations
        if done == len(self):
            return point
        more = self.runs.measures(point.values[None, :], self.objective.needs, done)
        own = {k: np.concatenate([v, more[k][0]]) for k, v in point.measures.items()}
        return self._point(point.values, own)

    def _point(self, values: Array, measures: dict[str, Array]) -> Point:
        linear = self._linear(values)
        return Point(
            values,
            measures,
            float(self.objective.value(measures)),
            float(self.objective.merit(measures, smooth=True)) + PRICE * sum(linear.values()),
            float(self.objective.share(measures)),
        )

    def _linear(self, values: Array) -> dict[str, float]:
        if self.loops is None:
            return {}
        return {k: v for k, v in self.loops.at(values).violations.items() if v > ROUNDING}

    def violations(self, point: Point) -> dict[str, float]:
        """Requirements that a point misses, over their limits."""
        runs = {k: float(v) for k, v in self.objective.violations(point.measures).items()}
        return {k: v for k, v in runs.items() if v > ROUNDING} | self._linear(point.values)
