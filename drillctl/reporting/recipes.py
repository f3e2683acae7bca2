"""Profiles of a report (quick, standard, full), and how each of its studies is run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import drillctl
from drillctl.design import Design
from drillctl.reporting import cells
from drillctl.studies import base
from drillctl.studies.applies import fitting_map, in_batch
from drillctl.studies.base import Requested, Run, Study, studies

if TYPE_CHECKING:
    from drillctl.progress import Progress
    from drillctl.store import RunFolder


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

PROFILES = {profile.name: profile for profile in (QUICK, STANDARD, FULL)}
"""Profiles by name."""


def _applies(requested: Requested) -> str:
    return ""


def _as_requested(requested: Requested) -> Design:
    return requested.design


def _summary(result: Any) -> dict[str, Any]:
    return dict(result.summary())


class Recipe(NamedTuple):
    """One study of a report."""

    name: str  # of its folder
    title: str  # in messages
    verb: str  # command that writes the same folder
    # the result, from its design, its folder and the progress
    compute: Callable[[Design, RunFolder, Progress], Any]
    missing: Callable[[Requested], str] = _applies  # why it does not apply; empty where it does
    variant: Callable[[Requested], Design] = _as_requested  # the design that is studied
    needs: tuple[str, ...] = ()  # studies that must finish before
    # further settings of the result
    settings: Mapping[str, Any] = MappingProxyType({})
    growing: bool = False  # whether draws may be added later
    grows: Callable[[Design], Any] | None = None
    summary: Callable[[Any], dict[str, Any]] = _summary  # of a result


def level_of(design: Design) -> float:
    """The level of J1 (s) of the verdict."""
    return design.tables.tune.level


def _both(*reasons: Callable[[Requested], str]) -> Callable[[Requested], str]:
    return lambda requested: next((why for reason in reasons if (why := reason(requested))), "")


def _cells(design: Design, folder: RunFolder, progress: Progress) -> Any:
    return cells.traced(design, folder.path, progress)


def _setting(design: Design, folder: RunFolder, progress: Progress) -> Any:
    return drillctl.uncertainty(design, axes=(), audit_cells=0, progress=progress)


def _setting_summary(result: Any) -> dict[str, Any]:
    level = level_of(result.design)
    share = result.probability(level)
    low, high = share.interval
    return {
        "level": level,
        "realizations": result.realizations,
        "seed": result.seed,
        "uncertain": list(result.drawn),
        "probability": float(share.probability),
        "interval_95": [float(low), float(high)],
        "failures": [{"reason": one.reason, "count": one.count} for one in result.failures],
    }


def _at_setting(requested: Requested) -> Design:
    """The design with more draws at its own gains, and the level of the verdict."""
    design, level = requested.design, level_of(requested.design)
    levels = sorted({*design.tables.map.levels, level})
    # Only the draws of the map under uncertainty.
    values: dict[str, Any] = {
        "map.levels": levels, "uncertainty.sampling": "monte-carlo",
        "uncertainty.realizations": requested.profile.setting, "uncertainty.sensitivity": None,
        "uncertainty.until": None, "uncertainty.axes": [], "uncertainty.contours": False,
        "uncertainty.keep": [],
    }  # fmt: skip
    return design.replace(values)


ALL = (
    Recipe("setting", "the draws at the current setting", "uncertainty", _setting, in_batch,
           _at_setting, settings={"axes": []}, summary=_setting_summary),
    Recipe("cells", "the responses over the map", "report-cells", _cells, fitting_map,
           needs=("map",), summary=dict),
)  # fmt: skip
"""Every study that is no object yet, in the order in which they are done."""
_ORDER = {"setting": 30, "cells": 50}


def _of(study: Study, recipe: base.Recipe) -> Recipe:
    options = study.defaults() | dict(recipe.options)

    def compute(design: Design, folder: RunFolder, progress: Progress) -> Any:
        return study.compute(design, Run(options, progress, folder.path))

    return Recipe(
        recipe.name, recipe.title, study.name, compute, recipe.missing, recipe.variant,
        recipe.needs, study.settings(options), summary=recipe.summary, grows=study.growing,
    )  # fmt: skip


def _recipes() -> dict[str, Recipe]:
    """Every study of a report by name, in order of execution."""
    placed = [(_ORDER[recipe.name], recipe) for recipe in ALL]
    placed += [
        (one.order, _of(study, one)) for study in studies().values() for one in study.recipes
    ]
    return {recipe.name: recipe for _, recipe in sorted(placed, key=lambda pair: pair[0])}


RECIPES = _recipes()
