"""What the study of a weight that follows the bit speed against a constant one has found."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.provenance import provenance
from drillctl.studies.advantage.cases import MEASURES, Case
from drillctl.studies.advantage.chart import FIGURES, Chart
from drillctl.studies.advantage.delays import DelayCurve
from drillctl.studies.advantage.equalities import MEAN
from drillctl.studies.advantage.measured import Estimate
from drillctl.studies.advantage.policies import IDEAL
from drillctl.studies.advantage.regions import Regions

if TYPE_CHECKING:
    from pathlib import Path

    import xarray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Advantage:
    """PI against PI with a weight that follows the bit speed, each at its own robust optimum."""

    design: Design  # its `[advantage]` and `[tune]` tables say what was compared and to what end
    cases: tuple[Case, ...]  # at the design's own weight and speed; the constant weight first
    regions: tuple[Regions, ...]  # of every policy, over the gains of the drive
    front: Chart  # over weights at the design's own speed
    chart: Chart  # over weights and speeds
    delay: DelayCurve  # against the delay of the real path
    total_seconds: float  # from call to return (s)
    # versions and processor it came from
    provenance: dict[str, str] = field(default_factory=provenance)

    @property
    def baseline(self) -> Case:
        """The constant weight."""
        return self.cases[0]

    @property
    def levels(self) -> tuple[float, ...]:
        """Levels of J1 (s): those of `[map]` and that of `[tune]`."""
        own = self.design.tables
        return tuple(sorted({*own.map.levels, own.tune.level}))

    @property
    def seed(self) -> int:
        """What the fresh draws follow from."""
        return self.design.tables.advantage.seed

    def case(self, policy: str, terms: str) -> Case:
        """A case by the names of its policy and terms."""
        return next(one for one in self.cases if (one.policy, one.terms) == (policy, terms))

    @property
    def verdict(self) -> Estimate:
        """Objective with an ideal path at equal mean weight less that of the constant weight."""
        return self.case(IDEAL, MEAN.name).objective_less

    @property
    def data(self) -> xarray.Dataset:
        """Draws of the cases, regions, front, map and delays; with units."""
        import xarray

        coordinates: dict[str, Any] = {
            "case": ("case", np.array([case.name for case in self.cases], dtype=object)),
            "policy": ("policy", np.array(self.chart.policies, dtype=object)),
            "parameter": ("parameter", np.array(["kp", "ki", "gain"], dtype=object)),
            "kp": ("kp", self.regions[0].kp, {"units": "N*m*s"}),
            "ki": ("ki", self.regions[0].ki, {"units": "N*m"}),
            "weight": ("weight", self.chart.weights, {"units": "N"}),
            "speed": ("speed", self.chart.speeds, {"units": "rad/s"}),
            "kept_delay": ("kept_delay", self.delay.kept.delays, {"units": "s"}),
            "anew_delay": ("anew_delay", self.delay.anew.delays, {"units": "s"}),
        }
        variables: dict[str, Any] = {
            f"case_{name}": (
                ("case", "realization"),
                np.stack([case.measures[name] for case in self.cases]),
                {"units": unit},
            )
            for name, unit in MEASURES.items()
        }
        variables |= _regions(self.regions)
        for prefix, found, over in (
            ("front", self.front, ("policy", "weight")),
            ("map", self.chart, ("policy", "weight", "speed")),
        ):
            for name, unit in FIGURES.items():
                values = found.figures[name][:, :, 0] if prefix == "front" else found.figures[name]
                variables[f"{prefix}_{name}"] = (over, values, {"units": unit})
        for prefix, line in (("kept", self.delay.kept), ("anew", self.delay.anew)):
            variables[f"{prefix}_gains"] = ((f"{prefix}_delay", "parameter"), line.gains)
            for name in ("objective", "advantage", "low", "high"):
                variables[f"{prefix}_{name}"] = (
                    f"{prefix}_delay", getattr(line, name), {"units": "s"},
                )  # fmt: skip
        return xarray.Dataset(variables, coordinates, dict(self.provenance))

    def summary(self) -> dict[str, Any]:
        """Cases with paired differences, areas, front, map, crossing delays; SI units."""
        table, tune = self.design.tables.advantage, self.design.tables.tune
        return {
            "objective": tune.objective
            + (f" {tune.quantile:g}" if tune.objective in ("quantile", "cvar") else ""),
            "cases": {
                case.name: case.summary(self.baseline, self.levels, self.seed)
                for case in self.cases
            },
            "regions": {one.policy: one.summary() for one in self.regions},
            "front": _chart_summary(self.front),
            "map": _chart_summary(self.chart),
            "delay": self.delay.summary(),
            "realizations": table.realizations,
            "seed": table.seed,
            "material": table.material,
            "total_seconds": self.total_seconds,
        }

    def save(self, folder: str | Path) -> Path:
        """Write design, dataset and summary into a folder; see `drillctl.store`."""
        from drillctl.store import save

        return save(self, folder)


def _regions(found: tuple[Regions, ...]) -> dict[str, Any]:
    over = ("policy", "kp", "ki")
    return {
        "region_j1": (
            (*over, "region_realization"), np.stack([one.j1 for one in found]), {"units": "s"},
        ),
        "region_nominal_j1": (over, np.stack([one.nominal for one in found]), {"units": "s"}),
    }  # fmt: skip


def _chart_summary(found: Chart) -> dict[str, Any]:
    shown = ("objective", "mean_weight", "advantage", "advantage_low", "advantage_high")
    return {
        "weights": found.weights.tolist(),
        "speeds": found.speeds.tolist(),
        "policies": {
            name: {
                **{one: _plain(found.figures[one][k]) for one in shown},
                "significant": found.significant(k).tolist(),
            }
            for k, name in enumerate(found.policies)
        },
    }


def _plain(values: Array) -> list[list[float | None]]:
    return [[float(v) if np.isfinite(v) else None for v in row] for row in values]
