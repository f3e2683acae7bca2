"""The studies of a report in their folders: read if finished, else run."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import drillctl
from drillctl import store
from drillctl.design import Design
from drillctl.errors import DrillctlError, InputError
from drillctl.progress import SILENT, Progress
from drillctl.reporting.recipes import RECIPES, Profile
from drillctl.reporting.words import Words
from drillctl.store.json_files import read_json
from drillctl.store.result import Result
from drillctl.studies.base import Recipe, Requested, Run
from drillctl.studies.base import Study as Kind

State = Literal["done", "failed", "interrupted", "left_out", "not_requested"]


class NotThereError(DrillctlError):
    """A study that a section needs is missing."""

    def __init__(self, why: str) -> None:
        self.why = why
        super().__init__(why)


@dataclass(frozen=True)
class Study:
    """One study of a report."""

    # of its folder, and in messages
    name: str
    title: str
    state: State
    why: str  # reason, if it is not done
    folder: Path  # where it is

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Its `summary.json`."""
        result: dict[str, Any] = read_json(self.folder / "summary.json")
        return result

    @cached_property
    def result(self) -> Any:
        """The whole result, read back."""
        return store.open(self.folder)

    @property
    def key(self) -> str:
        """Identifies the run: identity, count of draws."""
        about = read_json(self.folder / "run.json")
        return f"{about['identity']}{about.get('count', '')}"


@dataclass(frozen=True)
class Gathered:
    """A design with its studies, the input of the sections."""

    design: Design  # reduced by the profile
    requested: Design  # as given
    profile: Profile  # of the report
    words: Words  # units of the reader
    studies: dict[str, Study] = field(repr=False)  # by name

    def need(self, name: str) -> Study:
        """A finished study; `NotThereError` if there is none."""
        study = self.studies[name]
        if study.state != "done":
            raise NotThereError(study.why)
        return study

    def have(self, name: str) -> Study | None:
        """A finished study, or None."""
        study = self.studies[name]
        return study if study.state == "done" else None

    def key(self, names: Iterable[str]) -> str:
        """Hash that identifies a figure of some studies."""
        parts = [drillctl.__version__, self.words.system, store.identity("report", self.design)]
        parts += [self.studies[name].key for name in names]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()

    @property
    def problems(self) -> tuple[str, ...]:
        """Failed or interrupted studies, with reasons."""
        return tuple(
            f"{one.title[0].upper()}{one.title[1:]} {_PARTIAL[one.state]}: {one.why}"
            for one in self.studies.values()
            if one.state in _PARTIAL
        )


_PARTIAL = {"failed": "failed", "interrupted": "is not finished"}
INTERRUPTED = "the report was interrupted; repeat the command with the same folder to resume"


def gather(
    design: Design,
    profile: Profile,
    folder: Path,
    wanted: Iterable[str],
    words: Words,
    progress: Progress = SILENT,
) -> Gathered:
    """Read or run the studies of a report."""
    cut = profile.applied(design)
    names = _with_needs(wanted)
    results: dict[str, Study] = {}
    interrupted = False
    for study, recipe in RECIPES.values():
        place = folder / recipe.name
        if recipe.name not in names:
            why = "it was not requested"
            results[recipe.name] = Study(recipe.name, recipe.title, "not_requested", why, place)
        elif interrupted and not _finished(place):
            results[recipe.name] = Study(
                recipe.name, recipe.title, "interrupted", INTERRUPTED, place
            )
        else:
            requested = Requested(cut, profile, results)
            results[recipe.name] = _study(study, recipe, requested, place, progress)
            interrupted |= results[recipe.name].state == "interrupted"
    return Gathered(cut, design, profile, words, results)


def _with_needs(wanted: Iterable[str]) -> set[str]:
    names: set[str] = set()
    waiting = list(wanted)
    while waiting:
        name = waiting.pop()
        if name not in names:
            names.add(name)
            waiting += RECIPES[name][1].needs
    return names


def _finished(place: Path) -> bool:
    try:
        return bool(read_json(place / "run.json").get("finished"))
    except InputError:
        return False


def _study(
    study: Kind, recipe: Recipe, requested: Requested, place: Path, progress: Progress
) -> Study:
    """Read or run one study; errors become its state."""

    def ended(state: State, why: str = "") -> Study:
        return Study(recipe.name, recipe.title, state, why, place)

    lacking = [
        requested.done[name] for name in recipe.needs if requested.done[name].state != "done"
    ]
    if lacking:
        state = lacking[0].state
        why = f"{lacking[0].title} is missing: {lacking[0].why}"
        return ended("left_out" if state in ("failed", "not_requested") else state, why)
    if why := recipe.missing(requested):
        return ended("left_out", why)
    try:
        design = recipe.variant(requested)
    except InputError as error:
        return ended("failed", str(error))
    options = study.defaults() | dict(recipe.options)
    run = store.claim(study.name, design, place, study.growing(design), **study.settings(options))
    if run.finished:
        return ended("done")
    try:
        compute = recipe.compute or study.compute
        result = compute(design, Run(options, progress, run.path))
        if isinstance(result, Result):
            result.write(run.path)
        run.finish(recipe.summary(result))
    except KeyboardInterrupt:
        return ended("interrupted", INTERRUPTED)
    except (DrillctlError, ArithmeticError, MemoryError, ValueError) as error:
        run.discard()
        return ended("failed", str(error) or type(error).__name__)
    return ended("done")
