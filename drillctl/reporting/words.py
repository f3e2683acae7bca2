"""Numbers and names as people read them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from drillctl import units
from drillctl.design import Design, parameter
from drillctl.plots.style import NAMES

NOTHING = "–"
"""Where there is no number."""
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_INCH = 0.0254


def number(value: float | None, digits: int = 4) -> str:
    """A number with so many significant digits, without needless zeros."""
    if value is None or math.isnan(value):
        return NOTHING
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    if value == 0.0:
        return "0"
    power = math.floor(math.log10(abs(value)))
    if not -4 <= power < 6:
        mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
        text = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        return f"{text} × 10{str(int(exponent)).translate(_RAISED)}".replace("-", "−")
    text = f"{value:.{max(0, digits - 1 - power)}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return text.replace("-", "−")


def percent(share: float | None, digits: int = 3) -> str:
    """A share in percent."""
    return NOTHING if share is None else f"{number(100.0 * share, digits)} %"


def between(low: float | None, high: float | None, digits: int = 4) -> str:
    """From the least to the largest value."""
    return f"{number(low, digits)} to {number(high, digits)}"


def chance(share: float, interval: Iterable[float | None]) -> str:
    """A probability with its 95 % interval, in percent."""
    low, high = interval
    if low is None or high is None:
        return percent(share)
    return f"{percent(share)} ({between(100.0 * low, 100.0 * high, 3)} %)"


@dataclass(frozen=True)
class Words:
    """Quantities in a system of units."""

    system: units.System  # {'si', 'field'}: Whose units

    def quantity(self, value: float | None, si_unit: str, digits: int = 4) -> str:
        """A value in SI with the unit that people read."""
        if value is None:
            return NOTHING
        return f"{number(self.scaled(value, si_unit), digits)} {self.unit(si_unit)}".rstrip()

    def unit(self, si_unit: str) -> str:
        """The unit that people read for one of SI."""
        if si_unit == "J":
            return "kJ"
        return _unit(units.displayed(1.0, si_unit, self.system)[1])

    def scaled(self, value: float, si_unit: str) -> float:
        """A value in the unit that people read."""
        if si_unit == "J":
            return value / 1e3
        return float(units.displayed(value, si_unit, self.system)[0])

    def diameter(self, value: float | None) -> str:
        """A diameter (m) in mm, or in."""
        if value is None:
            return NOTHING
        if self.system == "field":
            return f"{number(value / _INCH)} in"
        return f"{number(1e3 * value)} mm"

    def named(self, design: Design, path: str, value: float) -> str:
        """A parameter of a design with a value (SI) and its unit."""
        return f"{name_of(path)} {self.quantity(value, parameter(design, path).si_unit)}"

    def place(self, design: Design, at: dict[str, float]) -> str:
        """Parameters by path (SI), in a line."""
        return ", ".join(self.named(design, path, value) for path, value in at.items())

    def head(self, design: Design, path: str) -> str:
        """Name of a parameter with its unit in brackets."""
        unit = self.unit(parameter(design, path).si_unit)
        return f"{name_of(path)} ({unit})" if unit else name_of(path)


def _unit(name: str) -> str:
    """An SI unit as it is printed."""
    return name.replace("^2", "²").replace("*", " ") if name != "1" else ""


def name_of(path: str) -> str:
    """What a parameter is called; its path where it has no usual name."""
    return NAMES.get(path, path)
