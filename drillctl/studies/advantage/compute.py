"""PI with a constant weight on bit against PI with one that follows the bit speed."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble.cases import Estimate
from drillctl.ensemble.grid import refuse_too_large
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.provenance import provenance
from drillctl.simulation.measures import STATUSES
from drillctl.studies.advantage.cases import (
    ALL_TERMS,
    MEAN,
    MEASURES,
    Case,
    cases,
    fresh_draws,
    own_optima,
)
from drillctl.studies.advantage.delays import DelayCurve, delay_curve
from drillctl.studies.advantage.policies import IDEAL, SPEED, WEIGHT, Policies, policies
from drillctl.studies.advantage.sweeps import FIGURES, Chart, Regions, chart, regions

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
        flags = {"flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
        status = np.stack([case.status for case in self.cases])
        variables["case_status"] = (("case", "realization"), status, flags)
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


def advantage(design: Design, progress: Progress = SILENT) -> Advantage:
    """Compare PI with a constant weight on bit and PI with one that follows the bit speed.

    Each is tuned to the objective of `[tune]` at the same draws and measured at fresh ones: at
    equal nominal weight, equal mean weight and equal ROP proxy; with an ideal path and a real one;
    over the gains of the drive, over weights and speeds, over delays of the path.

    Parameters
    ----------
    design : Design
        With a PI controller. Its `[advantage]` table gives law and path of the weight, what is
        run over and how many draws.
    progress : Progress
        Told of gains found.

    Returns
    -------
    Advantage
        Positive advantage: the weight that follows is better.

    Raises
    ------
    InputError
        A controller or weight law that is not compared, a weight or speed outside what the rock or
        the limits of the law allow, impossible bounds, or something drawn that the study sets.

    Notes
    -----
    The law of the weight is that of Navarro-Lopez & Suarez, Proc. IEEE CCA (2004) 1454-1460.
    """
    begin = time.perf_counter()
    compared = policies(design)
    checked(compared)
    table = design.tables.advantage
    speeds = table.speeds if design.speed in table.speeds else (*table.speeds, design.speed)
    cells = len(speeds) * len(table.weights) * len(compared)
    progress.begin("comparing", 2 * len(compared) + 2 * len(ALL_TERMS) + cells + len(table.delays))
    draws = fresh_draws(design)
    optima = own_optima(compared, progress)
    found = cases(compared, optima, draws, progress)
    areas = regions(compared, optima, progress)
    curve = delay_curve(compared, optima, draws, progress)
    over = chart(compared, table.weights, table.speeds, draws, progress)
    front = over.at_speed(design.speed) or chart(
        compared, table.weights, (design.speed,), draws, progress
    )
    return Advantage(
        design=design,
        cases=found,
        regions=areas,
        front=front,
        chart=over,
        delay=curve,
        total_seconds=time.perf_counter() - begin,
    )


def checked(compared: Policies) -> None:
    """Refuse (`InputError`) what would be refused in the midst of the work."""
    design = compared.constant.design
    table, where = design.tables.advantage, f"{design.origin}: " if design.origin else ""
    for key, path, values in (
        ("weights", WEIGHT, table.weights), ("speeds", SPEED, table.speeds),
    ):  # fmt: skip
        for value in values:
            try:
                for policy in compared.at(path, value):
                    policy.design.bit_rock  # noqa: B018  its friction, and the limits of the law
                    policy.design.weight_on_bit  # noqa: B018
            except InputError as error:
                raise InputError(error.problem, f"{where}advantage.{key}") from None
    points = [table.region_points, table.region_points, table.region_realizations]
    refuse_too_large(points, "advantage.region_points", 1)
    refuse_too_large([table.realizations], "advantage.realizations")
