"""What a study is: one object that commands, folders, reports and Python are driven by.

A study is a package below `drillctl.studies`, named in `drillctl.registry.STUDIES`. Its
`__init__.py` holds `STUDY = Study(...)` and imports nothing heavy: what computes or draws is
imported inside its functions, which the object knows by their names. From this object follow the
command with its options and help, the folder of a run and its resumption, tables on the terminal
and as CSV, pictures, the JSON summary, `drillctl.open`, `drillctl.NAME` and the section of the
report.

Usual files of a package: `__init__.py` with `STUDY` and the functions that it names, `compute.py`
with the result class and the computation, `settings.py` with the keys of the design file. Orders
of recipes and sections in a report come in tens, see `reporting`: recipes modes 0, loop 10,
simulate 20, setting 30, map 40, cells 50, best 60, bad 70, slope-margin 80, regions 85,
uncertainty 90, compare 100, tune 110, advantage 120, doctor 130, meshes and steps from 140 on;
sections summary 0, rig 10, operating point 20, modes 30, loop 40, map 50, responses 60, regions
65, uncertainty 70, sensitivity 80, tuning 90, comparison 100, advantage 110, audit 120, glossary
130.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from drillctl import registry
from drillctl.progress import SILENT, Progress
from drillctl.store.tables import Column, Table, Told

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drillctl import units
    from drillctl.design import Design
    from drillctl.ensemble.audit import Audit
    from drillctl.store.folder import Growing

Group = Literal["Describe a rig", "Analyse the loop", "Simulate", "Decide", "Hand over"]
"""What a person wants to do; commands are listed under it."""


class Option(NamedTuple):
    """An option of a command.

    An option with `sets` changes the design. Any other goes to `compute` in `Run.options`, and
    makes another run of the same design unless it is its default or `how`.
    """

    name: str  # in Python: `allow_other_machine` is --allow-other-machine
    type: Any
    help: str  # verb first, at most 60 characters
    default: Any = None
    sets: str = ""  # dotted path of the design
    how: bool = False  # whether it only says how to compute: the result is the same
    metavar: str | None = None
    least: float | None = None
    opposite: str = ""  # name of the flag that says no
    formerly: str = ""  # flag of an earlier version, which does the same
    files: bool = False  # whether it is a list of files, whose content makes a run another one

    @property
    def flag(self) -> str:
        """As it is written on the command line."""
        return f"--{self.name.replace('_', '-')}"


DRAWS = Option("realizations", int, "Use this many draws", sets="uncertainty.realizations")
SEED = Option("seed", int, "Draw with this seed", sets="uncertainty.seed")
OTHER_MACHINE = Option(
    "allow_other_machine", bool, "Resume with other packages or processors", False, how=True,
    formerly="--allow-mixed",
)  # fmt: skip
"""Of every study that resumes."""


@dataclass(frozen=True)
class Run:
    """How to compute a study once."""

    options: Mapping[str, Any] = field(default_factory=dict)  # by `Option.name`, defaults included
    progress: Progress = SILENT
    folder: Path | None = None  # where finished blocks may be kept
    system: units.System = "si"  # of interim pictures
    verbose: bool = False


class Picture(NamedTuple):
    """A picture of a result."""

    name: str  # of its file
    caption: str  # what it shows
    alt: str  # the same in words, with what it says
    draw: Callable[[units.System], Figure]
    paper: bool = False  # whether it needs light paper, as maps with dark contours do


class Check(NamedTuple):
    """A question about a result, with its answer."""

    question: str
    answer: bool | None  # None: undecided
    detail: str  # the numbers

    @property
    def word(self) -> str:
        """The answer in a word."""
        return "open" if self.answer is None else "yes" if self.answer else "no"


@dataclass(frozen=True)
class Requested:
    """A study that a report needs."""

    design: Design
    profile: Any  # `reporting.gather.Profile`
    done: Mapping[str, Any]  # studies before it, by name

    def summary(self, name: str) -> dict[str, Any]:
        """Summary of a study before it."""
        result: dict[str, Any] = self.done[name].summary
        return result


def _summary(result: Any) -> dict[str, Any]:
    return dict(result.summary())


@dataclass(frozen=True)
class Recipe:
    """A run of a study for a report."""

    name: str  # of its folder
    title: str  # what messages call it
    # why it does not apply, empty where it does; and the design that is studied
    missing: Callable[[Requested], str] = lambda request: ""
    variant: Callable[[Requested], Design] = lambda request: request.design
    needs: tuple[str, ...] = ()  # recipes that must be done before
    options: Mapping[str, Any] = field(default_factory=dict)
    compute: Callable[[Design, Run], Any] | None = None  # if not that of the study
    summary: Callable[[Any], dict[str, Any]] = _summary
    # sentences from the summary, in place of all that the study shows of a result
    says: Callable[[dict[str, Any]], Iterable[str]] | None = None
    order: int = 50  # those with less are done first


@dataclass(frozen=True)
class Section:
    """A section of a report."""

    name: str  # by which it is requested
    title: str
    reads: tuple[str, ...]  # recipes
    order: int  # place among the sections
    # tables, pictures and `remarks` of the first in their order; by default remarks, checks,
    # pictures and tables of all recipes, except for what another section of the study shows
    shows: tuple[str, ...] = ()
    # why none of `shows` is there
    absent: Callable[[Design], str] = lambda design: "nothing of it was computed"
    text: str = ""  # last paragraph
    # blocks from what was gathered, for what cannot be said so
    build: Callable[[Any], tuple[Any, ...]] | None = None


FUNCTIONS = (
    "tables", "pictures", "remarks", "checks", "notes", "summary", "files", "failure", "growing",
    "check",
)  # fmt: skip
"""Of a study, by which its module may name them."""


def _none(*values: Any) -> tuple[()]:
    return ()


def _nothing(*values: Any) -> None: ...


@dataclass(frozen=True)
class Study:
    """One study.

    Its functions are those of its `module` with the name of a field, and `computed` there is
    `compute`: it takes a design and a `Run` and returns a `store.result.Result`, whose class names
    the study in `kind`. Without it `call` is called, with the options of the command by their
    names, and with `progress` and `verbose` if it takes them; by default that is the function
    called `python` in `compute.py` of the package. What a search of it runs is kept in its folder,
    if it resumes. The other functions take that result; `tables`, `pictures` and `remarks` give
    what people see, in units of theirs, `notes` what deserves attention on stderr.
    """

    name: str
    help: str
    group: Group
    compute: Callable[[Design, Run], Any] | None = None
    options: tuple[Option, ...] = ()
    axes: bool = False  # whether `--axis` sets the axes of the map
    command: bool = True  # whether it is a command of its own
    python: str = ""  # name in `drillctl`, if any
    call: str = ""  # "module:function" that it stands for
    resumes: bool = False  # whether finished blocks are kept
    tables: Callable[[Any], Iterable[Table]] = _none
    pictures: Callable[[Any], Iterable[Picture]] = _none
    remarks: Callable[[Any, units.System], Iterable[str]] = _none
    checks: Callable[[Any], Iterable[Check]] = _none  # of the numbers, for a report
    notes: Callable[[Any], Iterable[str]] = _none
    summary: Callable[[Any], dict[str, Any]] = _summary
    files: Callable[[Any, Path, units.System], None] = _nothing  # further files of a folder
    failure: Callable[[Any], str | None] = _nothing  # why the command ends with exit code 1
    growing: Callable[[Design], Growing | None] = _nothing
    check: Callable[[Design], None] = _nothing  # what `validate` refuses of its settings
    recipes: tuple[Recipe, ...] = ()
    sections: tuple[Section, ...] = ()
    system: Literal["si", "field"] = "si"  # units that people read unless they or the design say
    module: str = ""

    def __post_init__(self) -> None:
        """Take functions from the module."""
        given = vars(sys.modules[self.module]) if self.module else {}
        results = {name: given[name] for name in FUNCTIONS if name in given}
        results |= {"compute": given["computed"]} if "computed" in given else {}
        if self.module and self.python and not self.call:
            results["call"] = f"{self.module}.compute:{self.python}"
        if self.resumes:
            results["options"] = (*self.options, OTHER_MACHINE)
        for name, value in results.items():
            object.__setattr__(self, name, value)

    def settings(self, options: Mapping[str, Any]) -> dict[str, Any]:
        """What a result depends on beside its design."""
        return {
            one.name: _stamped(options[one.name]) if one.files else options[one.name]
            for one in self.options
            if not (one.sets or one.how) and options.get(one.name, one.default) != one.default
        }

    def values(self, options: Mapping[str, Any]) -> dict[str, Any]:
        """What options change in a design, by dotted path."""
        return {
            one.sets: options[one.name]
            for one in self.options
            if one.sets and options.get(one.name) is not None
        }

    def defaults(self) -> dict[str, Any]:
        """Every option at its default."""
        return {one.name: one.default for one in self.options}

    def computed(self, design: Design, run: Run) -> Any:
        """The result of a run, from the steps of a search that its folder may hold."""
        if self.compute is not None:
            return self.compute(design, run)
        function = registry.resolve(self.call)
        own = {x.name: run.options[x.name] for x in self.options if not (x.sets or x.how)}
        passed = {"progress": run.progress, "verbose": run.verbose}
        own |= {name: passed[name] for name in signature(function).parameters if name in passed}
        if "progress" not in own:
            run.progress.begin(f"computing {self.name}", 1)
        with self._kept(run.folder):
            return function(design, **own)

    def _kept(self, folder: Path | None) -> AbstractContextManager[None]:
        if not self.resumes:
            return nullcontext()
        from drillctl.ensemble.storing import kept_in

        return kept_in(folder)

    def run(self, design: Design, **options: Any) -> Any:
        """Compute without a folder, as Python does; `progress` goes to the `Run`."""
        progress = options.pop("progress", SILENT)
        return self.computed(design, Run(self.defaults() | options, progress))


def _stamped(files: Iterable[str | Path]) -> list[str]:
    """Files by name, size and date: what tells one content from another."""
    stamps = []
    for file in map(Path, files):
        with suppress(OSError):  # whoever reads it says why it cannot be read
            about = file.stat()
            stamps.append(f"{file.resolve()} {about.st_size} {about.st_mtime_ns}")
    return stamps


@cache
def studies() -> dict[str, Study]:
    """Every registered study by name, in the order of the registry."""
    results = [import_module(module).STUDY for module in registry.STUDIES]
    return {study.name: study for study in results}


def fitting_map(request: Requested) -> str:
    """Why the default map does not fit a design that names no axes of its own."""
    from drillctl.ensemble.grid import axes_of
    from drillctl.errors import InputError

    try:
        axes_of(request.design)
    except InputError as error:
        return f"its map does not fit this design ({error.problem}); name other axes in [map]"
    return ""


def mapped_in_batch(request: Requested) -> str:
    """Why no map by the batch engine applies."""
    return in_batch(request) or fitting_map(request)


def over_two_axes(request: Requested) -> str:
    """Why no map over two parameters applies."""
    from drillctl.design import axis_tables

    if reason := fitting_map(request):
        return reason
    count = len(axis_tables(request.design))
    return "" if count == 2 else f"it is shown over two parameters, this map has {count}"


def in_batch(request: Requested) -> str:
    """Why the batch engine does not apply."""
    if request.design.tables.bit_rock.law == "printed-three-branch":
        return "the batch engine does not take the friction law printed-three-branch"
    return ""


def audited(audit: Audit, what: str, cells: str) -> Iterator[Check]:
    """Whether the reference solver agrees, if anything was audited."""
    if len(audit.cells):
        detail = audit.sentence(cells).removeprefix(f"audit: {audit.verdict}, ")
        question = f"Does the reference solver agree with {what}?"
        yield Check(question, audit.verdict == "ok", detail)


def doubted(audit: Audit) -> Iterator[str]:
    """What deserves attention in an audit."""
    if audit.verdict == "check":
        reasons = [f"the reference solver fails in {n}"] if (n := audit.failed.sum()) else []
        reasons += [f"the engines differ in {', '.join(audit.wrong)}"] if audit.wrong else []
        if audit.unsettled:
            reasons.append(f"the step is too long for {', '.join(audit.unsettled)}")
        yield f"audit: check: {'; '.join(reasons)}"


def levels_any_run_keeps(design: Design, levels: Iterable[float]) -> Iterator[str]:
    """A warning of levels of J1 that even a bit at rest keeps, as the runs are so short."""
    table = design.tables.simulation
    longest = table.duration - table.j1_from
    empty = [f"{level:g}" for level in levels if level >= longest]
    if empty:
        yield (
            f"warning: a bit that never turns has a J1 of {longest:g} s in these runs, so that J1 "
            f"under {', '.join(empty)} s says nothing; lengthen simulation.duration or lower the "
            "level"
        )


def audit_tables(
    audit: Audit, place: Callable[[int], str], ending: str = "", of: str = ""
) -> Iterator[Table]:
    """What was compared, and where one stick more or less decides."""
    from drillctl.ensemble.audit import measure_label

    if not len(audit.cells):
        return
    columns = (
        Column("measure", hidden=True), Column("label", "measure"),
        Column("worst", "largest difference", digits=2),
        Column("tolerance", "tolerance", digits=2), Column("beyond", "beyond it"),
        Column("excused", "another at a finer step"),
    )  # fmt: skip
    rows = [
        [one.name, measure_label(one.name), one.worst, one.tolerance, one.beyond, one.excused]
        for one in audit.compared
    ]
    title = f"{of}audit: batch engine against reference solver, of {len(audit.cells)} {audit.of}s"
    yield Table(f"audit{ending}", title, columns, rows, shown=audit.verdict == "check")
    runs = (audit.batch, audit.finer, audit.reference)
    lines = [
        [Told(place(int(audit.cells[k]))), *(float(one["j1"][k]) for one in runs)]
        for k in audit.verge.nonzero()[0]
    ]
    heads = (
        Column(audit.of), Column("j1", "J1", "s", 6),
        Column("finer_j1", "J1 at a quarter of the step", "s", 6),
        Column("reference_j1", "J1 by the reference solver", "s", 6),
    )  # fmt: skip
    title = f"{of}audited {audit.of}s on the verge, where one stick more or less decides"
    yield Table(f"verge{ending}", title, heads, lines, shown=bool(lines))
