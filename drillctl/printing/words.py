"""Words that tables share: titles, heads, places, spans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drillctl import units

if TYPE_CHECKING:
    from drillctl.studies import Axis


def title_of(result: Any) -> str:
    """Title of the design of a result, or its name."""
    title: str = result.design.tables.title or result.design.name
    return title


def head_of(name: str, label: str) -> str:
    """Name of a column with its unit, where it has one."""
    return f"{name} ({label})" if label not in ("", "1") else name


def place_of(at: dict[str, float], axes: tuple[Axis, ...], system: units.System) -> str:
    """Values of parameters by path with their units."""
    words = []
    for axis in axes:
        value, unit = units.displayed(at[axis.path], axis.unit, system)
        words.append(f"{axis.path} = {value:g} {unit}".rstrip())
    return ", ".join(words)
