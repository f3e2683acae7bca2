"""Tension, side force and torque of a string in its well: the computation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl.arrays import Array
from drillctl.design import Design, well
from drillctl.design.parts import torque_at_set_speed
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.rig.table import MOST_FRICTION
from drillctl.rig.well.soft_string import Drag, Line, Motion, Run, drag, sinusoidal_limit
from drillctl.store.codec import label
from drillctl.store.result import Result

CASES = {
    "rotating": "rotating at the weight on bit of the design",
    "off_bottom": "rotating off bottom",
    "pulling_out": "pulled out",
    "running_in": "run in",
}
"""How the string is moved, and in words."""


@dataclass(frozen=True, eq=False)
class TorqueDrag(Result, kind="torque-drag"):
    """A string in its well, turned off bottom and on bottom, pulled out and run in."""

    design: Design = label(means="what was laid into its well")
    friction_factor: float = label(means="of the wall where no hole has one of its own")
    depth: Array = label("depth", unit="m", name="depth", means="measured depth, from the rig down")
    tension: dict[str, Array] = label(
        "depth", unit="N", means=lambda case: f"effective tension, {CASES[case]}"
    )
    torque: dict[str, Array] = label(
        "depth", unit="N*m", means=lambda case: f"torque, {CASES[case]}"
    )
    side_force: dict[str, Array] = label(
        "cell", unit="N/m", means=lambda case: f"force of the wall per length, {CASES[case]}"
    )
    middle: Array = label("cell", unit="m", name="cell", means="measured depth of the side forces")
    buckling: Array = label(
        "cell", unit="N", means="compression at which sinusoidal buckling begins"
    )
    factors: Array = label("factor", name="factor", means="friction factors swept over")
    # by case: of each friction factor
    hook_loads: dict[str, Array] = label(
        "factor", unit="N", means=lambda case: f"hook load, {CASES[case]}"
    )
    torques: dict[str, Array] = label(
        "factor", unit="N*m", means=lambda case: f"torque at the rig, {CASES[case]}"
    )
    total_depth: tuple[float, float, float] = label(
        unit="m", means="vertical depth, north and east of the bit"
    )
    notes: tuple[str, ...] = label(means="what deserves attention")

    def summary(self) -> dict[str, Any]:
        """Hook load and torque of each case, friction factor, place of the bit; SI."""
        tvd, north, east = self.total_depth
        return {
            "cases": {
                case: {
                    "hook_load": float(self.tension[case][0]),
                    "torque": float(self.torque[case][0]),
                    "bit_torque": float(self.torque[case][-1]),
                }
                for case in self.tension
            },
            "friction_factor": self.friction_factor,
            "total_depth": {"tvd": tvd, "north": north, "east": east},
        }


def torque_drag(design: Design, progress: Progress = SILENT) -> TorqueDrag:
    """Lay a string into its well and move it.

    Parameters
    ----------
    design : Design
        With its `[well]`; without a survey it is vertical.
    progress : Progress
        Not needed: it takes a moment.

    Returns
    -------
    TorqueDrag

    Raises
    ------
    InputError
        A section without weight, or a measured torque from which no friction factor follows.
    """
    settings = design.tables.torque_drag
    with design.within("torque_drag"):
        placed, made = well.line(design.tables)
        factor = _factor(design, placed, made)
    found = _cases(design, placed, made, factor)
    swept = [_cases(design, placed, made, one) for one in settings.friction_factors]
    place, _, _ = well.path(design.tables).at(float(placed.depth[-1]))
    north, east, tvd = (float(x) for x in place[0])
    limit = sinusoidal_limit(placed, made)
    return TorqueDrag(
        design=design,
        friction_factor=factor,
        depth=placed.depth,
        tension={case: one.tension for case, one in found.items()},
        torque={case: one.torque for case, one in found.items()},
        side_force={case: one.side_force for case, one in found.items()},
        middle=0.5 * (placed.depth[:-1] + placed.depth[1:]),
        buckling=limit,
        factors=np.array(settings.friction_factors),
        hook_loads={case: np.array([one[case].hook_load for one in swept]) for case in CASES},
        torques={case: np.array([one[case].torque[0] for one in swept]) for case in CASES},
        total_depth=(tvd, north, east),
        notes=tuple(_notes(design, made, found, limit, placed)),
    )


def _cases(design: Design, placed: Line, made: tuple[Run, ...], factor: float) -> dict[str, Drag]:
    """Every case at a friction factor; holes keep their own."""
    tables = design.tables
    settings = tables.torque_drag
    # A swept or measured factor stands in for that of the well.
    own = tables.model_copy(
        update={"well": tables.well.model_copy(update={"friction_factor": factor})}
    )
    each = well.friction_factors(own, made, factor)[placed.run]
    ahead = Motion(tables.well.axial_speed, design.speed)
    tripping, turning = abs(settings.tripping_speed) or 1.0, settings.tripping_rotation
    weight = tables.operating_point.weight_on_bit
    coupled = tables.well.tension
    return {
        "rotating": drag(placed, each, ahead, weight, torque_at_set_speed(tables), coupled),
        "off_bottom": drag(placed, each, Motion(0.0, design.speed), 0.0, 0.0, coupled),
        "pulling_out": drag(placed, each, Motion(-tripping, turning), 0.0, 0.0, coupled),
        "running_in": drag(placed, each, Motion(tripping, turning), 0.0, 0.0, coupled),
    }


def _factor(design: Design, placed: Line, made: tuple[Run, ...]) -> float:
    """The friction factor of the well: given, or that of a measured off-bottom torque."""
    tables = design.tables
    settings, given = tables.torque_drag, tables.well.friction_factor
    measured = settings.off_bottom_torque
    if measured is None:
        return float(settings.friction_factor if given is None else given)
    # The side force of a string that turns does not depend on the factor: the torque is a line.
    none, one = (_cases(design, placed, made, x)["off_bottom"].torque[0] for x in (0.0, 1.0))
    if one - none <= 0.0:
        raise InputError(
            "no friction factor follows from it: every hole has its own, or the well is vertical",
            "off_bottom_torque",
        )
    if measured < none:
        raise InputError(
            f"{measured / 1e3:.4g} kN*m is less than the {none / 1e3:.4g} kN*m of the holes with a "
            "friction factor of their own", "off_bottom_torque",
        )  # fmt: skip
    factor = float((measured - none) / (one - none))
    if factor > MOST_FRICTION:
        raise InputError(
            f"{measured / 1e3:.4g} kN*m need a friction factor of {factor:.3g}; that of a wall is "
            f"at most {MOST_FRICTION:g}", "off_bottom_torque",
        )  # fmt: skip
    return factor


def _notes(
    design: Design, made: tuple[Run, ...], found: dict[str, Drag], limit: Array, placed: Line
) -> Iterator[str]:
    """What deserves attention: a well of which little is known, and what was left out."""
    tables = design.tables.well
    if made[-1].bottom == 1.0 and made[-1].mass == 0.0:
        yield "the string is of lumped springs: it has no length, and no weight in the well"
    if not tables.survey:
        yield (
            "the well has no survey and is taken as vertical, where nothing rubs: give well.survey"
        )
    if tables.holes and all(hole.friction_factor is not None for hole in tables.holes):
        yield "every hole has a friction factor of its own: the sweep changes nothing"
    if found["running_in"].hook_load < 0.0:
        yield "run in: the hook load is negative, the string does not go down by its own weight"
    for case, one in found.items():
        pressed = -0.5 * (one.tension[:-1] + one.tension[1:])
        over = np.flatnonzero(pressed > limit)
        if over.size:
            yield (
                f"{CASES[case]}: compressed beyond the limit of sinusoidal buckling from "
                f"{placed.depth[over[0]]:.0f} m down; a buckled string rubs more than is computed "
                "here"
            )
