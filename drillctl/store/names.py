"""Names on disk, and axes on their way there and back."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from drillctl.design import Design
from drillctl.ensemble.grid import Axis, axes_of
from drillctl.errors import InputError

if TYPE_CHECKING:
    import xarray


def stored_name(name: str) -> str:
    """Name of a variable on disk: zarr takes a slash, as a section's name may hold, for a group."""
    return name.replace("/", "%2F")


def axis_of(path: str, data: xarray.Dataset, name: str | None = None) -> Axis:
    """Axis of a parameter, whose values are called by its path unless a name is given."""
    values = data[stored_name(path if name is None else name)]
    return Axis(path, values.attrs.get("units", ""), values.values)


def own_axes(design: Design) -> tuple[Axis, ...]:
    """Axes of the design's `[map]` table."""
    return axes_of(design, design.tables.map.axes)


def asked_axes(result: Any, own: Callable[[Design], tuple[Axis, ...]] = own_axes) -> dict[str, Any]:
    """Axes of a result where they are not those that its design gives, for `claim`."""
    axes = [[axis.path, axis.values.tolist()] for axis in result.axes]
    try:
        given = [[axis.path, axis.values.tolist()] for axis in own(result.design)]
    except InputError:  # the default ones do not fit every law
        return {"axes": axes}
    return {} if axes == given else {"axes": axes}
