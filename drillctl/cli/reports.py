"""The command that writes the report of a design."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import typer

from drillctl.cli import console
from drillctl.cli.options import Common, command_of
from drillctl.studies.base import Option

if TYPE_CHECKING:
    from drillctl.design import Design

OPTIONS = (
    Option("profile", Literal["quick", "standard", "full"], "Set how much to compute.", "quick"),
    Option("sections", str, "Write only these sections.", metavar="NAME,NAME"),
    Option("title", str, "Set the title of the report."),
    Option("format", list[str], "Write this format; repeatable.", metavar="html|pdf|md"),
)


def _report(design: Design, given: dict[str, Any], common: Common) -> None:
    from drillctl.reporting import report as write_report

    sections = given["sections"]
    with console.progress() as bar, console.library_output_on_stderr():
        result = write_report(
            design,
            common.out,
            profile=given["profile"],
            sections=None if sections is None else sections.split(","),
            title=given["title"],
            formats=given["format"] or ["html"],
            system=common.units,
            progress=bar,
        )
    for problem in result.problems:
        console.note(f"warning: {problem}")
    for reason in result.unwritten.values():
        console.note(f"warning: {reason}")
    if common.json:
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


report = command_of(
    "report", "Full report: verdict, figures, accuracy audit", OPTIONS, _report, system="field"
)
