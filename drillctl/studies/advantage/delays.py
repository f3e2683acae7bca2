"""The advantage against the delay of the path, and the delay at which it vanishes.

Two answers, which are not to be mixed. *Gains of the ideal path*, kept while the signal comes
later: the advantage turns to harm, and the delay where it does is a zero of a line. *Gains tuned
anew* at every delay: a policy that may set its gain to zero contains the constant weight and is
never worse but for the draws; its advantage fades, and the delay is told where it falls under a
stated share of the constant weight's objective, and where its interval first holds zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.cases import Crossing, percentile_estimate, resampled_crossing
from drillctl.ensemble.draws import CommonDraws
from drillctl.progress import Progress
from drillctl.store.codec import label
from drillctl.studies.advantage.cases import Optima, less, measured, optimum_beside
from drillctl.studies.advantage.policies import DELAY, Optimum, Policies, Policy

Array = NDArray[np.float64]

STEPS = 10  # into which a step of the grid is divided where kept gains lose their advantage
STEPS_ANEW = 5  # the same where gains tuned anew do, each of which is a search


@dataclass(frozen=True, eq=False)
class DelayLine:
    """One choice of gains over the delays, at the same fresh draws."""

    name: str
    delays: Array = label(
        "{name}_delay", unit="s", name="{name}_delay",
        means="increasing, closer together where the advantage vanishes",
    )  # fmt: skip
    gains: Array = label("{name}_delay", "parameter", means="kp, ki and K_w, SI")
    objective: Array = label("{name}_delay", unit="s", means="at the fresh draws")
    advantage: Array = label(
        "{name}_delay", unit="s", means="objective of the constant weight less that"
    )
    low: Array = label("{name}_delay", unit="s", means="lower end of its 95 % interval")
    high: Array = label("{name}_delay", unit="s", means="upper end of its 95 % interval")
    zero: Crossing = label(means="where the advantage first is none")
    material: Crossing = label(
        means="where it first falls under the stated share of the constant weight's objective"
    )

    @property
    def indistinct_from(self) -> float | None:
        """First of the delays (s) at which the interval does not lie above zero."""
        result = np.flatnonzero(~(self.low > 0.0))
        return float(self.delays[result[0]]) if result.size else None


@dataclass(frozen=True, eq=False)
class DelayCurve:
    """The advantage against the delay of the path."""

    delays: Array = label(
        "delay", unit="s",
        means="of the way from the bit to the driller; lags and limits are the same at all",
    )  # fmt: skip
    constant: float = label(unit="s", means="objective of the constant weight")
    kept: DelayLine = label(means="gains of the ideal path")
    anew: DelayLine = label(means="gains tuned at each delay")

    def summary(self) -> dict[str, Any]:
        """As strict JSON values, SI."""
        return {
            "delays": self.delays.tolist(),
            "constant": self.constant,
            **{
                name: {
                    "delays": line.delays.tolist(),
                    "advantage": _plain(line.advantage),
                    "low": _plain(line.low),
                    "high": _plain(line.high),
                    "zero": line.zero.summary("delay"),
                    "material": line.material.summary("delay"),
                    "indistinct_from": line.indistinct_from,
                }
                for name, line in (("kept", self.kept), ("anew", self.anew))
            },
        }


def delay_curve(
    compared: Policies, optima: Optima, draws: CommonDraws, progress: Progress
) -> DelayCurve:
    """Advantage of the real path over the delays of the design's `[advantage]` table."""
    constant = _objectives(compared.constant, optima.constant.values, draws)
    ground = float(constant[0])
    table = compared.real.design.tables.advantage
    delays, fixed = np.array(table.delays), optima.ideal.values
    anew = _tuned_anew(compared.real, optima, draws, ground, progress)
    kept: Points = {
        delay: (fixed, _objectives(_late(compared.real, delay), fixed, draws))
        for delay in table.delays
    }
    for delay in _between(delays, _advantages(ground, kept)):
        kept[delay] = fixed, _objectives(_late(compared.real, delay), fixed, draws)
    return DelayCurve(
        delays,
        ground,
        _line("kept", kept, constant, table.material),
        _line("anew", anew, constant, table.material),
    )


def _tuned_anew(
    policy: Policy, optima: Optima, draws: CommonDraws, constant: float, progress: Progress
) -> Points:
    """Gains tuned at each delay of the grid, and closer where the advantage vanishes.

    What is best at one delay is a start for the next. Where the grid has lost the advantage in a
    step, the small steps into it may carry it over the end: then it is looked for in the next.
    """
    table, tune = policy.design.tables.advantage, policy.design.tables.tune
    results: dict[float, Optimum] = {}
    points: Points = {}

    def tuned(delay: float, start: Array) -> Optimum:
        # As many draws as the constant weight was tuned at: fewer would fit their own draws more.
        return optimum_beside(
            _late(policy, delay), tune.realizations, optima.constant, [optima.real.values, start]
        )

    def keep(delay: float, one: Optimum) -> Array:
        results[delay] = one
        points[delay] = one.values, _objectives(_late(policy, delay), one.values, draws)
        return one.values

    last = optima.real.values
    for delay in table.delays:
        last = keep(delay, tuned(delay, last))
        progress.advance(1)
    none = table.material * constant
    while True:
        over = [d for d in table.delays if constant - points[d][1][0] <= none]
        before = [d for d in table.delays if over and d < over[0]]
        if not before:
            return points
        last = results[before[-1]].values
        for delay in np.linspace(before[-1], over[0], STEPS_ANEW + 1)[1:-1].tolist():
            last = keep(delay, tuned(delay, last))
        again = tuned(over[0], last)
        if not again.value < results[over[0]].value:
            return points
        keep(over[0], again)


Points = dict[float, tuple[Array, Array]]  # gains, and what was measured with them, by delay (s)


def _advantages(constant: float, points: Points) -> Array:
    """Over increasing delays (s)."""
    return np.array([constant - points[delay][1][0] for delay in sorted(points)])


def _late(policy: Policy, delay: float) -> Policy:
    return policy.at(DELAY, delay) if policy.follows else policy


def _objectives(policy: Policy, gains: Array, draws: CommonDraws) -> Array:
    """Objective at the fresh draws, then of every resample, shape (1 + resamples,)."""
    return measured(policy.with_gains(gains), draws).objectives


def _between(delays: Array, advantage: Array) -> list[float]:
    """Delays between the two of the grid where an advantage first vanishes.

    It falls off a cliff there, where draws begin to stick: a straight line over a wide step of the
    grid would put the crossing next to its upper end, whatever the cliff is.
    """
    over = np.flatnonzero(advantage <= 0.0)
    if not over.size or over[0] == 0:
        return []
    k = int(over[0])
    inside = np.linspace(delays[k - 1], delays[k], STEPS + 1)[1:-1]
    return [float(delay) for delay in inside]


def _line(name: str, points: Points, constant: Array, share: float) -> DelayLine:
    """A line from what was measured: objectives of the draws, then of every resample."""
    delays = np.array(sorted(points))
    gains = np.stack([points[delay][0] for delay in delays.tolist()])
    result = np.stack([points[delay][1] for delay in delays.tolist()])
    apart = less(constant, result)
    ends = np.array([percentile_estimate(row).ends for row in apart], dtype=float)
    padded = np.zeros((len(gains), 3))
    padded[:, : gains.shape[1]] = gains
    return DelayLine(
        name=name,
        delays=delays,
        gains=padded,
        objective=result[:, 0],
        advantage=apart[:, 0],
        low=ends[:, 0],
        high=ends[:, 1],
        zero=resampled_crossing(delays, -apart),
        material=resampled_crossing(delays, -less(apart, share * constant)),
    )


def _plain(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
