"""Steady drilling of the cells of a grid: operating speed, slope of the rock, gains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.loop_analysis import tolerated_slope
from drillctl.linear.operating_point import operating_point, rock_at
from drillctl.linear.slope_margin import SlopeMargins, slope_margins
from drillctl.simulation.lanes import Lanes
from drillctl.studies.grid import Axis, Group, cell_design

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Steady:
    """Steady drilling of a number of lanes."""

    # shape (lanes,): Of top and bit (rad/s); NaN where drive, drag and rock balance at no speed
    speed: Array
    # shape (lanes,): Falling slope of the rock there (N m s/rad); NaN at the same lanes
    slope: Array


def steady_drilling(design: Design, axes: tuple[Axis, ...], group: Group) -> Steady:
    """Operating speed of each cell of a group and the slope there."""
    lanes = group.lanes
    speed = lanes.set_speed.copy()
    for lane in np.flatnonzero(gains_of(lanes)[1] == 0.0):
        cell = cell_design(design, axes, int(group.cells[lane]))
        try:
            speed[lane] = operating_point(cell).speed
        except InputError:  # there is none
            speed[lane] = np.nan
    _, slope = rock_at(lanes.friction, lanes.weight, speed)
    return Steady(speed, np.where(np.isnan(speed), np.nan, -slope))


def slopes_tolerated(
    design: Design, axes: tuple[Axis, ...], group: Group, speed: Array
) -> SlopeMargins:
    """Slope margins of the cells of a group that drill steadily at `speed`, shape (lanes,).

    All at once where two gains tell the loop, one by one for other drives and for a weight that
    comes late.
    """
    lanes = group.lanes
    if group.design.simple_loop:
        return slope_margins(ends_of(group.design.string), *gains_of(lanes))
    slope, omega = np.full((2, len(lanes)), np.nan)
    for lane in np.flatnonzero(np.isfinite(speed)):
        cell = cell_design(design, axes, int(group.cells[lane]))
        slope[lane], omega[lane] = tolerated_slope(cell, float(speed[lane]))
    return SlopeMargins(slope, omega)


def gains_of(lanes: Lanes) -> tuple[Array, Array]:
    """Proportional and integral gain of every lane (N m s/rad, N m/rad)."""
    kp, ki = (np.broadcast_to(np.asarray(g, float), len(lanes)) for g in lanes.drive.gains())
    return kp, ki
