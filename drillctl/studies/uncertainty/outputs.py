"""What is written and drawn of regions under uncertainty: data, summary, large tables."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.grid import over_axes, span
from drillctl.ensemble.parameters import uncertain_parameters
from drillctl.ensemble.probability import INNER, MEDIAN, OUTER
from drillctl.ensemble.realizations import Drawn, Realizations
from drillctl.ensemble.running import Block
from drillctl.ensemble.storing import FILES, ZarrBlocks, disk_errors
from drillctl.errors import InputError
from drillctl.simulation.measures import STATUSES
from drillctl.store.codec import TREE, encoded, stored_name
from drillctl.store.json_files import write_json
from drillctl.store.tables import texts, write_columns
from drillctl.studies.uncertainty.best import Mean, Quantile, TailMean

if TYPE_CHECKING:
    from pathlib import Path

    from drillctl import units
    from drillctl.studies.uncertainty.result import Uncertainty

Array = NDArray[np.float64]


def derived(result: Uncertainty) -> dict[str, Any]:
    """What follows from the lanes: counts with intervals, moments; and units of the draws."""
    paths = [a.path for a in result.axes]
    results: dict[str, Any] = {
        one.path: ("realization", result.drawn[one.path], {"units": one.unit})
        for one in uncertain_parameters(result.design)
    }
    results["level"] = ("level", np.array(result.levels), {"units": "s"})
    every = list(result.maps.values())
    columns: dict[str, list[NDArray[Any]]] = {
        "count": [one.counts for one in every],
        "probability": [one.probability for one in every],
        "probability_low": [one.interval[0] for one in every],
        "probability_high": [one.interval[1] for one in every],
        "simultaneous_low": [one.simultaneous[0] for one in every],
        "simultaneous_high": [one.simultaneous[1] for one in every],
    }
    results |= {name: (["level", *paths], np.stack(rows), {}) for name, rows in columns.items()}
    return results | {
        f"j1_{name}": (paths, values, {"units": "s"}) for name, values in known(result).items()
    }


def known(result: Uncertainty) -> dict[str, Array]:
    """Mean, 95 % quantile and tail mean in every cell (s); NaN where stopped lanes enter."""
    results = {}
    for name in (Mean().name, Quantile().name, TailMean().name):
        one = result.values[name]
        certain = np.where(one.certain, one.values, np.nan)
        results[name] = certain.reshape(result.nominal.shape)
    return results


def summary(result: Uncertainty) -> dict[str, Any]:
    """What the command tells; SI units, parameters by path."""
    table = result.design.tables.uncertainty
    told: dict[str, Any] = {
        "realizations": result.realizations,
        "seed": result.seed,
        "sampling": table.sampling,
        "replicates": result.scatter.replicates,
        "uncertain": list(result.drawn),
        "axes": span(result.axes),
        "levels": {f"{level:g}": _level(result, level) for level in result.levels},
        "best": {name: _best(result, name) for name in result.objectives},
        "looks": [
            {
                "realizations": one.realizations, "area": one.area,
                "interval": list(one.interval), "confidence": one.confidence,
            }
            for one in result.looks
        ],
        "statuses": {
            name: int((result.status == code).sum())
            for code, name in enumerate(STATUSES)
            if (result.status == code).any()
        },
        "failures": [
            {"reason": one.reason, "count": one.count, "example": one.example}
            for one in result.failures
        ],
        "audit": result.audit.summary(),
        "trajectories": result.trajectories,
        "seconds": result.seconds,
        "total_seconds": result.total_seconds,
    }  # fmt: skip
    if len(result.axes) == 3:
        told["slices"] = {
            result.axes[2].path: [
                {"value": value, "levels": {f"{x:g}": _level(one, x) for x in one.levels}}
                for value, one in result.slices().items()
            ]
        }
    if result.sensitivity is not None:
        told["sensitivity"] = result.sensitivity.summary()
    return told


def _level(result: Uncertainty, level: float) -> dict[str, Any]:
    areas, one = result.areas[level], result.maps[level]
    low, high = one.simultaneous
    return {
        "nominal_area": result.nominal_regions[level].area_fraction,
        "area_p95": areas[INNER].value,
        "area_p50": areas[MEDIAN].value,
        "area_p05": areas[OUTER].value,
        "interval_95": list(areas[INNER].interval),
        "interval_95_p50": list(areas[MEDIAN].interval),
        "interval_95_p05": list(areas[OUTER].interval),
        "area_always": float(one.always.mean()),
        "area_ever": float(one.ever.mean()),
        # Cells that are in the inner region, and that may be, with all cells' intervals at once.
        "simultaneous_95": [float((low >= INNER).mean()), float((high >= INNER).mean())],
    }


def _best(result: Uncertainty, name: str) -> dict[str, Any]:
    try:
        found = result.best(name)
    except InputError as error:
        nothing = dict.fromkeys(("at", "value", "interval_95", "alike_cells"))
        return nothing | {"reason": error.problem}
    return {
        "at": result.at(found.cell),
        "value": found.value,
        "interval_95": list(found.interval),
        "alike_cells": None if found.alike is None else int(found.alike.sum()),
    }


def write(result: Uncertainty, folder: Path) -> None:
    """Write lanes that are not in the folder yet, and all else."""
    import zarr

    job = Realizations(result.design, result.axes, Drawn(result.seed), tuple(result.measures), None)
    stored = ZarrBlocks(folder, "realizations", job)
    for first, count in stored.missing(result.realizations):
        rows = slice(first, first + count)
        flat = {k: v[rows].reshape(-1, job.width) for k, v in result.measures.items()}
        status = result.status[rows].reshape(-1, job.width)
        stored.keep(Block(first, flat, status, provenance=result.provenance))
    path = folder / FILES["realizations"]
    own = {*result.measures, "status"}
    with disk_errors(path):
        group = zarr.open_group(path, mode="a")
        for name in list(group.array_keys()):
            if name not in own:  # of fewer realizations
                del group[name]
        data = result.data.drop_vars(own)
        names = {str(n): stored_name(str(n)) for n in (*data.variables, *data.dims)}
        data.rename(names).to_zarr(path, mode="a", consolidated=False)
    write_json(folder / TREE, encoded(result)[0])


class Interim:
    """Pictures of what is finished, from time to time."""

    def __init__(self, every: float, path: Path, system: units.System) -> None:
        self._every, self._path, self._system = every, path, system
        self._next = time.monotonic() + every

    def __call__(self, so_far: Callable[[], Uncertainty | None]) -> None:
        """Draw what is finished if it is time."""
        if time.monotonic() < self._next:
            return
        from drillctl import plots

        result = so_far()
        if result is not None and len(result.axes) == 2:
            part = self._path.with_suffix(".part.png")
            plots.probability_map(result, system=self._system).savefig(part)
            part.replace(self._path)
        self._next = time.monotonic() + self._every


def write_columns_of(result: Uncertainty, folder: Path) -> None:
    """Write what has many rows (SI): `cells.csv`, `draws.csv`, and `contours.csv` on request."""
    columns: dict[str, Array] = {}
    for level, one in result.maps.items():
        name = f"probability_{level:g}"
        columns[name] = one.probability
        columns[f"{name}_low"], columns[f"{name}_high"] = one.interval
    columns |= {f"j1_{name}": values for name, values in known(result).items()}
    columns["nominal_j1"] = result.nominal
    cells = over_axes(result.axes) | {name: texts(v) for name, v in columns.items()}
    write_columns(folder / "cells.csv", cells)
    write_columns(folder / "draws.csv", {path: texts(v) for path, v in result.drawn.items()})
    if result.design.tables.uncertainty.contours:
        heads = ["level", "realization", "polygon", "ring", *(a.path for a in result.axes)]
        rows = [[f"{one}" for one in row] for row in _contours(result)]
        columns_ = zip(*rows, strict=True) if rows else [[] for _ in heads]
        write_columns(folder / "contours.csv", dict(zip(heads, columns_, strict=True)))


def _contours(result: Uncertainty) -> Iterator[tuple[Any, ...]]:
    for level in result.levels:
        for number in range(result.realizations):
            outline = result.contours(level, number)
            for k, polygon in enumerate(outline.geoms):
                for ring, line in enumerate((polygon.exterior, *polygon.interiors)):
                    for x, y in line.coords:
                        yield level, number, k, ring, x, y
