"""The job that every peer does: the paper's map of 41 x 41 gains at 140 kN, 100 s a cell."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import drillctl
from drillctl.design import Design
from drillctl.ensemble.grid import Axis, axes_of, cell_design, shape_of

Array = NDArray[np.float64]

DESIGN = "monteiro-trindade-140kn"
CELLS = (1037, 659, 1400, 250)
"""Cells on which accuracy is compared, and the only ones that slow peers simulate: well damped,
poorly damped, and two that stick and slip to the end."""
EXACT = Path(__file__).with_name("exact.json")
"""J1 of `CELLS`, located events at tight tolerance; made by `python -m benchmarks.exact`."""


class Rig(NamedTuple):
    """One cell in plain numbers (SI): all that a peer is told.

    The frame turns at the set speed; the drive's torque is -kp v_top - ki u_top.
    """

    mass: Array
    stiffness: Array
    kp: float
    ki: float
    a1: float
    a2: float
    beta: float
    weight: float
    set_speed: float
    start_speed: float
    duration: float


@dataclass(frozen=True, eq=False)
class Job:
    """The map, and the cells whose J1 is known exactly.

    Attributes
    ----------
    design : Design
        The map's, with its duration.
    axes : tuple of Axis
        Its gains.
    exact : dict
        J1 by cell, from the event-accurate solver.
    """

    design: Design
    axes: tuple[Axis, ...]
    exact: dict[int, float]

    @property
    def cells(self) -> tuple[int, ...]:
        """Those whose J1 is known."""
        return tuple(self.exact)

    @cached_property
    def size(self) -> int:
        """Number of cells of the map."""
        return int(np.prod(shape_of(self.axes)))

    def cell(self, cell: int) -> Design:
        """The design of one cell."""
        return cell_design(self.design, self.axes, cell)

    def rig(self, cell: int) -> Rig:
        """One cell in plain numbers."""
        design = self.cell(cell)
        string = design.string
        if string.damping.nnz:
            raise ValueError("the peers have no damping in the string; this design has")
        kp, ki = design.top_drive.gains()
        return Rig(
            string.mass.toarray(), string.stiffness.toarray(), kp, ki, *design.bit_rock,
            float(design.weight_on_bit.weight(0.0)), design.speed,
            design.tables.start.speed, design.tables.simulation.duration,
        )  # fmt: skip


def gains(design: Design, axes: tuple[Axis, ...]) -> dict[str, list[float]]:
    """What a cached J1 belongs to: gains of each cell."""
    return {str(c): list(cell_design(design, axes, c).top_drive.gains()) for c in CELLS}


def load_job() -> Job:
    """The job, with the exact J1 from disk.

    Raises
    ------
    ValueError
        The cached values belong to another map.
    """
    design = drillctl.load(DESIGN)
    axes = axes_of(design)
    known = json.loads(EXACT.read_text(encoding="utf-8"))
    same = known["gains"] == gains(design, axes)
    if not same or known["duration"] != design.tables.simulation.duration:
        raise ValueError(f"{EXACT.name} belongs to another map: run python -m benchmarks.exact")
    return Job(design, axes, {int(cell): value for cell, value in known["j1"].items()})
