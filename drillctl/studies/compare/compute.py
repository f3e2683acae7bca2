"""Cases compared at equal terms: the same starts, the same draws, optionally the same mean weight.

What differs between two cases is their paired difference, see `ensemble.cases`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design, to_toml
from drillctl.ensemble.cases import Estimate, Runs
from drillctl.ensemble.draws import CommonDraws, Failures, equalising_shift, run_draws, start_up
from drillctl.ensemble.grid import refuse_too_large
from drillctl.ensemble.parameters import refuse_dependent, uncertain_parameters
from drillctl.ensemble.regions import Region, region
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import label
from drillctl.store.result import Result
from drillctl.studies.compare.cases import (
    Nominal,
    case_designs,
    cells_of,
    in_case,
    nominal_runs,
    refuse_unequal,
    shifted_design,
)

if TYPE_CHECKING:
    from drillctl.design.tables import AxisTable

Array = NDArray[np.float64]

COMPARED = (
    "j1", "stuck_time", "stick_slip_index", "peak_bit_speed", "peak_pipe_torque",
    "peak_top_torque", "settling_time", "mean_weight_on_bit", "mean_weight_after_start",
    "rop_proxy", "work_per_turn", "time_outside_table",
)  # fmt: skip
"""Measures that are compared."""
NO_ANSWER = "no finite answer"  # reason of a run that broke down


@dataclass(frozen=True, eq=False)
class ComparedCase(Runs):
    """One case at all draws."""

    name: str = label()
    design: Design = label(means="what was simulated, but for the draws and the shift")
    drawn: dict[str, Array] = label("realization", means="drawn values by path, SI")
    failures: tuple[Failures, ...] = label(means="draws without a result, by reason")
    weight_shift: float = label(
        unit="N", means="added to the nominal weight on bit for the sake of equal means"
    )
    nominal: Nominal = label(means="map and motion at its own values, the weight shifted")

    def region(self, level: float) -> Region | None:
        """Cells and outline of the nominal map at or under a level of J1 (s); None without map."""
        result = self.nominal.map
        return None if result is None else region(result.j1, result.axes, level)

    def summary(self, levels: tuple[float, ...]) -> dict[str, Any]:
        """Measures, regions, statuses, failures, shift, scheme and nominal runs; SI."""
        regions = {}
        for level in levels:
            share, inside = self.share(level), self.region(level)
            regions[f"{level:g}"] = {
                "draws": share.hits,
                **share.summary("share"),
                "cells": None if inside is None else inside.cells,
                "area_fraction": None if inside is None else inside.area_fraction,
            }
        return {
            "measures": {name: self.distribution(name) for name in self.measures},
            "regions": regions,
            "statuses": self.counts(),
            "failures": [asdict(failure) for failure in self.failures],
            "weight_shift": self.weight_shift,
            "step": self.step,
            "modes": self.modes,
            "nominal": self.nominal.summary(),
        }


@dataclass(frozen=True, eq=False)
class Comparison(Result):
    """Cases at the same starts and the same draws."""

    kind: ClassVar[str] = "compare"

    design: Design = label(means="whose cases they are; of cases given one by one the first")
    cases: tuple[ComparedCase, ...] = label(over="case", flat=True, means="the baseline first")
    realizations: int = label(means="number of draws")
    seed: int = label(means="what the draws follow from")
    levels: tuple[float, ...] = label(unit="s", means="levels of J1")
    weight_from: float = label(
        unit="s", means="where the window of `mean_weight_after_start` begins"
    )
    equal_mean_weight: bool = label(means="whether nominal weights were shifted for equal means")
    total_seconds: float = label(unit="s", means="from call to return")

    @property
    def baseline(self) -> ComparedCase:
        """The case that the others are compared with."""
        return self.cases[0]

    @cached_property
    def paired(self) -> dict[str, dict[str, Estimate]]:
        """Mean difference of every other case from the baseline, by case and measure."""
        return {
            case.name: {
                name: case.difference(self.baseline, name, self.seed) for name in case.measures
            }
            for case in self.cases[1:]
        }

    def derived(self) -> dict[str, Any]:
        """Drawn values with their units."""
        over = ("case", "realization")
        return {
            f"drawn.{one.path}": (
                over, np.stack([case.drawn[one.path] for case in self.cases]), {"units": one.unit},
            )
            for one in uncertain_parameters(self.baseline.design)
        }  # fmt: skip

    def summary(self) -> dict[str, Any]:
        """Cases with their measures and regions, paired differences, settings; SI units."""
        return {
            "cases": {case.name: case.summary(self.levels) for case in self.cases},
            "paired": {
                name: {
                    measure: {**result.summary("difference"), "pairs": result.draws}
                    for measure, result in differences.items()
                }
                for name, differences in self.paired.items()
            },
            "baseline": self.baseline.name,
            "realizations": self.realizations,
            "seed": self.seed,
            "uncertain": list(self.baseline.drawn),
            "equal_mean_weight": self.equal_mean_weight,
            "weight_from": self.weight_from,
            "total_seconds": self.total_seconds,
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Cases that the design does not name."""
        cases = {case.name: case.design for case in self.cases}
        with suppress(InputError):  # cases given one by one need not be those of their first
            if list(cases.items()) == list(case_designs(self.design).items()):
                return self.design, {}
        return self.design, {"cases": {name: to_toml(case) for name, case in cases.items()}}


def compare(
    cases: Design | Mapping[str, Design],
    realizations: int | None = None,
    seed: int | None = None,
    equal_mean_weight: bool | None = None,
    progress: Progress = SILENT,
) -> Comparison:
    """Compare cases on the same starts and the same draws of what is uncertain.

    Parameters
    ----------
    cases : Design or dict of Design
        A design, for the cases of its `[compare]` table; or cases by name. The first is the
        baseline.
    realizations : int, optional
        Number of draws; by default that of the first design's `[uncertainty]` table.
    seed : int, optional
        What they follow from; by default from there too.
    equal_mean_weight : bool, optional
        Shift the nominal weight of a case with a moving weight on bit until its mean after the
        start, over the draws, is the nominal one; by default as `[compare]` says.
    progress : Progress
        Told of runs and of cells of the maps.

    Returns
    -------
    Comparison
        A draw that is impossible or breaks down is a status and counted, not an exception. Maps
        of the cases over the axes of the first design's `[map]` table, unless its `compare.maps`
        says no.

    Raises
    ------
    InputError
        Cases that are not on equal terms, impossible settings, every draw impossible, a mean
        weight that cannot be reached, or maps too large for the memory.
    """
    begin = time.perf_counter()
    given = {
        "uncertainty.realizations": realizations,
        "uncertainty.seed": seed,
        "compare.equal_mean_weight": equal_mean_weight,
    }
    asked = {path: value for path, value in given.items() if value is not None}
    if isinstance(cases, Design):
        design = cases.replace(asked) if asked else cases
        named = case_designs(design)
    else:
        named = dict(cases)
        refuse_unequal(named)
        first = next(iter(named.values()))
        design = first.replace(asked) if asked else first
    refuse_unequal(named)
    table, equal = design.tables.uncertainty, design.tables.compare.equal_mean_weight
    refuse_dependent(design)
    refuse_too_large([table.realizations, len(named)], "uncertainty.realizations")
    axes = design.tables.map.axes if design.tables.compare.maps else None
    if axes:
        refuse_too_large([len(named), *(one.points for one in axes)])
    progress.begin("simulating cases", (table.realizations + cells_of(axes)) * len(named))
    draws = CommonDraws(table.realizations, table.seed)
    results = []
    for name, variant in named.items():
        try:
            results.append(_compared(name, variant, draws, equal, axes, progress))
        except InputError as error:
            raise in_case(error, variant, name) from None
    return Comparison(
        design=design,
        cases=tuple(results),
        realizations=draws.count,
        seed=draws.seed,
        levels=design.tables.map.levels,
        weight_from=start_up(design.tables.simulation.duration),
        equal_mean_weight=equal,
        total_seconds=time.perf_counter() - begin,
    )


def _compared(
    name: str, design: Design, draws: CommonDraws, equal: bool,
    axes: tuple[AxisTable, ...] | None, progress: Progress,
) -> ComparedCase:  # fmt: skip
    drawn = draws.lanes(design)
    shift = equalising_shift(drawn, draws.count) if equal else 0.0
    runs = run_draws(drawn, draws.count, shift)
    impossible = sum(failure.count for failure in drawn.failures)
    broken = runs.counts().get("failed", 0) - impossible
    failures = drawn.failures
    if broken:
        failures = (*failures, Failures(NO_ANSWER, broken, "a number of the run is not finite"))
    progress.advance(draws.count)
    return ComparedCase(
        measures={measure: runs.measures[measure] for measure in COMPARED},
        status=runs.status,
        step=runs.step,
        modes=runs.modes,
        name=name,
        design=design,
        drawn=draws.values(design),
        failures=failures,
        weight_shift=shift,
        nominal=nominal_runs(shifted_design(design, shift), axes, progress),
    )
