"""Profiles of a report (quick, standard, full); its studies in their folders: read, or else run."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import drillctl
from drillctl import store, units
from drillctl.design import Design, axis_tables
from drillctl.design.tables import AxisTable
from drillctl.errors import DrillctlError, InputError
from drillctl.progress import SILENT, Progress
from drillctl.reporting.blocks import Block, Text, Words, block, figure
from drillctl.reporting.cells import CELLS
from drillctl.store.json_files import read_json
from drillctl.studies.base import Check, Recipe, Requested, Run, studies
from drillctl.studies.base import Study as Kind

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
        axes = _axes_that_fit(design)
        if self.points is not None and any(axis.points > self.points for axis in axes):
            values["map.axes"] = [
                {
                    "path": axis.path, "min": axis.min, "max": axis.max,
                    "points": min(axis.points, self.points),
                }
                for axis in axes
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
        for axis in (*_axes_that_fit(design), *table.axes):
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


def _axes_that_fit(design: Design) -> tuple[AxisTable, ...]:
    try:
        return axis_tables(design)
    except InputError:  # the map is left out, with this reason
        return ()


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


def _recipes() -> dict[str, tuple[Kind, Recipe]]:
    """Every run of a report by name, with the study that it is of, in order of execution."""
    placed = [(study, recipe) for study in (*studies().values(), CELLS) for recipe in study.recipes]
    placed.sort(key=lambda pair: pair[1].order)
    return {recipe.name: (study, recipe) for study, recipe in placed}


RECIPES = _recipes()

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
        return opened(self.folder, self.key)

    @property
    def key(self) -> str:
        """Identifies the run: identity, count of draws."""
        about = read_json(self.folder / "run.json")
        return f"{about['identity']}{about.get('count', '')}"


@lru_cache(4)
def opened(folder: Path, key: str) -> Any:
    """A result on disk; `key` says which it is."""
    return store.open(folder)


def drawn(pictures: Any, folder: Path, key: str, name: str, system: units.System) -> Figure:
    """A picture of a result on disk, one of those that a study makes of it."""
    found: Figure = next(
        one.draw(system) for one in pictures(opened(folder, key)) if one.name == name
    )
    return found


class Shown(NamedTuple):
    """What a report may show of a study."""

    remarks: tuple[Text, ...]
    checks: tuple[Check, ...]
    parts: tuple[tuple[str, Block, bool], ...]  # name, picture or table, whether unless asked for


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

    def shown(self, name: str) -> Shown:
        """What a finished study shows of its result; nothing without it."""
        study, (kind, recipe) = self.have(name), RECIPES[name]
        if study is None:
            return Shown((), (), ())
        if recipe.says is not None:
            return Shown(tuple(map(Text, recipe.says(study.summary))), (), ())
        result, system = study.result, self.words.system
        said = tuple(Text(one[0].upper() + one[1:]) for one in kind.remarks(result, system))
        draw = partial(drawn, kind.pictures, study.folder, study.key, system=system)
        pictures = [
            (one.name, figure(one, name, partial(draw, name=one.name), system), True)
            for one in kind.pictures(result)
        ]
        made = [(one.name, block(one, system), one.shown) for one in kind.tables(result)]
        tables = [one for one in made if one[1].rows]
        checks = (c._replace(detail=units.told(c.detail, system)) for c in kind.checks(result))
        return Shown(said, tuple(checks), (*pictures, *tables))

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
        return ended("failed", explained(error))
    options = study.defaults() | dict(recipe.options)
    with store.claim(
        study.name, design, place, study.growing(design), **study.settings(options)
    ) as run:
        if run.finished:
            return ended("done")
        try:
            compute = recipe.compute or study.computed
            result = compute(design, Run(options, progress, run.path))
            run.conclude(result, recipe.summary(result))
        except KeyboardInterrupt:
            return ended("interrupted", INTERRUPTED)
        except Exception as error:  # one study less, whatever it raises
            run.discard()
            return ended("failed", explained(error))
    return ended("done")


_LISTS = re.compile(r"[;,.]?\s*(?:did you mean '[^']*'\? )?allowed: .*$|^[^:\s]+\.toml:(?:\d+:)? ")


def explained(error: BaseException) -> str:
    """Why a study failed, as the end of a sentence: no list of keys, no file of its own."""
    if isinstance(error, MemoryError):
        return "there is not enough memory"
    known = isinstance(error, (DrillctlError, ArithmeticError, ValueError))
    first = (str(error).splitlines() or [""])[0]
    text = _LISTS.sub("", _LISTS.sub("", first)).rstrip(" .;:")
    if known and text:
        return text
    return f"an error of the program itself ({type(error).__name__}{f', {text}' if text else ''})"
