"""Time responses at cells of a map, and every cell as CSV."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from drillctl.ensemble.grid import cell_design, over_axes
from drillctl.ensemble.sweeps import Sweep
from drillctl.simulation import Simulation, simulate
from drillctl.simulation.measures import STATUSES
from drillctl.store.tables import texts, write_columns


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


def write_cells(result: Sweep, path: Path) -> None:
    """Write a row a cell: parameters, measures (SI) and status."""
    columns = over_axes(result.axes) | {name: texts(v) for name, v in result.measures.items()}
    columns["status"] = np.array(STATUSES, dtype=object)[result.status.ravel()].tolist()
    write_columns(path, columns)
