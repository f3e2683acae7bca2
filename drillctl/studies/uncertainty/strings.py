"""Prepared strings of realizations: step and modes of each follow from that one alone.

The step is bounded by the steepest friction among the lanes that share it. Were that all lanes
of a block, the bits of a lane would depend on its company. So each realization has the scheme
of its own lanes, and what comes out the same is prepared once.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

from drillctl.design.tables import SimulationTable
from drillctl.simulation.batch import Prepared, prepare
from drillctl.simulation.lanes import Lanes


@dataclass
class _Known:
    """A prepared string, and between which slopes of the friction it is right (N m s/rad)."""

    gentlest: float
    steepest: float
    prepared: Prepared


class Strings:
    """Prepared strings by what they follow from."""

    def __init__(self) -> None:
        self._known: dict[Hashable, list[_Known]] = {}

    def give(self, key: Hashable, steepest: float, prepared: Prepared) -> None:
        """Take a string that was prepared elsewhere, lest it be prepared again."""
        self._known.setdefault(key, []).append(_Known(steepest, steepest, prepared))

    def prepared(self, key: Hashable, lanes: Lanes, table: SimulationTable) -> Prepared:
        """The string of a realization."""
        fall = lanes.steepest_fall
        known = self._known.setdefault(key, [])
        for one in known:
            # The longest step falls with the slope: between two slopes of one step lies no other.
            if one.gentlest <= fall <= one.steepest:
                return one.prepared
        made = prepare(lanes, table)
        for one in known:
            if one.prepared.scheme == made.scheme:
                one.gentlest, one.steepest = min(fall, one.gentlest), max(fall, one.steepest)
                return one.prepared
        known.append(_Known(fall, fall, made))
        return made
