"""A setting with all that is said of it: runs, loop, window, tolerance, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.design.paths import USUAL_NAMES
from drillctl.ensemble.cases import Interval, share_interval, share_of
from drillctl.progress import SILENT
from drillctl.simulation import simulate
from drillctl.store.codec import label
from drillctl.store.json_files import strict
from drillctl.studies.recommend import candidates as c
from drillctl.studies.recommend.criteria import (
    Criterion,
    LoopFigures,
    drive_of,
    limit_criterion,
    loop_criteria,
    loop_figures,
    own_delay,
    run_criteria,
)
from drillctl.studies.recommend.window import Window, window
from drillctl.studies.tune.certificate import FreshDraws, Tolerance, fresh_design, tolerances
from drillctl.studies.tune.problem import GainRuns, alike, objective_of
from drillctl.studies.tune.tuned import Tuned, spread

NOMINAL = (
    "j1", "stick_slip_index", "peak_top_torque", "time_at_torque_limit", "time_at_power_limit",
)  # fmt: skip
"""What is said of the run at nominal rock."""
LOOKED_AT, FEW_DRAWS = 64, 16  # numbers and draws at which it is seen whether they matter at all
TOLERANCE_DRAWS = 300  # first of the fresh draws, at which numbers are moved one by one
PASSES, FRAGILE, FAILS = "passes", "fragile", "does not pass"


@dataclass(frozen=True, eq=False)
class Assessed:
    """One setting with all that is said of it."""

    name: str = label(means="what it is")
    law: str = label(means="of the drive")
    design: Design = label(means="with the setting")
    gains: dict[str, float] = label(means="numbers of the drive by path (SI)")
    controller: dict[str, float] = label(means="numbers as the drive has them (SI)")
    status: str = label(means="how the nominal run ended")
    nominal: dict[str, float] = label(means="measures of the nominal run (SI)")
    j1: Array = label("realization", unit="s", means="J1 at each fresh draw, infinite for no rig")
    objective: float = label(unit="s", means="statistic of J1 that `[tune]` names")
    limited: float = label(means="mean share of the time at a limit of the drive")
    loop: LoopFigures = label(means="figures of the linear loop")
    window: Window = label(means="where it drills without sticking")
    tolerance: tuple[Tolerance, ...] = label(means="how far each number may be off alone")
    criteria: tuple[Criterion, ...] = label(means="what it must keep, and whether it does")
    fragile: tuple[str, ...] = label(means="what makes it fragile")

    @property
    def hits(self) -> int:
        """Draws at or under the level."""
        return int(np.count_nonzero(self.j1 <= self.design.tables.tune.level))

    @property
    def probability(self) -> float:
        """Their share."""
        return self.hits / len(self.j1)

    @property
    def interval(self) -> Interval:
        """Its interval, 95 %."""
        return share_interval(self.hits, len(self.j1))

    @property
    def missed(self) -> tuple[Criterion, ...]:
        """What is not kept."""
        return tuple(one for one in self.criteria if not one.kept)

    @property
    def verdict(self) -> str:
        """In a word or three."""
        if self.missed:
            return FAILS
        return FRAGILE if self.fragile else PASSES

    @property
    def badness(self) -> tuple[float, float]:
        """By how much all criteria together are missed, then the objective: less is better."""
        return sum(one.miss for one in self.missed), self.objective

    def summary(self) -> dict[str, Any]:
        """Strict JSON values, SI."""
        return dict(strict({
            "law": self.law, "gains": self.gains, "j1": self.nominal["j1"],
            "stick_slip_index": self.nominal["stick_slip_index"],
            "peak_top_torque": self.nominal["peak_top_torque"],
            "status": self.status, "probability": self.probability,
            "interval_95": list(self.interval), "objective": self.objective,
            "time_at_limit": self.limited, **self.loop.summary(), **self.window.summary(),
            "tolerance": {one.path: [one.low, one.high] for one in self.tolerance},
            "verdict": self.verdict, "criteria": [one.summary() for one in self.criteria],
            "fragile": list(self.fragile),
        }))  # fmt: skip


def best_of(some: Iterable[Assessed]) -> Assessed:
    """The setting that is recommended among some."""
    ranks = (PASSES, FRAGILE, FAILS)
    return min(some, key=lambda one: (ranks.index(one.verdict), *one.badness))


def assessed(one: c.Candidate, design: Design) -> Assessed:
    """All that is said of one setting."""
    asked, table = design.tables.recommend, design.tables.tune
    run = simulate(design, "batch")
    nominal = {key: _number(getattr(run.measures, key)) for key in NOMINAL}
    j1, limited = drawn(design)
    figures = loop_figures(design, asked.slope_share)
    share = share_of(j1 <= table.level)
    criteria = (
        *loop_criteria(design, figures, asked),
        *run_criteria(nominal["j1"], run.status, table.level, share, table.probability),
        limit_criterion(limited, asked.time_at_limit),
    )
    where = window(design)
    drift = _tolerances(design, share.value) if share.interval[0] >= table.probability else ()
    result = Assessed(
        name=one.name,
        law=one.law or design.tables.controller.law,
        design=design,
        gains=c.gains_of(design),
        controller=c.controller_numbers(design),
        status=run.status,
        nominal=nominal,
        j1=j1,
        objective=float(objective_of(design).value({"j1": j1[None, :]})[0])
        if objective_of(design).needs == ("j1",) else float(np.quantile(j1, table.quantile)),
        limited=limited,
        loop=figures,
        window=where,
        tolerance=drift,
        criteria=criteria,
        fragile=(),
    )  # fmt: skip
    return replace(result, fragile=tuple(_fragile(result)))


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def drawn(design: Design, count: int | None = None) -> tuple[Array, float]:
    """J1 at the fresh draws, and the mean share of the time at a limit of the drive."""
    fresh = fresh_design(design)
    count = fresh.tables.tune.realizations if count is None else count
    runs = GainRuns(fresh, (), count, fresh.tables.tune.seed)
    names = ("j1", "time_at_torque_limit", "time_at_power_limit")
    measures = runs.measures(np.empty((1, 0)), names)
    j1 = np.full(count, np.inf)
    j1[runs.numbers] = measures["j1"][0]
    at_limit = np.maximum(measures[names[1]], measures[names[2]])
    share = np.nanmean(at_limit) / design.tables.simulation.duration
    return j1, float(share) if np.isfinite(share) else 0.0


def _tolerances(design: Design, share: float) -> tuple[Tolerance, ...]:
    """How far each number of the drive may be off alone, at the first of the fresh draws."""
    few = min(TOLERANCE_DRAWS, design.tables.tune.certificate.realizations)
    ranges = c.kept_ranges(design)
    if not ranges:
        return ()
    fresh = FreshDraws(design.replace({"tune.certificate.realizations": few}), ranges)
    gains = c.gains_of(design)
    if alike(fresh.problem.points(spread(ranges, LOOKED_AT), FEW_DRAWS)):
        return tuple(_open(one, gains[one.path], share) for one in ranges)
    return tolerances(fresh, np.array([gains[t.path] for t in ranges]), share, SILENT)


def _open(tuned: Tuned, value: float, share: float) -> Tolerance:
    """That of a number that changes nothing: as far as it is followed."""
    at = np.array([tuned.low, value, tuned.high])
    ends = (tuned.low, tuned.high, True, True)
    return Tolerance(tuned.path, tuned.unit, value, *ends, at, np.full(3, share))


def _fragile(one: Assessed) -> Iterable[str]:
    """What makes a setting fragile."""
    asked = one.design.tables.recommend
    for drift in one.tolerance:
        off = min(drift.value - drift.low, drift.high - drift.value) / drift.value
        at_bound = drift.low_at_bound if drift.value - drift.low < drift.high - drift.value else (
            drift.high_at_bound
        )  # fmt: skip
        if off < asked.fragile_tolerance and not at_bound:
            yield f"{USUAL_NAMES.get(drift.path, drift.path)} may be off by {100 * off:.2g} % only"
    if one.loop.aside:
        yield "modes grow that are too high for the elements to follow, and were not counted"
    whole = one.loop.whole
    if whole is not None and whole.delay < asked.fragile_delay:
        more = own_delay(drive_of(one.design))
        yield (
            f"it bears {1e3 * whole.delay:.2g} ms more delay than the {1e3 * more:.2g} ms of the "
            "drive as described"
        )
    low, high = one.window.lowest_speed, one.window.highest_weight
    speed, weight = one.design.speed, one.design.tables.operating_point.weight_on_bit
    if low is None or low > speed * (1.0 - asked.fragile_window):
        at = "at the highest speed run" if low is None else f"under {units.full(low, 'rad/s', 7)}"
        yield f"the bit sticks {at}"
    if high is None or (
        high < weight * (1.0 + asked.fragile_window) and not one.window.weight_open
    ):
        at = "at the lowest weight run" if high is None else f"above {units.full(high, 'N', 4)}"
        yield f"the bit sticks {at}"
