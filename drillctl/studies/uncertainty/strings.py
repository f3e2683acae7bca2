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
        """Take a string that was prepared elsewhere, lest it be prepared again.

        Parameters
        ----------
        key : hashable
            What tells strings apart, beside the friction.
        steepest : float
            Steepest falling slope of the friction that it was prepared for (N m s/rad).
        prepared : Prepared
            String and scheme.
        """
        self._known.setdefault(key, []).append(_Known(steepest, steepest, prepared))

    def prepared(self, key: Hashable, lanes: Lanes, table: SimulationTable) -> Prepared:
        """The string of a realization.

        Parameters
        ----------
        key : hashable
            What tells strings apart, beside the friction: realizations with one key share the
            string, the period of their controllers and the moments of their programs.
        lanes : Lanes
            All that matters to the step: lanes of the realization with every friction it meets.
        table : SimulationTable
            What was asked for.
        """
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
