"""How much is computed for a report: a look, the design as it stands, or everything.

The studies that a report is made of: what each asks for, and when it does not apply.
"""

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
    """What a report spends on its studies."""

    name: str  # by which it is asked for
    told: str  # one line of what it means, for people
    points: int | None  # most points along an axis of the map; None for those of the design
    # cells of the map that are simulated again with the reference solver; None for as many as the
    # design says
    audited: int | None
    realizations: int | None  # most draws over the map; None for those of the design
    lanes: int  # most lanes over the map and all draws
    setting: int  # draws at the design's own setting alone
    # lanes under uncertainty that are simulated again; None for as many as cells
    drawn_audit: int | None
    sensitivity: bool  # whether Sobol indices are computed where the design asks for them
    # whether the cases of the design are compared, and its gains tuned
    compared: bool
    tuned: bool

    def applied(self, design: Design) -> Design:
        """The design with its map and draws cut down to what the profile spends."""
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
        """So many that neither their own bound nor that of the lanes is passed."""
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
        if table.sampling == "sobol":  # whose points come in powers of two
            each = 1 << (each.bit_length() - 1)
        return each * table.replicates


QUICK = Profile(
    name="quick", told="a look: a map of 21 x 21 cells, 200 draws, no comparison, no tuning",
    points=21, audited=4, realizations=200, lanes=1_000_000, setting=2000, drawn_audit=0,
    sensitivity=False, compared=False, tuned=False,
)  # fmt: skip
STANDARD = Profile(
    name="standard", told="the design's own map; its draws up to four million lanes",
    points=None, audited=None, realizations=None, lanes=4_000_000, setting=10_000,
    drawn_audit=None, sensitivity=True, compared=False, tuned=False,
)  # fmt: skip
FULL = Profile(
    name="full", told="everything the design asks for, comparison and tuning included",
    points=None, audited=None, realizations=None, lanes=1_000_000_000, setting=10_000,
    drawn_audit=None, sensitivity=True, compared=True, tuned=True,
)  # fmt: skip

PROFILES = {profile.name: profile for profile in (QUICK, STANDARD, FULL)}
"""Profiles by name."""


def _applies(asked: Requested) -> str:
    return ""


def _as_asked(asked: Requested) -> Design:
    return asked.design


def _summary(result: Any) -> dict[str, Any]:
    return dict(result.summary())


class Recipe(NamedTuple):
    """One study of a report."""

    name: str  # of its folder
    title: str  # what it is called in messages
    verb: str  # command that would make the same folder
    # the result, from its design, its folder and the progress
    compute: Callable[[Design, RunFolder, Progress], Any]
    missing: Callable[[Requested], str] = _applies  # why it does not apply; empty where it does
    variant: Callable[[Requested], Design] = _as_asked  # the design that is studied
    needs: tuple[str, ...] = ()  # studies that must be done before
    # what the result depends on beside its design
    settings: Mapping[str, Any] = MappingProxyType({})
    growing: bool = False  # whether more draws may be added later
    grows: Callable[[Design], Any] | None = None
    write: bool = True  # whether the result is one that the store writes
    told: Callable[[Any], dict[str, Any]] = _summary  # the summary of a result


def level_of(design: Design) -> float:
    """The level of J1 (s) that a setting is judged by."""
    return design.tables.tune.level


def _both(*reasons: Callable[[Requested], str]) -> Callable[[Requested], str]:
    return lambda asked: next((why for reason in reasons if (why := reason(asked))), "")


def _cells(design: Design, folder: RunFolder, progress: Progress) -> Any:
    return cells.traced(design, folder.path, progress)


def _setting(design: Design, folder: RunFolder, progress: Progress) -> Any:
    return drillctl.uncertainty(design, axes=(), audit_cells=0, progress=progress)


def _told_of_setting(result: Any) -> dict[str, Any]:
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


def _at_setting(asked: Requested) -> Design:
    """The design with more draws at its own gains, and its level among those that are counted."""
    design, level = asked.design, level_of(asked.design)
    levels = sorted({*design.tables.map.levels, level})
    # Nothing that a map under uncertainty has beyond its draws.
    values: dict[str, Any] = {
        "map.levels": levels, "uncertainty.sampling": "monte-carlo",
        "uncertainty.realizations": asked.profile.setting, "uncertainty.sensitivity": None,
        "uncertainty.until": None, "uncertainty.axes": [], "uncertainty.contours": False,
        "uncertainty.keep": [],
    }  # fmt: skip
    return design.replace(values)


def _no_cases(asked: Requested) -> str:
    if not asked.design.tables.compare.cases:
        return "the design names no cases to compare ([compare])"
    if not asked.profile.compared:
        return "cases are compared with --profile full"
    return ""


def _not_tuned(asked: Requested) -> str:
    if not asked.profile.tuned:
        return "gains are tuned with --profile full"
    if not hasattr(drillctl, "tune"):
        return "this version does not tune gains"
    return ""


def _not_weighed(asked: Requested) -> str:
    if not asked.profile.compared or not hasattr(drillctl, "advantage"):
        return "the benefit of a moving weight on bit was not studied"
    if "advantage" not in asked.design.tree:
        return "the design does not ask for it ([advantage])"
    return ""


def _by_name(verb: str) -> Callable[[Design, RunFolder, Progress], Any]:
    def compute(design: Design, folder: RunFolder, progress: Progress) -> Any:
        return getattr(drillctl, verb)(design, progress=progress)

    return compute


def _compared(design: Design, folder: RunFolder, progress: Progress) -> Any:
    return drillctl.compare(design, progress=progress)


ALL = (
    Recipe("setting", "the draws at the current setting", "uncertainty", _setting, in_batch,
           _at_setting, settings={"axes": []}, told=_told_of_setting),
    Recipe("cells", "the responses over the map", "report-cells", _cells, fitting_map,
           needs=("map",), write=False, told=dict),
    Recipe("compare", "the comparison", "compare", _compared, _both(_no_cases, in_batch)),
    Recipe("tune", "the tuning of the gains", "tune", _by_name("tune"),
           _both(_not_tuned, in_batch)),
    Recipe("advantage", "the benefit of a moving weight", "advantage", _by_name("advantage"),
           _both(_not_weighed, in_batch)),
)  # fmt: skip
"""Every study that is no object yet, in the order in which they are done."""
_ORDER = {
    "setting": 30, "cells": 50, "compare": 100, "tune": 110, "advantage": 120,
}  # fmt: skip


def _of(study: Study, recipe: base.Recipe) -> Recipe:
    options = study.defaults() | dict(recipe.options)

    def compute(design: Design, folder: RunFolder, progress: Progress) -> Any:
        return study.compute(design, Run(options, progress, folder.path))

    return Recipe(
        recipe.name, recipe.title, study.name, compute, recipe.missing, recipe.variant,
        recipe.needs, study.settings(options), told=recipe.summary, grows=study.growing,
    )  # fmt: skip


def _recipes() -> dict[str, Recipe]:
    """Every study of a report by name, in the order in which they are done."""
    placed = [(_ORDER[recipe.name], recipe) for recipe in ALL]
    placed += [
        (one.order, _of(study, one)) for study in studies().values() for one in study.recipes
    ]
    return {recipe.name: recipe for _, recipe in sorted(placed, key=lambda pair: pair[0])}


RECIPES = _recipes()
