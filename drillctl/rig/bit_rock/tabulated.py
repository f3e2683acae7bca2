"""Friction given as points of torque over speed."""

from __future__ import annotations

from collections import namedtuple
from itertools import pairwise
from typing import Any, Literal

from pydantic import model_validator

from drillctl.errors import InputError
from drillctl.rig import table as q
from drillctl.rig.bit_rock.law import Exp, Form, FrictionLaw, RockTable
from drillctl.rig.table import Table

KNOTS = 12  # most points after the first


class Tabulated(
    namedtuple(
        "Tabulated",
        "static start rise fall w1 w2 w3 w4 w5 w6 w7 w8 w9 w10 w11 w12 "
        "c1 c2 c3 c4 c5 c6 c7 c8 c9 c10 c11 c12",
    )
):
    r"""Set-valued friction through measured points, straight between them, level after the last.

    .. math:: T(\omega) = W \Big[ t_0 + s_0 |\omega|
              + \sum_i c_i \max(0, |\omega| - \omega_i) \Big] \mathrm{sign}\,\omega,
              \qquad T(0) \in [-t_s W, t_s W]

    Made by `tabulated`; the coefficients follow from the points.

    Attributes
    ----------
    static : float
        Static torque over weight on bit t_s (m).
    start : float
        Torque over weight t_0 of a bit that just turns (m).
    rise : float
        Slope of the first piece over weight (m s/rad).
    fall : float
        Steepest falling slope over weight (m s/rad), not negative.
    w1, ..., w12 : float
        Speeds at which the slope changes (rad/s).
    c1, ..., c12 : float
        Changes of slope over weight there (m s/rad); zero where there are fewer points.
    """

    __slots__ = ()

    @property
    def set_valued(self) -> bool:
        """A bit can stand still under this law."""
        return True

    def static_torque(self, weight: Any) -> Any:
        """Largest torque of a bit at rest (N m)."""
        return self.static * weight

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque of a bit that just turns (N m)."""
        return self.start * weight

    def steepest_fall(self, weight: Any) -> Any:
        """Largest falling slope (N m s/rad)."""
        return self.fall * weight

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) and slope (N m s/rad) at `speed` >= 0 (rad/s) under `weight` (N)."""
        torque, slope = self.start + self.rise * speed, self.rise + 0.0 * speed
        for knot in range(12):  # KNOTS, as a number that every compiler of laws can see
            above = speed > self[4 + knot]
            torque = torque + above * self[16 + knot] * (speed - self[4 + knot])
            slope = slope + above * self[16 + knot]
        return torque * weight, slope * weight


def tabulated(static: float, speeds: tuple[float, ...], torques: tuple[float, ...]) -> Tabulated:
    """The law through given points.

    Parameters
    ----------
    static : float
        Static torque over weight on bit (m), not less than the first torque.
    speeds : tuple of float
        Speeds (rad/s), increasing from zero; at most `KNOTS` + 1.
    torques : tuple of float
        Torque over weight at these speeds (m).

    Returns
    -------
    Tabulated
        Beyond the last point its torque holds.
    """
    slopes = [
        (t1 - t0) / (w1 - w0)
        for w0, w1, t0, t1 in zip(speeds, speeds[1:], torques, torques[1:], strict=False)
    ]
    changes = [b - a for a, b in zip(slopes, [*slopes[1:], 0.0], strict=True)]
    unused = KNOTS - len(changes)
    return Tabulated(
        static,
        torques[0],
        slopes[0],
        max(0.0, *(-slope for slope in slopes)),
        *speeds[1:],
        *([0.0] * unused),
        *changes,
        *([0.0] * unused),
    )


class FrictionPoint(Table):
    """Torque over weight on bit at one speed."""

    speed: q.Speed
    a: q.Arm


class TabulatedFrictionTable(RockTable):
    """Measured points of torque over weight, straight lines between them."""

    law: Literal["tabulated"]
    points: tuple[FrictionPoint, ...]
    static: q.Arm | None = None

    @model_validator(mode="after")
    def _ordered(self) -> TabulatedFrictionTable:
        if not 2 <= len(self.points) <= KNOTS + 1:
            raise InputError(f"needs 2 to {KNOTS + 1} points, got {len(self.points)}")
        speeds = [point.speed for point in self.points]
        if speeds[0] != 0.0 or any(b <= a for a, b in pairwise(speeds)):
            raise InputError("speeds of the points must begin at 0 and increase")
        if self.static is not None and self.static < self.points[0].a:
            raise InputError(
                f"static = {self.static:g} must not be less than the first a = {self.points[0].a:g}"
            )
        return self


def _law(table: TabulatedFrictionTable, weight: float, moves: bool) -> Tabulated:
    arms = tuple(point.a for point in table.points)
    static = arms[0] if table.static is None else table.static
    return tabulated(static, tuple(point.speed for point in table.points), arms)


LAWS = (
    FrictionLaw(
        TabulatedFrictionTable,
        _law,
        forms=(
            Form(
                Tabulated,
                static=("static",),
                sliding=("start", "rise", "fall", *(f"c{k}" for k in range(1, KNOTS + 1))),
                keys='`law = "tabulated"` (points, static)',
                use="For measured torque over speed.",
                curves=(
                    (
                        "tabulated",
                        tabulated(0.09, (0.0, 3.0, 8.0, 20.0), (0.085, 0.06, 0.05, 0.035)),
                    ),
                ),
            ),
        ),
    ),
)
