"""The program: options without a command, error messages and exit codes."""

from __future__ import annotations

import _thread
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, get_args

import typer
from typer.core import TyperGroup

from drillctl import __version__
from drillctl.cli import console
from drillctl.errors import DrillctlError, InputError
from drillctl.studies.base import Group
from drillctl.text import LONGEST_ERROR, shortened

INTERRUPTED = 128 + signal.SIGINT
DEBUG = "--debug prints the traceback"


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
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help: rich would double the time it takes to appear
    context_settings={"help_option_names": ["-h", "--help"]},
)


def run(arguments: list[str]) -> int:
    """Run a command line and return its exit code; an error prints one message."""
    with _terminated_as_interrupted() as terminated:
        code, message = _outcome(arguments)
    if code == INTERRUPTED and terminated:
        code, message = 128 + signal.SIGTERM, "terminated"
    for line in message.splitlines():
        console.note(f"drillctl: {shortened(line, LONGEST_ERROR)}")
    return code


@contextmanager
def _terminated_as_interrupted() -> Iterator[list[int]]:
    """Let a request to terminate end a command as Ctrl-C does; yields such requests."""
    came: list[int] = []

    def stop(number: int, frame: Any) -> None:
        came.append(number)
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():  # signals are the main one's
        yield came
        return
    before = signal.signal(signal.SIGTERM, stop)
    try:
        with _dropped_ones_again(came):
            yield came
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def _dropped_ones_again(terminations: list[int]) -> Iterator[None]:
    """Let an interruption come again that Python drops, as it does those within a finaliser."""
    before, due = sys.unraisablehook, []

    def hook(dropped: Any) -> None:
        if not issubclass(dropped.exc_type, KeyboardInterrupt):
            before(dropped)
            return
        number = signal.SIGTERM if terminations else signal.SIGINT
        due.append(threading.Timer(0.01, _thread.interrupt_main, [number]))  # not within this hook
        due[-1].start()

    sys.unraisablehook = hook
    try:
        yield
    finally:
        for timer in due:
            timer.cancel()
        sys.unraisablehook = before


def _outcome(arguments: list[str]) -> tuple[int, str]:
    """Exit code of a command line, and a message if it failed."""
    usage_error: Any = typer.BadParameter.__mro__[1]
    try:
        code = app(arguments or ["--help"], prog_name="drillctl", standalone_mode=False)
        console.flush()
        # Some versions of typer return 130 on an interruption, others raise Abort.
        return int(code or 0), "interrupted" if code == INTERRUPTED else ""
    except typer.Exit as stop:
        return int(stop.exit_code), ""
    except (KeyboardInterrupt, typer.Abort) as stop:
        if isinstance(stop.__cause__, EOFError):  # typer takes the end of a file for Ctrl-C
            return 1, f"a file ends too early: {stop.__cause__} ({DEBUG})"
        return INTERRUPTED, "interrupted"
    except usage_error as error:
        # The words of the library that reads choices are not ours.
        return 2, error.format_message().replace(": Value error, ", ": ")
    except BrokenPipeError:  # whoever reads the output has left; typer, too, answers with 1
        console.silence()
        return 1, ""
    except Exception as error:
        if "--debug" in arguments:
            traceback.print_exc()
        if isinstance(error, DrillctlError):
            return 2 if isinstance(error, InputError) else 1, str(error)
        if isinstance(error, OSError) and error.strerror:
            return 1, f"{error.filename or 'the output'}: {error.strerror} ({DEBUG})"
        return 1, f"{type(error).__name__}: {error} ({DEBUG})"


def _version(requested: bool) -> None:
    if requested:
        console.line(f"drillctl {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool,
        typer.Option(
            "-V", "--version", callback=_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Control design against torsional stick-slip of oil-well drillstrings."""
