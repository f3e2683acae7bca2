"""The command that writes the report of a design."""

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
        Literal["quick", "standard", "full"],
        typer.Option("--profile", help="Set how much to compute."),
    ] = "quick",
    sections: Annotated[
        str | None,
        typer.Option("--sections", metavar="NAME,NAME", help="Write only these sections."),
    ] = None,
    title: Annotated[
        str | None, typer.Option("--title", help="Set the title of the report.")
    ] = None,
    formats: Annotated[
        list[str] | None,
        typer.Option("--format", metavar="html|pdf|md", help="Write this format; repeatable."),
    ] = None,
) -> None:
    """Full report: verdict, figures, accuracy audit."""
    from drillctl.reporting import report as write_report

    with console.progress() as bar, running.library_output_on_stderr():
        result = write_report(
            design,
            options.out,
            profile=profile,
            sections=None if sections is None else sections.split(","),
            title=title,
            formats=formats or ["html"],
            system=options.units,
            progress=bar,
        )
    for problem in result.problems:
        console.note(f"warning: {problem}")
    for reason in result.unwritten.values():
        console.note(f"warning: {reason}")
    if options.json:
        console.emit(result.summary())
        console.note(f"results: {result.folder}")
    else:
        console.line(f"the current setting {result.content['verdict']['current_setting']}")
        for path in result.files.values():
            console.line(f"report: {path}")
        console.line(f"results: {result.folder}")
    if result.interrupted:
        raise typer.Exit(130)
    if result.problems or result.unwritten:
        raise typer.Exit(1)
