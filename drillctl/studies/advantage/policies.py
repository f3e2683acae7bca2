"""What is compared, a constant weight on bit and one that follows the bit speed; its robust gains.

A policy is a law of the weight with what is tuned beside it. The drive and its bounds are the same
for all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design, parameter
from drillctl.design.validation import validated
from drillctl.ensemble.parameters import refuse_dependent, uncertain_parameters
from drillctl.errors import InputError
from drillctl.studies.advantage.settings import GAIN, REAL_PATH
from drillctl.studies.delay.lanes import LAWS
from drillctl.studies.delay.settings import LAW
from drillctl.studies.tune.tuned import Tuned, put, tuned_parameters

Array = NDArray[np.float64]

KP, KI = "controller.kp", "controller.ki"
DELAY = LAW + "path.delay"
WEIGHT, SPEED = "operating_point.weight_on_bit", "operating_point.speed"
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
    """The policies of a design's `[advantage]` table.

    A gain that may only be zero is a constant weight: all three are the same then.
    """
    if design.tables.controller.law != "pi":
        raise InputError(
            f"{design.tables.controller.law!r} is not compared here; allowed: pi",
            _where(design, "controller.law"),
        )
    if design.tables.tune.weights.effort > 0.0:
        raise InputError("the effort of the drive is not measured in this study",
                         _where(design, "tune.weights.effort"))  # fmt: skip
    _refuse_drawn(design)
    constant = design.replace({"weight_on_bit.law": "constant"})
    real, ideal = _following(design, design.tables.advantage.values)
    drive, gain = _tuned(design, real)
    bare = Policy(CONSTANT, constant, drive)
    if gain.high == 0.0:
        return Policies(bare, replace(bare, name=IDEAL), replace(bare, name=REAL))
    tuned = (*drive, gain)
    return Policies(bare, Policy(IDEAL, ideal, tuned), Policy(REAL, real, tuned))


def _refuse_drawn(design: Design) -> None:
    for path in (WEIGHT, SPEED, KP, KI):
        if path in design.tables.uncertain:
            raise InputError("is what the study sets and cannot be drawn",
                             _where(design, f"uncertain.{path}"))  # fmt: skip
    for path in design.tables.uncertain:
        if path.startswith(LAW):
            raise InputError("a constant weight does not have it: it cannot be drawn",
                             _where(design, f"uncertain.{path}"))  # fmt: skip
    refuse_dependent(design)
    uncertain_parameters(design)


def _following(design: Design, given: dict[str, object]) -> tuple[Design, Design]:
    """The design with a weight that follows on its way, and at once."""
    values = dict(given)
    own = design.tables.weight_on_bit
    law = values.setdefault(f"{LAW}law", LAWS[0] if own.law == "constant" else own.law)
    if law not in LAWS:
        raise InputError(
            f"{law!r} does not follow the bit speed; allowed: {', '.join(LAWS)}",
            _where(design, f"{LAW}law"),
        )
    values.setdefault(GAIN, units.SI(0.0))
    try:
        real = design.replace(values)
        if real.tables.weight_on_bit.path.ideal and law == LAWS[0]:
            real = real.replace(REAL_PATH)
        ideal = _at_once(real)
        for result in (real, ideal):
            result.weight_on_bit  # noqa: B018  limits are compared when the law is made
            result.bit_rock  # noqa: B018  not every friction goes with a weight that moves
    except InputError as error:
        key = error.where.removeprefix(design.origin).removeprefix(": ")
        raise InputError(error.problem, _where(design, f"advantage.set: {key}")) from None
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
                _where(design, "tune.parameters"),
            )
    for path in (KP, KI):
        if path not in named:
            raise InputError(f"{path} has no bounds", _where(design, "tune.parameters"))
    largest = design.tables.advantage.largest_gain
    gain = Tuned(GAIN, parameter(following, GAIN).si_unit, 0.0, largest)
    return (named[KP], named[KI]), named.get(GAIN, gain)


def _where(design: Design, key: str) -> str:
    """A key after the file it is in."""
    return f"{design.origin}: {key}" if design.origin else key


@dataclass(frozen=True, eq=False)
class Optimum:
    """Gains with the least objective."""

    values: Array  # shape (parameters,): SI
    value: float  # objective at the realizations of the search (s)
    share: float  # share of them with J1 at or under the level
    # paths of gains that lie on a bound: the objective may be less beyond it
    at_bounds: tuple[str, ...]
    trajectories: int  # runs that it took


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
    return Optimum(best.values, best.value, best.share, bounds, problem.trajectories)
