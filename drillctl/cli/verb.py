"""The generic command of a study: claim a folder, show again or compute, write, draw, print."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from drillctl.cli import console
from drillctl.cli.options import Common, command_of, warn, with_warnings
from drillctl.errors import InputError
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


def perform(study: Study, design: Design, options: dict[str, Any], common: Common) -> None:
    """Run a study in its folder, or show the finished run again."""
    from drillctl import store

    values = study.values(options)
    design = design.replace(values) if values else design
    _refuse_nothing_to_resume(options, common.out)
    folder = store.claim(
        study.name, design, common.out, study.growing(design),
        bool(options.get("allow_mixed")), **study.settings(options),
    )  # fmt: skip
    if folder.finished:
        result = store.open(folder.path)
        _show(study, result, folder.summary(), common)
        console.note(f"already done: {folder.path}")
    else:
        with guarded(folder, study), console.progress() as bar, console.library_output_on_stderr():
            run = Run(options, bar, folder.path, common.units, common.verbose)
            result = study.computed(design, run)
        _write(study, result, folder, common)
        for note in study.notes(result):
            console.note(note)
        summary = with_warnings(study.summary(result), result.design)
        folder.finish(summary)
        _show(study, result, summary, common)
        (console.note if common.json else console.line)(f"results: {folder.path}")
    failure = study.failure(result)
    if failure is not None:
        console.note(f"drillctl: {failure}")
        raise typer.Exit(1)


def _refuse_nothing_to_resume(options: dict[str, Any], out: Path | None) -> None:
    if not options.get("resume"):
        return
    if out is None:
        raise InputError("requires --out, the folder of the run to resume", "--resume")
    if not (out / "run.json").is_file():
        raise InputError(f"{out} holds no run to resume", "--resume")


def _write(study: Study, result: Any, folder: RunFolder, common: Common) -> None:
    """Write data, tables, figures and further files of a result."""
    from drillctl.store.tables import write_csv

    result.write(folder.path)
    for table in study.tables(result):
        write_csv(table, folder.path)
    for picture in study.pictures(result):
        draw(picture.draw(common.units), folder.path / f"{picture.name}.png")
    study.files(result, folder.path)


def draw(figure: Figure, path: Path) -> None:
    """Write a figure atomically."""
    from drillctl.plots.style import lay_out

    part = path.with_suffix(".part")
    lay_out(figure, DPI)
    figure.savefig(part, dpi=DPI, format="png")
    part.replace(path)


def _show(study: Study, result: Any, summary: dict[str, Any], common: Common) -> None:
    """Print the summary as JSON, or tables and remarks; the warnings of the design."""
    warn(result.design)
    if common.json:
        console.emit(with_warnings(summary, result.design))
        return
    title = result.design.tables.title or result.design.name
    for number, table in enumerate(one for one in study.tables(result) if one.shown):
        head = f"{title}: {table.title}" if number == 0 else table.title
        console.table(head, table.heads(common.units), table.texts(common.units))
    for remark in study.remarks(result, common.units):
        console.line(remark)


@contextmanager
def guarded(folder: RunFolder, study: Study) -> Iterator[None]:
    """Discard the folder of an invalid run; keep that of an interrupted one that can resume."""
    try:
        yield
    except InputError:
        folder.discard()
        raise
    except KeyboardInterrupt:
        if study.resumes:
            console.note(f"finished blocks are kept; to resume, repeat with --out {folder.path}")
        else:
            folder.discard()
        raise
