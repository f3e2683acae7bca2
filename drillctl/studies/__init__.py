"""Studies over many lanes, a package a subject.

- `grid.py`: axes over a design's parameters, and the lanes they stand for; `lane_grid.py`: lane
  numbers, held along the axes they vary over.
- `sweeps.py`: measures over a grid, the J1 map being one case; `regions.py`: cells and outlines at
  or under a level; `responses.py`, `tables.py`: time responses at cells, maps as CSV.
- `loop_maps.py`: figures of the linear loop over a grid.
- `three_regions/`: locally stable, J1 under a level, attracted: three regions of one map.
- `regularisation.py`: the same map with friction smoothed by tanh, beside the set-valued one.
- `draws/`: what is uncertain, and draws from it.
- `compare/`: cases at the same draws.
- `delay/`: a weight on bit that follows the bit speed, against the delay of its path.
- `uncertainty/`: a map at thousands of draws.
- `robust/`: gains searched for many realizations at once, and certified at fresh ones.
- `advantage/`: PI against PI with dynamic weight on bit, each at its robust optimum.
- `diagnosis/`: what the batch engine does with a design; `audit.py`: cells of a map simulated again
  with the reference solver.
- `blocks.py`: finished blocks of a long run; `memory.py`: grids too large for the memory;
  `checking.py`: what a design asks of the studies, without running any.
"""

from drillctl.ensemble.grid import Axis
from drillctl.ensemble.parameters import Draws, draw, uncertain_parameters
from drillctl.ensemble.regions import Region, region
from drillctl.ensemble.sweeps import Sweep, stability_map, sweep
from drillctl.studies.compare.compute import Comparison
from drillctl.studies.delay.compute import WeightDelay, weight_delay
from drillctl.studies.diagnosis.examination import doctor
from drillctl.studies.diagnosis.result import Doctor
from drillctl.studies.loop_maps import LoopMap, loop_map
from drillctl.studies.regularisation import Regularisation, regularisation
from drillctl.studies.responses import responses
from drillctl.studies.tables import (
    write_comparison,
    write_loop_table,
    write_tables,
    write_weight_delay,
)
from drillctl.studies.three_regions.compute import ThreeRegions, three_regions
from drillctl.studies.uncertainty import Uncertainty, uncertainty
from drillctl.studies.uncertainty.tables import write_uncertainty_tables

__all__ = [
    "Axis",
    "Comparison",
    "Doctor",
    "Draws",
    "LoopMap",
    "Region",
    "Regularisation",
    "Sweep",
    "ThreeRegions",
    "Uncertainty",
    "WeightDelay",
    "doctor",
    "draw",
    "loop_map",
    "region",
    "regularisation",
    "responses",
    "stability_map",
    "sweep",
    "three_regions",
    "uncertain_parameters",
    "uncertainty",
    "weight_delay",
    "write_comparison",
    "write_loop_table",
    "write_tables",
    "write_uncertainty_tables",
    "write_weight_delay",
]
