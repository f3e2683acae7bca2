"""Work of the open pages, slice by slice: the newest request counts, and pages take turns.

A piece of work is a generator. What it yields is delivered to its page; between two slices another
piece may have its turn, and a piece that a newer one of its kind has replaced goes no further. So a
slider can be moved faster than a map is computed, and no page holds up another.

Each queue has a thread. What follows the cross never waits for a map; maps run in as many threads
of the kernels as the machine has, all else in one.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from typing import Any

from drillctl.arrays import own_errstate
from drillctl.progress import Silent

Slices = Iterator[Any]

FOREVER = 3600.0  # s: a condition takes no infinite time
PATIENCE = 0.1  # time (s) that what follows the cross lets a coarse map go first


class Dropped(Exception):  # noqa: N818 - no error, but an end
    """Work that nobody waits for any more."""


class Until(Silent):
    """Progress of long work that ends it once a newer one is asked for."""

    def __init__(self) -> None:
        self.dropped = False

    def advance(self, done: int) -> None:
        """Parts are done: go on, or stop here."""
        if self.dropped:
            raise Dropped


@dataclass(eq=False)
class Piece:
    """Work of a page."""

    owner: Hashable  # the page
    kind: str  # the page wants the newest of each kind alone
    rank: int  # what has less is done first
    slices: Slices
    deliver: Callable[[Any], None]  # takes what is yielded, in the thread of the work
    failed: Callable[[Exception], None]
    until: Until
    turns: int = 0  # slices so far
    since: float = field(default_factory=time.monotonic)  # when it was asked for (s)


class Queue:
    """Pieces of work that wait for one thread."""

    def __init__(
        self, name: str, threads: int, changed: threading.Condition,
        after: tuple[Queue, ...] = (), behind: tuple[Queue, ...] = (), patience: float = math.inf,
    ) -> None:  # fmt: skip
        self.name, self._threads = name, threads  # of the kernels
        self._changed = changed  # one for all queues that look at each other
        # this one waits until those have begun with all that they hold, or have none of it left
        self._after, self._behind, self._patience = after, behind, patience  # s
        self._waiting: dict[tuple[Hashable, str], Piece] = {}
        self._turns: dict[Hashable, int] = {}  # of each page
        self._ended = False
        self.thread = threading.Thread(target=self._work, name=f"explorer {name}", daemon=True)
        self.thread.start()

    def put(self, piece: Piece) -> None:
        """Take a piece of work, in place of an older one of its kind."""
        with self._changed:
            self._forget((piece.owner, piece.kind))
            self._waiting[piece.owner, piece.kind] = piece
            # A page that is opened later starts with as many turns as the page with the fewest.
            self._turns.setdefault(piece.owner, min(self._turns.values(), default=0))
            self._changed.notify_all()

    def drop(self, owner: Hashable, kind: str | None = None) -> None:
        """Forget the work of a page, or one kind of it."""
        with self._changed:
            for key in [k for k in self._waiting if k[0] == owner and kind in (None, k[1])]:
                self._forget(key)
            if kind is None:
                self._turns.pop(owner, None)
            self._changed.notify_all()

    def end(self) -> None:
        """Let the thread end after its slice."""
        with self._changed:
            self._ended = True
            for key in list(self._waiting):
                self._forget(key)
            self._changed.notify_all()

    def _forget(self, key: tuple[Hashable, str]) -> None:
        piece = self._waiting.pop(key, None)
        if piece is not None:
            piece.until.dropped = True

    @property
    def _has_its_turn(self) -> bool:
        late = time.monotonic() - self._patience
        begun = all(
            one.turns or one.since < late
            for queue in self._after
            for one in queue._waiting.values()
        )
        return bool(self._waiting) and begun and not any(one._waiting for one in self._behind)

    def _next(self) -> Piece | None:
        """The piece whose turn it is, once there is one; None at the end."""
        with self._changed:
            while not (self._ended or self._has_its_turn):
                self._changed.wait(min(self._patience, FOREVER))
            if self._ended:
                return None
            piece = min(
                self._waiting.values(), key=lambda one: (one.rank, self._turns.get(one.owner, 0))
            )
            self._turns[piece.owner] = self._turns.get(piece.owner, 0) + 1
            return piece

    def _work(self) -> None:
        import numba

        numba.set_num_threads(min(self._threads, numba.config.NUMBA_NUM_THREADS))
        with own_errstate():
            while (piece := self._next()) is not None:
                self._slice(piece)

    def _slice(self, piece: Piece) -> None:
        try:
            value = next(piece.slices)
        except (StopIteration, Dropped):
            self._done(piece)
        except Exception as error:
            self._done(piece)
            if not piece.until.dropped:
                piece.failed(error)
        else:
            with self._changed:
                piece.turns += 1
                self._changed.notify_all()
            if not piece.until.dropped:
                piece.deliver(value)

    def _done(self, piece: Piece) -> None:
        with self._changed:
            if self._waiting.get((piece.owner, piece.kind)) is piece:
                del self._waiting[piece.owner, piece.kind]
            self._changed.notify_all()


class Engine:
    """The queues that all pages share.

    What follows the cross lets coarse maps go first, but not for long. Loops wait for them, and
    shares of draws and checks for the whole ones.
    """

    def __init__(self, threads: int) -> None:
        changed = threading.Condition()
        self.maps = Queue("maps", threads, changed)
        self.quick = Queue("cross", 1, changed, after=(self.maps,), patience=PATIENCE)
        self.loops = Queue("loop", 1, changed, after=(self.maps,))
        self.shares = Queue("drawn rocks", threads, changed, behind=(self.maps,))
        self.checks = Queue(
            "boundary and audit", 1, changed, behind=(self.quick, self.maps, self.loops)
        )
        self.advice = Queue("recommendation", 1, changed)

    @property
    def queues(self) -> tuple[Queue, ...]:
        """All of them."""
        return (self.quick, self.maps, self.loops, self.shares, self.checks, self.advice)

    def drop(self, owner: Hashable) -> None:
        """Forget all work of a page."""
        for queue in self.queues:
            queue.drop(owner)

    def end(self) -> None:
        """End all work."""
        for queue in self.queues:
            queue.end()

    def ended(self, within: float) -> bool:
        """Whether all threads have ended after so long a time (s)."""
        last = time.monotonic() + within
        for queue in self.queues:
            queue.thread.join(max(0.0, last - time.monotonic()))
        return not any(queue.thread.is_alive() for queue in self.queues)
