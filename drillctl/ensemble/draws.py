"""Draws of uncertain parameters at one setting as lanes; impossible ones are counted by reason.

Runs of a design at every draw, and the weight on bit that it had on the mean. All draws of a
case share the step that the steepest of them asks for, so that compared cases and searched gains
run at one step; each realization of a map (`realizations.py`) has a step of its own, since it
must not depend on which others are in its block. The two give different last digits, and neither
can take the place of the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from drillctl import units
from drillctl.arrays import Array, Index
from drillctl.design import Design
from drillctl.ensemble.cases import Runs, resampled_draws
from drillctl.ensemble.grid import SHARED, refuse_more_bytes
from drillctl.ensemble.parameters import Draws, draw
from drillctl.ensemble.running import measured
from drillctl.errors import InputError
from drillctl.rig.weight_on_bit import AlarmWeight, ConstantWeight
from drillctl.simulation.batch import Prepared, prepare
from drillctl.simulation.lanes import Lanes, kinds, lane_numbers, lanes_of
from drillctl.simulation.measures import BATCH_MEASURES, STATUSES


@dataclass(frozen=True, eq=False)
class DrawnGroup:
    """Draws that share a string."""

    design: Design  # of the first of them
    lanes: Lanes  # one a draw
    numbers: Index  # shape (lanes,): Position of each among all draws


@dataclass(frozen=True)
class Failures:
    """Draws that came to nothing, for one reason."""

    reason: str  # key or cause
    count: int  # how many draws
    example: str  # problem of the first of them

    def sentence(self, draws: int) -> str:
        """For people, of so many draws."""
        return f"{self.count} of {draws} draws failed; {self.reason}: {self.example}"


@dataclass(frozen=True, eq=False)
class DrawnLanes:
    """All draws of a design."""

    # the possible ones; a single group unless a draw changes the string or a law's type
    groups: tuple[DrawnGroup, ...]
    failures: tuple[Failures, ...]  # the impossible ones


BYTES_PER_DRAW = 2_500
"""Memory that the lane of a draw takes while it is made, beside all others."""


def draw_all(design: Design, count: int, seed: int) -> Draws:
    """Draws to run side by side; refused (`InputError`) if memory falls short."""
    refuse_more_bytes(BYTES_PER_DRAW * count, f"{count:,} draws", "uncertain")
    return draw(design, count, seed)


def drawn_lanes(design: Design, draws: Draws) -> DrawnLanes:
    """Lanes of a design at every draw."""
    design = beyond_the_table(design, tuple(draws.values))
    apart = any(path.startswith(SHARED) for path in draws.values)
    possible: list[_Drawn] = []
    errors: list[InputError] = []
    like: dict[tuple[Any, ...], Design] = {}
    for number in range(len(draws)):
        values = {path: units.SI(column[number]) for path, column in draws.values.items()}
        try:
            variant = design.replace(values)
            lane = lane_numbers(variant)
        except InputError as error:
            errors.append(error)
        else:
            # Thousands of designs would fill the memory; lanes that run together need but one.
            kind = kinds(variant)
            kept = variant if apart else like.setdefault(kind, variant)
            possible.append(_Drawn(number, kept, lane))
    if not possible:
        raise InputError(f"every draw is impossible; the first: {errors[0]}", "uncertain")
    parts = [[one] for one in possible]
    if not apart:
        parts = [[one for one in possible if one.design is kept] for kept in like.values()]
    return DrawnLanes(tuple(_group(part) for part in parts), by_reason(errors))


class _Drawn(NamedTuple):
    """A possible draw: its position, the design of its string, the numbers of its lane."""

    number: int
    design: Design
    lane: dict[str, float]


def beyond_the_table(design: Design, drawn: tuple[str, ...]) -> Design:
    """The design with its friction table extrapolated, if the weight on bit is drawn."""
    table = getattr(design.tables.bit_rock, "table", None)
    if table is None or "operating_point.weight_on_bit" not in drawn:
        return design
    return design.replace({"bit_rock.outside_table": "extrapolate"})


def drawn_designs(design: Design, values: dict[str, Array], numbers: Index) -> list[Design]:
    """The design at some draws, by their numbers."""
    design = beyond_the_table(design, tuple(values))
    return [
        design.replace({path: units.SI(column[n]) for path, column in values.items()})
        for n in numbers.tolist()
    ]


def _group(part: list[_Drawn]) -> DrawnGroup:
    columns = {key: np.array([one.lane[key] for one in part]) for key in part[0].lane}
    design = part[0].design
    return DrawnGroup(design, lanes_of(design, columns), np.array([one.number for one in part]))


def by_reason(errors: list[InputError]) -> tuple[Failures, ...]:
    """Errors counted by the key that they name: their numbers differ from draw to draw."""
    by_key: dict[str, list[InputError]] = {}
    for error in errors:
        by_key.setdefault(error.where, []).append(error)
    return tuple(Failures(key, len(some), some[0].problem) for key, some in by_key.items())


START_UP = 20.0  # time (s) that `mean_weight_after_start` leaves out, of runs of 100 s and more
START_UP_SHARE = 0.2  # and its largest share of shorter runs
EQUAL_TO = 2e-3  # largest relative difference of mean weights that are called equal
SOUGHT_TO = 5e-4  # relative difference that the search for equal weights stops at
MOST_SHIFTS = 40  # shifts of the nominal weight that are tried


def start_up(duration: float) -> float:
    """Time (s) at the beginning of a run that `mean_weight_after_start` leaves out."""
    return min(START_UP, START_UP_SHARE * duration)


def run_draws(drawn: DrawnLanes, count: int, shift: float = 0.0) -> Runs:
    """Simulate a design at every draw with the batch engine."""
    measures = {
        name: np.full(count, np.nan) for name in (*BATCH_MEASURES, "mean_weight_after_start")
    }
    status = np.full(count, STATUSES.index("failed"), dtype=np.int8)
    schemes = set()
    for group in drawn.groups:
        lanes = shifted(group.lanes, shift)
        prepared = prepare(lanes, group.design.tables.simulation)
        batch = measured(lanes, prepared)
        schemes.add((prepared.scheme.step, prepared.scheme.modes))
        for name in BATCH_MEASURES:
            measures[name][group.numbers] = batch.measures[name]
        whole = batch.measures["mean_weight_on_bit"]
        measures["mean_weight_after_start"][group.numbers] = _after_start(lanes, prepared, whole)
        status[group.numbers] = batch.status
    step, modes = next(iter(schemes)) if len(schemes) == 1 else (None, None)
    return Runs(measures, status, step, modes)


def _after_start(lanes: Lanes, prepared: Prepared, whole: Array) -> Array:
    """Mean weight (N) after the start: the mean of the whole run less that of its beginning.

    The beginning is run again by itself. That is the same trajectory, step for step, and the
    kernel needs no second window that every other study would pay for.
    """
    scheme = prepared.scheme
    steps = round(start_up(prepared.duration) / scheme.step)
    if isinstance(lanes.weight, ConstantWeight) or not 0 < steps < scheme.steps:
        return whole
    time = steps * scheme.step
    beginning = Prepared(prepared.stepper, replace(scheme, steps=steps), time, 0.0)
    before = measured(lanes, beginning, ("mean_weight_on_bit",)).measures["mean_weight_on_bit"]
    return np.asarray((whole * prepared.duration - before * time) / (prepared.duration - time))


def shifted(lanes: Lanes, shift: float) -> Lanes:
    """Lanes whose law of the weight on bit has its nominal weight shifted (N)."""
    if shift == 0.0:
        return lanes
    return replace(lanes, weight=lanes.weight._replace(nominal=lanes.weight.nominal + shift))


def equalising_shift(drawn: DrawnLanes, count: int) -> float:
    """Shift of the nominal weight (N) at which the mean weight on bit is the nominal one.

    Means over the draws; that of the weight over each run after its start.
    """
    if isinstance(drawn.groups[0].lanes.weight, ConstantWeight):
        return 0.0
    target = _nominal(drawn)
    shift, error = matching_shift(drawn, count, "mean_weight_after_start", target)
    if abs(error) > EQUAL_TO:
        raise InputError(
            f"within its limits the law cannot have a mean weight of {target / 1e3:g} kN: at the "
            f"nominal weight shifted by {shift / 1e3:g} kN it has {(1 + error) * target / 1e3:g}",
            "weight_on_bit",
        )
    return shift


def matching_shift(
    drawn: DrawnLanes, count: int, measure: str, target: float
) -> tuple[float, float]:
    """Shift of the nominal weight at which the mean of a measure over the draws is a given one."""
    low, high = _allowed(drawn)

    def excess(shift: float) -> float:
        result = run_draws(drawn, count, shift).measures[measure]
        if np.isnan(result).all():
            raise InputError("no draw gives a finite answer", "weight_on_bit")
        return float(np.nanmean(result)) / target - 1.0

    return _zero(excess, low, high, _nominal(drawn))


def _nominal(drawn: DrawnLanes) -> float:
    """Mean over the draws of the nominal weight (N)."""
    return float(np.mean(np.concatenate([g.lanes.nominal_weight for g in drawn.groups])))


def _allowed(drawn: DrawnLanes) -> tuple[float, float]:
    """Shifts (N) that keep the nominal weight of every draw within the limits of its law."""
    laws = [group.lanes.weight for group in drawn.groups]
    if isinstance(laws[0], AlarmWeight):  # its least weight is a share of the nominal one
        return max(float(np.max(-law.nominal)) for law in laws), math.inf
    low = max(float(np.max(law.least - law.nominal)) for law in laws)
    high = min(float(np.min(law.most - law.nominal)) for law in laws)
    return low, high


def _zero(
    excess: Callable[[float], float], low: float, high: float, scale: float
) -> tuple[float, float]:
    """Where the excess vanishes, and what is left of it; the nearest if it does not."""
    known = {0.0: excess(0.0)}
    stride = 1.0
    while len(known) < MOST_SHIFTS:
        best = min(known, key=lambda shift: abs(known[shift]))
        if abs(known[best]) <= SOUGHT_TO:
            break
        under = max((s for s, e in known.items() if e < 0.0), default=None)
        over = min((s for s, e in known.items() if e > 0.0), default=None)
        if under is not None and over is not None:
            share = known[under] / (known[under] - known[over])
            # Not too near an end: the mean jumps where a draw begins to stick.
            trial = under + (over - under) * min(max(share, 0.1), 0.9)
        else:
            # More weight, more mean weight, at about the same rate.
            trial = min(max(best - stride * known[best] * scale, low), high)
            stride *= 1.5
        if trial in known:
            break
        known[trial] = excess(trial)
    best = min(known, key=lambda shift: abs(known[shift]))
    return best, known[best]


@dataclass(frozen=True)
class CommonDraws:
    """The same draws for every design that is run at them."""

    count: int
    seed: int  # what they follow from

    def values(self, design: Design) -> dict[str, Array]:
        """Values of the uncertain parameters of a design by path (SI)."""
        return draw_all(design, self.count, self.seed).values

    def lanes(self, design: Design) -> DrawnLanes:
        """Lanes of a design at these draws."""
        return drawn_lanes(design, draw_all(design, self.count, self.seed))

    def run(self, design: Design, shift: float = 0.0) -> Runs:
        """A design at these draws, its nominal weight shifted (N)."""
        return run_draws(self.lanes(design), self.count, shift)

    @cached_property
    def resamples(self) -> Index:
        """Draws of each resample of an objective, the same for all designs."""
        return resampled_draws(self.count, self.seed)
