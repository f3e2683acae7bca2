"""Axes on their way to disk and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl.ensemble.grid import Axis
from drillctl.store.names import stored_name

if TYPE_CHECKING:
    import xarray


def axis_of(path: str, data: xarray.Dataset, name: str | None = None) -> Axis:
    """Axis of a parameter, whose values are called by its path unless a name is given."""
    values = data[stored_name(path if name is None else name)]
    return Axis(path, values.attrs.get("units", ""), values.values)
