"""The one place where lanes of realizations are given to the batch engine."""

from __future__ import annotations

import math

from drillctl.simulation.batch import Batch, Prepared, run_batch
from drillctl.simulation.lanes import Lanes


def simulate(lanes: Lanes, prepared: Prepared, censor: float | None) -> Batch:
    """Simulate lanes that need not be known beyond a level of J1."""
    return run_batch(lanes, prepared, math.inf if censor is None else censor)
