"""Studies, a package each: settings, computation, tables, figures and section in one place.

`base.py` says what a study is; `drillctl.registry` names those that there are.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drillctl.ensemble.grid import Axis as Axis
    from drillctl.ensemble.parameters import Draws as Draws
    from drillctl.ensemble.parameters import draw as draw
    from drillctl.ensemble.parameters import uncertain_parameters as uncertain_parameters
    from drillctl.ensemble.regions import Region as Region
    from drillctl.ensemble.regions import region as region
    from drillctl.ensemble.sweeps import Sweep as Sweep
    from drillctl.ensemble.sweeps import stability_map as stability_map
    from drillctl.ensemble.sweeps import sweep as sweep
    from drillctl.studies.compare.compute import Comparison as Comparison
    from drillctl.studies.delay.compute import WeightDelay as WeightDelay
    from drillctl.studies.delay.compute import weight_delay as weight_delay
    from drillctl.studies.doctor.compute import Doctor as Doctor
    from drillctl.studies.doctor.compute import doctor as doctor
    from drillctl.studies.loop_mapping.compute import LoopMap as LoopMap
    from drillctl.studies.loop_mapping.compute import loop_map as loop_map
    from drillctl.studies.map.outputs import responses as responses
    from drillctl.studies.uncertainty.result import Uncertainty as Uncertainty

_HOME = {
    "Axis": "drillctl.ensemble.grid",
    "Comparison": "drillctl.studies.compare.compute",
    "Doctor": "drillctl.studies.doctor.compute",
    "Draws": "drillctl.ensemble.parameters",
    "LoopMap": "drillctl.studies.loop_mapping.compute",
    "Region": "drillctl.ensemble.regions",
    "Sweep": "drillctl.ensemble.sweeps",
    "Uncertainty": "drillctl.studies.uncertainty.result",
    "WeightDelay": "drillctl.studies.delay.compute",
    "doctor": "drillctl.studies.doctor.compute",
    "draw": "drillctl.ensemble.parameters",
    "loop_map": "drillctl.studies.loop_mapping.compute",
    "region": "drillctl.ensemble.regions",
    "responses": "drillctl.studies.map.outputs",
    "stability_map": "drillctl.ensemble.sweeps",
    "sweep": "drillctl.ensemble.sweeps",
    "uncertain_parameters": "drillctl.ensemble.parameters",
    "weight_delay": "drillctl.studies.delay.compute",
}

__all__ = [*_HOME]


def __getattr__(name: str) -> Any:
    # Commands import the package to list the studies: what computes comes with its first use.
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'drillctl.studies' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
