"""Output: tables and strict JSON on stdout, progress and notes on stderr."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from typing import TYPE_CHECKING, Any, TextIO

from drillctl.errors import StoreError
from drillctl.progress import SILENT, Progress
from drillctl.text import clean

if TYPE_CHECKING:
    from rich.progress import Progress as RichBar

PIPED_WIDTH = 160
"""Width of tables written to a file or pipe (characters)."""


def note(text: str) -> None:
    """Print a line on stderr."""
    print(clean(text), file=sys.stderr)  # noqa: T201


def _output() -> TextIO:
    """Where answers go; refused (`StoreError`) if the caller closed it."""
    if sys.stdout is None:
        raise StoreError("the standard output is closed: nothing can be printed")
    return sys.stdout


def flush() -> None:
    """Write what is still in memory, while its failure can be reported."""
    if sys.stdout is not None:
        sys.stdout.flush()


def silence() -> None:
    """Drop what is still to be printed, after whoever reads it has left."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def emit(summary: dict[str, Any]) -> None:
    """Print one strict JSON object on stdout."""
    from drillctl.store.json_files import strict

    print(json.dumps(strict(summary), allow_nan=False), file=_output())


def line(text: str) -> None:
    """Print a line on stdout."""
    print(clean(text), file=_output())


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table on stdout; all columns but the first are right-aligned."""
    from rich.console import Console
    from rich.table import Table

    made = Table(header_style="bold")
    for number, column in enumerate(columns):
        made.add_column(column, justify="left" if number == 0 else "right", overflow="fold")
    for row in rows:
        made.add_row(*map(clean, row))
    # Titles and names come from the user: brackets and colons in them are not markup.
    console = Console(file=_output(), markup=False, emoji=False, highlight=False)
    if not console.is_terminal:
        console.width = PIPED_WIDTH
    # Rich would wrap a title of the table at the width of the table.
    console.print(clean(title), style="bold", soft_wrap=True)
    console.print(made)


class Bar:
    """Progress as a rich bar on stderr."""

    def __init__(self, bar: RichBar) -> None:
        self._bar = bar
        self._task: Any = None

    def begin(self, task: str, total: int) -> None:
        """Start a task; the previous one is finished."""
        if self._task is not None:
            self._bar.update(self._task, visible=False)
        self._task = self._bar.add_task(task, total=total)

    def advance(self, done: int) -> None:
        """Add finished parts."""
        self._bar.advance(self._task, done)


@contextmanager
def progress() -> Iterator[Progress]:
    """Progress on stderr while the block runs; cleared at its end, absent from files and pipes."""
    from rich.console import Console

    console = Console(stderr=True)
    if not console.is_terminal:
        yield SILENT
        return

    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        ProgressColumn,
        Task,
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as RichBar
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text("" if task.speed is None else f"{task.speed:,.0f}/s")

    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Rate(),
        TimeRemainingColumn(),
    )  # fmt: skip
    with RichBar(*columns, console=console, transient=True) as bar:
        yield Bar(bar)


@contextmanager
def library_output_on_stderr() -> Iterator[None]:
    """Send what libraries print, from C or Python, to stderr: stdout is reserved for JSON."""
    import ctypes

    flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        with suppress(OSError, TypeError):  # not every system has the C library under this name
            ctypes.CDLL(None).fflush(None)  # buffered output of C must not reach stdout later
        os.dup2(kept, 1)
        os.close(kept)
