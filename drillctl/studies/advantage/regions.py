"""How large the regions of the drive's gains are, with the gain of the weight at its optimum."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.grid import Axis
from drillctl.ensemble.sweeps import sweep
from drillctl.progress import Progress
from drillctl.studies.advantage.cases import Optima
from drillctl.studies.advantage.optimum import Optimum
from drillctl.studies.advantage.policies import GAIN, Policies, Policy
from drillctl.studies.robust.evaluation import Evaluation
from drillctl.studies.uncertainty.areas import Area, region_areas
from drillctl.studies.uncertainty.probability import INNER, OUTER, probability_map
from drillctl.studies.uncertainty.scatter import Scatter

Array = NDArray[np.float64]

INDEPENDENT = Scatter(1)


@dataclass(frozen=True, eq=False)
class Regions:
    """J1 of one policy over the gains of the drive."""

    policy: str  # name
    gain: float  # of the weight (N s/rad)
    # shape (points,): Axes: the bounds of the tuning (SI)
    kp: Array
    ki: Array
    j1: Array  # shape (kp, ki, realizations): J1 at fresh draws (s); infinite where one failed
    nominal: Array  # shape (kp, ki): J1 without draws (s); NaN where it failed
    levels: tuple[float, ...]  # levels of J1 (s)
    seed: int  # of the resampling

    @cached_property
    def areas(self) -> dict[float, dict[str, Area]]:
        """Shares of the window by level: `p95`, `p05` with intervals, of realizations."""
        flat = np.ascontiguousarray(np.moveaxis(self.j1, -1, 0).reshape(self.j1.shape[-1], -1))
        found = {}
        for level in self.levels:
            one = probability_map(flat, level, INDEPENDENT)
            both = region_areas(flat, [(one, INNER), (one, OUTER)], INDEPENDENT, self.seed)
            found[level] = dict(zip(("p95", "p05"), both, strict=True))
        return found

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
    found = []
    for policy, best in zip(compared, (optima.constant, optima.ideal, optima.real), strict=True):
        found.append(_regions(policy, best))
        progress.advance(1)
    return tuple(found)


def _regions(policy: Policy, best: Optimum) -> Regions:
    table = policy.design.tables.advantage
    drive = policy.tuned[:2]
    axes = [np.linspace(t.low, t.high, table.region_points) for t in drive]
    gain = float(best.values[2]) if policy.follows else 0.0
    design = policy.design
    if policy.follows:
        design = design.replace({GAIN: units.SI(gain)})
    runs = Evaluation(design, drive, table.region_realizations, table.seed)
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
