"""Control design against torsional stick-slip of oil-well drillstrings.

A design flows one way: file -> `Design` -> plant -> simulation -> map -> region -> figure.

======================  ==========================================================
`design`, `catalog`     TOML files in, validated frozen `Design` out; shipped files
`rig.drillstring`       sections, API pipes, finite-element assembly
`rig.bit_rock`          friction laws of the bit, set-valued at rest
`rig.top_drive`         control laws of the top drive
`rig.weight_on_bit`     laws of the weight on bit
`rig.program`           what changes by the clock in a run
`linear`                plant and loop as `control.StateSpace`, modes, margins, boundaries
`simulation`            reference solver (located events) and batch engine (lanes)
`studies`               sweeps, regions, comparisons, audits
`plots`                 a result in, a figure out
`store`                 results on disk
`reporting`             a design's results as HTML, PDF or Markdown
`units`, `errors`       quantities at the edge; exceptions
======================  ==========================================================

Numbers are SI and radians throughout; angles and speeds of the dynamics are measured in the
frame that turns at the final set speed, unless a name says otherwise. Positive bit torque
brakes. Start with `load`.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if TYPE_CHECKING:
    from drillctl.design import Design as Design
    from drillctl.design import load as load
    from drillctl.errors import InputError as InputError
    from drillctl.linear import loop as loop
    from drillctl.linear import modes as modes
    from drillctl.reporting.making import report as report
    from drillctl.simulation import simulate as simulate
    from drillctl.simulation.limit_cycle import limit_cycle as limit_cycle
    from drillctl.store import open as open
    from drillctl.studies import doctor as doctor
    from drillctl.studies import stability_map as stability_map
    from drillctl.studies import sweep as sweep
    from drillctl.studies.advantage.compute import advantage as advantage
    from drillctl.studies.compare.compute import compare as compare
    from drillctl.studies.regularisation.compute import regularisation as regularisation
    from drillctl.studies.three_regions.compute import three_regions as three_regions
    from drillctl.studies.torque_drag.compute import torque_drag as torque_drag
    from drillctl.studies.tune.compute import tune as tune
    from drillctl.studies.uncertainty.compute import uncertainty as uncertainty

_HOME = {
    "Design": "drillctl.design",
    "load": "drillctl.design",
    "InputError": "drillctl.errors",
    "sweep": "drillctl.studies",
    "open": "drillctl.store",
    "report": "drillctl.reporting.making",
}


def _studies() -> dict[str, str]:
    """Names of the studies in Python, and what they stand for."""
    studies = import_module("drillctl.studies.base").studies()
    return {study.python: study.call for study in studies.values() if study.python}


def _is_module(name: str) -> bool:
    """Whether a name is that of a module below."""
    here = Path(__file__).parent
    return (here / name / "__init__.py").is_file() or (here / f"{name}.py").is_file()


def __getattr__(name: str) -> Any:
    # Scientific imports cost a second: each comes with the first use of what needs it.
    if name == "__all__":
        return [*_HOME, *_studies(), "plots", "__version__"]
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    if not name.startswith("_"):
        if _is_module(name):
            return import_module(f"drillctl.{name}")
        if place := _studies().get(name):
            module, _, function = place.partition(":")
            return getattr(import_module(module), function)
    raise AttributeError(f"module 'drillctl' has no attribute {name!r}{_called(name)}")


def _called(command: str) -> str:
    """How a command is called in Python, if by another name."""
    study = import_module("drillctl.studies.base").studies().get(command)
    return f"; in Python it is drillctl.{study.python}" if study and study.python else ""


def __dir__() -> list[str]:
    return sorted(__getattr__("__all__"))
