"""What the command line says: tables on stdout, progress and notes on stderr, strict JSON."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from typing import TYPE_CHECKING, Any

from drillctl.progress import SILENT, Progress

if TYPE_CHECKING:
    from rich.progress import Progress as RichBar

PIPED_WIDTH = 160
"""Width of tables that do not go to a terminal (characters)."""


def note(text: str) -> None:
    """A line for people, on stderr."""
    print(text, file=sys.stderr)  # noqa: T201


def emit(summary: dict[str, Any]) -> None:
    """One strict JSON object on stdout."""
    from drillctl.store.json_files import strict

    print(json.dumps(strict(summary), allow_nan=False))  # noqa: T201


def line(text: str) -> None:
    """A line of a command's answer, on stdout."""
    print(text)  # noqa: T201


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table on stdout; every column but the first is set flush right."""
    from rich.console import Console
    from rich.table import Table

    made = Table(header_style="bold")
    for number, column in enumerate(columns):
        made.add_column(column, justify="left" if number == 0 else "right", overflow="fold")
    for row in rows:
        made.add_row(*row)
    # Titles and names are the user's: a bracket or a colon in them is no markup.
    console = Console(markup=False, emoji=False, highlight=False)
    if not console.is_terminal:
        console.width = PIPED_WIDTH
    # Not as the table's own title, which would be broken at the table's width.
    console.print(title, style="bold", soft_wrap=True)
    console.print(made)


class Bar:
    """Progress as a rich bar on stderr."""

    def __init__(self, bar: RichBar) -> None:
        self._bar = bar
        self._task: Any = None

    def begin(self, task: str, total: int) -> None:
        """A task begins; the one before is finished."""
        if self._task is not None:
            self._bar.update(self._task, visible=False)
        self._task = self._bar.add_task(task, total=total)

    def advance(self, done: int) -> None:
        """Parts of it are done."""
        self._bar.advance(self._task, done)


@contextmanager
def progress() -> Iterator[Progress]:
    """Progress on stderr while the block runs; gone when it ends, absent from files and pipes."""
    from rich.console import Console
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
    console = Console(stderr=True)
    if not console.is_terminal:
        yield SILENT
        return
    with RichBar(*columns, console=console, transient=True) as bar:
        yield Bar(bar)


def sized(value: float | None, digits: int = 5) -> str:
    """A number for a table; a dash where there is none."""
    return "-" if value is None or value != value else f"{value:.{digits}g}"


@contextmanager
def library_output_on_stderr() -> Iterator[None]:
    """What a library prints by itself goes to stderr, be it by C or by Python: stdout is JSON's."""
    import ctypes

    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        with suppress(OSError, TypeError):  # not every system names its C library so
            ctypes.CDLL(None).fflush(None)  # what C holds back goes where it was meant to
        os.dup2(kept, 1)
        os.close(kept)
