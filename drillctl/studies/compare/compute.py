"""Cases compared at equal terms: the same starts, the same draws, optionally the same mean weight.

Each case is a design; its map and one motion are computed without draws. What differs between two
cases is their paired difference, see `ensemble.cases`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design, axis_tables, parameter, to_toml
from drillctl.ensemble.audit import Audit, audited, choose_cells, kept, unaudited
from drillctl.ensemble.cases import Estimate, Runs
from drillctl.ensemble.draws import (
    CommonDraws,
    Failures,
    drawn_designs,
    equalising_shift,
    run_draws,
    start_up,
)
from drillctl.ensemble.grid import axes_of, refuse_too_large
from drillctl.ensemble.parameters import Uncertain, refuse_dependent, uncertain_parameters
from drillctl.ensemble.sweeps import Region, Sweep, region, sweep
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress, Within
from drillctl.simulation import Simulation, simulate
from drillctl.simulation.measures import with_axial
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.store.result import Timed, timed

if TYPE_CHECKING:
    from drillctl.design.tables import AxisTable

ALONE = "as designed"  # name of the only case of a design without cases
INTERVAL = 0.1  # sampling interval of the responses (s), rounded to a whole number of steps
NO_MAPS = "compare.maps is false"  # reason where no maps are requested
WEIGHT = "operating_point.weight_on_bit"  # what is shifted for the sake of equal mean weights


def case_designs(design: Design) -> dict[str, Design]:
    """The cases of a design's `[compare]` table, the baseline first."""
    cases = design.tables.compare.cases
    if not cases:
        return {ALONE: design}
    results = {}
    for case in cases:
        with design.within(_of_case(case.name)):
            results[case.name] = design.replace(case.values)
    return results


def _of_case(name: str) -> str:
    return f"compare.cases {name!r}"


def refuse_unequal(cases: Mapping[str, Design]) -> tuple[Uncertain, ...]:
    """Refuse cases that are not on equal terms: other starts, other runs, other draws."""
    if not cases:
        raise InputError("at least one case is needed", "compare.cases")
    baseline = next(iter(cases.values()))
    expected = uncertain_parameters(baseline)
    for name, design in cases.items():
        with design.within(_of_case(name)):
            _refuse_other_runs(design, baseline)
            _refuse_other_draws(design, baseline, expected)
    return expected


def _refuse_other_runs(design: Design, baseline: Design) -> None:
    one, other = design.tables, baseline.tables
    if one.start != other.start:
        raise InputError("cases are compared from the same start as the first", "start")
    for key in ("duration", "j1_from"):
        if getattr(one.simulation, key) != getattr(other.simulation, key):
            raise InputError("cases are compared over the same run as the first",
                             f"simulation.{key}")  # fmt: skip


def _refuse_other_draws(design: Design, baseline: Design, expected: tuple[Uncertain, ...]) -> None:
    result = uncertain_parameters(design)
    if design.tables.uncertain != baseline.tables.uncertain or (
        [p.path for p in result] != [p.path for p in expected]
    ):
        raise InputError(
            f"the first case draws {', '.join(p.path for p in expected)}; every case must draw "
            "the same: name them in [uncertain] of the design",
            "uncertain",
        )
    for drawn in (p for p in result if not p.own_mean):
        if parameter(design, drawn.path).value != parameter(baseline, drawn.path).value:
            raise InputError(
                "is drawn, from one distribution in all cases, so that a value of its own has no "
                "effect; a distribution without mean is drawn about the value of each case",
                drawn.path,
            )


@dataclass(frozen=True, eq=False)
class Nominal:
    """A case at its own values, nothing drawn."""

    map: Sweep | None  # J1 and the other measures over the two axes of the comparison, not audited
    no_map: str | None  # why there is none; None where there is one
    response: Simulation  # by the batch engine, sampled about every `INTERVAL`

    def summary(self) -> dict[str, Any]:
        """Measures and scheme of the response, map or why there is none; SI."""
        result = None
        if self.map is not None:
            # Regions stand with the case, at the levels of the comparison; no cell was audited.
            whole = self.map.summary()
            result = {key: whole[key] for key in whole if key not in ("regions", "audit")}
        return {**self.response.summary(), "map": result, "no_map": self.no_map}


def shifted_design(design: Design, shift: float) -> Design:
    """The design with its nominal weight on bit shifted (N)."""
    if shift == 0.0:
        return design
    weight = design.tables.operating_point.weight_on_bit + shift
    values: dict[str, Any] = {WEIGHT: units.SI(weight)}
    low, high = design.table_range
    if not low <= weight <= high:
        # A weight that moves leaves the table in its draws too; only a design is asked first.
        values["bit_rock.outside_table"] = "extrapolate"
    return design.replace(values)


def cells_of(tables: tuple[AxisTable, ...] | None) -> int:
    """Cells of the map of each case."""
    return math.prod(table.points for table in tables) if tables else 0


def nominal_runs(
    design: Design, tables: tuple[AxisTable, ...] | None, progress: Progress
) -> Nominal:
    """Map and response of a case; without tables of axes no map."""
    result, reason = None, None
    try:
        if tables is None:
            raise InputError(NO_MAPS)
        if len(tables) != 2:
            raise InputError(f"a map runs over 2 parameters, [map] has {len(tables)}")
        result = sweep(design, axes_of(design, tables), audit_cells=0, progress=Within(progress))
    except InputError as error:  # the axes do not fit this case, or a value on them is impossible
        reason = str(error)
        progress.advance(cells_of(tables))
    return Nominal(result, reason, simulate(design, engine="batch", interval=INTERVAL))


COMPARED = (
    "j1", "stuck_time", "stick_slip_index", "peak_bit_speed", "peak_pipe_torque",
    "peak_top_torque", "settling_time", "mean_weight_on_bit", "mean_weight_after_start",
    "rop_proxy", "work_per_turn", "time_outside_table",
)  # fmt: skip
"""Measures that are compared, beside those of axial motion."""
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
    audit: Audit = label(means="draws simulated again by the reference solver")

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
            **picked(self, "weight_shift", "step", "modes"),
            "nominal": self.nominal.summary(),
            "audit": self.audit.summary(),
        }


@dataclass(frozen=True, eq=False)
class Comparison(Timed, kind="compare"):
    """Cases at the same starts and the same draws."""

    design: Design = label(means="whose cases they are; of cases given one by one the first")
    cases: tuple[ComparedCase, ...] = label(over="case", flat=True, means="the baseline first")
    realizations: int = label(means="number of draws")
    seed: int = label(means="what the draws follow from")
    levels: tuple[float, ...] = label(unit="s", means="levels of J1")
    weight_from: float = label(
        unit="s", means="where the window of `mean_weight_after_start` begins"
    )
    equal_mean_weight: bool = label(means="whether nominal weights were shifted for equal means")

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
            "uncertain": list(self.baseline.drawn),
            **picked(
                self, "realizations", "seed", "equal_mean_weight", "weight_from", "total_seconds"
            ),
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Cases that the design does not name."""
        cases = {case.name: case.design for case in self.cases}
        with suppress(InputError):  # cases given one by one need not be those of their first
            if list(cases.items()) == list(case_designs(self.design).items()):
                return self.design, {}
        return self.design, {"cases": {name: to_toml(case) for name, case in cases.items()}}


@timed
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
        start, over the draws, is the nominal one; by default as in `[compare]`.
    progress : Progress
        Receives finished runs and cells of the maps.

    Returns
    -------
    Comparison
        A draw that is impossible or breaks down is a status and counted, not an exception. Maps
        of the cases over the axes of the first design's `[map]` table, unless its `compare.maps`
        is false.

    Raises
    ------
    InputError
        Cases that are not on equal terms, impossible settings, every draw impossible, a mean
        weight that cannot be reached, or maps too large for the memory.
    """
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
    axes = axis_tables(design) if design.tables.compare.maps else None
    if axes:
        refuse_too_large([len(named), *(one.points for one in axes)])
    progress.begin("simulating cases", (table.realizations + cells_of(axes)) * len(named))
    draws = CommonDraws(table.realizations, table.seed)
    measures = with_axial(COMPARED, any(one.axial is not None for one in named.values()))
    results = []
    for name, variant in named.items():
        with variant.within(_of_case(name)):
            results.append(_compared(name, variant, draws, equal, axes, measures, progress))
    each = -(-design.tables.map.audit_cells // len(named))
    levels = design.tables.map.levels
    results = [replace(case, audit=_audit(case, levels, each, progress)) for case in results]
    return Comparison(
        design=design,
        cases=tuple(results),
        realizations=draws.count,
        seed=draws.seed,
        levels=design.tables.map.levels,
        weight_from=start_up(design.tables.simulation.duration),
        equal_mean_weight=equal,
    )


def _compared(
    name: str, design: Design, draws: CommonDraws, equal: bool,
    axes: tuple[AxisTable, ...] | None, measures: tuple[str, ...], progress: Progress,
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
        **vars(runs) | {"measures": {one: runs.measures[one] for one in measures}},
        name=name,
        design=design,
        drawn=draws.values(design),
        failures=failures,
        weight_shift=shift,
        nominal=nominal_runs(shifted_design(design, shift), axes, progress),
        audit=unaudited("draw"),
    )


def _audit(case: ComparedCase, levels: tuple[float, ...], count: int, progress: Progress) -> Audit:
    """Some draws of a case again."""
    numbers, shift = choose_cells(case.measures["j1"], levels, count), case.weight_shift
    batch, drawn = kept(case.measures, case.status, numbers), dict(case.drawn)
    if shift:
        del batch["rop_proxy"]  # over a nominal weight that is shifted in designs, not in lanes
        drawn |= {WEIGHT: drawn[WEIGHT] + shift} if WEIGHT in drawn else {}
    designs = drawn_designs(shifted_design(case.design, shift), drawn, numbers)
    return audited(numbers, batch, designs, "draw", progress)
