"""Profiles of a report (quick, standard, full), and how each of its studies is run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drillctl.design import Design
from drillctl.reporting.cells import CELLS
from drillctl.studies.base import Recipe, Study, studies


@dataclass(frozen=True)
class Profile:
    """How much a report computes."""

    name: str  # value of --profile
    meaning: str  # one line for a reader
    points: int | None  # most points along an axis of the map; None for those of the design
    # cells audited with the reference solver; None for the number of the design
    audited: int | None
    realizations: int | None  # most draws over the map; None for the number of the design
    lanes: int  # most lanes over the map and all draws
    setting: int  # draws at the design's own setting alone
    # lanes audited under uncertainty; None for as many as cells
    drawn_audit: int | None
    sensitivity: bool  # whether Sobol indices requested by the design are computed
    # whether the cases of the design are compared, and its gains tuned
    compared: bool
    tuned: bool

    def applied(self, design: Design) -> Design:
        """The design with map and draws reduced to the limits of the profile."""
        values: dict[str, Any] = {}
        if self.points is not None and any(a.points > self.points for a in design.tables.map.axes):
            values["map.axes"] = [
                {
                    "path": axis.path, "min": axis.min, "max": axis.max,
                    "points": min(axis.points, self.points),
                }
                for axis in design.tables.map.axes
            ]  # fmt: skip
        if self.audited is not None:
            values["map.audit_cells"] = min(self.audited, design.tables.map.audit_cells)
        if not self.sensitivity and design.tables.uncertainty.sensitivity is not None:
            values["uncertainty.sensitivity"] = None
        changed = design.replace(values) if values else design
        draws = self._draws(changed)
        if draws != changed.tables.uncertainty.realizations:
            changed = changed.replace({"uncertainty.realizations": draws})
        return changed

    def _draws(self, design: Design) -> int:
        """Number of draws within the limits of draws and lanes."""
        table = design.tables.uncertainty
        cells = 1
        for axis in (*design.tables.map.axes, *table.axes):
            cells *= axis.points
        most = max(2, self.lanes // cells)
        if self.realizations is not None:
            most = min(most, self.realizations)
        draws = min(table.realizations, most)
        if table.sampling == "monte-carlo" or draws == table.realizations:
            return draws
        each = max(1, draws // table.replicates)
        if table.sampling == "sobol":  # Sobol points come in powers of two
            each = 1 << (each.bit_length() - 1)
        return each * table.replicates


QUICK = Profile(
    name="quick", meaning="a map of 21 x 21 cells, 200 draws, no comparison, no tuning",
    points=21, audited=4, realizations=200, lanes=1_000_000, setting=2000, drawn_audit=0,
    sensitivity=False, compared=False, tuned=False,
)  # fmt: skip
STANDARD = Profile(
    name="standard", meaning="map and draws of the design, up to four million lanes",
    points=None, audited=None, realizations=None, lanes=4_000_000, setting=10_000,
    drawn_audit=None, sensitivity=True, compared=False, tuned=False,
)  # fmt: skip
FULL = Profile(
    name="full", meaning="all studies of the design, with comparison and tuning",
    points=None, audited=None, realizations=None, lanes=1_000_000_000, setting=10_000,
    drawn_audit=None, sensitivity=True, compared=True, tuned=True,
)  # fmt: skip

PROFILES = {profile.name: profile for profile in (QUICK, STANDARD, FULL)}  # profiles by name


def _recipes() -> dict[str, tuple[Study, Recipe]]:
    """Every run of a report by name, with the study that it is of, in order of execution."""
    placed = [(study, recipe) for study in (*studies().values(), CELLS) for recipe in study.recipes]
    return {recipe.name: (study, recipe) for study, recipe in sorted(placed, key=_order)}


def _order(placed: tuple[Study, Recipe]) -> int:
    return placed[1].order


RECIPES = _recipes()
