"""PI with a constant weight on bit against PI with one that follows the bit speed."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl.design import Design
from drillctl.ensemble.cases import Estimate
from drillctl.ensemble.grid import refuse_too_large
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import label
from drillctl.store.json_files import picked, strict
from drillctl.store.result import Result
from drillctl.studies.advantage.cases import (
    ALL_TERMS,
    IDEAL,
    MEAN,
    SPEED,
    WEIGHT,
    Case,
    Policies,
    cases,
    fresh_draws,
    own_optima,
    policies,
)
from drillctl.studies.advantage.sweeps import (
    Chart,
    DelayCurve,
    Regions,
    chart,
    delay_curve,
    regions,
)


@dataclass(frozen=True, eq=False)
class Advantage(Result, kind="advantage"):
    """PI against PI with a weight that follows the bit speed, each at its own robust optimum.

    Its design's `[advantage]` and `[tune]` say what was compared and to what end.
    """

    design: Design = label(means="what was compared")
    cases: tuple[Case, ...] = label(
        over="case", flat=True,
        means="at the design's own weight and speed; the constant weight first",
    )  # fmt: skip
    regions: tuple[Regions, ...] = label(
        over="policy", flat=True, means="of each policy, over the gains of the drive"
    )
    front: Chart = label(means="over weights at the design's own speed")
    chart: Chart = label(name="map", means="over weights and speeds")
    delay: DelayCurve = label(means="against the delay of the real path")
    total_seconds: float = label(unit="s", means="from call to return")

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
    def objective(self) -> str:
        """What the gains are tuned to."""
        tune = self.design.tables.tune
        return {
            "mean": "mean of J1",
            "quantile": f"{tune.quantile:.0%} quantile of J1",
            "cvar": f"mean of J1 beyond its {tune.quantile:.0%} quantile",
            "worst": "worst J1",
        }[tune.objective]

    def derived(self) -> dict[str, Any]:
        """Names of policies and gains."""
        return {
            "policy": ("policy", np.array(self.chart.policies, dtype=object)),
            "parameter": ("parameter", np.array(["kp", "ki", "gain"], dtype=object)),
        }

    def summary(self) -> dict[str, Any]:
        """Cases with paired differences, areas, front, map, crossing delays; SI units."""
        table, tune = self.design.tables.advantage, self.design.tables.tune
        return {
            "objective": tune.objective_name,
            "cases": {
                case.name: case.summary(self.baseline, self.levels, self.seed)
                for case in self.cases
            },
            "regions": {one.policy: one.summary() for one in self.regions},
            "front": _chart_summary(self.front),
            "map": _chart_summary(self.chart),
            "delay": self.delay.summary(),
            **picked(table, "realizations", "seed", "material"),
            "total_seconds": self.total_seconds,
        }


def _chart_summary(result: Chart) -> Any:
    shown = ("objective", "mean_weight", "advantage", "advantage_low", "advantage_high")
    policies = {
        name: {
            **{one: result.figures[one][k] for one in shown},
            "significant": result.significant(k),
        }
        for k, name in enumerate(result.policies)
    }
    return strict({"weights": result.weights, "speeds": result.speeds, "policies": policies})


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
        Receives finished searches.

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
    result = cases(compared, optima, draws, progress)
    areas = regions(compared, optima, progress)
    curve = delay_curve(compared, optima, draws, progress)
    over = chart(compared, table.weights, table.speeds, draws, progress)
    front = over.at_speed(design.speed)
    if front is None:
        front = chart(compared, table.weights, (design.speed,), draws, progress, "front_speed")
    return Advantage(
        design=design,
        cases=result,
        regions=areas,
        front=front,
        chart=over,
        delay=curve,
        total_seconds=time.perf_counter() - begin,
    )


def checked(compared: Policies) -> None:
    """Refuse (`InputError`) what would be refused in the midst of the work."""
    design = compared.constant.design
    table = design.tables.advantage
    for key, path, values in (
        ("weights", WEIGHT, table.weights), ("speeds", SPEED, table.speeds),
    ):  # fmt: skip
        for value in values:
            try:
                for policy in compared.at(path, value):
                    policy.design.bit_rock  # noqa: B018  its friction, and the limits of the law
                    policy.design.weight_on_bit  # noqa: B018
            except InputError as error:
                raise InputError(error.problem, design.where(f"advantage.{key}")) from None
    points = [table.region_points, table.region_points, table.region_realizations]
    refuse_too_large(points, "advantage.region_points", 1)
    refuse_too_large([table.realizations], "advantage.realizations")
