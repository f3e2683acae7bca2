"""A design at other depths: pipe added at the top, or another value of what changes the string."""

from __future__ import annotations

from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design, parameter
from drillctl.errors import InputError
from drillctl.studies.recommend.candidates import AS_PI, as_pi, pi_problem, with_law
from drillctl.studies.schedule.settings import DEPTH

POINTS = 10  # depths without any in the design


class Along:
    """Variants of a design along its schedule."""

    def __init__(self, design: Design) -> None:
        self.design, self.asked = design, design.tables.schedule
        self.path = self.asked.along
        if self.path == DEPTH:
            self.unit, self.rest = "m", self._rest()
        else:
            self.unit = parameter(design, self.path).si_unit

    def _rest(self) -> float:
        """Length (m) of the string under its topmost section."""
        first, *others = self.design.tables.drillstring.sections
        if first.length is None:
            raise InputError(
                "a depth needs a topmost section with a length, to which pipe is added; name "
                "another axis in schedule.along",
                f"drillstring.sections.{first.name}",
            )
        return sum(one.span for one in others)

    def values(self) -> Array:
        """Depths (SI) of the schedule, increasing."""
        if self.asked.values is not None:
            first, last, count = self.asked.ends
            read = self._read(first), self._read(last)
            return np.linspace(min(read), max(read), count)
        if self.path != DEPTH:
            raise InputError("first:last:points is needed of another axis", "schedule.values")
        top = self.design.tables.drillstring.sections[0].span
        return np.linspace(self.rest + 0.5 * top, self.rest + top, POINTS)

    def _read(self, text: str) -> float:
        try:
            if self.path == DEPTH:
                return units.parse(text, units.LENGTH)
            return float(parameter(self.design, self.path).parse(text))
        except InputError as error:
            raise InputError(error.problem, "schedule.values") from None

    def at(self, value: float) -> Design:
        """The design at a depth (SI)."""
        if self.path != DEPTH:
            return self.design.replace({self.path: units.SI(value)})
        first = self.design.tables.drillstring.sections[0]
        top = value - self.rest
        if top <= 0.0:
            raise InputError(
                f"{value:g} m is no depth of this string: {self.rest:g} m of it hang under "
                f"{first.name!r}",
                "schedule.values",
            )
        where = f"drillstring.sections.{first.name}"
        changed: dict[str, Any] = {f"{where}.length": units.SI(top)}
        if first.repeat > 1:  # pieces become one run, with the joints that they have
            changed[f"{where}.repeat"] = 1
            if first.joint and first.inertia is None:
                changed[f"{where}.joint_spacing"] = units.SI(first.spacing)
        return self.design.replace(changed)

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
