"""Responses of a design over its draws: bands that hold 90 % of them, moment by moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.ensemble.draws import drawn_lanes
from drillctl.ensemble.parameters import Draws
from drillctl.errors import InputError
from drillctl.simulation.batch import prepare, trace
from drillctl.store.codec import documented, label

PERCENTILES = (5.0, 50.0, 95.0)
ENVELOPED = {
    "bit_speed": "rad/s", "top_speed": "rad/s", "pipe_torque": "N*m", "bit_torque": "N*m",
}  # fmt: skip
"""Signals with their units."""
MOST_DRAWS = 200  # a percentile of 5 is the tenth of them
TIMES = 501


@dataclass(frozen=True, eq=False)
@documented
class Envelope:
    """Percentiles of signals over the draws at the design's own setting."""

    count: int = label(means="draws with a finite answer")
    time: Array = label("moment", unit="s", name="envelope_time", means="moments")
    signals: dict[str, Array] = label(
        "percentile", "moment", unit=lambda name: ENVELOPED[name], name="envelope",
        means="5th, 50th and 95th percentile over the draws",
    )  # fmt: skip


def envelope(design: Design, draw: Callable[[int, int], Draws], count: int) -> Envelope | None:
    """Percentiles over the first draws; None where none of them is possible."""
    try:
        drawn = drawn_lanes(design, draw(min(count, MOST_DRAWS), 0))
    except InputError:
        return None
    time = np.linspace(0.0, design.tables.simulation.duration, TIMES)
    columns: dict[str, list[Array]] = {name: [] for name in ENVELOPED}
    for group in drawn.groups:
        prepared = prepare(group.lanes, group.design.tables.simulation)
        seen, traced = trace(group.lanes, prepared, float(time[1]))
        for name, rows in columns.items():
            rows += [np.interp(time, seen, lane) for lane in traced[name].T]
    stacked = {name: np.array(rows) for name, rows in columns.items()}
    finite = np.isfinite(np.array([*stacked.values()])).all(axis=(0, 2))
    if not finite.any():
        return None
    signals = {
        name: np.percentile(rows[finite], PERCENTILES, axis=0) for name, rows in stacked.items()
    }
    return Envelope(int(finite.sum()), time, signals)
