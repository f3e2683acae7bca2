"""Labels of the arrays of a result, and names on disk.

A result is a frozen dataclass. Its arrays are labelled where they are declared:

    axes: tuple[Axis, ...]
    j1: Array = label("axes", unit="s", means="J1; NaN where the run failed")
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Label:
    """Dimensions, unit and meaning of an array or of a dictionary of arrays."""

    # "axes" means the paths of the axes of the object; {name} an attribute of the object
    dims: tuple[str, ...] = ()
    unit: str | Callable[[str], str] = "1"  # SI; for a dictionary a function of the key
    means: str | Callable[[str], str] = ""
    name: str = ""  # of the variable; default: that of the field
    flat: bool = False  # whether names inside omit the name of this field
    over: str = ""  # dimension along which arrays of a tuple of objects are stacked
    flags: tuple[str, ...] = ()  # meanings of the integers 0, 1, ...


def label(
    *dims: str,
    unit: str | Callable[[str], str] = "1",
    means: str | Callable[[str], str] = "",
    name: str = "",
    flat: bool = False,
    over: str = "",
    flags: tuple[str, ...] = (),
    **options: Any,
) -> Any:
    """Declare a field of a result with its label; other options are those of a dataclass field."""
    return field(metadata={"label": Label(dims, unit, means, name, flat, over, flags)}, **options)


def stored_name(name: str) -> str:
    """Name of a variable on disk: zarr reads a slash, which a section name may hold, as a group."""
    return name.replace("/", "%2F")
