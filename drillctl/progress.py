"""Progress of long work: injected by whoever shows it, silent by default."""

from __future__ import annotations

from typing import Protocol


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

    def begin(self, task: str, total: int) -> None:
        """A task begins; nobody is told."""

    def advance(self, done: int) -> None:
        """Parts are done; nobody is told."""


SILENT = Silent()
