"""Studies over many lanes.

- `grid.py`: axes over a design's parameters, and the lanes they stand for.
- `sweeps.py`: measures over a grid; the J1 map is one case.
- `regions.py`: cells and outlines at or under a level.
- `audit.py`: cells of a map simulated again with the reference solver.
- `responses.py`, `tables.py`: time responses at cells of a map; maps as CSV.
- `blocks.py`: finished blocks of a long run.
- `memory.py`: grids too large for the memory.
"""

from drillctl.studies.grid import Axis
from drillctl.studies.regions import Region, region
from drillctl.studies.responses import responses
from drillctl.studies.sweeps import Sweep, stability_map, sweep
from drillctl.studies.tables import write_tables

__all__ = [
    "Axis",
    "Region",
    "Sweep",
    "region",
    "responses",
    "stability_map",
    "sweep",
    "write_tables",
]
