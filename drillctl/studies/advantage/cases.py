"""The table: every policy at its own robust optimum, on all terms, at the same fresh draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.intervals import Interval, mean_interval, share_interval
from drillctl.progress import Progress
from drillctl.studies.advantage.equalities import (
    ALL_TERMS,
    NOMINAL,
    Terms,
    fresh_shift,
    tuned_on_terms,
)
from drillctl.studies.advantage.measured import Estimate, Fresh, Measured, estimate, less
from drillctl.studies.advantage.optimum import Optimum, optimum
from drillctl.studies.advantage.policies import CONSTANT, GAIN, KI, KP, Policies, Policy

Array = NDArray[np.float64]

MEASURES = {
    "j1": "s", "mean_weight_after_start": "N", "rop_proxy": "1", "peak_bit_speed": "rad/s",
    "peak_pipe_torque": "N*m", "peak_top_torque": "N*m", "settling_time": "s",
}  # fmt: skip
"""What is kept of every draw, with its unit."""
PATHS = (KP, KI, GAIN)


@dataclass(frozen=True, eq=False)
class Case:
    """A policy at its robust optimum on some terms, at fresh draws."""

    # names
    policy: str
    terms: str
    gains: dict[str, float]  # path to value (SI)
    at_bounds: tuple[str, ...]  # gains that lie on a bound
    shift: float  # added to the nominal weight (N)
    off: float  # what the terms' mean is off by at that shift, over that of the constant weight
    tuned_value: float  # objective at the draws of the tuning (s), which flatters
    objective: Estimate  # at the fresh draws (s)
    objective_less: Estimate  # less that of the constant weight, by resampled pairs (s)
    # shape (realizations,): By the names of `MEASURES` (SI); NaN where undefined
    measures: dict[str, Array]

    @property
    def name(self) -> str:
        """Policy and terms."""
        return self.policy if self.policy == CONSTANT else f"{self.policy}, {self.terms}"

    def mean(self, measure: str) -> float | None:
        """Mean (SI) over the draws that define a measure."""
        values = self.measures[measure]
        values = values[~np.isnan(values)]
        return float(values.mean()) if values.size else None

    def difference(self, baseline: Case, measure: str, seed: int) -> Estimate:
        """Mean over the draws of a measure less that of another case, with its interval (SI)."""
        apart = self.measures[measure] - baseline.measures[measure]
        apart = apart[~np.isnan(apart)]
        if not apart.size:
            return Estimate(None, None)
        return Estimate(float(apart.mean()), mean_interval(apart, seed))

    def hits(self, level: float) -> NDArray[np.bool_]:
        """Draws with J1 at or under a level (s); one that failed is not."""
        return np.asarray(np.nan_to_num(self.measures["j1"], nan=np.inf) <= level)

    def share(self, level: float) -> tuple[float, Interval]:
        """Their share, and its Clopper-Pearson interval."""
        hits = self.hits(level)
        return float(hits.mean()), share_interval(int(hits.sum()), len(hits))

    def share_less(self, baseline: Case, level: float, seed: int) -> Estimate:
        """The share less that of another case, pair by pair."""
        apart = self.hits(level).astype(float) - baseline.hits(level)
        return Estimate(float(apart.mean()), mean_interval(apart, seed))

    def summary(self, baseline: Case, levels: tuple[float, ...], seed: int) -> dict[str, Any]:
        """As strict JSON values, SI."""
        shares = {}
        for level in levels:
            share, interval = self.share(level)
            apart = self.share_less(baseline, level, seed)
            shares[f"{level:g}"] = {
                "share": share, "interval_95": list(interval), "difference": apart.summary(),
            }  # fmt: skip
        return {
            "policy": self.policy,
            "terms": self.terms,
            "gains": self.gains,
            "at_bounds": list(self.at_bounds),
            "shift": self.shift,
            "off": self.off,
            "tuned_value": self.tuned_value,
            "objective": self.objective.summary(),
            "objective_difference": self.objective_less.summary(),
            "means": {name: self.mean(name) for name in MEASURES},
            "differences": {
                name: self.difference(baseline, name, seed).summary() for name in MEASURES
            },
            "levels": shares,
        }


@dataclass(frozen=True)
class Optima:
    """Optima at the design's own weight and speed, at equal nominal weight."""

    # of the policies
    constant: Optimum
    ideal: Optimum
    real: Optimum


def own_optima(compared: Policies, progress: Progress) -> Optima:
    """Every policy tuned at the design's own weight and speed, at `tune.realizations`."""
    count = compared.constant.design.tables.tune.realizations
    constant = optimum(compared.constant, count)
    progress.advance(1)
    ideal = optimum_beside(compared.ideal, count, constant)
    progress.advance(1)
    real = optimum_beside(compared.real, count, constant, [ideal.values])
    progress.advance(1)
    return Optima(constant, ideal, real)


STARTS = (0.0, 500.0, 1500.0)
"""Gains of the weight (N s/rad) that are tried with the constant weight's gains of the drive."""


def optimum_beside(
    policy: Policy, realizations: int, constant: Optimum, starts: Sequence[Array] = ()
) -> Optimum:
    """The optimum of a policy that contains the constant weight, whose gains it starts from."""
    if not policy.follows:
        return constant
    own = [np.append(constant.values, gain) for gain in STARTS]
    return optimum(policy, realizations, [*own, *starts])


def cases(compared: Policies, optima: Optima, fresh: Fresh, progress: Progress) -> tuple[Case, ...]:
    """The table's cases, the constant weight first."""
    baseline = compared.constant.with_gains(optima.constant.values)
    ground = fresh.run(baseline)
    below = ground.resampled(fresh)
    zero = Estimate(0.0, (0.0, 0.0))
    start = (0.0, 0.0)
    found = [_case(compared.constant, NOMINAL, optima.constant, start, ground, below, zero)]
    for policy, first in ((compared.ideal, optima.ideal), (compared.real, optima.real)):
        for terms in ALL_TERMS:
            on = tuned_on_terms(policy, terms, baseline, first)
            design = policy.with_gains(on.found.values)
            shift = fresh_shift(policy, terms, fresh.lanes(design), ground)
            measured = fresh.run(design, shift[0])
            own = measured.resampled(fresh)
            apart = estimate(
                float(less(np.array(measured.value), np.array(ground.value))), less(own, below)
            )
            found.append(_case(policy, terms, on.found, shift, measured, own, apart))
            progress.advance(1)
    return tuple(found)


def _case(
    policy: Policy, terms: Terms, found: Optimum, shift: tuple[float, float],
    measured: Measured, resampled: Array, apart: Estimate,
) -> Case:  # fmt: skip
    gains = {t.path: float(v) for t, v in zip(policy.tuned, found.values, strict=True)}
    return Case(
        policy=policy.name,
        terms=terms.name,
        gains={path: gains.get(path, 0.0) for path in PATHS},
        at_bounds=found.at_bounds,
        shift=shift[0],
        off=shift[1],
        tuned_value=found.value,
        objective=estimate(measured.value, resampled),
        objective_less=apart,
        measures={name: measured.runs.measures[name] for name in MEASURES},
    )
