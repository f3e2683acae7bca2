"""Where the loops of given gains cross: slopes and frequencies, on a grid and refined."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.robust.line_data import WITHIN, Circle, circles
from drillctl.studies.robust.loops import Loop

Array = NDArray[np.float64]

KEPT = 16
"""Crossings of a loop that are refined at least: the lowest, as seen on the grid."""
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
    found = []
    for circle, place in zip(around, seen.place[order], strict=True):
        bracket = loop.grid.omega[place], loop.grid.omega[place + 1]
        omega = _refined(loop, values, circle, *bracket)
        found.append(Crossing(float(_impedance(loop, values, circle, omega).real), omega, circle))
    return sorted(found, key=lambda crossing: crossing.slope)


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


def by_path(tuned: Any, values: Array) -> dict[str, float]:
    """Values (SI), shape (parameters,), by path."""
    return {t.path: float(v) for t, v in zip(tuned, values, strict=True)}
