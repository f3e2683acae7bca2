"""Time responses at cells of a map, from its best on: what the values of J1 look like."""

from __future__ import annotations

import numpy as np

from drillctl.ensemble.grid import cell_design
from drillctl.ensemble.sweeps import Sweep
from drillctl.simulation import Simulation, simulate


def responses(result: Sweep, count: int = 4) -> list[Simulation]:
    """Simulate some cells of growing J1, by the batch engine.

    Parameters
    ----------
    result : Sweep
        The map.
    count : int
        How many cells, at most: the minimum, then the cells nearest to values of J1 spread
        evenly in logarithm up to twice the highest level.

    Returns
    -------
    list of Simulation
        By growing J1; without repeats.
    """
    if result.minimum is None:
        return []
    flat = result.j1.ravel()
    high = 2.0 * result.levels[-1]
    low = max(result.minimum[0], 1e-6 * high)  # a rig that never leaves its set speed has J1 = 0
    targets = np.geomspace(low, max(low, high), count)
    cells = dict.fromkeys(int(np.nanargmin(np.abs(flat - target))) for target in targets)
    designs = [cell_design(result.design, result.axes, cell) for cell in cells]
    return [simulate(design, engine="batch", interval=0.05) for design in designs]
