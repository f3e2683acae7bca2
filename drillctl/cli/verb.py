"""The generic command of a study: claim a folder, compute, conclude; then draw and print."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drillctl import units
from drillctl.cli import console
from drillctl.cli.options import (
    Common,
    Debug,
    Json,
    Out,
    Sets,
    Threads,
    Units,
    Verbose,
    command_of,
    common_options,
    loaded,
    warn,
    with_warnings,
)
from drillctl.errors import InputError
from drillctl.store.json_files import replaced
from drillctl.studies.base import Run, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drillctl.design import Design
    from drillctl.store import RunFolder

DPI = 150


def command(study: Study) -> Callable[..., None]:
    """The command of a study."""
    return command_of(
        study.name, study.help, study.options, partial(perform, study), study.axes, study.system
    )


def log(
    files: Annotated[list[str], typer.Argument(metavar="FILE...", help="Logs of one well.")],
    design: Annotated[
        str | None, typer.Option(metavar="DESIGN", help="Take string and columns from this rig.")
    ] = None,
    sets: Sets = None, out: Out = None, json: Json = False, threads: Threads = None,
    units: Units = None, verbose: Verbose = False, debug: Debug = False,
) -> None:  # fmt: skip
    """Read logs: faults, oscillations, windows ranked."""
    from drillctl.design import parse_setting
    from drillctl.studies.base import studies
    from drillctl.studies.log.compute import stand_in

    if design is None:
        values = dict(parse_setting(text) for text in sets or [])
        made = stand_in(Path(files[0]).stem, values)
    else:
        made = loaded(design, sets)
    common = common_options(out, json, threads, units or made.tables.units, verbose, debug)
    perform(studies()["log"], made, {"files": files, "known": design is not None}, common)


def perform(study: Study, design: Design, options: dict[str, Any], common: Common) -> None:
    """Run a study in its folder, or show the finished run again."""
    from drillctl import store

    values = study.values(options)
    design = design.replace(values) if values else design
    _refuse_nothing_to_resume(options, common.out)
    with store.claim(
        study.name, design, common.out, study.growing(design),
        bool(options.get("allow_other_machine")), **study.settings(options),
    ) as folder:  # fmt: skip
        if folder.finished:
            result = store.open(folder.path)
            _show(study, result, folder.summary(), common)
            _check_beside(study, result, folder, common)
            console.note(f"already done: {folder.shown}")
        else:
            result = _computed(study, design, options, folder, common)
            _write_beside(study, result, folder, common)
            for note in study.notes(result):
                console.note(units.told(note, common.units))
            _show(study, result, folder.summary(), common)
            (console.note if common.json else console.line)(f"results: {folder.shown}")
    failure = study.failure(result)
    if failure is not None:
        console.note(f"drillctl: {units.told(failure, common.units)}")
        raise typer.Exit(1)


def _refuse_nothing_to_resume(options: dict[str, Any], out: Path | None) -> None:
    from drillctl.store.folder import resolved

    if not options.get("resume"):
        return
    if out is None:
        raise InputError("requires --out, the folder of the run to resume", "--resume")
    if not (resolved(out) / "run.json").is_file():
        raise InputError(f"{out} holds no run to resume", "--resume")


def _computed(
    study: Study, design: Design, options: dict[str, Any], folder: RunFolder, common: Common
) -> Any:
    """Compute a study and conclude its run, before anything of it is shown."""
    with guarded(folder, study):
        with console.progress() as bar, console.library_output_on_stderr():
            run = Run(options, bar, folder.path, common.units, common.verbose)
            result = study.computed(design, run)
        folder.conclude(result, with_warnings(study.summary(result), result.design))
    return result


def _write_beside(study: Study, result: Any, folder: RunFolder, common: Common) -> None:
    """Write tables, pictures and further files of a result that is safe: a failure is a note."""
    from drillctl.store.tables import write_csv

    def tables() -> None:
        for table in study.tables(result):
            write_csv(table, folder.path, common.units)

    def pictures() -> None:
        for picture in study.pictures(result):
            with _noted(f"{picture.name}.png"):
                draw(picture.draw(common.units), folder.path / f"{picture.name}.png")

    parts = {"tables": tables, "pictures": pictures,
             "further files": lambda: study.files(result, folder.path, common.units)}  # fmt: skip
    with _noted("pictures and tables"), folder.beside():
        for name, write in parts.items():
            with _noted(name):
                write()


@contextmanager
def _noted(what: str) -> Iterator[None]:
    try:
        yield
    except Exception as error:  # whatever a picture or a disk may raise
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        console.note(f"warning: {what}: not written: {reason}; the results are safe")


def _check_beside(study: Study, result: Any, folder: RunFolder, common: Common) -> None:
    """Note tables and pictures that were changed; write those that a kill left out."""
    changed = folder.changed()
    if changed is None and folder.lock is not None:
        _write_beside(study, result, folder, common)
    for problem in changed or ():
        console.note(f"warning: {problem}")


def draw(figure: Figure, path: Path) -> None:
    """Write a figure atomically."""
    from drillctl.plots.style import lay_out

    lay_out(figure, DPI)
    with replaced(path) as part:
        figure.savefig(part, dpi=DPI, format="png")


def _show(study: Study, result: Any, summary: dict[str, Any], common: Common) -> None:
    """Print the summary as JSON, or tables and remarks; the warnings of the design."""
    warn(result.design, common.units)
    if common.json:
        console.emit(with_warnings(summary, result.design))
        return
    title = result.design.tables.title or result.design.name
    for number, table in enumerate(one for one in study.tables(result) if one.shown):
        said = table.said(common.units)
        head = f"{title}: {said}" if number == 0 else said
        console.table(head, table.heads(common.units), table.texts(common.units))
    for remark in study.remarks(result, common.units):
        console.line(remark)


@contextmanager
def guarded(folder: RunFolder, study: Study) -> Iterator[None]:
    """Discard the folder of a run that failed, except for finished blocks."""
    try:
        yield
    except KeyboardInterrupt:
        if study.resumes:
            console.note(f"finished blocks are kept; to resume, repeat with --out {folder.shown}")
        else:
            folder.discard()
        raise
    except BaseException:
        folder.discard()
        raise
