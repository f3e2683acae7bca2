"""A run in its folder: shown again, interrupted, concluded; its pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from drillctl.cli import console
from drillctl.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from drillctl.cli.options import Options
    from drillctl.store import RunFolder

DPI = 150
RESUMED = ("map", "uncertainty")
"""Runs that go on from what was finished; the others have no finished parts to go on from."""


def draw(figure: Figure, path: Path) -> None:
    """Write a picture."""
    figure.savefig(path, dpi=DPI)


def shown_again(folder: RunFolder, options: Options, show: Callable[[], None]) -> bool:
    """Whether the folder held the finished run, whose summary is then shown once more."""
    if not folder.finished:
        return False
    if options.json:
        console.emit(folder.summary())
    else:
        show()
    console.note(f"already done: {folder.path}")
    return True


@contextmanager
def guarded(folder: RunFolder) -> Iterator[None]:
    """A run in its folder: an impossible one leaves none, an interrupted map can go on."""
    try:
        yield
    except InputError:
        folder.discard()
        raise
    except KeyboardInterrupt:
        if folder.verb in RESUMED:
            console.note(f"what is finished is kept: the same with --out {folder.path} goes on")
        else:
            folder.discard()
        raise


def conclude(folder: RunFolder, summary: dict[str, Any], options: Options) -> None:
    """Mark a run finished and tell its summary."""
    folder.finish(summary)
    if options.json:
        console.emit(summary)
        console.note(f"results: {folder.path}")
    else:
        console.line(f"results: {folder.path}")


library_output_on_stderr = console.library_output_on_stderr
