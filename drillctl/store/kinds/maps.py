"""Maps over a grid: J1, smoothed, of the loop, three regions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design
from drillctl.ensemble.audit import Audit, choose_cells
from drillctl.ensemble.sweeps import Sweep
from drillctl.simulation.measures import BATCH_MEASURES
from drillctl.store.kind import Kind
from drillctl.store.kinds.axes import asked_axes, axis_of
from drillctl.studies.loop_maps import QUANTITIES, LoopMap

if TYPE_CHECKING:
    import xarray


def read_sweep(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Sweep:
    """A `Sweep` as it was saved."""
    axes = tuple(axis_of(path, data) for path in summary["axes"])
    cells = data["audited_cell"].values.astype(np.int64)
    j1 = data["j1"].values
    return Sweep(
        design=design,
        axes=axes,
        levels=design.tables.map.levels,
        measures={name: data[name].values for name in BATCH_MEASURES if name in data},
        status=data["status"].values.astype(np.int8),
        audit=Audit(cells, j1.ravel()[cells], data["audited_j1"].values),
        step=summary["step"],
        modes=summary["modes"],
        seconds=summary["seconds"],
        total_seconds=summary["total_seconds"],
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


def read_loop_map(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> LoopMap:
    """A `LoopMap` as it was saved."""
    axes = tuple(axis_of(path, data) for path in summary["axes"])
    values = {name: data[name].values for name in QUANTITIES if name in data}
    return LoopMap(design, axes, values, summary["total_seconds"])


def asked_measures(kept: tuple[str, ...]) -> dict[str, Any]:
    """What a map that keeps some measures alone was asked for, for `claim`."""
    return {} if kept == BATCH_MEASURES else {"measures": list(kept)}


def _asked_of_sweep(result: Sweep) -> tuple[Design, dict[str, Any]]:
    settings = asked_axes(result)
    count = result.design.tables.map.audit_cells
    if not np.array_equal(choose_cells(result.j1, result.levels, count), result.audit.cells):
        settings["audited"] = result.audit.cells.tolist()
    return result.design, settings | asked_measures(tuple(result.measures))


def _asked_of_loop_map(result: LoopMap) -> tuple[Design, dict[str, Any]]:
    return result.design, {"quantities": list(result.values)} | asked_axes(result)


KINDS = (
    Kind("map", Sweep, read_sweep, _asked_of_sweep),
    Kind("loop-map", LoopMap, read_loop_map, _asked_of_loop_map),
)
