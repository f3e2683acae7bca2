"""Room for what a run keeps of its steps: tables that grow, up to a bound."""

from __future__ import annotations

import numpy as np

from drillctl.arrays import Array
from drillctl.errors import SimulationError

LARGEST = 4 << 30
"""Largest table (bytes): some millions of steps, an hour of a drive that is sampled each
millisecond. A run that needs more has steps so short that it would not end."""
SPARE = 8  # rows that one step may fill, and more


def longer(table: Array, used: int, time: float) -> Array:
    """A table twice as long where it is nearly full at that time (s) of the run."""
    if used + SPARE < len(table):
        return table
    if 2 * table.nbytes > LARGEST:
        raise SimulationError(
            f"{used} steps by {time:g} s of the run, more than the reference solver keeps in "
            f"{LARGEST / (1 << 30):g} GiB; shorten the run, or let the batch engine simulate it"
        )
    more = np.empty((2 * len(table), table.shape[1]))
    more[: len(table)] = table
    return more
