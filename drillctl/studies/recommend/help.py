"""What would help next: more speed, less weight, found by trying."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.cases import share_interval
from drillctl.errors import InputError
from drillctl.studies.recommend.assess import Assessed, drawn
from drillctl.studies.recommend.criteria import drive_of, loop_criteria, loop_figures, own_delay
from drillctl.studies.recommend.deeper import at_depth, depth_of
from drillctl.studies.recommend.window import SPEED, WEIGHT

STEPS = (0.03, 0.06, 0.10, 0.15, 0.20, 0.30, 0.40, 0.60)
"""Changes of speed and weight that are tried, over the design's own."""
DEEPER = (0.05, 0.10, 0.20, 0.40, 0.70, 1.0)
"""How much deeper a setting that passes is tried, over the depth of the design."""
DRAWS = 300  # at which the probability is looked at


def what_helps(one: Assessed) -> tuple[str, ...]:
    """Room that a setting has, or the change that would make it pass."""
    if not one.missed:
        return tuple(_room(one))
    return tuple(_changes(one))


def _room(one: Assessed) -> Iterator[str]:
    window = one.window
    low, high = window.lowest_speed, window.highest_weight
    ends = []
    if low is not None:
        last = ", the lowest that was run" if window.speed_open else ""
        ends.append(f"down to {units.full(low, 'rad/s', 7)}{last}")
    if high is not None:
        last = ", the highest that was run" if window.weight_open else ""
        ends.append(f"up to {units.full(high, 'N', 4)} on bit{last}")
    if ends:
        yield f"the bit does not stick {', nor '.join(ends)}"


def until_depth(one: Assessed) -> tuple[float, float | None] | None:
    """Depth (m) down to which a setting keeps passing, and where it no longer does.

    None where it does not pass, or the string has no depth; the second is None if it passes at
    every depth that is tried.
    """
    if one.missed:
        return None
    try:
        last = depth = depth_of(one.design)
    except InputError:
        return None
    for more in DEEPER:
        there = depth * (1.0 + more)
        try:
            passes = _passes(at_depth(one.design, there))
        except InputError:  # beyond holes or survey of the well
            return last, None
        if not passes:
            return last, there
        last = there
    return last, None


def _changes(one: Assessed) -> Iterator[str]:
    design = one.design
    speed, weight = design.speed, design.tables.operating_point.weight_on_bit
    more = _first(design, [{SPEED: units.SI(speed * (1.0 + x))} for x in STEPS])
    less = _first(design, [{WEIGHT: units.SI(weight * (1.0 - x))} for x in STEPS])
    if more is not None:
        yield f"speed up by {units.full(STEPS[more] * speed, 'rad/s', 7)} makes it pass"
    if less is not None:
        yield f"weight down by {units.full(STEPS[less] * weight, 'N', 5)} makes it pass"
    late = own_delay(drive_of(design))
    if late > 0.0 and (bears := _borne(design)) < late:
        yield (
            f"without the {1e3 * late:.3g} ms of delay and lags of the drive the loop bears "
            f"{1e3 * bears:.3g} ms: a faster drive would help, or damping not in the design"
        )
    if more is None and less is None:
        yield (
            f"neither {100 * STEPS[-1]:.0f} % more speed nor {100 * STEPS[-1]:.0f} % less weight "
            "makes it pass"
        )


def _borne(design: Design) -> float:
    """Delay (s) that the loop bears with a drive at once; infinite if it is not stable at all."""
    at_once = design.replace({
        f"controller.drive.{key}": value
        for key, value in (
            ("sampling_period", "0 s"), ("one_sample_delay", False), ("lag", "0 s"),
            ("encoder_lag", "0 s"), ("torque_lag", "0 s"), ("torque_rate_limit", "inf"),
        )
    })  # fmt: skip
    whole = loop_figures(at_once, design.tables.recommend.slope_share).whole
    return math.inf if whole is None else whole.delay


def _first(design: Design, changes: list[dict[str, Any]]) -> int | None:
    """The first change with which everything is kept."""
    for number, values in enumerate(changes):
        try:
            changed = design.replace(values)
            if _passes(changed):
                return number
        except InputError:  # outside the friction table, or nothing that the drive can turn
            continue
    return None


def _passes(design: Design) -> bool:
    asked, table = design.tables.recommend, design.tables.tune
    figures = loop_figures(design, asked.slope_share)
    if not all(one.kept for one in loop_criteria(design, figures, asked)):
        return False
    j1, limited = drawn(design, min(DRAWS, table.certificate.realizations))
    hits = int(np.count_nonzero(j1 <= table.level))
    return share_interval(hits, len(j1))[1] >= table.probability and (
        hits >= table.probability * len(j1) and limited <= asked.time_at_limit
    )
