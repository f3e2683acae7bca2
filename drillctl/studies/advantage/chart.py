"""Every policy tuned anew over weights and speeds: the front, and the map of the advantage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.progress import Progress
from drillctl.studies.advantage.cases import optimum_beside
from drillctl.studies.advantage.measured import Fresh, Measured, estimate, less
from drillctl.studies.advantage.optimum import Optimum, optimum
from drillctl.studies.advantage.policies import SPEED, WEIGHT, Policies

Array = NDArray[np.float64]

FIGURES = {
    "objective": "s", "objective_low": "s", "objective_high": "s", "mean_weight": "N",
    "rop_proxy": "1", "tuned_value": "s", "advantage": "s", "advantage_low": "s",
    "advantage_high": "s", "kp": "N*m*s", "ki": "N*m", "gain": "N*s/rad",
}  # fmt: skip
"""What is told of a policy at a weight and speed, with its unit; the advantage is the objective of
the constant weight less its own."""


@dataclass(frozen=True, eq=False)
class Chart:
    """Every policy at every weight and speed, each time at its own robust optimum."""

    weights: Array  # shape (weights,): Nominal weight (N)
    speeds: Array  # shape (speeds,): Set speed (rad/s)
    policies: tuple[str, ...]  # names, the constant weight first
    # shape (policies, weights, speeds): By the names of `FIGURES` (SI); NaN where unknown
    figures: dict[str, Array]

    def at_speed(self, speed: float) -> Chart | None:
        """The part at one set speed (rad/s), where it is among the speeds."""
        j = np.flatnonzero(self.speeds == speed)
        if not j.size:
            return None
        figures = {name: values[:, :, j] for name, values in self.figures.items()}
        return Chart(self.weights, self.speeds[j], self.policies, figures)

    def significant(self, policy: int) -> NDArray[np.bool_]:
        """Where the interval of a policy's advantage excludes zero, shape (weights, speeds)."""
        low, high = (self.figures[f"advantage_{end}"][policy] for end in ("low", "high"))
        return np.asarray(low * high > 0.0)


def chart(
    compared: Policies, weights: Sequence[float], speeds: Sequence[float], fresh: Fresh,
    progress: Progress,
) -> Chart:  # fmt: skip
    """Tune every policy at every weight and speed, and measure it at the fresh draws."""
    shape = (len(compared), len(weights), len(speeds))
    figures = {name: np.full(shape, np.nan) for name in FIGURES}
    known: dict[tuple[int, int, int], Optimum] = {}
    for j, speed in enumerate(speeds):
        for i, weight in enumerate(weights):
            here = compared.at(WEIGHT, weight).at(SPEED, speed)
            near = [(i - 1, j), (i, j - 1)]
            ground: tuple[Measured, Array] | None = None
            for k, policy in enumerate(here):
                starts = [known[k, *at].values for at in near if (k, *at) in known]
                count = policy.design.tables.advantage.sweep_realizations
                if k == 0:
                    found = optimum(policy, count, starts)
                else:
                    starts += [known[1, i, j].values] if k > 1 else []
                    found = optimum_beside(policy, count, known[0, i, j], starts)
                known[k, i, j] = found
                measured = fresh.run(policy.with_gains(found.values))
                own = (measured, measured.resampled(fresh))
                ground = own if ground is None else ground
                for name, value in _figures(found, *own, *ground).items():
                    figures[name][k, i, j] = value
                progress.advance(1)
    names = tuple(policy.name for policy in compared)
    return Chart(np.array(weights), np.array(speeds), names, figures)


def _figures(
    found: Optimum, measured: Measured, own: Array, ground: Measured, below: Array
) -> dict[str, float]:
    objective = estimate(measured.value, own)
    apart = estimate(
        float(less(np.array(ground.value), np.array(measured.value))), less(below, own)
    )
    low, high = objective.interval or (np.nan, np.nan)
    least, most = apart.interval or (np.nan, np.nan)
    return {
        "objective": np.nan if objective.value is None else objective.value,
        "objective_low": low,
        "objective_high": high,
        "mean_weight": measured.mean("mean_weight_after_start"),
        "rop_proxy": measured.mean("rop_proxy"),
        "tuned_value": found.value,
        "advantage": np.nan if apart.value is None else apart.value,
        "advantage_low": least,
        "advantage_high": most,
        "kp": found.values[0],
        "ki": found.values[1],
        "gain": found.values[2] if len(found.values) > 2 else 0.0,
    }
