"""Progress of long work: injected by whoever shows it, silent by default."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol


class Progress(Protocol):
    """What long work reports to."""

    def begin(self, task: str, total: int) -> None:
        """A task of `total` equal parts begins."""
        ...

    def advance(self, done: int) -> None:
        """So many more parts are done."""
        ...


class Silent:
    """Reports nothing."""

    def __repr__(self) -> str:
        return "SILENT"

    def begin(self, task: str, total: int) -> None:
        """A task begins; nothing is shown."""

    def advance(self, done: int) -> None:
        """Parts are done; nothing is shown."""


class Within:
    """Reports a task that is a part of a larger one, as parts of that one.

    A task that begins anew, as a sweep does for each kernel, and reports again what is
    done already, is not counted twice.
    """

    def __init__(self, whole: Progress) -> None:
        self._whole = whole
        self._done = self._reported = 0

    def begin(self, task: str, total: int) -> None:
        """The part begins, perhaps once more; the larger task goes on."""
        self._done = 0

    def advance(self, done: int) -> None:
        """Parts are done; those not yet reported are reported."""
        self._done += done
        if self._done > self._reported:
            self._whole.advance(self._done - self._reported)
            self._reported = self._done


SILENT = Silent()


@contextmanager
def reporting_compilation(progress: Progress) -> Iterator[None]:
    """Report the first compilation by numba while the block runs; what lies on disk is silent."""
    from numba.core import event

    class Listener(event.Listener):
        begun = False

        def on_start(self, event: Any) -> None:
            if not self.begun:
                self.begun = True
                progress.begin("compiling the solver, once per machine", 1)

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", Listener()):
        yield
