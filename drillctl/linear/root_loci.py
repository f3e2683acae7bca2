"""Poles of the loop against any one parameter of the design."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drillctl import units
from drillctl.design import Design, parameter
from drillctl.errors import InputError
from drillctl.linear.ends import BitSide, weight_path
from drillctl.linear.loop_model import loop_poles, model_poles
from drillctl.linear.operating_point import operating_point
from drillctl.rig.weight_on_bit import PATHS

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]


@dataclass(frozen=True, eq=False)
class RootLocus:
    """Poles of a loop as one parameter changes.

    Attributes
    ----------
    design : Design
        The rig.
    path, unit : str
        The parameter and its SI unit.
    values : ndarray, shape (values,)
        Its values (SI).
    poles : ndarray of complex, shape (values, tracks)
        Poles (1/s), each column one pole followed from value to value; NaN where there are
        fewer of them. The lowest by magnitude first, as they stand at the first value.
    """

    design: Design
    path: str
    unit: str
    values: Array
    poles: ComplexArray

    @property
    def data(self) -> xarray.Dataset:
        """The poles by value of the parameter and track."""
        import xarray

        coords = {self.path: (self.path, self.values, {"units": self.unit})}
        return xarray.Dataset(
            {"pole": ((self.path, "track"), self.poles, {"units": "1/s"})}, coords
        )


def root_locus(design: Design, path: str, values: ArrayLike, count: int = 12) -> RootLocus:
    """Closed-loop poles, slope of the rock included, over values of a parameter.

    Parameters
    ----------
    design : Design
        The rig.
    path : str
        Dotted path of the parameter: a gain, the weight on bit, a length, any number.
    values : array_like, shape (values,)
        SI values; close enough for poles to be followed.
    count : int
        How many poles, the lowest first.

    Raises
    ------
    InputError
        Unknown path, a value that is impossible or has no operating point, no values.
    """
    found = parameter(design, path)
    points = np.atleast_1d(np.asarray(values, dtype=float))
    if points.ndim != 1 or points.size == 0:
        raise InputError("needs a list of one value or more", path)
    rows = [_lowest(design.replace({path: units.SI(float(v))}), 2 * count) for v in points]
    width = max(len(row) for row in rows)
    table = np.full((len(rows), width), np.nan, dtype=complex)
    table[0, : len(rows[0])] = rows[0]
    for i in range(1, len(rows)):
        table[i] = _followed(table[i - 1], rows[i], width)
    return RootLocus(design, path, found.si_unit, points, table[:, : min(count, width)])


def _lowest(design: Design, count: int) -> ComplexArray:
    point = operating_point(design)
    at_once = not isinstance(design.weight_on_bit, PATHS)
    if design.simple_loop:
        return loop_poles(design.string, *design.top_drive.gains(), point.slope)[:count]
    path = None if at_once else weight_path(design, point.speed)
    return model_poles(design, BitSide(point.slope, path))[:count]


def _followed(before: ComplexArray, now: ComplexArray, width: int) -> ComplexArray:
    """The poles in the order of those before: the pairing of least total distance."""
    from scipy.optimize import linear_sum_assignment

    far = 1e6 * (1.0 + np.abs(now).max())
    distance = np.abs(before[:, None] - now[None, :])
    rows, columns = linear_sum_assignment(np.where(np.isnan(distance), far, distance))
    placed = np.full(width, np.nan, dtype=complex)
    placed[rows] = now[columns]
    return placed
