"""A report in a real browser: from disk, without network, with pointer, keyboard and printer."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import pypdf
import pytest

from drillctl.reporting import Report
from drillctl.reporting import pages as pdf

pytestmark = [
    pytest.mark.skipif(pdf.browser() is None, reason="no Chromium"),
]

# Text on what it stands on; WCAG 2.1 asks for 4.5, and 3 for large text. Also: labels, names of
# what can be focused, one main part, tables with heads.
ACCESSIBLE = """
() => {
  const wrong = [];
  const paint = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  function colour(text) {
    paint.clearRect(0, 0, 1, 1);
    paint.fillStyle = text;
    paint.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = paint.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  }
  const light = ([r, g, b]) => {
    const part = [r, g, b].map((v) => v / 255).map(
      (v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
    return 0.2126 * part[0] + 0.7152 * part[1] + 0.0722 * part[2];
  };
  function ground(element) {
    for (let at = element; at; at = at.parentElement) {
      const found = colour(getComputedStyle(at).backgroundColor);
      if (found[3] === 1) return found;
      if (found[3] > 0) wrong.push(`half transparent ground: ${at.className}`);
    }
    return [255, 255, 255, 1];
  }
  let checked = 0, least = 99;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const holder = walker.currentNode.parentElement;
    if (!walker.currentNode.textContent.trim() || holder.closest("script, style, svg")) continue;
    if (!holder.getClientRects().length) continue;
    const style = getComputedStyle(holder);
    const a = light(colour(style.color)), b = light(ground(holder));
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    const large = parseFloat(style.fontSize) >= 24;
    checked += 1;
    least = Math.min(least, contrast);
    if (contrast < (large ? 3 : 4.5))
      wrong.push(`contrast ${contrast.toFixed(2)}: ${walker.currentNode.textContent.slice(0, 40)}`);
  }
  for (const label of document.querySelectorAll(".trace text")) {
    const a = light(colour(getComputedStyle(label).fill)), b = light(ground(label));
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) wrong.push(`contrast ${contrast.toFixed(2)}: ${label.textContent}`);
  }
  for (const image of document.images)
    if (!image.alt || !image.complete || !image.naturalWidth) wrong.push(`image ${image.alt}`);
  for (const one of document.querySelectorAll("[tabindex], a[href], summary")) {
    const labelled = one.getAttribute("aria-labelledby");
    const name = one.getAttribute("aria-label") || one.textContent.trim()
      || (labelled && document.getElementById(labelled).textContent.trim());
    if (!name) wrong.push(`no name: ${one.outerHTML.slice(0, 60)}`);
    if (one.tabIndex > 0) wrong.push("order of focus changed by hand");
  }
  for (const table of document.querySelectorAll("table"))
    if (!table.caption || !table.tHead || table.querySelector("th:not([scope])"))
      wrong.push("table without caption or heads");
  if (document.querySelectorAll("main").length !== 1) wrong.push("main");
  if (document.documentElement.lang !== "en") wrong.push("lang");
  const roles = document.querySelectorAll("[role=img]:not([aria-label])");
  if (roles.length) wrong.push("role=img without a name");
  return { wrong, checked, least };
}
"""


class Seen:
    """A page, with what it said and asked for."""

    def __init__(self, browser: Any, report: Report, **options: Any) -> None:
        self.context = browser.new_context(**options)
        self.page = self.context.new_page()
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(report.files["html"].resolve().as_uri())

    def values(self) -> str:
        return str(self.page.locator(".values").text_content())

    def shown(self) -> str:
        return str(self.page.locator(".trace svg").get_attribute("aria-label"))


@pytest.fixture
def seen(browser: Any, small: Report) -> Iterator[Seen]:
    found = Seen(browser, small, viewport={"width": 1280, "height": 900})
    yield found
    found.context.close()


def test_it_opens_from_disk_in_silence(seen, small):
    assert seen.said == []
    outside = [url for url in seen.asked if not url.startswith("data:")]
    assert outside == [small.files["html"].resolve().as_uri()]


def place(seen: Seen, i: int, j: int, within: float = 0.5) -> tuple[float, float]:
    """A point of a cell of the 5 x 4 map on the screen, its middle by default."""
    over = seen.page.locator(".over")
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    across, up = (i + within) / 5, (j + within) / 4
    return box["x"] + across * box["width"], box["y"] + (1.0 - up) * box["height"]


# N m s/rad in klbf ft/rpm, N m/rad in klbf ft/rev
FOOT_POUND = 1.3558179483314
PER_RPM, PER_TURN = math.pi / 30 / FOOT_POUND / 1e3, 2 * math.pi / FOOT_POUND / 1e3
CELLS = r"Kp (\S+) klbf ft/rpm, Ki (\S+) klbf ft/rev: J1 (\S+) s, (.*)"
CELL = f"Kp {400 * PER_RPM:.4g} klbf ft/rpm, Ki {200 * PER_TURN:.4g} klbf ft/rev"


def test_pointing_at_a_cell_tells_its_values(seen, small):
    import drillctl

    swept = drillctl.open(small.folder / "studies" / "map")
    for i, j, within in ((0, 0, 0.5), (4, 3, 0.04), (2, 1, 0.5), (1, 1, 0.96), (3, 2, 0.04)):
        seen.page.mouse.move(*place(seen, i, j, within))
        kp, ki = swept.axes[0].values[i], swept.axes[1].values[j]
        told = re.fullmatch(CELLS, seen.values())
        assert float(told[1]) == pytest.approx(kp * PER_RPM, rel=1e-3)
        assert float(told[2]) == pytest.approx(ki * PER_TURN, rel=1e-3)
        assert float(told[3]) == pytest.approx(swept.j1[i, j], rel=1e-3)
        mark = seen.page.locator(".over .cell").bounding_box()
        x, y = place(seen, i, j)
        assert mark["x"] + 0.5 * mark["width"] == pytest.approx(x, abs=2.0)
        assert mark["y"] + 0.5 * mark["height"] == pytest.approx(y, abs=2.0)
    assert seen.said == []


def test_a_click_shows_the_response_of_that_cell(seen):
    first = seen.shown()
    seen.page.mouse.click(*place(seen, 0, 3))
    assert seen.shown() != first
    assert CELL in seen.shown()
    lines = seen.page.locator(".trace svg path")
    assert lines.count() == 2
    assert len(lines.first.get_attribute("d")) > 2000
    assert seen.said == []


def test_the_keyboard_does_the_same(seen):
    seen.page.locator(".over").focus()
    before = seen.values()
    seen.page.keyboard.press("ArrowRight")
    assert seen.values() != before
    for _ in range(9):
        seen.page.keyboard.press("ArrowLeft")
        seen.page.keyboard.press("ArrowUp")
    assert seen.values().startswith(CELL)
    seen.page.keyboard.press("Enter")
    assert CELL in seen.shown()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
def test_nothing_stands_in_the_way_of_reading(browser, small, scheme, width):
    seen = Seen(
        browser, small, color_scheme=scheme, viewport={"width": width, "height": 900}
    )  # fmt: skip
    found = seen.page.evaluate(ACCESSIBLE)
    assert found["wrong"] == []
    assert found["checked"] > 200
    assert seen.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    seen.context.close()


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 1280), ("light", 400)])
def test_axe_finds_nothing_serious(browser, small, scheme, width, serious):
    """In the open parts of the page."""
    seen = Seen(browser, small, color_scheme=scheme, viewport={"width": width, "height": 900})
    holding, found = serious(seen.page)
    assert found == []
    assert holding > 20
    seen.context.close()


def test_labels_of_pictures_can_be_read_on_a_phone(browser, small):
    seen = Seen(browser, small, viewport={"width": 400, "height": 900})
    shares = seen.page.evaluate(
        "() => [...document.images].map(one => one.width / one.naturalWidth)"
    )
    assert min(shares) > 0.7  # of letters of 12 pixels
    seen.context.close()


def test_a_wide_table_breaks_its_heads_before_it_is_scrolled(browser, small):
    seen = Seen(browser, small, viewport={"width": 1280, "height": 900})
    widest = seen.page.evaluate(
        "() => Math.max(...[...document.querySelectorAll('table')].map(one => one.offsetWidth))"
    )
    assert widest < 1.3 * seen.page.locator("main").bounding_box()["width"]
    seen.context.close()


# Words of cells that lie on two lines, where neither hyphen nor <wbr> allows it.
BROKEN = r"""
() => {
  const broken = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode;
    if (!node.parentElement.closest("th, td, caption, h2, figcaption")) continue;
    for (const word of node.textContent.matchAll(/[^\s\u2010-\u2015-]+/g)) {
      const range = document.createRange();
      range.setStart(node, word.index);
      range.setEnd(node, word.index + word[0].length);
      const lines = new Set([...range.getClientRects()].map((box) => Math.round(box.top)));
      if (lines.size > 1) broken.push(word[0]);
    }
  }
  return broken;
}
"""


def test_no_word_is_broken_in_print(browser, small):
    seen = Seen(browser, small, viewport={"width": 680, "height": 960})
    seen.page.emulate_media(media="print")
    assert seen.page.evaluate(BROKEN) == []
    assert seen.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    seen.context.close()


def test_it_is_whole_without_scripts(browser, small):
    seen = Seen(browser, small, java_script_enabled=False)
    assert seen.page.locator("section").count() >= 10
    assert seen.page.locator(".stage img").is_visible()
    assert not seen.page.locator(".over").is_visible()
    assert not seen.page.locator(".response-text").is_visible()
    seen.context.close()


def test_it_prints_with_no_clipped_picture(browser, small, tmp_path):
    seen = Seen(browser, small, viewport={"width": 680, "height": 960})
    seen.page.emulate_media(media="print")
    sizes = seen.page.evaluate(
        """() => [...document.images].map((image) => {
             const box = image.getBoundingClientRect();
             return [box.left, box.right, box.height, document.documentElement.clientWidth];
        })"""
    )
    for left, right, height, width in sizes:
        assert left >= 0
        assert right <= width + 0.5
        assert height < 297 / 25.4 * 96 - 2 * 60  # of a page without its margins
    seen.context.close()
    made = pdf.printed(small.files["html"], tmp_path / "report.pdf")
    pages = pypdf.PdfReader(made).pages
    assert 8 <= len(pages) <= 40
    assert [round(float(size) * 25.4 / 72.0) for size in pages[0].mediabox[2:]] == [210, 297]
    heads = re.findall(r"<h2[^>]*>(.*?)</h2>", small.files["html"].read_text(encoding="utf-8"))
    for number, page in enumerate(pages, start=1):
        lines = page.extract_text().strip().splitlines()
        assert f"page {number} of {len(pages)}" in lines
        assert lines[-1].strip() not in heads  # which stay with what follows
    assert made.stat().st_size > 100_000
