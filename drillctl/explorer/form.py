"""What the browser is told beside the pictures: what can be turned, and numbers at the cross."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.design import Design
from drillctl.design.paths import USUAL_NAMES
from drillctl.explorer import controls
from drillctl.simulation.measures import BATCH_MEASURES, MEASURES

if TYPE_CHECKING:
    from drillctl.ensemble.grid import Axis
    from drillctl.explorer.computed import Loop
    from drillctl.explorer.state import State
    from drillctl.simulation import Simulation

GROUPS = {
    "operating_point": "Drilling", "depth": "Drilling", "drillstring": "Drilling",
    "controller": "Drive", "weight_on_bit": "Dynamic weight",
}  # fmt: skip
"""Head under which the parameters of a table stand; others are of the rock."""


def described(state: State, base: Design) -> dict[str, Any]:
    """What can be turned, chosen and put along an axis."""
    design = base.replace(state.settings)
    known = controls.axis_ranges(design)
    grid = state.grid(design)
    names = {one.path: USUAL_NAMES.get(one.path, one.path) for one in grid}
    own = {
        "controller.law": design.tables.controller.law,
        "weight_on_bit.law": design.tables.weight_on_bit.law,
    }
    return {
        "title": design.tables.title or design.name,
        "ranges": list(_ranges(state, design)),
        "laws": {path: [names, own[path]] for path, names in controls.laws().items()},
        "axes": [_axis(one, state.units) for one in grid],
        "choices": names | {path: one.label for path, one in known.items()},
        "measures": {name: MEASURES[name].label for name in BATCH_MEASURES},
        "warnings": [one.said(state.units) for one in design.warnings],
    }


def _axis(one: Axis, system: units.System) -> dict[str, Any]:
    factor, unit = controls.shown_unit(one.unit, system)
    low, high = (float(f"{value / factor:.6g}") for value in (one.values[0], one.values[-1]))
    return {"path": one.path, "unit": unit, "low": low, "high": high}


def values(state: State, base: Design) -> dict[str, Any]:
    """What each control shows, by path, in the units that are shown."""
    turned = _ranges(state, base.replace(state.settings))
    return {one["path"]: one["value"] for one in turned} | {
        "level": state.level, "draws": state.draws, "measure": state.measure,
        "units": state.units, "kept": state.kept is not None,
    }  # fmt: skip


def crossed(state: State, axes: Sequence[Axis]) -> dict[str, float]:
    """The same of a cross that has moved, alone."""
    results = {}
    for one, value in zip(axes, state.cross, strict=True):
        factor, _ = controls.shown_unit(one.unit, state.units)
        results[one.path] = float(f"{value / factor:.5g}")
    return results


def _ranges(state: State, design: Design) -> Iterator[dict[str, Any]]:
    """Parameters that can be turned; those along the axes move the cross."""
    grid = {one.path: one for one in state.grid(design)}
    at = dict(zip(grid, state.cross, strict=True))
    found = controls.ranges(design)
    found |= {path: r for path, r in controls.axis_ranges(design).items() if path in grid}
    for path, one in found.items():
        factor, unit = controls.shown_unit(one.unit, state.units)
        low, high, value = one.low, one.high, one.value
        if path in grid:
            low, high = float(grid[path].values[0]), float(grid[path].values[-1])
            value = at[path]
        yield {
            "path": path,
            "label": one.label,
            "unit": unit,
            "means": one.means,
            "low": low / factor,
            "high": high / factor,
            "value": float(f"{value / factor:.5g}"),
            "axis": list(grid).index(path) if path in grid else None,
            "group": GROUPS.get(path.partition(".")[0], "Rock"),
        }


# Numbers at the cross.


def readouts(
    runs: Sequence[Simulation | None], loops: Sequence[Loop | None], system: units.System
) -> list[list[str | None]]:
    """Rows of a table: what it is, its unit, the number at the cross, and that of case A."""
    rows: list[list[str | None]] = []
    for table, ones in ((_OF_RUN, runs), (_OF_LOOP, loops)):
        for label, (unit, value) in table.items():
            found = [None if one is None else value(one) for one in ones]
            numbers = any(isinstance(v, (int, float)) and math.isfinite(v) for v in found)
            shown = units.unit_name(unit, system) if numbers and unit != "1" else ""
            texts = (
                None if one is None else _text(v, unit, system)
                for one, v in zip(ones, found, strict=True)
            )  # fmt: skip
            rows.append([label, shown, *texts])
    return rows


def _text(value: Any, unit: str, system: units.System) -> str:
    if isinstance(value, str):
        return value.replace("_", " ")
    if value is None or math.isnan(value):
        return "none"
    if math.isinf(value):
        return "any"
    return f"{units.displayed(value, unit, system)[0] + 0.0:.5g}"  # no -0


def _margin(name: str) -> Callable[[Any], Any]:
    def value(one: Loop) -> Any:
        if not one.stable:
            return "not stable"
        return "..." if one.margins is None else getattr(one.margins, name)

    return value


_Rows = dict[str, tuple[str, Callable[[Any], Any]]]
_OF_RUN: _Rows = {
    "J1": ("s", lambda run: run.measures.j1),
    "ends as": ("1", lambda run: run.status),
    "stick-slip index": ("1", lambda run: run.measures.stick_slip_index),
    "time stuck": ("s", lambda run: run.measures.stuck_time),
    "peak torque": ("N*m", lambda run: run.measures.peak_pipe_torque),
    "settles in": ("s", lambda run: run.measures.settling_time),
}
_OF_LOOP: _Rows = {
    "slope of rock": ("N*m*s/rad", lambda one: one.slope),
    "slope tolerated": ("N*m*s/rad", lambda one: one.slope_margin),
    "disk margin": ("1", _margin("disk")),
    "peak sensitivity": ("1", _margin("peak_sensitivity")),
    "delay margin": ("s", _margin("delay")),
}
