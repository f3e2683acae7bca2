"""Three regions of one grid that are easily taken for each other: each in its own name.

Locally stable: small deviations from steady drilling die out; the linear loop decides, for ever
and at once. Inside the level: J1 of the design's own run, nonlinear, from one start and over a
finite time. Attracted: steady drilling is where long nonlinear runs end, from a bit at rest and
from a wound-up string.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from drillctl.arrays import Array, Mask
from drillctl.design import Design
from drillctl.ensemble.grid import (
    Axis,
    Group,
    axes_of,
    cell_design,
    groups,
    other_axes,
    shape_of,
    span,
)
from drillctl.ensemble.running import measured
from drillctl.ensemble.sweeps import sweep
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.loop_analysis import tolerated_slope
from drillctl.linear.operating_point import operating_point, rock_at
from drillctl.linear.slope_margin import Crossings, slope_margins
from drillctl.progress import SILENT, Progress
from drillctl.simulation.batch import Prepared, prepare, trace
from drillctl.simulation.lanes import Kind, Lanes
from drillctl.simulation.measures import NARROW_BAND, STATUSES, WINDOW
from drillctl.store.codec import label
from drillctl.store.json_files import picked
from drillctl.store.result import Timed, timed

HORIZON = 200.0
"""Length of the runs (s): on the paper's map sticking that will end has ended by 80 s."""
STARTS: tuple[Kind, ...] = ("rest", "wound_up")
"""Starts that a cell must leave for steady drilling: both are far from it."""
TRACED_LANES = 128  # lanes traced together: some 70 MB at 20 ms


class Ended(NamedTuple):
    """How runs from one start ended, shapes (lanes,)."""

    attracted: Mask  # bit speed within the band of the operating speed throughout the last window
    sticking: Mask  # the bit stood still at some time in that window
    failed: Mask  # no finite answer; neither of the others holds then


def long_runs(group: Group) -> Prepared:
    """The string of a group, prepared for runs over `HORIZON`."""
    table = group.design.tables.simulation
    return prepare(group.lanes, table.model_copy(update={"duration": HORIZON, "j1_from": 0.0}))


def ends_from(kind: Kind, lanes: Lanes, operating_speed: Array, prepared: Prepared) -> Ended:
    """Run every lane from a start and see where it ends."""
    # A drive without any speed control has no set speed, only a frame: there the operating speed
    # takes its place, also as the speed of the top of a wound-up string. Proportional control alone
    # has a set speed that it never holds, and it cannot be moved: those lanes are traced.
    kp, ki = gains_of(lanes)
    steady = np.isfinite(operating_speed)
    framed = steady & (kp == 0.0) & (ki == 0.0)
    lanes = replace(lanes, start=kind, set_speed=np.where(framed, operating_speed, lanes.set_speed))
    batch = measured(lanes, prepared)
    # NaN is more than any time: not settled.
    attracted = batch.measures["settling_time"] <= HORIZON - WINDOW
    traced = np.flatnonzero(steady & (kp != 0.0) & (ki == 0.0))
    for first in range(0, len(traced), TRACED_LANES):
        some = traced[first : first + TRACED_LANES]
        attracted[some] = _stays(lanes[some], operating_speed[some], prepared)
    failed = batch.status == STATUSES.index("failed")
    stuck = [STATUSES.index("sticking"), STATUSES.index("stalled")]
    return Ended(attracted & steady & ~failed, np.isin(batch.status, stuck), failed)


def _stays(lanes: Lanes, speed: Array, prepared: Prepared) -> Mask:
    """Whether the bit speed stays in the band around `speed` (rad/s) to the end, lane by lane."""
    time, signals = trace(lanes, prepared, prepared.scheme.step)
    late = signals["bit_speed"][time >= HORIZON - WINDOW]
    return np.asarray((np.abs(late - speed) <= NARROW_BAND * speed).all(axis=0))


class Steady(NamedTuple):
    """Steady drilling of a number of lanes, shapes (lanes,)."""

    speed: Array  # of top and bit (rad/s); NaN where drive, drag and rock balance at no speed
    slope: Array  # falling slope of the rock there (N m s/rad); NaN at the same lanes


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
) -> Crossings:
    """Slope margins of the cells of a group that drill steadily at `speed`, shape (lanes,)."""
    # All at once where two gains define the loop, one by one for other drives and for a weight that
    # comes late.
    lanes = group.lanes
    if group.design.simple_loop:
        return slope_margins(ends_of(group.design.sliding_string), *gains_of(lanes))
    slope, omega = np.full((2, len(lanes)), np.nan)
    for lane in np.flatnonzero(np.isfinite(speed)):
        cell = cell_design(design, axes, int(group.cells[lane]))
        slope[lane], omega[lane] = tolerated_slope(cell, float(speed[lane]))
    return Crossings(slope, omega)


def gains_of(lanes: Lanes) -> tuple[Array, Array]:
    """Proportional and integral gain of every lane (N m s/rad, N m/rad)."""
    kp, ki = (np.broadcast_to(np.asarray(g, float), len(lanes)) for g in lanes.drive.gains())
    return kp, ki


PAPER_LEVEL = 33.0
"""J1 above which Monteiro & Trindade (2012) call operation undesirable (s); of runs of 100 s."""

FIELDS = ("slope", "slope_margin", "deciding_frequency", "reference_speed", "j1")
"""What is computed of each cell."""
MASKS = (
    "locally_stable", "inside_level", "from_rest", "from_wound_up", "sticking_from_rest",
    "sticking_from_wound_up", "failed",
)  # fmt: skip
"""What is decided of each cell."""


@dataclass(frozen=True, eq=False)
class ThreeRegions(Timed, kind="regions"):
    """Local stability, J1 and attraction over one grid.

    With integral action the operating speed is the set speed; a drive without it has the
    equilibrium nearest to the set speed, be it stable or not, and starts wound up with its top
    at this speed.
    """

    design: Design = label(means="what was varied")
    axes: tuple[Axis, ...] = label(means="parameters and their values")
    level: float = label(unit="s", means="level of J1")
    slope: Array = label(
        "axes", unit="N*m*s/rad", means="falling slope of the rock at the operating speed"
    )
    slope_margin: Array = label("axes", unit="N*m*s/rad", means="friction-slope margin")
    deciding_frequency: Array = label(
        "axes", unit="Hz", means="frequency of the poles that decide the margin"
    )
    locally_stable: Mask = label("axes", means="slope under its margin")
    j1: Array = label("axes", unit="s", means="J1; NaN where the run failed")
    inside_level: Mask = label("axes", means="J1 at or under the level")
    from_rest: Mask = label("axes", means="drills steadily after a start from rest")
    from_wound_up: Mask = label("axes", means="drills steadily after a start wound up")
    sticking_from_rest: Mask = label("axes", means="still sticks long after a start from rest")
    sticking_from_wound_up: Mask = label("axes", means="still sticks long after a wound-up start")
    failed: Mask = label("axes", means="one of the runs gave no finite answer")
    reference_speed: Array = label(
        "axes", unit="rad/s", means="operating speed; NaN where there is none"
    )
    horizon: float = label(unit="s", means="length of the runs from either start")
    window: float = label(unit="s", means="their end that counts")
    band: float = label(means="steady drilling, as a share of the operating speed")

    @property
    def attracted(self) -> Mask:
        """Cells in steady drilling after either start, shape of the grid."""
        return self.from_rest & self.from_wound_up

    @property
    def sticking(self) -> Mask:
        """Cells that stick in the last window after a start or both, shape of the grid."""
        return self.sticking_from_rest | self.sticking_from_wound_up

    @property
    def bistable(self) -> Mask:
        """Locally stable, yet sticking long after a start: two long-time answers from one rig."""
        # A bit that turns outside the band is no proof: where damping is weak the way there is
        # longer than the horizon. Those cells are `undecided`.
        return self.locally_stable & self.sticking & ~self.failed

    @property
    def undecided(self) -> Mask:
        """Locally stable and free of sticking, yet out of the band at the end of the horizon."""
        return self.locally_stable & ~self.sticking & ~self.attracted & ~self.failed

    @property
    def lingering(self) -> Mask:
        """Not locally stable, yet in the band from both starts: it grows too slowly to show."""
        return ~self.locally_stable & self.attracted

    @property
    def no_operating_point(self) -> Mask:
        """Cells at which drive, drag and rock balance at no speed."""
        return np.isnan(self.reference_speed)

    @property
    def counts(self) -> dict[str, int]:
        """Cells of each region and of what lies between them."""
        names = (*MASKS, "attracted", "bistable", "undecided", "lingering", "no_operating_point")
        return {name: int(getattr(self, name).sum()) for name in names}

    @property
    def combinations(self) -> dict[str, int]:
        """Cells of every combination of regions; the failed apart, so that all add up."""
        names = ("locally_stable", "inside_level", "from_rest", "from_wound_up")
        results = {}
        for signs in itertools.product((True, False), repeat=len(names)):
            cells = ~self.failed
            for name, sign in zip(names, signs, strict=True):
                cells = cells & (getattr(self, name) == sign)
            held = [name for name, sign in zip(names, signs, strict=True) if sign]
            results[" + ".join(held) or "none"] = int(cells.sum())
        return results | {"failed": int(self.failed.sum())}

    def summary(self) -> dict[str, Any]:
        """Axes, level, counts, what attraction means here, time; strict JSON values, SI."""
        figures = ("level", "counts", "combinations", "horizon", "band", "window", "total_seconds")
        return {"axes": span(self.axes), "cells": int(self.j1.size), **picked(self, *figures)}

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Axes and level that the design does not give."""
        level = {} if self.level == PAPER_LEVEL else {"level": self.level}
        return self.design, other_axes(self) | level


@timed
def three_regions(
    design: Design,
    axes: tuple[Axis, ...] | None = None,
    level: float | None = None,
    progress: Progress = SILENT,
) -> ThreeRegions:
    """Where a rig is locally stable, where J1 is low, and where it is drawn to steady drilling.

    Parameters
    ----------
    design : Design
        Its `[map]` table gives the axes, its start and duration are those of J1.
    axes : tuple of Axis, optional
        Instead of the design's own.
    level : float, optional
        Level of J1 (s); 33 s if none is given, the one level that the paper gives a meaning,
        whatever levels the design wants drawn. It was judged on runs of 100 s.
    progress : Progress
        Receives finished blocks and cells.

    Returns
    -------
    ThreeRegions
        A run that fails is marked, not an exception.

    Raises
    ------
    InputError
        An axis that does not fit the design, a grid too large for the memory, or a level that
        is not positive.
    """
    level = PAPER_LEVEL if level is None else float(level)
    if not (np.isfinite(level) and level > 0.0):
        raise InputError(f"{level:g} must be positive and finite", "level")
    axes = axes_of(design) if axes is None else axes
    swept = sweep(design, axes, audit_cells=0, progress=progress)
    cells = swept.j1.size
    fields: dict[str, Any] = {name: np.full(cells, np.nan) for name in FIELDS if name != "j1"}
    masks = {name: np.zeros(cells, dtype=bool) for name in MASKS if name != "inside_level"}
    masks["failed"] = np.isnan(swept.j1.ravel())
    progress.begin("long runs from either start", cells)
    for group in groups(design, axes):
        _fill(group, design, axes, fields, masks)
        progress.advance(len(group.cells))
    shape = shape_of(axes)
    return ThreeRegions(
        design=design,
        axes=axes,
        level=level,
        j1=swept.j1,
        # NaN is at or under no level.
        inside_level=swept.j1 <= level,
        **{name: values.reshape(shape) for name, values in (fields | masks).items()},
        horizon=HORIZON,
        band=NARROW_BAND,
        window=WINDOW,
    )


def _fill(
    group: Group, design: Design, axes: tuple[Axis, ...], fields: dict[str, Array],
    masks: dict[str, Mask],
) -> None:  # fmt: skip
    """Put the linear answer and the long runs of a group into the flat arrays."""
    cells = group.cells
    steady = steady_drilling(design, axes, group)
    margin = slopes_tolerated(design, axes, group, steady.speed)
    fields["reference_speed"][cells], fields["slope"][cells] = steady
    fields["slope_margin"][cells] = margin.slope
    fields["deciding_frequency"][cells] = margin.omega / (2.0 * np.pi)
    # NaN, where nothing is steady, is under no margin.
    masks["locally_stable"][cells] = steady.slope < margin.slope
    prepared = long_runs(group)
    for kind in STARTS:
        ended = ends_from(kind, group.lanes, steady.speed, prepared)
        masks[f"from_{kind}"][cells] = ended.attracted
        masks[f"sticking_from_{kind}"][cells] = ended.sticking
        masks["failed"][cells] |= ended.failed
