"""Lanes of a weight on bit that follows the bit speed: every draw at every delay, one gain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.cases import Runs, joined
from drillctl.ensemble.draws import DrawnGroup, DrawnLanes, drawn_lanes, run_draws
from drillctl.ensemble.parameters import Draws, uncertain_parameters
from drillctl.errors import InputError
from drillctl.simulation.lanes import Lanes
from drillctl.studies.delay.settings import VARIED

Array = NDArray[np.float64]

LAWS = ("navarro-lopez-suarez", "surface-observer")  # laws of a weight that follows the bit speed
GAIN, DELAY = VARIED
KEPT = (
    "j1", "peak_bit_speed", "peak_pipe_torque", "mean_weight_on_bit", "mean_weight_after_start",
)  # fmt: skip
"""Measures that are kept of a run."""


def following_design(design: Design) -> Design:
    """The design with a weight on bit that follows the bit speed, as yet with no gain or delay."""
    for path in VARIED:
        if path in design.tables.uncertain:
            where = _where(design, f"uncertain.{path}")
            raise InputError("is what the study runs over and cannot be drawn", where)
    values = dict(design.tables.weight_delay.values)
    own = design.tables.weight_on_bit.law
    law = values.setdefault("weight_on_bit.law", LAWS[0] if own == "constant" else own)
    if law not in LAWS:
        raise InputError(
            f"{law!r} does not follow the bit speed; allowed: {', '.join(LAWS)}",
            _where(design, "weight_on_bit.law"),
        )
    try:
        result = design.replace({**values, GAIN: units.SI(0.0), DELAY: units.SI(0.0)})
        # Limits are compared with the nominal weight only when the law is made of them.
        result.weight_on_bit  # noqa: B018
    except InputError as error:
        key = error.where.removeprefix(design.origin).removeprefix(": ")
        raise InputError(error.problem, _where(design, f"weight_delay.set: {key}")) from None
    uncertain_parameters(result)
    return result


def _where(design: Design, key: str) -> str:
    """A key after the file it is in."""
    return f"{design.origin}: {key}" if design.origin else key


@dataclass(frozen=True, eq=False)
class DelayedLanes:
    """Every draw at every delay."""

    # at no delay, where that is asked for, and at all others: without any lag the first is of the
    # law that acts at once, which has a kernel of its own
    parts: tuple[DrawnLanes, ...]
    draws: int  # how many draws, the impossible ones included
    delays: Array  # shape (delays,): Increasing (s)

    def run(self, gain: float) -> Runs:
        """Simulate all at one gain (N s/rad); runs of shape (delays, draws)."""
        results = []
        at = (self.delays > 0.0).astype(int)
        sizes = [int((at == k).sum()) for k in (0, 1) if (at == k).any()]
        for part, size in zip(self.parts, sizes, strict=True):
            given = _replaced(part, lambda lanes: _with(lanes, gain=np.full(len(lanes), gain)))
            runs = run_draws(given, size * self.draws)
            results.append(runs.over((size, self.draws), KEPT))
        return joined(results, np.concatenate)


def delayed_lanes(following: Design, draws: Draws, delays: Array) -> DelayedLanes:
    """Lanes of a design at every draw and delay."""
    late = delays[delays > 0.0]
    parts = []
    if late.size < delays.size:
        parts.append(drawn_lanes(following, draws))
    if late.size:
        first = drawn_lanes(following.replace({DELAY: units.SI(float(late[0]))}), draws)
        parts.append(_at_delays(first, len(draws), late))
    return DelayedLanes(tuple(parts), len(draws), delays)


def _at_delays(drawn: DrawnLanes, count: int, delays: Array) -> DrawnLanes:
    """All draws again at every delay, delay by delay."""
    groups = []
    for group in drawn.groups:
        size = len(group.lanes)
        lanes = group.lanes[np.tile(np.arange(size), len(delays))]
        numbers = np.concatenate([group.numbers + k * count for k in range(len(delays))])
        delayed = _with(lanes, delay=np.repeat(delays, size))
        groups.append(DrawnGroup(group.design, delayed, numbers))
    return DrawnLanes(tuple(groups), drawn.failures)


def _replaced(drawn: DrawnLanes, change: Callable[[Lanes], Lanes]) -> DrawnLanes:
    groups = tuple(DrawnGroup(g.design, change(g.lanes), g.numbers) for g in drawn.groups)
    return DrawnLanes(groups, drawn.failures)


def _with(lanes: Lanes, **numbers: Array) -> Lanes:
    """Lanes with other numbers of their weight law."""
    return replace(lanes, weight=lanes.weight._replace(**numbers))
