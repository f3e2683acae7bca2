"""Stability regions under uncertainty as a labelled dataset, and as a summary."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.ensemble.parameters import uncertain_parameters
from drillctl.ensemble.realizations import Drawn, Realizations
from drillctl.ensemble.running import Block
from drillctl.ensemble.storing import FILES, ZarrBlocks, disk_errors
from drillctl.errors import InputError
from drillctl.simulation.measures import MEASURES, STATUSES
from drillctl.studies.uncertainty.objectives import Mean, Quantile, TailMean
from drillctl.studies.uncertainty.probability import INNER, MEDIAN, OUTER

if TYPE_CHECKING:
    from pathlib import Path

    import xarray

    from drillctl.studies.uncertainty.result import Uncertainty

Array = NDArray[np.float64]


def dataset(result: Uncertainty) -> xarray.Dataset:
    """All that a result holds, and the maps that follow from it."""
    import xarray

    variables = lanes(result) | maps(result)
    coordinates: dict[str, Any] = {
        a.path: (a.path, a.values, {"units": a.unit}) for a in result.axes
    }
    coordinates["level"] = ("level", np.array(result.levels), {"units": "s"})
    return xarray.Dataset(variables, coordinates, dict(result.provenance))


def lanes(result: Uncertainty) -> dict[str, Any]:
    """What was simulated, lane by lane, as variables of a dataset."""
    dimensions = ["realization", *(a.path for a in result.axes)]
    variables: dict[str, Any] = {
        name: (dimensions, values, {"units": MEASURES[name].unit})
        for name, values in result.measures.items()
    }
    flags = {"flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
    return variables | {"status": (dimensions, result.status, flags)}


def maps(result: Uncertainty) -> dict[str, Any]:
    """Everything else: draws, nominal map, counts with intervals, moments, audit."""
    paths = [a.path for a in result.axes]
    found: dict[str, Any] = {
        one.path: ("realization", result.drawn[one.path], {"units": one.unit})
        for one in uncertain_parameters(result.design)
    }
    found["nominal_j1"] = (paths, result.nominal, {"units": "s"})
    found["audited_lane"] = ("audited", result.audit.cells, {})
    found["audited_j1"] = ("audited", result.audit.reference, {"units": "s"})
    every = list(result.maps.values())
    columns: dict[str, list[NDArray[Any]]] = {
        "count": [one.counts for one in every],
        "probability": [one.probability for one in every],
        "probability_low": [one.interval[0] for one in every],
        "probability_high": [one.interval[1] for one in every],
        "simultaneous_low": [one.simultaneous[0] for one in every],
        "simultaneous_high": [one.simultaneous[1] for one in every],
    }
    found |= {name: (["level", *paths], np.stack(rows), {}) for name, rows in columns.items()}
    return found | {
        f"j1_{name}": (paths, values, {"units": "s"}) for name, values in known(result).items()
    }


def known(result: Uncertainty) -> dict[str, Array]:
    """Mean, 95 % quantile and tail mean in every cell (s); NaN where stopped lanes enter."""
    found = {}
    for name in (Mean().name, Quantile().name, TailMean().name):
        one = result.values[name]
        certain = np.where(one.certain, one.values, np.nan)
        found[name] = certain.reshape(result.nominal.shape)
    return found


def summary(result: Uncertainty) -> dict[str, Any]:
    """What the command tells; SI units, parameters by path."""
    table = result.design.tables.uncertainty
    told: dict[str, Any] = {
        "realizations": result.realizations,
        "seed": result.seed,
        "sampling": table.sampling,
        "replicates": result.scatter.replicates,
        "uncertain": list(result.drawn),
        "axes": {
            a.path: {"min": float(a.values[0]), "max": float(a.values[-1]), "points": len(a)}
            for a in result.axes
        },
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


def write_uncertainty(result: Uncertainty, folder: Path) -> None:
    """Write a study under uncertainty: lanes that are not there yet, and what follows from them."""
    import zarr

    from drillctl.store.names import stored_name

    job = Realizations(result.design, result.axes, Drawn(result.seed), tuple(result.measures), None)
    stored = ZarrBlocks(folder, "realizations", job)
    for first, count in stored.missing(result.realizations):
        rows = slice(first, first + count)
        flat = {k: v[rows].reshape(-1, job.width) for k, v in result.measures.items()}
        status = result.status[rows].reshape(-1, job.width)
        stored.keep(Block(first, flat, status, provenance=result.provenance))
    path = folder / FILES["realizations"]
    own = set(lanes(result))
    with disk_errors(path):
        group = zarr.open_group(path, mode="a")
        for name in list(group.array_keys()):
            if name not in own:  # of fewer realizations
                del group[name]
        data = dataset(result).drop_vars(own)
        names = {str(n): stored_name(str(n)) for n in (*data.variables, *data.dims)}
        data.rename(names).to_zarr(path, mode="a", consolidated=False)
