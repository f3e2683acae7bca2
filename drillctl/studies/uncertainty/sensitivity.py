"""Which of the uncertain parameters matters: Sobol indices of J1 and of the areas of regions.

Saltelli's design (Comput. Phys. Commun. 181 (2010) 259-270) as SALib has it: `samples` points of
a scrambled Sobol sequence in twice as many dimensions as there are parameters, and each again
with one parameter from the other half. The first index of a parameter is the share of the
variance that it explains alone, the total index the share that is left when all others are known.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.ensemble.cases import CONFIDENCE
from drillctl.ensemble.parameters import uncertain_parameters
from drillctl.errors import InputError
from drillctl.simulation.measures import STATUSES
from drillctl.store.codec import label
from drillctl.store.json_files import picked, strict
from drillctl.studies.uncertainty.best import NEEDS_FULL

_EDGE = 2.0**-53  # nearest to 0 and to 1 that a point comes, where quantiles are infinite
RESAMPLES = 1000  # of the bootstrap of the indices


@dataclass(frozen=True, eq=False)
class Indices:
    """Sobol indices of one figure."""

    of: str  # what they explain
    unit: str  # of that figure
    first: Array = label("parameter", means="NaN where the figure does not vary")
    total: Array = label("parameter", means="NaN where the figure does not vary")
    first_error: Array = label("parameter", means="half-width of the 95 % bootstrap interval")
    total_error: Array = label("parameter", means="the same; NaN with too few points to know")
    variance: float = label(means="of the figure, in its unit squared")


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Sobol indices of J1 at chosen cells and of the areas under each level."""

    parameters: tuple[str, ...]  # paths of what is uncertain
    samples: int  # points of Saltelli's design
    trajectories: int  # lanes simulated for it
    indices: tuple[Indices, ...] = label(over="figure", means="one a figure")

    def summary(self) -> dict[str, Any]:
        """Indices by figure and parameter."""
        return {
            "parameters": list(self.parameters),
            **picked(self, "samples", "trajectories"),
            "indices": {
                one.of: strict(picked(one, "unit", "variance", *COLUMNS)) for one in self.indices
            },
        }


COLUMNS = ("first", "first_error", "total", "total_error")
"""Figures of `Indices` that there is one of a parameter."""


def refuse_correlated(design: Design) -> None:
    """Refuse (`InputError`) correlated parameters, of which Sobol indices say nothing."""
    joint = any(table.joint for table in design.tables.uncertain.values())
    if joint or design.tables.uncertainty.correlations:
        raise InputError(
            "Sobol indices are of independent parameters: leave correlations, joint samples or "
            "sensitivity out",
            "uncertainty.sensitivity",
        )


def points(design: Design, samples: int, seed: int) -> dict[str, Array]:
    """Realizations of Saltelli's design, in the order in which SALib takes their results."""
    from SALib.sample import sobol

    refuse_correlated(design)
    result = uncertain_parameters(design)
    table = sobol.sample(_problem(tuple(p.path for p in result)), samples,
                         calc_second_order=False, scramble=True, seed=seed)  # fmt: skip
    inside = np.clip(table, _EDGE, 1.0 - _EDGE)
    return {p.path: p.values(inside[:, k]) for k, p in enumerate(result)}


def indices(of: str, unit: str, values: Array, parameters: tuple[str, ...], seed: int) -> Indices:
    """Sobol indices of a figure."""
    from SALib.analyze import sobol

    nothing = np.full(len(parameters), np.nan)
    if np.ptp(values) == 0.0:
        return Indices(of, unit, nothing, nothing, nothing, nothing, 0.0)
    # SALib takes a seed of 0 for none. A resample may be of equal values: its error is not known.
    with np.errstate(invalid="ignore", divide="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        result = sobol.analyze(
            _problem(parameters), values, calc_second_order=False, num_resamples=RESAMPLES,
            conf_level=CONFIDENCE, seed=seed + 1,
        )  # fmt: skip
    names = {"first": "S1", "total": "ST", "first_error": "S1_conf", "total_error": "ST_conf"}
    columns = {key: np.asarray(result[name], dtype=float) for key, name in names.items()}
    return Indices(of=of, unit=unit, variance=float(values.var()), **columns)


def _problem(parameters: tuple[str, ...]) -> dict[str, Any]:
    count = len(parameters)
    return {"num_vars": count, "names": list(parameters), "bounds": [[0.0, 1.0]] * count}


def sensitivity(
    parameters: tuple[str, ...],
    samples: int,
    j1: Array,
    status: NDArray[np.int8],
    cells: dict[int, str],
    levels: tuple[float, ...],
    seed: int,
) -> Sensitivity:
    """Indices of J1 at cells, and of the area under each level."""
    results = []
    for cell, name in cells.items():
        for reason, problem in (("censored", NEEDS_FULL), ("failed", "lanes failed there")):
            if (status[:, cell] == STATUSES.index(reason)).any():
                raise InputError(f"J1 at {name}: {problem}", "uncertainty.sensitivity")
        results.append(indices(f"J1 at {name}", "s", j1[:, cell], parameters, seed))
    for level in levels:
        area = (j1 <= level).mean(axis=1)
        results.append(indices(f"area of J1 <= {level:g}", "1", area, parameters, seed))
    return Sensitivity(parameters, samples, j1.size, tuple(results))
