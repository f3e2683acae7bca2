"""Maps of the loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl.design import Design
from drillctl.store.kind import Kind
from drillctl.store.kinds.axes import asked_axes, axis_of
from drillctl.studies.loop_maps import QUANTITIES, LoopMap

if TYPE_CHECKING:
    import xarray


def read_loop_map(design: Design, data: xarray.Dataset, summary: dict[str, Any]) -> LoopMap:
    """A `LoopMap` as it was saved."""
    axes = tuple(axis_of(path, data) for path in summary["axes"])
    values = {name: data[name].values for name in QUANTITIES if name in data}
    return LoopMap(design, axes, values, summary["total_seconds"])


def _asked_of_loop_map(result: LoopMap) -> tuple[Design, dict[str, Any]]:
    return result.design, {"quantities": list(result.values)} | asked_axes(result)


KINDS = (Kind("loop-map", LoopMap, read_loop_map, _asked_of_loop_map),)
