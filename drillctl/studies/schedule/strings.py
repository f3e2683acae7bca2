"""A design along its schedule: at other depths, or with another value of what is named."""

from __future__ import annotations

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design, parameter
from drillctl.errors import InputError
from drillctl.studies.recommend.candidates import AS_PI, as_pi, pi_problem, with_law
from drillctl.studies.recommend.deeper import at_depth, depth_of, under_top
from drillctl.studies.schedule.settings import DEPTH

POINTS = 10  # depths without any in the design


class Along:
    """Variants of a design along its schedule."""

    def __init__(self, design: Design) -> None:
        self.design, self.asked = design, design.tables.schedule
        self.path = self.asked.along
        self.rest = under_top(design) if self.path == DEPTH else 0.0
        self.unit = "m" if self.path == DEPTH else parameter(design, self.path).si_unit

    def values(self) -> Array:
        """Depths (SI) of the schedule, increasing."""
        if self.asked.values is not None:
            first, last, count = self.asked.ends
            read = self._read(first), self._read(last)
            return np.linspace(min(read), max(read), count)
        if self.path != DEPTH:
            raise InputError("first:last:points is needed of another axis", "schedule.values")
        whole = depth_of(self.design)
        return np.linspace(0.5 * (self.rest + whole), whole, POINTS)

    def _read(self, text: str) -> float:
        try:
            if self.path == DEPTH:
                return units.parse(text, units.LENGTH)
            return float(parameter(self.design, self.path).parse(text))
        except InputError as error:
            raise InputError(error.problem, "schedule.values") from None

    def at(self, value: float) -> Design:
        """The design at a depth (SI)."""
        if self.path == DEPTH:
            return at_depth(self.design, value)
        return self.design.replace({self.path: units.SI(value)})

    def earlier(self, value: float) -> float:
        """Value whose gains are kept at another one (SI)."""
        share = self.asked.kept_from * value
        return share if self.path != DEPTH or share > self.rest else value

    def by_rule(self, value: float) -> Design:
        """The design at a depth with the gains that its rule gives there; any PI of a search."""
        there, law = self.at(value), self.asked.law
        if law == "tuned":
            return pi_problem(there)
        made = with_law(there, {"controller.law": law})
        return as_pi(made, *made.linear_drive.gains()) if law in AS_PI else made
