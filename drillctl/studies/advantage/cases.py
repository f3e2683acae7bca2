"""Every policy at its own robust optimum, on all terms, at the same fresh draws.

A weight that follows the bit speed has its nominal value on the mean only if the bit turns at the
set speed on the mean. Terms other than the nominal one shift its nominal weight until the mean of
a measure over the draws is that of the constant weight. Gains and shift depend on each other: they
are computed in turns, at the draws of the tuning; then the shift once more at the fresh draws, so
that what is reported as equal is equal there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble.cases import Estimate, Runs, percentile_estimate
from drillctl.ensemble.draws import CommonDraws, matching_shift
from drillctl.progress import Progress
from drillctl.store.codec import label
from drillctl.studies.advantage.policies import (
    CONSTANT,
    GAIN,
    KI,
    KP,
    Optimum,
    Policies,
    Policy,
    optimum,
)
from drillctl.studies.tune.problem import Objective, objective_of

Array = NDArray[np.float64]

KEPT = (
    "j1", "mean_weight_after_start", "rop_proxy", "peak_bit_speed", "peak_pipe_torque",
    "peak_top_torque", "settling_time",
)  # fmt: skip
"""Measures that are kept of every draw."""
PATHS = (KP, KI, GAIN)
STARTS = (0.0, 500.0, 1500.0)
"""Gains of the weight (N s/rad) that are tried with the constant weight's gains of the drive."""
ROUNDS = 4  # most turns of gains and shift
STILL = 1e-3  # change of the shift over the nominal weight that ends them


class Terms(NamedTuple):
    """On what terms a policy is compared."""

    name: str  # what they are called
    # whose mean over the draws is made that of the constant weight; None for the same nominal
    # weight
    measure: str | None


NOMINAL = Terms("equal nominal weight", None)
MEAN = Terms("equal mean weight", "mean_weight_after_start")
ROP = Terms("equal ROP proxy", "rop_proxy")
ALL_TERMS = (NOMINAL, MEAN, ROP)


@dataclass(frozen=True, eq=False)
class Measured:
    """A design at fresh draws."""

    runs: Runs
    objective: Objective  # that it was tuned to
    draws: CommonDraws

    @cached_property
    def objectives(self) -> Array:
        """Objective (s) of the draws, then of every resample, shape (1 + resamples,)."""
        needed = {name: self.runs.measures[name] for name in self.objective.needs}
        needed["j1"] = self.j1
        again = {name: values[self.draws.resamples] for name, values in needed.items()}
        return np.append(self.objective.value(needed), self.objective.value(again))

    @property
    def j1(self) -> Array:
        """J1 (s); infinite where a draw has no result."""
        values = self.runs.measures["j1"]
        return np.where(np.isnan(values), np.inf, values)

    @property
    def value(self) -> float:
        """Objective (s)."""
        return float(self.objectives[0])

    @property
    def estimate(self) -> Estimate:
        """Objective (s) with its interval."""
        return percentile_estimate(self.objectives)

    def less(self, other: Measured) -> Estimate:
        """Objective less that of another design, by resampled pairs (s)."""
        return percentile_estimate(less(self.objectives, other.objectives))


def measured(design: Design, draws: CommonDraws, shift: float = 0.0) -> Measured:
    """A design at fresh draws, its nominal weight shifted (N)."""
    return Measured(draws.run(design, shift), objective_of(design), draws)


def fresh_draws(design: Design) -> CommonDraws:
    """Draws of the `[advantage]` table, which no tuning uses."""
    return CommonDraws(design.tables.advantage.realizations, design.tables.advantage.seed)


def less(one: Array, other: Array) -> Array:
    """One less the other; nothing where both are infinite."""
    with np.errstate(invalid="ignore"):
        return np.where(one == other, 0.0, one - other)


@dataclass(frozen=True, eq=False)
class Case(Runs):
    """A policy at its robust optimum on some terms, at fresh draws."""

    policy: str = label(means="name of the policy")
    terms: str = label(means="name of the terms")
    gains: dict[str, float] = label(means="path to value, SI")
    at_bounds: tuple[str, ...] = label(means="gains that lie on a bound")
    shift: float = label(unit="N", means="added to the nominal weight")
    off: float = label(
        means="what the terms' mean is off by at that shift, over that of the constant weight"
    )
    tuned_value: float = label(unit="s", means="objective at the draws of the tuning; flatters")
    objective: Estimate = label(unit="s", means="at the fresh draws")
    objective_less: Estimate = label(unit="s", means="less that of the constant weight")

    @property
    def name(self) -> str:
        """Policy and terms."""
        return self.policy if self.policy == CONSTANT else f"{self.policy}, {self.terms}"

    def summary(self, baseline: Case, levels: tuple[float, ...], seed: int) -> dict[str, Any]:
        """As strict JSON values, SI."""
        shares = {}
        for level in levels:
            share, apart = self.share(level), self.share_difference(baseline, level, seed)
            shares[f"{level:g}"] = {
                **share.summary("share"), "difference": apart.summary(),
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
            "means": {name: self.mean(name) for name in KEPT},
            "differences": {name: self.difference(baseline, name, seed).summary() for name in KEPT},
            "levels": shares,
            "step": self.step,
            "modes": self.modes,
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


def optimum_beside(
    policy: Policy, realizations: int, constant: Optimum, starts: Sequence[Array] = ()
) -> Optimum:
    """The optimum of a policy that contains the constant weight, whose gains it starts from."""
    if not policy.follows:
        return constant
    own = [np.append(constant.values, gain) for gain in STARTS]
    return optimum(policy, realizations, [*own, *starts])


def cases(
    compared: Policies, optima: Optima, draws: CommonDraws, progress: Progress
) -> tuple[Case, ...]:
    """The table's cases, the constant weight first."""
    baseline = compared.constant.with_gains(optima.constant.values)
    ground = measured(baseline, draws)
    results = [_case(compared.constant, NOMINAL, optima.constant, (0.0, 0.0), ground, ground)]
    for policy, first in ((compared.ideal, optima.ideal), (compared.real, optima.real)):
        for terms in ALL_TERMS:
            best = tuned_on_terms(policy, terms, baseline, first)
            design = policy.with_gains(best.values)
            shift = fresh_shift(policy, terms, design, ground)
            own = measured(design, draws, shift[0])
            results.append(_case(policy, terms, best, shift, own, ground))
            progress.advance(1)
    return tuple(results)


def tuned_on_terms(policy: Policy, terms: Terms, baseline: Design, first: Optimum) -> Optimum:
    """Gains of a policy on some terms, tuned at the shifted weight."""
    table, own = policy.design.tables.tune, policy.design.tables.operating_point.weight_on_bit
    if terms.measure is None or not policy.follows:
        return first
    draws = CommonDraws(table.realizations, table.seed)
    target = float(np.nanmean(draws.run(baseline).measures[terms.measure]))
    result, shift = first, 0.0
    for _ in range(ROUNDS):
        lanes = draws.lanes(policy.with_gains(result.values))
        wanted, _off = matching_shift(lanes, draws.count, terms.measure, target)
        if abs(wanted - shift) <= STILL * own:
            break
        shift = wanted
        result = optimum(policy.shifted(shift), table.realizations, [result.values])
    return result


def fresh_shift(
    policy: Policy, terms: Terms, design: Design, baseline: Measured
) -> tuple[float, float]:
    """Shift (N) at which a policy is on the terms at fresh draws, and how far off it is there."""
    if terms.measure is None or not policy.follows:
        return 0.0, 0.0
    target = baseline.runs.mean(terms.measure)
    assert target is not None
    draws = baseline.draws
    return matching_shift(draws.lanes(design), draws.count, terms.measure, target)


def _case(
    policy: Policy, terms: Terms, best: Optimum, shift: tuple[float, float],
    own: Measured, ground: Measured,
) -> Case:  # fmt: skip
    gains = {t.path: float(v) for t, v in zip(policy.tuned, best.values, strict=True)}
    return Case(
        measures={name: own.runs.measures[name] for name in KEPT},
        status=own.runs.status,
        step=own.runs.step,
        modes=own.runs.modes,
        policy=policy.name,
        terms=terms.name,
        gains={path: gains.get(path, 0.0) for path in PATHS},
        at_bounds=best.at_bounds,
        shift=shift[0],
        off=shift[1],
        tuned_value=best.value,
        objective=own.estimate,
        objective_less=own.less(ground),
    )
