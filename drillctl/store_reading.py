"""Results back from their dataset and summary, one function a verb."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.design import Design
from drillctl.linear.modal import Mode, Modes
from drillctl.simulation.batch import FLOATS
from drillctl.simulation.measures import Measures
from drillctl.simulation.reference import EnergyAudit
from drillctl.simulation.trajectory import SIGNALS, Simulation
from drillctl.studies.audit import Audit
from drillctl.studies.grid import Axis
from drillctl.studies.sweeps import Sweep

if TYPE_CHECKING:
    import xarray


def stored_name(name: str) -> str:
    """Name of a variable on disk: zarr takes a slash, as a section's name may hold, for a group."""
    return name.replace("/", "%2F")


def _axis(path: str, values: xarray.DataArray) -> Axis:
    return Axis(path, values.attrs.get("units", ""), values.values)


def read_sweep(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Sweep:
    """A `Sweep` as it was saved."""
    axes = tuple(_axis(path, data[stored_name(path)]) for path in summary["axes"])
    cells = data["audited_cell"].values.astype(np.int64)
    j1 = data["j1"].values
    return Sweep(
        design=design,
        axes=axes,
        levels=design.tables.map.levels,
        measures={name: data[name].values for name in FLOATS},
        status=data["status"].values.astype(np.int8),
        audit=Audit(cells, j1.ravel()[cells], data["audited_j1"].values),
        step=summary["step"],
        modes=summary["modes"],
        seconds=summary["seconds"],
        total_seconds=summary["total_seconds"],
        provenance={key: str(value) for key, value in data.attrs.items()},
    )


_TERMS = ("drive", "bit", "damping", "stored")


def read_simulation(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Simulation:
    """A `Simulation` as it was saved; its events are not kept."""
    energy = {key: value for key, value in (summary["energy"] or {}).items() if key in _TERMS}
    return Simulation(
        design=design,
        time=data["time"].values,
        signals={name: data[name].values for name in SIGNALS},
        events=(),
        measures=Measures(**summary["measures"]),
        status=summary["status"],
        engine=summary["engine"],
        step=summary["step"],
        modes=summary["modes"],
        energy=EnergyAudit(**energy) if energy else None,
    )


def read_modes(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> Modes:
    """`Modes` as they were saved."""
    return Modes(
        free_free=_modes(data, "free_free"),
        fixed_top=_modes(data, "fixed_top"),
        node_depth=data["node_depth"].values,
        element_depth=data["element_depth"].values,
        design=design,
    )


def _modes(data: xarray.Dataset, support: str) -> tuple[Mode, ...]:
    columns = (
        data[f"{support}_{name}"].values
        for name in ("frequency", "damping_ratio", "overdamped", "shape", "torque_shape")
    )
    return tuple(
        Mode(float(frequency), None if np.isnan(ratio) else float(ratio), bool(real), *shapes)
        for frequency, ratio, real, *shapes in zip(*columns, strict=True)
    )


READERS: dict[str, Callable[[Design, xarray.Dataset, dict[str, Any]], Any]] = {
    "map": read_sweep,
    "simulate": read_simulation,
    "modes": read_modes,
}
