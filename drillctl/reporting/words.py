"""Numbers and names as text for a reader."""

from __future__ import annotations

from dataclasses import dataclass

from drillctl import units
from drillctl.design import Design, parameter
from drillctl.plots.style import NAMES
from drillctl.simulation.measures import Measure
from drillctl.store.tables import (
    NOTHING,
    between,
    chance,
    displayed_unit,
    number,
    percent,
    scaled,
)

__all__ = ["NOTHING", "Words", "between", "chance", "name_of", "number", "percent"]


_INCH = 0.0254


@dataclass(frozen=True)
class Words:
    """Quantities in a system of units."""

    system: units.System  # {'si', 'field'}

    def quantity(self, value: float | None, si_unit: str, digits: int = 4) -> str:
        """Format an SI value with its displayed unit."""
        if value is None:
            return NOTHING
        return f"{number(self.scaled(value, si_unit), digits)} {self.unit(si_unit)}".rstrip()

    def unit(self, si_unit: str) -> str:
        """The displayed unit for an SI unit."""
        return displayed_unit(si_unit, self.system)

    def scaled(self, value: float, si_unit: str) -> float:
        """Convert an SI value to the displayed unit."""
        return scaled(value, si_unit, self.system)

    def measure(self, one: Measure) -> str:
        """Label of a measure with its unit in brackets."""
        return one.label if one.unit == "1" else f"{one.label} ({self.unit(one.unit)})"

    def diameter(self, value: float | None) -> str:
        """Format a diameter (m) in mm or inches."""
        if value is None:
            return NOTHING
        if self.system == "field":
            return f"{number(value / _INCH)} in"
        return f"{number(1e3 * value)} mm"

    def named(self, design: Design, path: str, value: float) -> str:
        """A parameter of a design with a value (SI) and its unit."""
        return f"{name_of(path)} {self.quantity(value, parameter(design, path).si_unit)}"

    def place(self, design: Design, at: dict[str, float]) -> str:
        """Format parameters by path (SI) on one line."""
        return ", ".join(self.named(design, path, value) for path, value in at.items())

    def head(self, design: Design, path: str) -> str:
        """Name of a parameter with its unit in brackets."""
        unit = self.unit(parameter(design, path).si_unit)
        return f"{name_of(path)} ({unit})" if unit else name_of(path)


def name_of(path: str) -> str:
    """The usual name of a parameter, else its path."""
    return NAMES.get(path, path)
