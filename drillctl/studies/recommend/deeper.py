"""A string as the well gets deeper: pipe added at the top."""

from __future__ import annotations

from typing import Any

from drillctl import units
from drillctl.design import Design
from drillctl.errors import InputError


def depth_of(design: Design) -> float:
    """Length (m) of the whole string, to which pipe can be added at the top."""
    first = design.tables.drillstring.sections[0]
    if first.length is None:
        raise InputError(
            "a depth needs a topmost section with a length, to which pipe is added; name another "
            "axis in schedule.along",
            f"drillstring.sections.{first.name}",
        )
    return float(sum(one.span for one in design.tables.drillstring.sections))


def under_top(design: Design) -> float:
    """Length (m) of the string under its topmost section."""
    return depth_of(design) - design.tables.drillstring.sections[0].span


def at_depth(design: Design, depth: float) -> Design:
    """The design with a string of that length (m), whose topmost section is shorter or longer."""
    return design.replace(depth_changes(design, depth))


def depth_changes(design: Design, depth: float) -> dict[str, Any]:
    """What a string of that length (m) changes in a design, by path."""
    first, rest = design.tables.drillstring.sections[0], under_top(design)
    top = depth - rest
    if top <= 0.0:
        raise InputError(
            f"{depth:g} m is no depth of this string: {rest:g} m of it hang under {first.name!r}",
            "schedule.values",
        )
    where = f"drillstring.sections.{first.name}"
    changed: dict[str, Any] = {f"{where}.length": units.SI(top)}
    if first.repeat > 1:  # pieces become one run, with the joints that they have
        changed[f"{where}.repeat"] = 1
        if first.joint and first.inertia is None:
            changed[f"{where}.joint_spacing"] = units.SI(first.spacing)
    return changed
