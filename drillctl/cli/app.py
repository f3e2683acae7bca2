"""The program: options without a command, error messages and exit codes."""

from __future__ import annotations

import traceback
from typing import Annotated, Any, get_args

import typer
from typer.core import TyperGroup

from drillctl import __version__
from drillctl.cli import console
from drillctl.errors import DrillctlError, InputError
from drillctl.studies.base import Group


class GroupedCommands(TyperGroup):
    """Commands by purpose, with help lines in full."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write one section per group, in the order of the groups."""
        for group in get_args(Group):
            with formatter.section(group):
                formatter.write_dl([
                    (name, command.help or "")
                    for name, command in self.commands.items()
                    if getattr(command, "rich_help_panel", None) == group
                ])  # fmt: skip


app = typer.Typer(
    name="drillctl",
    cls=GroupedCommands,
    help="Control design against torsional stick-slip of oil-well drillstrings.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help: rich would double the time it takes to appear
    context_settings={"help_option_names": ["-h", "--help"]},
)


def run(arguments: list[str]) -> int:
    """Run a command line and return its exit code; an error prints one message."""
    usage_error: Any = typer.BadParameter.__mro__[1]
    try:
        code = app(arguments or ["--help"], prog_name="drillctl", standalone_mode=False)
        # Some versions of typer return 130 on an interruption, others raise Abort.
        return _failed("interrupted", 130) if code == 130 else int(code or 0)
    except typer.Exit as stop:
        return int(stop.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        return _failed("interrupted", 130)
    except usage_error as error:
        return _failed(error.format_message(), 2)
    except Exception as error:
        if "--debug" in arguments:
            traceback.print_exc()
        if isinstance(error, DrillctlError):
            return _failed(str(error), 2 if isinstance(error, InputError) else 1)
        return _failed(f"{type(error).__name__}: {error} (--debug prints the traceback)", 1)


def _failed(message: str, code: int) -> int:
    console.note(f"drillctl: {message}")
    return code


def _version(requested: bool) -> None:
    if requested:
        console.line(f"drillctl {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Control design against torsional stick-slip of oil-well drillstrings."""
