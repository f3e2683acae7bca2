"""Pictures of what the other rooms compute.

Every function takes `ax`, the axes to draw on, or makes a figure of its own; it returns the
figure and never shows it. Nothing here touches the state of pyplot. Axes are in the units of
the rig floor: rpm, kN, kN m, m. What they share is in `style.py`: colours, sizes, planes, bars.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl.registry import at_first_use

if TYPE_CHECKING:
    from drillctl.plots.comparison import compared_regions as compared_regions
    from drillctl.plots.comparison import compared_responses as compared_responses
    from drillctl.plots.comparison import j1_against_weight as j1_against_weight
    from drillctl.plots.comparison import j1_distributions as j1_distributions
    from drillctl.plots.comparison import paired_differences as paired_differences
    from drillctl.plots.following_weight import advantage_cases as advantage_cases
    from drillctl.plots.following_weight import advantage_delay as advantage_delay
    from drillctl.plots.following_weight import advantage_front as advantage_front
    from drillctl.plots.following_weight import advantage_map as advantage_map
    from drillctl.plots.following_weight import weight_delay as weight_delay
    from drillctl.plots.logs import identified_curve as identified_curve
    from drillctl.plots.logs import identified_profile as identified_profile
    from drillctl.plots.logs import identified_window as identified_window
    from drillctl.plots.logs import log_overview as log_overview
    from drillctl.plots.logs import log_spectrum as log_spectrum
    from drillctl.plots.loop_gains import drive_impedance as drive_impedance
    from drillctl.plots.loop_gains import gain_boundary as gain_boundary
    from drillctl.plots.loop_gains import root_locus as root_locus
    from drillctl.plots.loop_maps import loop_map as loop_map
    from drillctl.plots.loop_shape import nichols as nichols
    from drillctl.plots.loop_shape import nyquist as nyquist
    from drillctl.plots.loop_shape import sensitivity as sensitivity
    from drillctl.plots.map import error_estimate as error_estimate
    from drillctl.plots.map import regularisation as regularisation
    from drillctl.plots.map import stability_map as stability_map
    from drillctl.plots.map import sweep_line as sweep_line
    from drillctl.plots.map import three_regions as three_regions
    from drillctl.plots.over_depth import schedule as schedule
    from drillctl.plots.over_time import limit_cycle as limit_cycle
    from drillctl.plots.over_time import time_response as time_response
    from drillctl.plots.plant import bode as bode
    from drillctl.plots.plant import friction_curves as friction_curves
    from drillctl.plots.plant import mobility as mobility
    from drillctl.plots.plant import mode_shapes as mode_shapes
    from drillctl.plots.recommend import recommended as recommended
    from drillctl.plots.tune import tune_baselines as tune_baselines
    from drillctl.plots.tune import tune_neighbourhood as tune_neighbourhood
    from drillctl.plots.uncertainty import area_convergence as area_convergence
    from drillctl.plots.uncertainty import cell_distributions as cell_distributions
    from drillctl.plots.uncertainty import probability_map as probability_map
    from drillctl.plots.uncertainty import region_error as region_error
    from drillctl.plots.uncertainty import response_envelope as response_envelope
    from drillctl.plots.uncertainty import sensitivity_bars as sensitivity_bars
    from drillctl.plots.uncertainty import uncertain_regions as uncertain_regions
    from drillctl.plots.well import friction_sweep as friction_sweep
    from drillctl.plots.well import sticking as sticking
    from drillctl.plots.well import torque_drag as torque_drag

__all__, __getattr__, __dir__ = at_first_use(__name__)
