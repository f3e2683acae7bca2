"""On what terms policies are compared: equal nominal weight, equal mean weight, equal ROP proxy.

A weight that follows the bit speed has its nominal value on the mean only if the bit turns at the
set speed on the mean. Terms other than the nominal one shift its nominal weight until the mean of
a measure over the draws is that of the constant weight. Gains and shift depend on each other: they
are found in turns, at the draws of the tuning; then the shift once more at the fresh draws, so that
what is told to be equal there is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.draws import DrawnLanes, drawn_lanes, matching_shift, run_draws
from drillctl.ensemble.parameters import draw
from drillctl.studies.advantage.measured import Measured
from drillctl.studies.advantage.optimum import Optimum, optimum
from drillctl.studies.advantage.policies import WEIGHT, Policy

ROUNDS = 4
"""Most turns of gains and shift."""
STILL = 1e-3
"""Change of the shift over the nominal weight that ends them."""


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


class OnTerms(NamedTuple):
    """Gains found on some terms."""

    found: Optimum  # at the nominal weight with its shift
    shift: float  # added to the nominal weight (N), at the draws of the tuning
    rounds: int  # turns of gains and shift


def tuned_on_terms(policy: Policy, terms: Terms, baseline: Design, first: Optimum) -> OnTerms:
    """Gains of a policy on some terms, tuned at the shifted weight."""
    table, own = policy.design.tables.tune, policy.design.tables.operating_point.weight_on_bit
    if terms.measure is None or not policy.follows:
        return OnTerms(first, 0.0, 0)
    target = _target(baseline, terms.measure, table.realizations, table.seed)
    found, shift = first, 0.0
    for turn in range(1, ROUNDS + 1):
        lanes = _lanes(policy.with_gains(found.values), table.realizations, table.seed)
        wanted, _ = matching_shift(lanes, table.realizations, terms.measure, target)
        if abs(wanted - shift) <= STILL * own:
            return OnTerms(found, wanted, turn)
        shift = wanted
        found = optimum(shifted_policy(policy, shift), table.realizations, [found.values])
    return OnTerms(found, shift, ROUNDS)


def fresh_shift(
    policy: Policy, terms: Terms, lanes: DrawnLanes, baseline: Measured
) -> tuple[float, float]:
    """The shift at which a policy is on the terms at fresh draws."""
    if terms.measure is None or not policy.follows:
        return 0.0, 0.0
    return matching_shift(lanes, len(baseline.j1), terms.measure, baseline.mean(terms.measure))


def shifted_policy(policy: Policy, shift: float) -> Policy:
    """A policy at a nominal weight shifted (N), outside of the friction table too."""
    weight = policy.design.tables.operating_point.weight_on_bit + shift
    if not hasattr(policy.design.tables.bit_rock, "outside_table"):
        return policy.at(WEIGHT, weight)
    values = {WEIGHT: units.SI(weight), "bit_rock.outside_table": "extrapolate"}
    return Policy(policy.name, policy.design.replace(values), policy.tuned)


def _target(baseline: Design, measure: str, count: int, seed: int) -> float:
    runs = run_draws(_lanes(baseline, count, seed), count)
    return float(np.nanmean(runs.measures[measure]))


def _lanes(design: Design, count: int, seed: int) -> DrawnLanes:
    return drawn_lanes(design, draw(design, count, seed))
