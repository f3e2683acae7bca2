"""Messages of a page: what waits for the browser, and when it is answered."""

from __future__ import annotations

import json
import queue
import time

import pytest

import drillctl
from drillctl.explorer.page import Page
from drillctl.explorer.reports import Reports
from drillctl.explorer.state import first_state
from drillctl.explorer.work import Engine

AXES = [
    {"path": "controller.kp", "min": 300, "max": 700, "points": 3},
    {"path": "controller.ki", "min": 50, "max": 250, "points": 3},
]


class Browser:
    """What a page was sent; work of its engine is taken when it is waited for."""

    def __init__(self, engine, folder):
        base = drillctl.load("monteiro-trindade-140kn", **{"map.axes": AXES, "map.audit_cells": 1})
        self.got, self._calls = [], queue.Queue()
        first = first_state(base, "si")
        reports = Reports(folder, "")
        self.page = Page(self._told, self._calls.put, base, first, engine, reports)
        self.page._asked_advice = True  # which would take long
        self.page.take(json.dumps({"do": "ready", "count": 1}))

    def _told(self, text):
        self.got += json.loads(text)

    def ask(self, **what):
        self.page.take(json.dumps(what))

    def until(self, name, holds=lambda value: True):
        """Wait for an answer; give it and all that came before."""
        while True:
            for place, one in enumerate(self.got):
                if name in one and holds(one[name]):
                    before, self.got = self.got[: place + 1], self.got[place + 1 :]
                    return before
            self._calls.get(timeout=300)()

    def drawn(self, kind):
        """Draw all that comes until there is a result of a kind."""
        while True:
            (*_, last) = self.until("drew")
            self.ask(do="drawn")
            if kind in last["drew"]:
                return last


@pytest.fixture
def browser(tmp_path):
    engine = Engine(1)
    yield Browser(engine, tmp_path)
    engine.end()


def test_results_wait_until_the_browser_has_drawn(browser):
    browser.until("drew")
    while len(browser.page._ready) < 2:  # nothing is sent before it has said so
        browser._calls.get(timeout=300)()
    assert not any("pictures" in one for one in browser.got)
    waiting = set(browser.page._ready)
    browser.ask(do="drawn")
    assert browser.until("drew")[-1]["drew"].keys() == waiting


def test_what_is_dragged_is_answered_with_its_picture(browser):
    browser.drawn("audit")  # the last that comes by itself
    browser.got.clear()
    browser.ask(do="cross", x=400, y=100, settled=False, count=2)
    assert not any("answered" in one for one in browser.got)
    told = browser.until("drew")
    while "response" not in told[-1]["drew"]:  # what came of the settled page before
        browser.ask(do="drawn")
        told = browser.until("drew")
    assert {"answered": 2} in told
    browser.ask(do="drawn")
    browser.ask(do="cross", x=500, y=100, settled=True, count=3)
    assert {"answered": 3} in browser.got  # nothing more is dragged


def test_a_request_that_fails_is_answered(browser):
    browser.until("answered")
    browser.ask(do="set", path="operating_point.speed", value=-1, settled=False, count=2)
    told = browser.until("answered")
    assert any("error" in one and one["error"]["at"] == "operating_point.speed" for one in told)


def test_a_page_that_is_closed_asks_for_no_more(browser):
    browser.until("answered")
    browser.got.clear()
    browser.page.close()
    assert not any(one._waiting for one in browser.page._engine.queues)
    time.sleep(0.5)
    while not browser._calls.empty():  # what was running is not told any more
        browser._calls.get()()
    assert browser.got == []
