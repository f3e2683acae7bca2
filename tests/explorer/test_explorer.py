"""The explorer in a real browser: drag, sliders, keys, undo, errors, files, and who may come in."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from http.client import HTTPConnection
from typing import Any

import pytest

import drillctl
from drillctl.explorer import state as states
from drillctl.reporting import pages as pdf

pytestmark = pytest.mark.skipif(pdf.browser() is None, reason="no Chromium")

DESIGN = """
schema = 1
model = "monteiro-trindade-2012"
title = "A rig to explore"
[operating_point]
weight_on_bit = "140 kN"
[controller]
law = "pi"
kp = 625.0
ki = 125.0
[map]
axes = [
    { path = "controller.kp", min = 0, max = 1000, points = 13 },
    { path = "controller.ki", min = 0, max = 500, points = 11 },
]
audit_cells = 2
[recommend]
laws = ["soft-torque"]
[tune]
realizations = 8
certificate = { realizations = 20 }
"""
WEIGHT = "#c-operating_point-weight_on_bit"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("explorer") / "rig.toml"
    path.write_text(DESIGN)
    return path


@pytest.fixture(scope="module")
def address(file):
    process = subprocess.Popen(
        [sys.executable, "-m", "drillctl", "explore", str(file), "--no-browser"],
        text=True, stdout=subprocess.PIPE, env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    line = process.stdout.readline()
    yield re.search(r"http://\S+", line)[0]
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=20) == 0  # Ctrl-C ends it


class Seen:
    """A page, with what it asked for and what went wrong in it."""

    def __init__(self, browser: Any, address: str, **options: Any) -> None:
        size = {"width": 1280, "height": 720}
        self.context = browser.new_context(viewport=size, accept_downloads=True, **options)
        self.page = self.context.new_page()
        self.errors: list[str] = []
        self.asked: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("websocket", lambda socket: self.asked.append(socket.url))
        self.page.goto(address)
        self.settled()

    def settled(self, state: str = "whole") -> None:
        """Wait for the whole map."""
        self.page.wait_for_function(f"document.body.dataset.map === '{state}'", timeout=60_000)

    def until(self, condition: str, *given: Any) -> None:
        self.page.wait_for_function(condition, arg=given[0] if given else None, timeout=60_000)

    def text(self, selector: str) -> str:
        return str(self.page.text_content(selector))

    def readout(self, label: str, column: int = 0) -> str:
        row = self.page.locator("#readouts tbody tr").filter(has_text=label)
        return str(row.locator("td").nth(column).text_content())

    def shows(self, label: str, value: str, column: int = 0) -> None:
        """Wait until a number of the table is the one that is expected."""
        self.until(
            "([label, value, column]) => [...document.querySelectorAll('#readouts tbody tr')].some("
            "row => row.cells[0].textContent === label && row.cells[column + 1]"
            " && row.cells[column + 1].textContent === value)",
            [label, value, column],
        )

    def rests(self) -> None:
        """Wait until nothing has been asked for some time, and all is answered."""
        counts = "[document.body.dataset.asked, document.body.dataset.answered]"
        before = None
        while before is None or before != (now := self.page.evaluate(counts)) or now[0] != now[1]:
            before = self.page.evaluate(counts)
            time.sleep(0.4)

    def slide(self, selector: str, value: float) -> None:
        self.page.evaluate(
            "([selector, value]) => { const one = document.querySelector(selector);"
            " one.value = value; for (const kind of ['input', 'change'])"
            " one.dispatchEvent(new Event(kind)); }",
            [selector, value],
        )


@pytest.fixture(scope="module")
def opened(browser, address):
    found = Seen(browser, address)
    yield found
    found.context.close()


@pytest.fixture
def seen(opened, file, tmp_path):
    """The page as it was opened: it opens its first state, which is quicker than another page."""
    base = drillctl.load(file)
    first = tmp_path / "first.json"
    first.write_text(states.saved(states.first_state(base, "si"), base))
    opened.page.set_input_files("#opened", first)
    opened.shows("J1", told(file))
    opened.settled()
    yield opened
    assert opened.errors == []


def told(file, **values):
    """J1 at a point, as the page writes it."""
    run = drillctl.simulate(drillctl.load(file, **values), engine="batch")
    return f"{run.measures.j1:.5g}"


def test_the_page_shows_the_numbers_of_the_commands(seen, file):
    seen.shows("J1", told(file))
    swept = drillctl.stability_map(drillctl.load(file), audit_cells=0)
    assert f"least J1 {swept.minimum[0]:.4g} s" in seen.text("#map-said")
    loop = drillctl.loop(drillctl.load(file))
    seen.shows("disk margin", f"{loop.margins.disk:.5g}")
    image = seen.page.evaluate(
        "(({ values, columns }) => [columns, [...values]])(pictures.all.map.image)"
    )
    assert image[0] == 13
    assert image[1] == swept.j1.T.ravel().tolist()  # every cell, to the bit


def test_the_cross_is_dragged_and_moved_by_keys(seen, file):
    box = seen.page.locator("#map").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    before = seen.page.input_value("#c-controller-kp")
    seen.page.mouse.move(x, y)
    seen.page.mouse.down()
    for step in range(12):
        seen.page.mouse.move(x - 6 * step, y + 4 * step)
    seen.page.mouse.up()
    seen.until("old => document.querySelector('#c-controller-kp').value !== old", before)
    seen.rests()
    kp, ki = (float(seen.page.input_value(f"#c-controller-{name}")) for name in ("kp", "ki"))
    seen.shows("J1", told(file, **{"controller.kp": kp, "controller.ki": ki}))
    seen.page.locator("#map").focus()
    seen.page.keyboard.press("ArrowRight")
    seen.until("value => +document.querySelector('#c-controller-kp').value > value", kp)
    moved = float(seen.page.input_value("#c-controller-kp"))
    assert moved == pytest.approx(kp + 1000 / 12, rel=1e-3)


def test_a_slider_moves_the_region_and_undo_brings_it_back(seen, file):
    seen.shows("J1", told(file))
    first = seen.text("#map-said")
    seen.slide(f"{WEIGHT}-range", 100)
    weight = {"operating_point.weight_on_bit": "100 kN"}
    seen.shows("J1", told(file, **weight))
    seen.until("old => document.querySelector('#map-said').textContent !== old && "
               "document.body.dataset.map === 'whole'", first)  # fmt: skip
    swept = drillctl.stability_map(drillctl.load(file, **weight), audit_cells=0)
    assert f"least J1 {swept.minimum[0]:.4g} s" in seen.text("#map-said")
    seen.page.keyboard.press("Control+z")
    seen.shows("J1", told(file))
    seen.page.click("#redo")
    seen.shows("J1", told(file, **weight))


def test_an_error_stands_beside_what_made_it(seen, file):
    seen.page.fill(WEIGHT, "-5")
    seen.page.press(WEIGHT, "Enter")
    seen.until("() => document.querySelector('#error-c-operating_point-weight_on_bit').textContent")
    assert "kN" in seen.text("#error-c-operating_point-weight_on_bit")
    seen.page.fill(WEIGHT, "120")
    seen.page.press(WEIGHT, "Enter")
    seen.shows("J1", told(file, **{"operating_point.weight_on_bit": "120 kN"}))
    assert seen.text("#error-c-operating_point-weight_on_bit") == ""


def test_a_case_is_kept_and_compared(seen, file):
    seen.shows("J1", told(file))
    seen.page.click("#keep")
    seen.slide(f"{WEIGHT}-range", 100)
    seen.shows("J1", told(file, **{"operating_point.weight_on_bit": "100 kN"}))
    seen.shows("J1", told(file), 1)
    seen.page.click("#keep")
    seen.until("() => document.querySelector('#readouts tbody tr').cells.length === 3")


def test_a_page_is_saved_and_opened(seen, file, tmp_path):
    seen.slide(f"{WEIGHT}-range", 100)
    expected = told(file, **{"operating_point.weight_on_bit": "100 kN"})
    seen.shows("J1", expected)
    with seen.page.expect_download() as download:
        seen.page.click("#save")
    saved = tmp_path / download.value.suggested_filename
    download.value.save_as(saved)
    assert json.loads(saved.read_text())["settings"] == {
        "operating_point.weight_on_bit": "100 kN"
    }  # fmt: skip
    seen.page.reload()
    seen.settled()
    seen.shows("J1", told(file))
    seen.page.set_input_files("#opened", saved)
    seen.shows("J1", expected)
    with seen.page.expect_download() as download:
        seen.page.click("#design")
    made = tmp_path / "explored.toml"
    download.value.save_as(made)
    assert told(made) == expected


def test_laws_axes_units_and_drawn_rocks(seen, file):
    seen.page.select_option("#c-controller-law", "z-torque")
    seen.until("() => document.querySelector('#axis-0').value === 'controller.absorption'")
    law = {"controller.law": "z-torque"}
    seen.shows("J1", told(file, **law))
    seen.page.select_option("#units", "field")
    seen.until("() => document.querySelector('#controls').textContent.includes('klbf')")
    seen.page.click("#undo")
    seen.page.click("#undo")
    seen.until("() => document.querySelector('#axis-0').value === 'controller.kp'")
    seen.page.fill("#axis-1-high", "250")
    seen.page.press("#axis-1-high", "Enter")
    seen.page.select_option("#mode", "200")
    seen.until("() => document.querySelector('#map-said').textContent.includes('of 200 rocks')")
    seen.page.fill("#draws", "6")
    seen.page.press("#draws", "Enter")
    seen.until(
        "() => document.querySelector('#map-said').textContent.startsWith('share of 6 of 6')"
    )


def test_the_audit_comes_by_itself_and_a_recommendation_on_request(seen, file):
    seen.until("() => document.querySelector('#chip').textContent.includes('2 cells')")
    assert "audit: ok" in seen.text("#chip")
    seen.page.click("#recommend")
    seen.until("() => document.querySelector('#sentence').textContent.startsWith('Searching')")
    seen.until("() => document.querySelector('#sentence').className === 'none' || "
               "/passes|fragile/.test(document.querySelector('#sentence').className)")  # fmt: skip
    assert "Kp 625" in seen.text("#sentence")


def test_commands_are_copied(seen, file):
    seen.context.grant_permissions(["clipboard-read", "clipboard-write"])
    base = drillctl.load(file)
    first = states.first_state(base, "si")
    for button, command in (("map", states.command), ("run", states.run_command)):
        seen.page.click(f"#copy-{button}")
        seen.until("text => document.querySelector('#report-said').textContent === text",
                   f"Copied: {command(first, base)}")  # fmt: skip
        assert seen.page.evaluate("navigator.clipboard.readText()") == command(first, base)


@pytest.mark.slow
def test_a_report_of_the_point_is_written_and_linked(seen, file):
    seen.page.click("#report")
    seen.page.wait_for_selector("#report-said a", timeout=300_000)
    with seen.context.expect_page() as opened:
        seen.page.click("#report-said a")
    report = opened.value
    report.wait_for_load_state()
    assert "A rig to explore" in report.title()
    assert told(file) in report.text_content("body")
    report.close()


def test_nothing_leaves_the_machine_and_a_wrong_token_is_refused(seen, address):
    host = address.split("/")[2]
    assert f"ws://{host}/{address.split('/')[3]}/ws" in seen.asked
    outside = [url for url in seen.asked if url.split("/")[2] != host]
    assert [url for url in outside if not url.startswith(("data:", "blob:"))] == []
    wrong = address[:-3] + "abc"
    for url in (wrong, f"{wrong}/ws", f"http://{host}/", f"{wrong}/reports/x"):
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(url, timeout=10)
        assert refused.value.code in (403, 404)
    # A page of another name that points here, and one that knows the token.
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    for path, headers, code in (
        (address, {"Host": "another.example"}, 404),
        (f"{address}/ws", upgrade | {"Origin": "http://another.example"}, 403),
    ):
        connection = HTTPConnection(host, timeout=10)
        connection.request("GET", path.partition(host)[2], headers=headers)
        assert connection.getresponse().status == code
        connection.close()
    own = urllib.request.urlopen(address, timeout=10).read()
    assert b"drillctl" in own


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious(browser, address, scheme, serious):
    seen = Seen(browser, address, color_scheme=scheme)
    holding, found = serious(seen.page)
    assert found == []
    assert holding > 10
    assert seen.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert seen.page.evaluate("document.documentElement.scrollHeight <= innerHeight")
    seen.context.close()
