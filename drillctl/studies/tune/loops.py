"""The loops that a linear design must hold for: strings, slopes of the rock, delays.

A loop is a design at one realization, seen from its ends: the string as data on a frequency grid,
the slope of the rock, what a moving weight adds. Drive and weight are closed by functions that
take numbers, arrays or pairs of symbols alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import Ends, WeightPath, ends_of, weight_path
from drillctl.linear.loop_margins import TURNS
from drillctl.linear.operating_point import at_speed
from drillctl.rig.weight_on_bit import FollowingSpeed, ObservedWeight, RealWeight
from drillctl.studies.tune.line_data import WITHIN, Circle, Grid, circles, grid_of
from drillctl.studies.tune.tuned import (
    WEIGHT_KEYS,
    StringNumbers,
    Tuned,
    controller_paths,
    drive_numbers,
    middle,
    string_numbers,
)

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WeightSide:
    """A weight on bit that follows the bit speed."""

    # torque of the rock per weight at constant speed (m)
    torque: Any  # these two may be symbols
    gain: Any  # K_w (N s/rad)
    path: WeightPath  # its lags


@dataclass(frozen=True, eq=False)
class Loop:
    """One loop that gains must hold for."""

    design: Design  # with the tuned parameters halfway, which gives laws their types
    ends: Ends  # its string
    grid: Grid  # the string on a frequency grid
    string: StringNumbers  # what drives are tuned to
    # falling slope of the rock at constant weight (N m s/rad)
    slope: Any  # may be a symbol
    weight: WeightSide | None  # of a weight that follows the bit speed

    def drive(self, values: Mapping[str, Any], s: Any) -> Any:
        """Impedance of the drive (N m s/rad) at `s`, with tuned values by path."""
        law: Any = self.design.top_drive
        numbers = drive_numbers(self.design, values, self.string)
        law = law._replace(**{k: v for k, v in numbers.items() if k in law._fields})
        return law.impedance(s)

    def rock(self, values: Mapping[str, Any], s: Any) -> Any:
        """What the moving weight adds to the impedance of the bit (N m s/rad)."""
        if self.weight is None:
            return 0.0 * s
        side = self.weight
        gain = values.get("weight_on_bit.gain", side.gain)
        delay = values.get("weight_on_bit.path.delay")
        path = side.path if delay is None else replace(side.path, delay=delay + _held(self.design))
        return replace(path, gain=side.torque * gain).feedback(s).bit + 0.0 * s


def _held(design: Design) -> float:
    """Mean age of a reading (s)."""
    return 0.5 * float(getattr(design.weight_on_bit, "period", 0.0))


def refuse_not_linear(design: Design, tuned: tuple[Tuned, ...]) -> None:
    """Refuse (`InputError`) what the linear loop does not depend on, or not in a known way."""
    law = design.tables.controller.law
    if law == "constant-torque":
        raise InputError("a constant torque has no loop that could be tuned", "controller.law")
    allowed = [*controller_paths(design)]
    if isinstance(design.weight_on_bit, (FollowingSpeed, RealWeight)):
        allowed += WEIGHT_KEYS
    for t in tuned:
        if t.path not in allowed:
            raise InputError(
                f"{t.path!r} is not tuned in the linear loop; allowed: {', '.join(allowed)}",
                "tune.parameters",
            )
    if isinstance(design.weight_on_bit, ObservedWeight):
        raise InputError(
            "the linear design takes a weight that follows the bit speed itself, not an observer",
            "weight_on_bit.law",
        )


def loops_of(designs: Iterable[Design], tuned: tuple[Tuned, ...]) -> list[Loop]:
    """Loops of a number of realizations of a design."""
    results: dict[tuple[Any, ...], Loop] = {}
    strings: dict[Any, tuple[Ends, Grid, StringNumbers]] = {}
    for design in designs:
        loop = _loop(middle(design, tuned), strings, tuned)
        side = None if loop.weight is None else (loop.weight.torque, loop.weight.path, loop.slope)
        key = (design.string.parts, design.tables.controller.model_dump_json(), side)
        if key not in results or results[key].slope < loop.slope:
            results[key] = loop
    return list(results.values())


def _loop(
    design: Design, strings: dict[Any, tuple[Ends, Grid, StringNumbers]], tuned: tuple[Tuned, ...]
) -> Loop:
    point = at_speed(design, design.speed)
    side, slope = _weight(design, point.slope)
    longest = max([t.high for t in tuned if t.path == WEIGHT_KEYS[1]], default=0.0)
    if side is not None:
        longest = max(longest, side.path.delay)
    parts = design.string.parts
    if parts not in strings:
        ends = ends_of(design.string)
        apart = 2.0 * math.pi / (TURNS * longest) if longest > 0.0 else math.inf
        strings[parts] = (ends, grid_of(ends, apart), string_numbers(design.string))
    return Loop(design, *strings[parts], slope, side)


def _weight(design: Design, slope: float) -> tuple[WeightSide | None, float]:
    """The side of the weight, and the slope of the rock at constant weight."""
    path = weight_path(design, design.speed)
    if path is None:
        return None, slope
    law: Any = design.weight_on_bit
    if law.moves:  # its part in the slope is the path's here
        slope += path.gain
    return WeightSide(path.gain / float(law.gain), float(law.gain), path), slope


KEPT = 16  # crossings of a loop that are refined at least: the lowest, as seen on the grid
ALIKE = 1.05
"""And all that are lowest but for this factor: high modes have margins of nearly one size."""


class Crossing(NamedTuple):
    """A slope at which poles of a loop reach the imaginary axis."""

    slope: float  # N m s/rad
    omega: float  # rad/s
    circle: Circle  # the string about it


class Seen(NamedTuple):
    """Crossings as a grid shows them: places before them, frequencies and slopes."""

    place: NDArray[np.int64]
    omega: Array
    slope: Array


def seen_on_grid(loop: Loop, values: Mapping[str, float]) -> Seen:
    """All crossings of a loop, to the resolution of its grid."""
    omega, chain = loop.grid
    s = 1j * omega
    over, under = chain.bit(loop.drive(values, s))
    # Times the square of the denominator: no poles, and zero only where the impedance is real.
    size = np.abs(under) ** 2
    product = over * under.conj() + loop.rock(values, s) * size
    signs = product.imag > 0.0
    place = np.flatnonzero(signs[1:] != signs[:-1])
    left, right = product.imag[place], product.imag[place + 1]
    share = left / (left - right)
    at = omega[place] + share * (omega[place + 1] - omega[place])
    real = product.real[place] + share * (product.real[place + 1] - product.real[place])
    level = real / (size[place] + share * (size[place + 1] - size[place]))
    return Seen(place, at, level)


def least_seen(loop: Loop, values: Mapping[str, float]) -> float:
    """Slope margin (N m s/rad) to the resolution of the grid; infinite if none crosses."""
    slope = seen_on_grid(loop, values).slope
    return float(np.min(slope[slope > 0.0], initial=np.inf))


def crossings_of(loop: Loop, values: Mapping[str, float]) -> list[Crossing]:
    """The lowest crossings of a loop, refined, by rising slope; negative ones too."""
    seen = seen_on_grid(loop, values)
    size = np.abs(seen.slope)
    order = np.argsort(size, kind="stable")
    alike = int((size <= ALIKE * np.min(size[seen.slope > 0.0], initial=np.inf)).sum())
    order = order[: max(KEPT, alike)]
    if len(seen.place) and (first := int(np.argmin(seen.omega))) not in order:
        order = np.append(order, first)  # high modes of one margin would crowd it out
    if len(order) == 0:
        return []
    around = circles(loop.ends, 1j * seen.omega[order])
    results = []
    for circle, place in zip(around, seen.place[order], strict=True):
        bracket = loop.grid.omega[place], loop.grid.omega[place + 1]
        omega = _refined(loop, values, circle, *bracket)
        results.append(Crossing(float(_impedance(loop, values, circle, omega).real), omega, circle))
    return sorted(results, key=lambda crossing: crossing.slope)


def _impedance(loop: Loop, values: Mapping[str, float], circle: Circle, omega: float) -> complex:
    u = (1j * omega - circle.centre) / circle.radius
    a, b, c, d = (np.polynomial.polynomial.polyval(u, row) for row in circle.terms)
    s = np.array([1j * omega])
    drive = complex(loop.drive(values, s)[0])
    rock = complex(loop.rock(values, s)[0])
    return complex((a + drive * b) / (c + drive * d) + rock)


def _refined(
    loop: Loop, values: Mapping[str, float], circle: Circle, low: float, high: float
) -> float:
    """The frequency within a bracket at which the impedance is real."""
    from scipy.optimize import brentq

    reach = WITHIN * circle.radius
    low, high = max(low, circle.centre.imag - reach), min(high, circle.centre.imag + reach)

    def reactance(omega: float) -> float:
        return _impedance(loop, values, circle, omega).imag

    if reactance(low) * reactance(high) > 0.0:  # within rounding of an end of the bracket
        return min(low, high, key=lambda omega: abs(reactance(omega)))
    return float(brentq(reactance, low, high, xtol=1e-14, rtol=1e-14))


def slope_margin_of(found: list[Crossing]) -> float:
    """The least positive slope (N m s/rad); infinite if there is none."""
    return min((c.slope for c in found if c.slope > 0.0), default=float("inf"))
