"""Work of pages: the newest counts, pages take turns, what is replaced goes no further."""

from __future__ import annotations

import threading
import time

import pytest

from drillctl.explorer.work import Dropped, Piece, Queue, Until


@pytest.fixture
def queue():
    made = Queue("test", 1, threading.Condition())
    yield made
    made.end()


class Asked:
    """A piece of work that waits until it is let go, with what was delivered."""

    def __init__(self, owner="page", kind="map", rank=0, slices=3):
        self.got, self.errors, self.go = [], [], threading.Semaphore(0)
        self.until, self.slices = Until(), slices
        self.piece = Piece(
            owner, kind, rank, self._work(), self.got.append, self.errors.append, self.until
        )

    def _work(self):
        for number in range(self.slices):
            assert self.go.acquire(timeout=10)
            yield number

    def let(self, count=1):
        for _ in range(count):
            self.go.release()


def until(condition):
    end = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.002)


def test_slices_are_delivered_in_order(queue):
    one = Asked()
    queue.put(one.piece)
    one.let(3)
    until(lambda: one.got == [0, 1, 2])
    assert not one.until.dropped


def test_a_newer_request_replaces_an_older_one(queue):
    old, new = Asked(), Asked()
    queue.put(old.piece)
    old.let()
    until(lambda: old.got == [0])
    queue.put(new.piece)
    old.let()  # the slice that was running ends, and is not delivered
    new.let(3)
    until(lambda: new.got == [0, 1, 2])
    assert old.got == [0]
    assert old.until.dropped
    with pytest.raises(Dropped):
        old.until.advance(1)


def test_kinds_do_not_replace_each_other(queue):
    one, other = Asked(kind="map"), Asked(kind="boundary", rank=1)
    queue.put(one.piece)
    queue.put(other.piece)
    one.let(3)
    other.let(3)
    until(lambda: len(one.got) == len(other.got) == 3)


def test_pages_take_turns(queue):
    order = []
    first = Asked(slices=1)
    queue.put(first.piece)  # holds the thread until both others wait

    def work(name):
        for _ in range(3):
            order.append(name)
            yield name

    for name in ("a", "b"):
        queue.put(Piece(name, "map", 0, work(name), lambda value: None, print, Until()))
    first.let()
    until(lambda: len(order) == 6)
    assert order in (list("ababab"), list("bababa"))


def test_what_has_less_rank_goes_first(queue):
    order = []
    first = Asked(slices=1)
    queue.put(first.piece)

    def work(name):
        for _ in range(2):
            order.append(name)
            yield name

    queue.put(Piece("a", "boundary", 2, work("late"), lambda value: None, print, Until()))
    queue.put(Piece("b", "map", 0, work("soon"), lambda value: None, print, Until()))
    first.let()
    until(lambda: len(order) == 4)
    assert order == ["soon", "soon", "late", "late"]


def test_a_page_that_leaves_stops_its_work(queue):
    one, other = Asked("leaves"), Asked("stays")
    queue.put(one.piece)
    queue.put(other.piece)
    queue.drop("leaves")
    one.let(3)
    other.let(3)
    until(lambda: other.got == [0, 1, 2])
    assert one.got == []
    assert one.until.dropped


def test_a_failure_is_told_and_the_thread_goes_on(queue):
    def fails():
        yield 1
        raise RuntimeError("no")

    errors, other = [], Asked(kind="loop")
    queue.put(Piece("page", "map", 0, fails(), lambda value: None, errors.append, Until()))
    queue.put(other.piece)
    other.let(3)
    until(lambda: len(errors) == 1 and other.got == [0, 1, 2])
    assert str(errors[0]) == "no"


def test_a_queue_waits_for_those_before_it():
    changed = threading.Condition()
    maps = Queue("maps", 1, changed)
    loops = Queue("loops", 1, changed, after=(maps,))
    checks = Queue("checks", 1, changed, behind=(maps, loops))
    whole, loop, check = Asked(kind="map"), Asked(kind="loop"), Asked(kind="check")
    for one in (loop, check):
        one.let(3)
    with changed:  # as if all were asked for at one moment
        for queue, one in ((checks, check), (loops, loop), (maps, whole)):
            queue.put(one.piece)
    time.sleep(0.1)
    assert (loop.got, check.got) == ([], [])
    whole.let()
    until(lambda: loop.got == [0, 1, 2])  # the coarse map is there
    time.sleep(0.1)
    assert check.got == []
    whole.let(2)
    until(lambda: check.got == [0, 1, 2])
    for queue in (maps, loops, checks):
        queue.end()
