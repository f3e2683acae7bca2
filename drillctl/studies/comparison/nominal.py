"""Cases without draws: the J1 map of each over the same axes, and its motion in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.grid import Axis, axes_of, refuse_too_large, shape_of
from drillctl.ensemble.sweeps import UNITS, Sweep, sweep
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress, Within
from drillctl.simulation import Simulation, simulate
from drillctl.simulation.measures import STATUSES
from drillctl.simulation.trajectory import SIGNALS
from drillctl.studies.comparison.cases import in_case

if TYPE_CHECKING:
    from drillctl.design.tables import AxisTable

Array = NDArray[np.float64]

INTERVAL = 0.1
"""Sampling interval of the responses (s), rounded to a whole number of steps."""
NOT_ASKED = "compare.maps is false"
"""Reason of a map that nobody wanted."""
WEIGHT = "operating_point.weight_on_bit"
"""What is shifted for the sake of equal mean weights."""


@dataclass(frozen=True, eq=False)
class Nominal:
    """A case at its own values, nothing drawn."""

    map: Sweep | None  # J1 and the other measures over the two axes of the comparison, not audited
    no_map: str | None  # why there is none; None where there is one
    response: Simulation  # by the batch engine, sampled about every `INTERVAL`

    def summary(self) -> dict[str, Any]:
        """Measures and scheme of the response, map or why there is none; SI."""
        found = None
        if self.map is not None:
            told = self.map.summary()
            # Regions stand with the case, at the levels of the comparison; of an audit that was
            # not made there is nothing to tell.
            found = {key: told[key] for key in told if key not in ("regions", "audit")}
        return {**self.response.summary(), "map": found, "no_map": self.no_map}


def nominal_design(design: Design, shift: float) -> Design:
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


def nominal_runs(
    cases: Mapping[str, Design],
    axes: tuple[AxisTable, ...] | None,
    progress: Progress = SILENT,
) -> list[Nominal]:
    """Map and response of every case."""
    if axes is not None:
        refuse_too_large([len(cases), *(table.points for table in axes)])
    fitting = {name: _axes_or_reason(design, axes) for name, design in cases.items()}
    grids = [shape_of(found) for found in fitting.values() if not isinstance(found, str)]
    if grids:
        progress.begin("mapping cases", sum(int(np.prod(grid)) for grid in grids))
    found = []
    for name, design in cases.items():
        made, reason = _map_or_reason(design, fitting[name], progress)
        try:
            response = simulate(design, engine="batch", interval=INTERVAL)
        except InputError as error:
            raise in_case(error, design, name) from None
        found.append(Nominal(made, reason, response))
    return found


def _axes_or_reason(design: Design, tables: tuple[AxisTable, ...] | None) -> tuple[Axis, ...] | str:
    if tables is None:
        return NOT_ASKED
    if len(tables) != 2:
        return f"a map runs over 2 parameters, [map] has {len(tables)}"
    try:
        return axes_of(design, tables)
    except InputError as error:
        return str(error)


def _map_or_reason(
    design: Design, axes: tuple[Axis, ...] | str, progress: Progress
) -> tuple[Sweep, None] | tuple[None, str]:
    if isinstance(axes, str):
        return None, axes
    try:
        return sweep(design, axes, audit_cells=0, progress=Within(progress)), None
    except InputError as error:  # a value on an axis is impossible for this case
        return None, str(error)


def map_dimension(path: str, drawn: Sequence[str]) -> str:
    """Name of a map's dimension: the path, unless draws of that parameter are called so."""
    return f"map {path}" if path in drawn else path


def labelled(cases: Sequence[Nominal], drawn: Sequence[str]) -> dict[str, Any]:
    """Variables and coordinates of the maps and responses of all cases."""
    return _maps(cases, drawn) | _responses(cases)


def _maps(cases: Sequence[Nominal], drawn: Sequence[str]) -> dict[str, Any]:
    like = next((case.map for case in cases if case.map is not None), None)
    if like is None:
        return {}
    names = [map_dimension(axis.path, drawn) for axis in like.axes]
    over = ("case", *names)
    made: dict[str, Any] = {
        name: (name, axis.values, {"units": axis.unit})
        for name, axis in zip(names, like.axes, strict=True)
    }
    absent = np.full(shape_of(like.axes), np.nan)
    for name in like.measures:
        values = [absent if case.map is None else case.map.measures[name] for case in cases]
        made[f"map_{name}"] = (over, np.stack(values), {"units": UNITS[name]})
    none = np.full(absent.shape, STATUSES.index("failed"), dtype=np.int8)
    status = [none if case.map is None else case.map.status for case in cases]
    flags = {"flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
    made["map_status"] = (over, np.stack(status), flags)
    return made


def _responses(cases: Sequence[Nominal]) -> dict[str, Any]:
    """Each with its own times: a step of its own makes its samples fall elsewhere."""
    longest = max(len(case.response.time) for case in cases)

    def padded(values: Array) -> Array:
        return np.pad(values, (0, longest - len(values)), constant_values=np.nan)

    over = ("case", "sample")
    time = np.stack([padded(case.response.time) for case in cases])
    made: dict[str, Any] = {"response_time": (over, time, {"units": "s"})}
    for name, (unit, words) in SIGNALS.items():
        values = np.stack([padded(case.response.signals[name]) for case in cases])
        made[f"response_{name}"] = (over, values, {"units": unit, "long_name": words})
    return made
