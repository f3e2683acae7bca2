"""API drill pipes by the name drillers use, and the yield strength of their grades.

Outside and inside diameters are those of API RP 7G for new pipe bodies.
"""

from __future__ import annotations

from dataclasses import dataclass

INCH = 0.0254
PSI = 6894.757293168361


@dataclass(frozen=True)
class Pipe:
    """Body of a drill pipe.

    Attributes
    ----------
    outer_diameter, inner_diameter : float
        Of the body (m).
    """

    outer_diameter: float
    inner_diameter: float


def _pipe(outer: float, inner: float) -> Pipe:
    return Pipe(outer * INCH, inner * INCH)


PIPES: dict[str, Pipe] = {
    "2 7/8 in 10.4 lb/ft": _pipe(2.875, 2.151),
    "3 1/2 in 9.5 lb/ft": _pipe(3.5, 2.992),
    "3 1/2 in 13.3 lb/ft": _pipe(3.5, 2.764),
    "3 1/2 in 15.5 lb/ft": _pipe(3.5, 2.602),
    "4 in 11.85 lb/ft": _pipe(4.0, 3.476),
    "4 in 14.0 lb/ft": _pipe(4.0, 3.340),
    "4 in 15.7 lb/ft": _pipe(4.0, 3.240),
    "4 1/2 in 13.75 lb/ft": _pipe(4.5, 3.958),
    "4 1/2 in 16.6 lb/ft": _pipe(4.5, 3.826),
    "4 1/2 in 20.0 lb/ft": _pipe(4.5, 3.640),
    "5 in 16.25 lb/ft": _pipe(5.0, 4.408),
    "5 in 19.5 lb/ft": _pipe(5.0, 4.276),
    "5 in 25.6 lb/ft": _pipe(5.0, 4.000),
    "5 1/2 in 19.2 lb/ft": _pipe(5.5, 4.892),
    "5 1/2 in 21.9 lb/ft": _pipe(5.5, 4.778),
    "5 1/2 in 24.7 lb/ft": _pipe(5.5, 4.670),
    "5 7/8 in 23.4 lb/ft": _pipe(5.875, 5.153),
    "6 5/8 in 25.2 lb/ft": _pipe(6.625, 5.965),
    "6 5/8 in 27.7 lb/ft": _pipe(6.625, 5.901),
}

GRADES: dict[str, float] = {
    "E-75": 75e3 * PSI,
    "X-95": 95e3 * PSI,
    "G-105": 105e3 * PSI,
    "S-135": 135e3 * PSI,
}
"""Minimum yield strength (Pa)."""
