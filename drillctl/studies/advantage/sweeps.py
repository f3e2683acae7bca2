"""Regions over the gains of the drive; front and map over weights and speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.draws import CommonDraws
from drillctl.ensemble.grid import Axis
from drillctl.ensemble.probability import INNER, OUTER, Area, Scatter, probability_map, region_areas
from drillctl.ensemble.sweeps import sweep
from drillctl.progress import Progress
from drillctl.store.codec import label
from drillctl.studies.advantage.cases import Measured, Optima, measured, optimum_beside
from drillctl.studies.advantage.policies import (
    GAIN,
    SPEED,
    WEIGHT,
    Optimum,
    Policies,
    Policy,
    optimum,
)
from drillctl.studies.tune.runs import GainRuns

Array = NDArray[np.float64]

INDEPENDENT = Scatter(1)
FIGURES = {
    "objective": "s", "objective_low": "s", "objective_high": "s", "mean_weight": "N",
    "rop_proxy": "1", "tuned_value": "s", "advantage": "s", "advantage_low": "s",
    "advantage_high": "s", "kp": "N*m*s", "ki": "N*m", "gain": "N*s/rad",
}  # fmt: skip
"""What is reported of a policy at a weight and speed, with its unit.

The advantage is the objective of the constant weight less that of the policy.
"""


@dataclass(frozen=True, eq=False)
class Regions:
    """J1 of one policy over the gains of the drive."""

    policy: str  # name
    gain: float  # of the weight (N s/rad)
    kp: Array = label("kp", unit="N*m*s", means="Kp over the bounds of the tuning")
    ki: Array = label("ki", unit="N*m", means="Ki over the bounds of the tuning")
    j1: Array = label(
        "kp", "ki", "region_realization", unit="s", name="region_j1",
        means="J1 at fresh draws; infinite where one failed",
    )  # fmt: skip
    nominal: Array = label(
        "kp", "ki", unit="s", name="region_nominal_j1",
        means="J1 without draws; NaN where it failed",
    )  # fmt: skip
    levels: tuple[float, ...] = label(unit="s", means="levels of J1")
    seed: int = label(means="of the resampling")

    @cached_property
    def areas(self) -> dict[float, dict[str, Area]]:
        """Shares of the window by level: `p95`, `p05` with intervals, of realizations."""
        flat = np.ascontiguousarray(np.moveaxis(self.j1, -1, 0).reshape(self.j1.shape[-1], -1))
        results = {}
        for level in self.levels:
            one = probability_map(flat, level, INDEPENDENT)
            both = region_areas(flat, [(one, INNER), (one, OUTER)], INDEPENDENT, self.seed)
            results[level] = dict(zip(("p95", "p05"), both, strict=True))
        return results

    def nominal_area(self, level: float) -> float:
        """Share of the window with J1 at or under a level (s) without draws."""
        return float((self.nominal <= level).mean())

    def summary(self) -> dict[str, Any]:
        """As strict JSON values."""
        return {
            "gain": self.gain,
            "levels": {
                f"{level:g}": {
                    "nominal_area": self.nominal_area(level),
                    **{
                        f"area_{name}": {"value": area.value, "interval_95": list(area.interval)}
                        for name, area in areas.items()
                    },
                }
                for level, areas in self.areas.items()
            },
        }


def regions(compared: Policies, optima: Optima, progress: Progress) -> tuple[Regions, ...]:
    """Regions of every policy with the gain of the weight at its optimum."""
    results = []
    for policy, best in zip(compared, (optima.constant, optima.ideal, optima.real), strict=True):
        results.append(_regions(policy, best))
        progress.advance(1)
    return tuple(results)


def _regions(policy: Policy, best: Optimum) -> Regions:
    table = policy.design.tables.advantage
    drive = policy.tuned[:2]
    axes = [np.linspace(t.low, t.high, table.region_points) for t in drive]
    gain = float(best.values[2]) if policy.follows else 0.0
    design = policy.design
    if policy.follows:
        design = design.replace({GAIN: units.SI(gain)})
    runs = GainRuns(design, drive, table.region_realizations, table.seed)
    points = np.stack([a.ravel() for a in np.meshgrid(*axes, indexing="ij")], axis=1)
    j1 = runs.measures(points, ("j1",))["j1"]
    shape = (len(axes[0]), len(axes[1]))
    return Regions(
        policy=policy.name,
        gain=gain,
        kp=axes[0],
        ki=axes[1],
        j1=j1.reshape(*shape, -1),
        nominal=_nominal(design, policy, axes),
        levels=policy.design.tables.map.levels,
        seed=table.seed,
    )


def _nominal(design: Design, policy: Policy, axes: list[Array]) -> Array:
    grid = tuple(Axis(t.path, t.unit, a) for t, a in zip(policy.tuned, axes, strict=False))
    return sweep(design, grid, audit_cells=0, measures=("j1",)).measures["j1"]


@dataclass(frozen=True, eq=False)
class Chart:
    """Every policy at every weight and speed, each time at its own robust optimum."""

    weights: Array = label("weight", unit="N", means="nominal weight on bit")
    speeds: Array = label("{over}", unit="rad/s", name="{over}", means="set speed")
    policies: tuple[str, ...] = label(means="names, the constant weight first")
    # by the names of `FIGURES`; NaN where unknown
    figures: dict[str, Array] = label(
        "policy", "weight", "{over}", unit=lambda name: FIGURES[name], flat=True
    )
    over: str = "speed"  # name of the dimension of the speeds

    def at_speed(self, speed: float) -> Chart | None:
        """The part at one set speed (rad/s), where it is among the speeds."""
        j = np.flatnonzero(self.speeds == speed)
        if not j.size:
            return None
        figures = {name: values[:, :, j] for name, values in self.figures.items()}
        return Chart(self.weights, self.speeds[j], self.policies, figures, "front_speed")

    def significant(self, policy: int) -> NDArray[np.bool_]:
        """Where the interval of a policy's advantage excludes zero, shape (weights, speeds)."""
        low, high = (self.figures[f"advantage_{end}"][policy] for end in ("low", "high"))
        return np.asarray(low * high > 0.0)


def chart(
    compared: Policies, weights: Sequence[float], speeds: Sequence[float], draws: CommonDraws,
    progress: Progress, over: str = "speed",
) -> Chart:  # fmt: skip
    """Tune every policy at every weight and speed, and measure it at the fresh draws."""
    shape = (len(compared), len(weights), len(speeds))
    figures = {name: np.full(shape, np.nan) for name in FIGURES}
    known: dict[tuple[int, int, int], Optimum] = {}
    for j, speed in enumerate(speeds):
        for i, weight in enumerate(weights):
            here = compared.at(WEIGHT, weight).at(SPEED, speed)
            near = [(i - 1, j), (i, j - 1)]
            ground: Measured | None = None
            for k, policy in enumerate(here):
                starts = [known[k, *at].values for at in near if (k, *at) in known]
                count = policy.design.tables.advantage.sweep_realizations
                if k == 0:
                    result = optimum(policy, count, starts)
                else:
                    starts += [known[1, i, j].values] if k > 1 else []
                    result = optimum_beside(policy, count, known[0, i, j], starts)
                known[k, i, j] = result
                own = measured(policy.with_gains(result.values), draws)
                ground = ground or own
                for name, value in _figures(result, own, ground).items():
                    figures[name][k, i, j] = np.nan if value is None else value
                progress.advance(1)
    names = tuple(policy.name for policy in compared)
    return Chart(np.array(weights), np.array(speeds), names, figures, over)


def _figures(best: Optimum, own: Measured, ground: Measured) -> dict[str, float | None]:
    objective, apart = own.estimate, ground.less(own)
    return {
        "objective": objective.value,
        "objective_low": objective.ends[0],
        "objective_high": objective.ends[1],
        "mean_weight": own.runs.mean("mean_weight_after_start"),
        "rop_proxy": own.runs.mean("rop_proxy"),
        "tuned_value": best.value,
        "advantage": apart.value,
        "advantage_low": apart.ends[0],
        "advantage_high": apart.ends[1],
        "kp": best.values[0],
        "ki": best.values[1],
        "gain": best.values[2] if len(best.values) > 2 else 0.0,
    }
