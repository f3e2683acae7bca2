"""Studies over many lanes.

- `grid.py`: axes over a design's parameters, and the lanes they stand for.
- `sweeps.py`: measures over a grid; the J1 map is one case.
- `adaptive.py`: contours of J1 at a grid's resolution from a fraction of its cells;
  `contour_search.py`: which cells; `lattices.py`: nested lattices of a grid;
  `chosen_cells.py`: their lanes; `adaptive_checks.py`: a sample, or all, of what was left out.
- `loop_maps.py`: figures of the linear loop over a grid.
- `regions.py`: cells and outlines at or under a level.
- `three_regions.py`: locally stable, J1 under a level, attracted: three regions of one map.
- `attraction.py`: long runs of its cells; `steady.py`: operating points of the cells of a grid.
- `regularisation.py`: the same map with friction smoothed by tanh, beside the set-valued one.
- `draws.py`: uncertain parameters and draws from them; `sampling.py`: the points behind them;
  `drawn_lanes.py`: the lanes of draws.
- `uncertainty/`: a map at thousands of draws, `uncertainty_tables.py` its CSV.
- `comparison.py`: cases at the same draws; `cases.py`: what makes them comparable.
- `weight_delay.py`: a weight on bit that follows the bit speed, against the delay of its path;
  `delayed_lanes.py`: its lanes; `delay_limits.py`: where a benefit ends.
- `advantage/`: that weight against a constant one, each with the drive at its robust optimum.
- `robust/`: gains searched for many realizations at once, linear and by trajectories.
- `nominal.py`: their maps and motions at their own values.
- `drawn_runs.py`: runs of draws, equal mean weights; `intervals.py`: shares and means.
- `lane_grid.py`: lane numbers over a grid, held along the axes they vary over.
- `examination.py`: what the batch engine does with a design, `diagnosis.py` what is found;
  `error_estimate.py`, `engine_speed.py`: its errors from itself, and its speed.
- `audit.py`: cells of a map simulated again with the reference solver.
- `responses.py`, `tables.py`: time responses at cells of a map; maps as CSV.
- `blocks.py`: finished blocks of a long run.
- `memory.py`: grids too large for the memory.
"""

from drillctl.studies.adaptive import AdaptiveMap, adaptive_map
from drillctl.studies.comparison import Comparison, compare
from drillctl.studies.diagnosis import Doctor
from drillctl.studies.draws import Draws, draw, uncertain_parameters
from drillctl.studies.examination import doctor
from drillctl.studies.grid import Axis
from drillctl.studies.loop_maps import LoopMap, loop_map
from drillctl.studies.regions import Region, region
from drillctl.studies.regularisation import Regularisation, regularisation
from drillctl.studies.responses import responses
from drillctl.studies.sweeps import Sweep, stability_map, sweep
from drillctl.studies.tables import (
    write_adaptive_tables,
    write_comparison,
    write_loop_table,
    write_tables,
    write_weight_delay,
)
from drillctl.studies.three_regions import ThreeRegions, three_regions
from drillctl.studies.uncertainty import Uncertainty, uncertainty
from drillctl.studies.uncertainty_tables import write_uncertainty_tables
from drillctl.studies.weight_delay import WeightDelay, weight_delay

__all__ = [
    "AdaptiveMap",
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
    "adaptive_map",
    "compare",
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
    "write_adaptive_tables",
    "write_comparison",
    "write_loop_table",
    "write_tables",
    "write_uncertainty_tables",
    "write_weight_delay",
]
