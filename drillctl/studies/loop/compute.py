"""The loop of a design, with the map over the two axes that the design names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drillctl.design import Design
from drillctl.ensemble.grid import axes_of
from drillctl.errors import InputError
from drillctl.linear.loop_analysis import LoopAnalysis, loop
from drillctl.progress import Progress
from drillctl.store.codec import label
from drillctl.studies.loop_mapping.compute import LoopMap, loop_map

MOST_NODES = 120
"""Nodes of a string up to which its poles are computed over and over, for maps and loci."""


@dataclass(frozen=True, eq=False)
class MappedLoop(LoopAnalysis):
    """The loop of a design, and a map of its quantities over two parameters."""

    map: LoopMap | None = label(means="the map; None where the axes make none")
    no_map: str = label(means="why there is none, where the design names axes")

    def summary(self) -> dict[str, Any]:
        """That of the loop, with that of the map."""
        more = {} if self.map is None else {"map": self.map.summary()}
        return super().summary() | more

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """The design alone."""
        return self.design, {}


def mapped_loop(design: Design, progress: Progress) -> MappedLoop:
    """Analyse a loop, and map it over the axes of the design if there are two that fit."""
    analysis = loop(design)
    result, why = _map(design, progress)
    return MappedLoop(**vars(analysis), map=result, no_map=why)


def _map(design: Design, progress: Progress) -> tuple[LoopMap | None, str]:
    try:
        axes = axes_of(design, design.tables.map.axes)
    except InputError as error:
        named = "axes" in design.tree.get("map", {})  # the default ones fit no drive without gains
        return None, str(error) if named else ""
    if len(axes) != 2:
        return None, f"it runs over 2 parameters, the design's [map] has {len(axes)}"
    if large(design) or not design.simple_loop:
        return loop_map(design, axes, ("slope_margin",), progress=progress), ""
    return loop_map(design, axes, progress=progress), ""


def large(design: Design) -> bool:
    """Whether the string has too many nodes for its poles to be computed over and over."""
    return design.string.nodes > MOST_NODES
