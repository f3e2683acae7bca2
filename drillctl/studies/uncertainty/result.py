"""Stability regions under uncertainty: what was simulated, and all that follows from it.

Areas settle as realizations are added. A run that is to stop when they have does so by a fixed
schedule of looks: looking at the data again and again until an interval happens to be narrow makes
it hold less often than it says. The looks are fixed before the first lane is run, and the interval
of each has its share of the error that all may make together (Bonferroni).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.arrays import Array, Index, Mask
from drillctl.design import Design, axis_tables
from drillctl.design.uncertain_tables import UntilTable
from drillctl.ensemble.audit import Audit, choose_cells, unaudited
from drillctl.ensemble.cases import CONFIDENCE, Interval
from drillctl.ensemble.draws import Failures
from drillctl.ensemble.envelopes import Envelope
from drillctl.ensemble.grid import Axis, axes_of, other_axes, place_of, span
from drillctl.ensemble.parameters import sampling_of, uncertain_parameters
from drillctl.ensemble.probability import (
    INNER,
    MEDIAN,
    OUTER,
    Area,
    ProbabilityMap,
    Scatter,
    probability_map,
    region_areas,
)
from drillctl.ensemble.sweeps import Region, outline, region
from drillctl.errors import InputError
from drillctl.simulation.measures import MEASURES, STATUSES, status_counts
from drillctl.store.codec import label
from drillctl.store.folder import Growing, growing_realizations
from drillctl.store.json_files import picked
from drillctl.store.result import Timed
from drillctl.studies.uncertainty.best import (
    NEEDS_FULL,
    Best,
    Mean,
    Objective,
    Quantile,
    TailMean,
    Values,
    best_cells,
    objectives,
    values_of,
)
from drillctl.studies.uncertainty.sensitivity import Sensitivity

if TYPE_CHECKING:
    import shapely

AUDITED = 64  # realizations that audited lanes are chosen from: the first ones are as good as any
FEWEST = 16  # realizations that the first point of a curve has, or two a replicate


class Convergence(NamedTuple):
    """Areas of the inner regions against the number of realizations."""

    counts: tuple[int, ...]  # realizations, from the first on
    # by level, one a count, with 95 % intervals of that count by itself
    areas: dict[float, tuple[Area, ...]]


def convergence(j1: Array, levels: tuple[float, ...], scatter: Scatter, seed: int) -> Convergence:
    """Areas of the inner regions at doubling numbers of realizations."""
    counts, rows = schedule(max(FEWEST, 2 * scatter.replicates), len(j1)), []
    for count in counts:
        asked = [(probability_map(j1[:count], level, scatter), INNER) for level in levels]
        rows.append(region_areas(j1[:count], asked, scatter, seed))
    return Convergence(counts, dict(zip(levels, zip(*rows, strict=True), strict=True)))


class Look(NamedTuple):
    """The area as it was known at a number of realizations."""

    realizations: int  # how many had been run
    area: float  # share of the map
    interval: Interval  # corrected for the number of looks
    confidence: float  # of this interval by itself

    def enough(self, half_width: float) -> bool:
        """Whether the area is known to within a half-width on either side."""
        low, high = self.interval
        return max(self.area - low, high - self.area) <= half_width


def schedule(first: int, most: int) -> tuple[int, ...]:
    """Numbers of realizations: doubling, up to the most."""
    looks = []
    while first < most:
        looks.append(first)
        first *= 2
    return (*looks, most)


def level_of(table: UntilTable, levels: tuple[float, ...]) -> float:
    """The level whose region is to be known: that of the table, or the highest of the map."""
    if table.level is None:
        return levels[-1]
    if table.level not in levels:
        allowed = ", ".join(f"{level:g}" for level in levels)
        raise InputError(
            f"{table.level:g} is no level of the map; allowed: {allowed}", "uncertainty.until.level"
        )
    return table.level


def look(
    j1: Array, table: UntilTable, level: float, looks: int, scatter: Scatter, seed: int
) -> Look:
    """The area at one of the looks."""
    confidence = 1.0 - (1.0 - CONFIDENCE) / looks
    result = probability_map(j1, level, scatter)
    (area,) = region_areas(j1, [(result, table.probability)], scatter, seed, confidence)
    return Look(len(j1), area.value, area.interval, confidence)


@dataclass(frozen=True, eq=False)
class Uncertainty(Timed, kind="uncertainty"):
    """J1 over a map at every realization of what is uncertain."""

    design: Design = label(means="with what is uncertain, named or by default")
    axes: tuple[Axis, ...] = label(means="of the map")
    levels: tuple[float, ...] = label(unit="s", means="levels of J1")
    drawn: dict[str, Array] = label(
        "realization", flat=True, means="values (SI) of what is uncertain, by path"
    )
    measures: dict[str, Array] = label(
        "realization", "axes", unit=lambda name: MEASURES[name].unit, flat=True,
        means=lambda name: MEASURES[name].meaning,
    )  # fmt: skip
    status: NDArray[np.int8] = label(
        "realization", "axes", flags=STATUSES, means="how the run ended"
    )
    nominal: Array = label("axes", unit="s", name="nominal_j1", means="J1 of the design itself")
    audit: Audit = label(
        flat=True, means="lanes of the flattened `status` simulated again by the reference solver"
    )
    failures: tuple[Failures, ...] = label(means="realizations that no rig has, by reason")
    looks: tuple[Look, ...] = label(
        means="at which it was decided whether to go on; empty without such a rule"
    )
    sensitivity: Sensitivity | None = label(means="Sobol indices, if they were requested")
    envelope: Envelope | None = label(flat=True, means="responses of the design over its draws")
    seconds: float = label(unit="s", means="in blocks, since the run was last resumed")

    @property
    def j1(self) -> Array:
        """J1 of every realization in every cell (s); a lower bound where it was censored."""
        return self.measures["j1"]

    @property
    def realizations(self) -> int:
        """How many."""
        return len(self.status)

    @property
    def seed(self) -> int:
        """What the draws follow from."""
        return self.design.tables.uncertainty.seed

    @property
    def scatter(self) -> Scatter:
        """Which realizations are independent of each other."""
        return Scatter(sampling_of(self.design.tables.uncertainty).replicates)

    @property
    def trajectories(self) -> int:
        """Lanes that the result stands on."""
        own = self.status.size + self.nominal.size
        return own + (0 if self.sensitivity is None else self.sensitivity.trajectories)

    @cached_property
    def censored(self) -> Mask:
        """Lanes that were stopped, whose J1 is a lower bound."""
        return np.asarray(self.status == STATUSES.index("censored"))

    @cached_property
    def possible(self) -> Mask:
        """Realizations that some rig has; the others failed in every cell."""
        failed = self._flat(self.status) == STATUSES.index("failed")
        return np.asarray(~failed.all(axis=1))

    def probability(self, level: float) -> ProbabilityMap:
        """How probable it is that J1 keeps to a level, over the map.

        Raises
        ------
        InputError
            Lanes were stopped at a lower level.
        """
        if level > self.levels[-1] and self.censored.any():
            raise InputError(f"above the highest level {self.levels[-1]:g}, {NEEDS_FULL}", "level")
        return probability_map(self.j1, level, self.scatter)

    @cached_property
    def maps(self) -> dict[float, ProbabilityMap]:
        """The same at every level of the map."""
        return {level: self.probability(level) for level in self.levels}

    @cached_property
    def nominal_regions(self) -> dict[float, Region]:
        """Regions of the design itself."""
        return {level: region(self.nominal, self.axes, level) for level in self.levels}

    @cached_property
    def areas(self) -> dict[float, dict[float, Area]]:
        """Areas of inner, median and outer region by level, with bootstrap intervals."""
        asked = [(one, bound) for one in self.maps.values() for bound in (INNER, MEDIAN, OUTER)]
        areas = region_areas(self._flat(self.j1), asked, self.scatter, self.seed)
        results: dict[float, dict[float, Area]] = {level: {} for level in self.levels}
        for (one, bound), area in zip(asked, areas, strict=True):
            results[one.level][bound] = area
        return results

    @cached_property
    def convergence(self) -> Convergence:
        """Areas of the inner regions against the number of realizations."""
        return convergence(self._flat(self.j1), self.levels, self.scatter, self.seed)

    @cached_property
    def objectives(self) -> dict[str, Objective]:
        """What cells are judged by, by name."""
        return {one.name: one for one in objectives(self.levels)}

    def best(self, name: str) -> Best:
        """The best cell by `mean`, `q95`, `cvar95` or `probability_` of a level.

        Raises
        ------
        InputError
            No such objective, every cell has failed lanes, or too many lanes were stopped.
        """
        if name not in self.objectives:
            raise InputError(f"no objective {name!r}; allowed: {', '.join(self.objectives)}")
        result = self._best[name]
        if isinstance(result, InputError):
            raise result
        return result

    @cached_property
    def values(self) -> dict[str, Values]:
        """Every objective in every cell of the flattened map, by name."""
        return values_of(self.objectives.values(), *self._lanes)

    @cached_property
    def _best(self) -> dict[str, Best | InputError]:
        scatter = self.scatter.of(self.possible)
        return best_cells(self.objectives.values(), self.values, *self._lanes, scatter, self.seed)

    @property
    def _lanes(self) -> tuple[Array, Mask]:
        """J1 of the possible realizations and which of it are bounds, shape (rows, cells)."""
        j1, censored = self._flat(self.j1), self._flat(self.censored)
        if self.possible.all():  # no copies, then
            return j1, censored
        return j1[self.possible], censored[self.possible]

    def mean(self) -> Array:
        """Mean of J1 over the possible realizations (s), shape of the map; see `over_map`."""
        return self.over_map(Mean())

    def quantile(self, probability: float) -> Array:
        """Quantile of J1 over the possible realizations (s), shape of the map; see `over_map`."""
        return self.over_map(Quantile(probability))

    def tail_mean(self, probability: float = 0.95) -> Array:
        """CVaR of J1 over the possible realizations (s), shape of the map; see `over_map`."""
        return self.over_map(TailMean(probability))

    def over_map(self, objective: Objective) -> Array:
        """An objective in every cell; NaN where lanes failed.

        Parameters
        ----------
        objective : Objective
            Which.

        Raises
        ------
        InputError
            It is not known in some cell because lanes were stopped there.
        """
        result = self.values.get(objective.name)
        if result is None or self.objectives[objective.name] != objective:
            result = values_of([objective], *self._lanes)[objective.name]
        if not result.certain.all():
            lacking = int((~result.certain).sum())
            raise InputError(f"unknown in {lacking} cells: {NEEDS_FULL}", objective.name)
        return result.values.reshape(self.nominal.shape)

    def contours(self, level: float, realization: int) -> shapely.MultiPolygon:
        """Outline of the region of one realization, in SI, over two parameters.

        Parameters
        ----------
        level : float
            Level (s).
        realization : int
            Which.

        Raises
        ------
        InputError
            Lanes were stopped, so that the outline between cells is not known; or the map does
            not run over two parameters.
        """
        if self.censored[realization].any():
            raise InputError(f"outlines between cells: {NEEDS_FULL}", "contours")
        if len(self.axes) != 2:
            raise InputError("outlines are of maps over 2 parameters", "contours")
        return outline(self.j1[realization], self.axes, level)

    def slices(self) -> dict[float, Uncertainty]:
        """The map over the first two of three parameters, by value (SI) of the third.

        Empty for a map over another number of parameters.
        """
        if len(self.axes) != 3:
            return {}
        last = self.axes[2]
        name = last.path.rpartition(".")[2].replace("_", " ")
        title = self.design.tables.title or self.design.name
        results = {}
        for k, value in enumerate(last.values):
            shown, unit = units.displayed(float(value), last.unit, "si")
            values = {last.path: units.SI(value), "title": f"{title}, {name} {shown:g} {unit}"}
            results[float(value)] = replace(
                self,
                design=self.design.replace(values),
                axes=self.axes[:2],
                measures={key: v[..., k] for key, v in self.measures.items()},
                status=self.status[..., k],
                nominal=self.nominal[..., k],
                audit=unaudited("lane"),
                looks=(),
                sensitivity=None,
                envelope=None,
            )
        return results

    def at(self, cell: int) -> dict[str, float]:
        """Parameters (SI) of a cell of the flattened map."""
        return place_of(self.axes, cell)

    def _flat(self, values: NDArray[Any]) -> NDArray[Any]:
        return values.reshape(len(values), -1)

    @property
    def known(self) -> dict[str, Array]:
        """Mean, 95 % quantile and tail mean in every cell (s); NaN where stopped lanes enter."""
        shown = {one.name: self.values[one.name] for one in (Mean(), Quantile(), TailMean())}
        return {
            name: np.where(one.certain, one.values, np.nan).reshape(self.nominal.shape)
            for name, one in shown.items()
        }

    def derived(self) -> dict[str, Any]:
        """Counts and probabilities by level, moments, and draws with their units."""
        paths = [a.path for a in self.axes]
        results: dict[str, Any] = {
            one.path: ("realization", self.drawn[one.path], {"units": one.unit})
            for one in uncertain_parameters(self.design)
        }
        results["level"] = ("level", np.array(self.levels), {"units": "s"})
        every = list(self.maps.values())
        columns: dict[str, list[NDArray[Any]]] = {
            "count": [one.counts for one in every],
            "probability": [one.probability for one in every],
        }
        for kind, name in (("interval", "probability"), ("simultaneous", "simultaneous")):
            for k, end in enumerate(("low", "high")):
                columns[f"{name}_{end}"] = [getattr(one, kind)[k] for one in every]
        results |= {name: (["level", *paths], np.stack(rows), {}) for name, rows in columns.items()}
        return results | {
            f"j1_{name}": (paths, values, {"units": "s"}) for name, values in self.known.items()
        }

    def summary(self) -> dict[str, Any]:
        """Levels with areas and intervals, best cells, failures, audit; SI units."""
        result: dict[str, Any] = {
            **picked(self, "realizations", "seed", "trajectories", "seconds", "total_seconds"),
            "sampling": self.design.tables.uncertainty.sampling,
            "replicates": self.scatter.replicates,
            "uncertain": list(self.drawn),
            "axes": span(self.axes),
            "levels": self._levels(),
            "best": {name: self._best_summary(name) for name in self.objectives},
            "looks": [one._asdict() | {"interval": list(one.interval)} for one in self.looks],
            "statuses": status_counts(self.status),
            "failures": [asdict(one) for one in self.failures],
            "audit": self.audit.summary(),
        }
        if len(self.axes) == 3:
            slices = [{"value": x, "levels": one._levels()} for x, one in self.slices().items()]
            result["slices"] = {self.axes[2].path: slices}
        if self.sensitivity is not None:
            result["sensitivity"] = self.sensitivity.summary()
        return result

    def _levels(self) -> dict[str, Any]:
        return {f"{level:g}": self._level(level) for level in self.levels}

    def _level(self, level: float) -> dict[str, Any]:
        areas, one = self.areas[level], self.maps[level]
        low, high = one.simultaneous
        return {
            "nominal_area": self.nominal_regions[level].area_fraction,
            "area_p95": areas[INNER].value,
            "area_p50": areas[MEDIAN].value,
            "area_p05": areas[OUTER].value,
            "interval_95": list(areas[INNER].interval),
            "interval_95_p50": list(areas[MEDIAN].interval),
            "interval_95_p05": list(areas[OUTER].interval),
            "area_always": float(one.always.mean()),
            "area_ever": float(one.ever.mean()),
            # Cells in the inner region, and that may be, with all cells' intervals at once.
            "simultaneous_95": [float((low >= INNER).mean()), float((high >= INNER).mean())],
        }

    def _best_summary(self, name: str) -> dict[str, Any]:
        try:
            best = self.best(name)
        except InputError as error:
            nothing = dict.fromkeys(("at", "value", "interval_95", "alike_cells"))
            return nothing | {"reason": error.problem}
        return {
            "at": self.at(best.cell),
            "value": best.value,
            "interval_95": list(best.interval),
            "alike_cells": None if best.alike is None else int(best.alike.sum()),
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Axes and audited lanes that the design does not give."""
        settings = other_axes(self, map_axes)
        lanes = self.to_audit(self.design.tables.map.audit_cells)
        if not np.array_equal(lanes, self.audit.cells):
            settings["audited"] = self.audit.cells.tolist()
        return self.design, settings

    def to_audit(self, count: int) -> Index:
        """Lanes to audit; none that was stopped."""
        known = np.where(self.censored, np.nan, self.j1)[:AUDITED]
        return choose_cells(known, self.levels, count)

    def growing(self) -> Growing | None:
        """The number of realizations, to which more can be added."""
        return growing_realizations(self.design)


def map_axes(design: Design) -> tuple[Axis, ...]:
    """Axes of the map under uncertainty: those of `[map]`, then those of `[uncertainty]`."""
    tables = (*axis_tables(design), *design.tables.uncertainty.axes)
    paths = [table.path for table in tables]
    for path in paths:
        if paths.count(path) > 1:
            raise InputError(f"two axes run over {path!r}", "uncertainty.axes")
    return axes_of(design, tables)
