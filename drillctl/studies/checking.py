"""What a design asks of the studies, checked without running any."""

from __future__ import annotations

from drillctl.design import Design
from drillctl.ensemble.grid import axes_of
from drillctl.ensemble.parameters import uncertain_parameters
from drillctl.studies.advantage.compute import checked
from drillctl.studies.advantage.policies import policies
from drillctl.studies.compare.cases import case_designs, refuse_unequal
from drillctl.studies.delay.lanes import following_design
from drillctl.studies.robust import tuned_parameters
from drillctl.studies.uncertainty.study import map_axes, refuse_impossible


def refuse_what_studies_would(design: Design) -> None:
    """Refuse (`InputError`) what a study would: axes, draws, cases, delays, what is tuned."""
    if "axes" in design.tree.get("map", {}):
        axes_of(design, design.tables.map.axes)
    if design.tables.uncertain:
        uncertain_parameters(design)
    if "uncertainty" in design.tree:
        refuse_impossible(design, map_axes(design))
    if design.tables.compare.cases:
        refuse_unequal(case_designs(design))
    if "weight_delay" in design.tree:
        following_design(design)
    if "advantage" in design.tree:
        checked(policies(design))
    if "tune" in design.tree:
        tuned_parameters(design)
