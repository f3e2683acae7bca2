"""Studies, a package each: settings, computation, tables, figures and section in one place.

`base.py` says what a study is; `drillctl.registry` names those that there are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from drillctl.registry import at_first_use

if TYPE_CHECKING:
    from drillctl.ensemble.grid import Axis as Axis
    from drillctl.ensemble.parameters import Draws as Draws
    from drillctl.ensemble.parameters import draw as draw
    from drillctl.ensemble.parameters import uncertain_parameters as uncertain_parameters
    from drillctl.ensemble.sweeps import Region as Region
    from drillctl.ensemble.sweeps import Sweep as Sweep
    from drillctl.ensemble.sweeps import region as region
    from drillctl.ensemble.sweeps import responses as responses
    from drillctl.ensemble.sweeps import stability_map as stability_map
    from drillctl.ensemble.sweeps import sweep as sweep
    from drillctl.studies.compare.compute import Comparison as Comparison
    from drillctl.studies.delay.compute import WeightDelay as WeightDelay
    from drillctl.studies.delay.compute import weight_delay as weight_delay
    from drillctl.studies.doctor.compute import Doctor as Doctor
    from drillctl.studies.doctor.compute import doctor as doctor
    from drillctl.studies.loop_mapping.compute import LoopMap as LoopMap
    from drillctl.studies.loop_mapping.compute import loop_map as loop_map
    from drillctl.studies.torque_drag.compute import TorqueDrag as TorqueDrag
    from drillctl.studies.uncertainty.result import Uncertainty as Uncertainty

# Commands import the package to list the studies: what computes comes with its first use.
__all__, __getattr__, __dir__ = at_first_use(__name__)
