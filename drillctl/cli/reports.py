"""The verb that turns a design into a report."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from drillctl.cli import console, running
from drillctl.cli.options import Options, computing

if TYPE_CHECKING:
    from drillctl.design import Design


@partial(computing, system="field")
def report(
    design: Design,
    options: Options,
    profile: Annotated[
        Literal["quick", "standard", "full"], typer.Option("--profile", help="How much to compute.")
    ] = "quick",
    sections: Annotated[
        str | None,
        typer.Option("--sections", metavar="NAME,NAME", help="Write only these sections."),
    ] = None,
    title: Annotated[
        str | None, typer.Option("--title", help="Title instead of the design's own.")
    ] = None,
    formats: Annotated[
        list[str] | None,
        typer.Option("--format", metavar="html|pdf|md", help="What to write; repeatable."),
    ] = None,
) -> None:
    """Full report: verdict, figures, accuracy audit."""
    from drillctl.reporting import report as made

    with console.progress() as bar, running.library_output_on_stderr():
        found = made(
            design,
            options.out,
            profile=profile,
            sections=None if sections is None else sections.split(","),
            title=title,
            formats=formats or ["html"],
            system=options.units,
            progress=bar,
        )
    for problem in found.problems:
        console.note(f"warning: {problem}")
    for reason in found.unwritten.values():
        console.note(f"warning: {reason}")
    if options.json:
        console.emit(found.summary())
        console.note(f"results: {found.folder}")
    else:
        console.line(f"the current setting {found.content['verdict']['current_setting']}")
        for path in found.files.values():
            console.line(f"report: {path}")
        console.line(f"results: {found.folder}")
    if found.interrupted:
        raise typer.Exit(130)
    if found.problems or found.unwritten:
        raise typer.Exit(1)
