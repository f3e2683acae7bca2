"""The studies that a report is made of: what each asks for, and when it does not apply."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import drillctl
from drillctl.design import Design
from drillctl.reporting import cells
from drillctl.studies import base
from drillctl.studies.applies import fitting_map, in_batch, over_two_axes
from drillctl.studies.base import Requested, Run, Study, studies

if TYPE_CHECKING:
    from drillctl.progress import Progress
    from drillctl.store import RunFolder


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


def _swept(design: Design, folder: RunFolder, progress: Progress) -> Any:
    from drillctl import studies
    from drillctl.ensemble.storing import Folder

    return studies.sweep(design, progress=progress, store=Folder(folder.path))


def _cells(design: Design, folder: RunFolder, progress: Progress) -> Any:
    return cells.traced(design, folder.path, progress)


def _uncertain(design: Design, folder: RunFolder, progress: Progress) -> Any:
    from drillctl import studies
    from drillctl.ensemble.storing import Folder

    return studies.uncertainty(design, progress=progress, store=Folder(folder.path))


def _under_uncertainty(asked: Requested) -> Design:
    """The design with as many audited lanes as the profile spends."""
    if asked.profile.drawn_audit is None:
        return asked.design
    return asked.design.replace({"map.audit_cells": asked.profile.drawn_audit})


def _setting(design: Design, folder: RunFolder, progress: Progress) -> Any:
    from drillctl import studies

    return studies.uncertainty(design, axes=(), audit_cells=0, progress=progress)


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


def _moded(design: Design, folder: RunFolder, progress: Progress) -> Any:
    return drillctl.modes(design)


def _looped(design: Design, folder: RunFolder, progress: Progress) -> Any:
    progress.begin("analysing the loop", 1)
    return drillctl.loop(design)


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


def _loop_map(design: Design, folder: RunFolder, progress: Progress) -> Any:
    from drillctl import studies

    return studies.loop_map(design, quantities=("slope_margin",), progress=progress)


ALL = (
    Recipe("modes", "the modes", "modes", _moded, settings={"count": 10}),
    Recipe("loop", "the loop", "loop", _looped),
    Recipe("setting", "the draws at the current setting", "uncertainty", _setting, in_batch,
           _at_setting, settings={"axes": []}, told=_told_of_setting),
    Recipe("map", "the J1 map", "map", _swept, _both(in_batch, fitting_map)),
    Recipe("cells", "the responses over the map", "report-cells", _cells, fitting_map,
           needs=("map",), write=False, told=dict),
    Recipe("slope-margin", "the slope margin over the map", "loop-map", _loop_map, over_two_axes),
    Recipe("uncertainty", "the map under uncertainty", "uncertainty", _uncertain,
           _both(in_batch, fitting_map), _under_uncertainty, growing=True),
    Recipe("compare", "the comparison", "compare", _compared, _both(_no_cases, in_batch)),
    Recipe("tune", "the tuning of the gains", "tune", _by_name("tune"),
           _both(_not_tuned, in_batch)),
    Recipe("advantage", "the benefit of a moving weight", "advantage", _by_name("advantage"),
           _both(_not_weighed, in_batch)),
)  # fmt: skip
"""Every study, in the order in which they are done."""


_ORDER = {
    "modes": 0, "loop": 10, "setting": 30, "map": 40, "cells": 50, "slope-margin": 80,
    "uncertainty": 90, "compare": 100, "tune": 110, "advantage": 120,
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
