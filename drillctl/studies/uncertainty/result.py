"""Stability regions under uncertainty: what was simulated, and all that follows from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.audit import Audit, unaudited
from drillctl.ensemble.draws import Failures
from drillctl.ensemble.grid import Axis, axes_of, other_axes
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
from drillctl.ensemble.regions import Region, region
from drillctl.ensemble.sampling import sampling_of
from drillctl.errors import InputError
from drillctl.provenance import provenance
from drillctl.simulation.measures import MEASURES, STATUSES
from drillctl.store.codec import label
from drillctl.store.folder import Growing, growing_realizations
from drillctl.store.result import Result
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
from drillctl.studies.uncertainty.convergence import Convergence, Look, convergence
from drillctl.studies.uncertainty.sensitivity import Sensitivity

if TYPE_CHECKING:
    from pathlib import Path

    import shapely

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Uncertainty(Result):
    """J1 over a map at every realization of what is uncertain."""

    kind: ClassVar[str] = "uncertainty"

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
    seconds: float = label(unit="s", means="in blocks, since the run was last resumed")
    total_seconds: float = label(unit="s", means="from call to return, since then")
    provenance: dict[str, str] = label(
        means="versions and processor it came from", default_factory=provenance
    )

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
        from drillctl.ensemble.regions import outline

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
            )
        return results

    def at(self, cell: int) -> dict[str, float]:
        """Parameters (SI) of a cell of the flattened map."""
        where = np.unravel_index(cell, self.nominal.shape)
        return {a.path: float(a.values[k]) for a, k in zip(self.axes, where, strict=True)}

    def _flat(self, values: NDArray[Any]) -> NDArray[Any]:
        return values.reshape(len(values), -1)

    def derived(self) -> dict[str, Any]:
        """Counts and probabilities by level, moments, and draws with their units."""
        from drillctl.studies.uncertainty.outputs import derived

        return derived(self)

    def summary(self) -> dict[str, Any]:
        """Levels with areas and intervals, best cells, failures, audit; SI units."""
        from drillctl.studies.uncertainty.outputs import summary

        return summary(self)

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Axes and audited lanes that the design does not give."""
        settings = other_axes(self, map_axes)
        if len(self.audit.cells) != self.design.tables.map.audit_cells:
            settings["audited"] = self.audit.cells.tolist()
        return self.design, settings

    def growing(self) -> Growing | None:
        """The number of realizations, to which more can be added."""
        return growing_realizations(self.design)

    def write(self, folder: Path) -> None:
        """Write what the folder does not hold yet: its lanes were written block by block."""
        from drillctl.studies.uncertainty.outputs import write

        write(self, folder)


def map_axes(design: Design) -> tuple[Axis, ...]:
    """Axes of the map under uncertainty: those of `[map]`, then those of `[uncertainty]`."""
    tables = (*design.tables.map.axes, *design.tables.uncertainty.axes)
    paths = [table.path for table in tables]
    for path in paths:
        if paths.count(path) > 1:
            raise InputError(f"two axes run over {path!r}", "uncertainty.axes")
    return axes_of(design, tables)
