"""Figures of what the other rooms compute.

- `modes.py`: `mode_shapes`, angle and torque of the modes along the string.
- `frequency.py`: `bode`, response of any signals to one other, of one system or several.
- `mobility.py`: `mobility` at bit and top; `impedance.py`: `drive_impedance` and reflection.
- `loop_shape.py`: `nyquist`, `nichols` and `sensitivity` of the loop at the top torque.
- `loop_map.py`: `loop_map`, figures of the loop over two parameters; `gain_boundary.py`: the
  boundary of the stable gains.
- `plane.py`: the plane that maps are drawn on; `colour_bars.py`.
- `root_locus.py`: `root_locus`, poles of the loop against a parameter.
- `friction.py`: `friction_curves`, bit torque against bit speed at each weight on bit.
- `map.py`: `stability_map` with regions and audit; `sweep_line` for a single parameter.
- `comparison.py`: `j1_distributions`, `paired_differences`, `j1_against_weight` of cases;
  `compared_regions` and `compared_responses` of cases at their own values.
- `following_weight.py`: `weight_delay`, a weight that follows the bit speed against its delay;
  `advantage_cases`, `advantage_front`, `advantage_map` and `advantage_delay`, the same against a
  constant weight.
- `limit_cycle.py`: `limit_cycle`, one period by each method.
- `three_regions.py`: `three_regions` over the same two parameters.
- `regularisation.py`: `regularisation`, what smoothing the friction does to a map.
- `tune_baselines.py`: `tune_baselines`, tuned gains beside others; `tune_neighbourhood.py`:
  `tune_neighbourhood`, how far they may drift.
- `uncertain_regions.py`: `uncertain_regions`, `probability_map` and `region_error` of draws.
- `uncertain_curves.py`: `area_convergence`, `cell_distributions`, `sensitivity_bars`.
- `time_response.py`: `time_response`, speeds against time with sticks shaded.
- `style.py`: colours, sizes and the making of figures, shared by all.

Every function takes `ax`, the axes to draw on, or makes a figure of its own; it returns the
figure and never shows it. Nothing here touches the state of pyplot. Axes are in the units of
the rig floor: rpm, kN, kN m, m.
"""

from drillctl.plots.comparison import (
    compared_regions,
    compared_responses,
    j1_against_weight,
    j1_distributions,
    paired_differences,
)
from drillctl.plots.following_weight import (
    advantage_cases,
    advantage_delay,
    advantage_front,
    advantage_map,
    weight_delay,
)
from drillctl.plots.friction import friction_curves
from drillctl.plots.impedance import drive_impedance
from drillctl.plots.loop_gains import gain_boundary, root_locus
from drillctl.plots.loop_map import loop_map
from drillctl.plots.loop_shape import nichols, nyquist, sensitivity
from drillctl.plots.map import error_estimate, regularisation, stability_map, sweep_line
from drillctl.plots.modes import bode, mobility, mode_shapes
from drillctl.plots.three_regions import three_regions
from drillctl.plots.time_response import limit_cycle, time_response
from drillctl.plots.tune import tune_baselines, tune_neighbourhood
from drillctl.plots.uncertainty import (
    area_convergence,
    cell_distributions,
    probability_map,
    region_error,
    sensitivity_bars,
    uncertain_regions,
)

__all__ = [
    "advantage_cases",
    "advantage_delay",
    "advantage_front",
    "advantage_map",
    "area_convergence",
    "bode",
    "cell_distributions",
    "compared_regions",
    "compared_responses",
    "drive_impedance",
    "error_estimate",
    "friction_curves",
    "gain_boundary",
    "j1_against_weight",
    "j1_distributions",
    "limit_cycle",
    "loop_map",
    "mobility",
    "mode_shapes",
    "nichols",
    "nyquist",
    "paired_differences",
    "probability_map",
    "region_error",
    "regularisation",
    "root_locus",
    "sensitivity",
    "sensitivity_bars",
    "stability_map",
    "sweep_line",
    "three_regions",
    "time_response",
    "tune_baselines",
    "tune_neighbourhood",
    "uncertain_regions",
    "weight_delay",
]
