"""Every policy at its own robust optimum, on all terms, at the same fresh draws.

A policy is a law of the weight with what is tuned beside it: a constant weight on bit, or one that
follows the bit speed. The drive and its bounds are the same for all.

A weight that follows the bit speed has its nominal value on the mean only if the bit turns at the
set speed on the mean. Terms other than the nominal one shift its nominal weight until the mean of
a measure over the draws is that of the constant weight. Gains and shift depend on each other: they
are computed in turns, at the draws of the tuning; then the shift once more at the fresh draws, so
that what is reported as equal is equal there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design, parameter
from drillctl.design.validation import validated
from drillctl.ensemble.cases import Estimate, Runs, percentile_estimate
from drillctl.ensemble.draws import CommonDraws, matching_shift
from drillctl.ensemble.parameters import refuse_dependent, uncertain_parameters
from drillctl.errors import InputError
from drillctl.progress import Progress
from drillctl.simulation.measures import with_axial
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.studies.advantage.settings import GAIN, REAL_PATH
from drillctl.studies.delay.compute import LAWS, following_law
from drillctl.studies.delay.settings import LAW
from drillctl.studies.tune.problem import Objective, objective_of
from drillctl.studies.tune.tuned import Tuned, put, tuned_parameters

KP, KI = "controller.kp", "controller.ki"
DELAY = LAW + "path.delay"
WEIGHT, SPEED = "operating_point.weight_on_bit", "operating_point.speed"
SET = (WEIGHT, SPEED)  # what the study runs over
CONSTANT, IDEAL, REAL = "constant weight", "dynamic, ideal path", "dynamic, real path"
"""Names of the policies."""
AT_BOUND = 1e-3  # over the width of the bounds: gains nearer to one are on it


@dataclass(frozen=True)
class Policy:
    """A law of the weight on bit, and what is tuned."""

    name: str  # what it is called
    design: Design  # with the law in place
    tuned: tuple[Tuned, ...]  # kp, ki and, where the weight follows, its gain

    @property
    def follows(self) -> bool:
        """Whether the weight follows the bit speed."""
        return len(self.tuned) > 2

    def at(self, path: str, value: float) -> Policy:
        """The same with another value (SI) of its design."""
        return replace(self, design=self.design.replace({path: units.SI(value)}))

    def shifted(self, shift: float) -> Policy:
        """The same with its nominal weight shifted (N), outside of the friction table too."""
        weight = self.design.tables.operating_point.weight_on_bit + shift
        if not hasattr(self.design.tables.bit_rock, "outside_table"):
            return self.at(WEIGHT, weight)
        values = {WEIGHT: units.SI(weight), "bit_rock.outside_table": "extrapolate"}
        return replace(self, design=self.design.replace(values))

    def with_gains(self, values: Array) -> Design:
        """Its design with tuned values (SI), shape (parameters,)."""
        return put(self.design, self.tuned, values)


class Policies(NamedTuple):
    """What is compared: `constant`, and a weight that follows at once and as a rig can do it."""

    constant: Policy
    ideal: Policy
    real: Policy

    def at(self, path: str, value: float) -> Policies:
        """The same with another value (SI) of their designs."""
        return Policies(*(policy.at(path, value) for policy in self))


def policies(design: Design) -> Policies:
    """The policies of a design's `[advantage]` table."""
    # A gain that may only be zero is a constant weight: all three are the same then.
    design = studied(design)
    if design.tables.tune.weights.effort > 0.0:
        raise InputError("the effort of the drive is not measured in this study",
                         design.where("tune.weights.effort"))  # fmt: skip
    _refuse_drawn(design)
    constant = design.replace({"weight_on_bit.law": "constant"})
    real, ideal = _following(design, design.tables.advantage.values)
    drive, gain = _tuned(design, real)
    bare = Policy(CONSTANT, constant, drive)
    if gain.high == 0.0:
        return Policies(bare, replace(bare, name=IDEAL), replace(bare, name=REAL))
    tuned = (*drive, gain)
    return Policies(bare, Policy(IDEAL, ideal, tuned), Policy(REAL, real, tuned))


def studied(design: Design) -> Design:
    """The design with a PI in its drive, and without draws of what the study itself sets."""
    if design.tables.controller.law != "pi":
        string = design.string
        gains = {KP: string.drive_damper, KI: string.drive_spring}  # both are searched
        design = design.replace({"controller.law": "pi", **gains})
    drawn = {path: one for path, one in design.tree.get("uncertain", {}).items() if path not in SET}
    if len(drawn) == len(design.tree.get("uncertain", {})):
        return design
    tree = {**design.tree, "uncertain": drawn}
    return Design(design.name, validated(tree, design.origin), tree, design.origin)


def _refuse_drawn(design: Design) -> None:
    for path in (KP, KI):
        if path in design.tables.uncertain:
            raise InputError("is what the study sets and cannot be drawn",
                             design.where(f"uncertain.{path}"))  # fmt: skip
    for path in design.tables.uncertain:
        if path.startswith(LAW):
            raise InputError("a constant weight does not have it: it cannot be drawn",
                             design.where(f"uncertain.{path}"))  # fmt: skip
    refuse_dependent(design)
    uncertain_parameters(design)


def _following(design: Design, given: dict[str, object]) -> tuple[Design, Design]:
    """The design with a weight that follows on its way, and at once."""
    values = {GAIN: units.SI(0.0), **following_law(design, given)}
    with design.within("advantage.set"):
        real = design.replace(values)
        if real.tables.weight_on_bit.path.ideal and values[f"{LAW}law"] == LAWS[0]:
            real = real.replace(REAL_PATH)
        ideal = _at_once(real)
        for result in (real, ideal):
            result.weight_on_bit  # noqa: B018  limits are compared when the law is made
            result.bit_rock  # noqa: B018  not every friction goes with a weight that moves
    return real, ideal


def _at_once(real: Design) -> Design:
    """The design whose weight follows the bit speed itself, within the same limits."""
    table = real.tables.weight_on_bit
    law = {k: v for k, v in real.tree["weight_on_bit"].items()
           if k not in ("path", "observer_modes", "law")}  # fmt: skip
    tree = {**real.tree, "weight_on_bit": {"law": LAWS[0], **law}}
    assert table.law in LAWS
    return Design(real.name, validated(tree, real.origin), tree, real.origin)


def _tuned(design: Design, following: Design) -> tuple[tuple[Tuned, Tuned], Tuned]:
    """What is tuned: kp and ki within the bounds of `[tune]`, and the gain of the weight."""
    named = {t.path: t for t in tuned_parameters(following)}
    for path in named:
        if path not in (KP, KI, GAIN):
            raise InputError(
                f"{path!r} is not tuned in this study; allowed: {KP}, {KI}, {GAIN}",
                design.where("tune.parameters"),
            )
    for path in (KP, KI):
        if path not in named:
            raise InputError(f"{path} has no bounds", design.where("tune.parameters"))
    largest = design.tables.advantage.largest_gain
    gain = Tuned(GAIN, parameter(following, GAIN).si_unit, 0.0, largest)
    return (named[KP], named[KI]), named.get(GAIN, gain)


class Optimum(NamedTuple):
    """Gains with the least objective."""

    values: Array  # shape (parameters,): SI
    value: float  # objective at the realizations of the search (s)
    # paths of gains that lie on a bound: the objective may be less beyond it
    at_bounds: tuple[str, ...]


def optimum(policy: Policy, realizations: int, starts: Sequence[Array] = ()) -> Optimum:
    """Search the gains of a policy with the least objective, from known ones as well."""
    # Checks of a design come here too, and need no engine.
    from drillctl.studies.tune.search import optimum as least
    from drillctl.studies.tune.search import search_problem

    design = policy.design.replace({"tune.realizations": realizations})
    problem = search_problem(design, policy.tuned)
    best = least(problem, starts)
    shares = problem.shares(best.values)
    bounds = tuple(
        t.path
        for t, share in zip(policy.tuned, shares, strict=True)
        if not AT_BOUND < share < 1.0 - AT_BOUND
    )
    return Optimum(best.values, best.value, bounds)


KEPT = (
    "j1", "mean_weight_after_start", "rop_proxy", "peak_bit_speed", "peak_pipe_torque",
    "peak_top_torque", "settling_time",
)  # fmt: skip
"""Measures that are kept of every draw, beside those of axial motion."""
PATHS = (KP, KI, GAIN)
STARTS = (0.0, 500.0, 1500.0)
"""Gains of the weight (N s/rad) that are tried with the constant weight's gains of the drive."""
ROUNDS = 4  # most turns of gains and shift
STILL = 1e-3  # change of the shift over the nominal weight that ends them


class Terms(NamedTuple):
    """On what terms a policy is compared."""

    name: str
    # its mean over the draws is made that of the constant weight; None for the same nominal weight
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
        shares = {
            f"{level:g}": {
                **self.share(level).summary("share"),
                "difference": self.share_difference(baseline, level, seed).summary(),
            }
            for level in levels
        }
        return {
            **picked(self, "policy", "terms", "gains", "shift", "off", "tuned_value"),
            "at_bounds": list(self.at_bounds),
            "objective": self.objective.summary(),
            "objective_difference": self.objective_less.summary(),
            "means": {name: self.mean(name) for name in self.measures},
            "differences": {
                name: self.difference(baseline, name, seed).summary() for name in self.measures
            },
            "levels": shares,
            **picked(self, "step", "modes"),
        }


class Optima(NamedTuple):
    """Optima of the policies at one weight and speed, at equal nominal weight."""

    constant: Optimum
    ideal: Optimum
    real: Optimum


def optima_of(
    compared: Policies, realizations: int, progress: Progress, near: Sequence[Optima] = ()
) -> Optima:
    """Every policy tuned, from its gains where they are known and from those of the one before."""
    results: list[Optimum] = []
    for k, policy in enumerate(compared):
        starts = [one[k].values for one in near] + [one.values for one in results[1:]]
        results.append(
            optimum_beside(policy, realizations, results[0], starts)
            if results
            else optimum(policy, realizations, starts)
        )
        progress.advance(1)
    return Optima(*results)


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
    for policy, first in zip(compared[1:], optima[1:], strict=True):
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
    kept = with_axial(KEPT, policy.design.axial is not None)
    return Case(
        **vars(own.runs) | {"measures": {name: own.runs.measures[name] for name in kept}},
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
