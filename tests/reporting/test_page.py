"""The HTML of a report: valid, whole, safe, and reachable by those who do not see it."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from itertools import pairwise

import pytest
from small_report import NOTES, TITLE

VOID = {"wbr", "meta", "link", "img", "br", "input", "hr"}


class Elements(HTMLParser):
    """Elements with their attributes, in order; text of each kind of element."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text: dict[str, list[str]] = {}
        self.open: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag, tag

    def handle_data(self, data: str) -> None:
        if self.open:
            self.text.setdefault(self.open[-1], []).append(data)

    def attributes(self, name: str) -> list[str]:
        return [value or "" for _, held in self.found for key, value in held.items() if key == name]


@pytest.fixture(scope="module")
def elements(page: str) -> Elements:
    return Elements(page)


def test_it_parses_without_errors(page):
    html5lib = pytest.importorskip("html5lib")
    parser = html5lib.HTMLParser()
    parser.parse(page)
    assert parser.errors == []


def test_elements_are_closed(elements):
    assert elements.open == []


def test_ids_are_unique_and_every_anchor_leads_somewhere(elements):
    ids = elements.attributes("id")
    assert len(ids) == len(set(ids))
    links = [link for link in elements.attributes("href") if not link.startswith("data:")]
    assert len(links) > 10
    for link in links:
        assert link[0] == "#", link
        assert link[1:] in ids
    for label in elements.attributes("aria-labelledby"):
        assert label in ids


def test_nothing_is_loaded_from_elsewhere(page, elements):
    for source in elements.attributes("src"):
        assert source.startswith("data:image/")
    assert "default-src 'none'" in page
    outside = re.sub(r"http://www\.w3\.org/\S+", "", page)  # names of namespaces
    assert not re.search(r"(?:src|href|url\()\s*=?\s*[\"']?https?:", outside)
    assert "@import" not in page
    assert len(page.encode()) < 10e6


def test_title_and_notes_are_text(page, elements):
    assert TITLE not in page
    assert "<b>bold" not in page
    assert TITLE in "".join(elements.text["title"])
    assert TITLE in "".join(elements.text["h1"])
    paragraphs = [text.replace("\xa0", " ") for text in elements.text["p"]]
    assert any(NOTES.strip() in text for text in paragraphs)
    # Two scripts: the data of the map, which is not run, and the program.
    scripts = [held for tag, held in elements.found if tag == "script"]
    assert [held.get("type") for held in scripts] == ["application/json", None]


def test_pictures_have_texts_and_tables_have_heads(elements):
    images = [held for tag, held in elements.found if tag == "img"]
    assert len(images) > 12
    for image in images:
        assert len(image["alt"] or "") > 20
        assert image["width"]
        assert image["height"]
    heads = [held for tag, held in elements.found if tag == "th"]
    assert all(held.get("scope") in ("col", "row") for held in heads)
    tables = sum(tag == "table" for tag, _ in elements.found)
    assert sum(tag == "caption" for tag, _ in elements.found) == tables
    assert next(held for tag, held in elements.found if tag == "html") == {"lang": "en"}


def test_headings_go_down_one_at_a_time(elements):
    levels = [int(tag[1]) for tag, _ in elements.found if re.fullmatch(r"h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in pairwise(levels))


def test_the_verdict_comes_first(page):
    body = page[page.index("<main") :]
    assert body.index('id="summary"') < body.index('id="rig"')
    assert "current setting" in body[: body.index('id="rig"')]


def test_the_map_carries_its_cells_and_some_responses(page):
    held = json.loads(re.search(r'class="cells">(.*?)</script>', page, re.DOTALL)[1])
    assert [axis["name"] for axis in held["axes"]] == ["Kp", "Ki"]
    cells = len(held["axes"][0]["values"]) * len(held["axes"][1]["values"])
    assert cells == len(held["j1"]) == len(held["status"]) == 20
    assert len(held["bit"]) == len(held["top"]) == len(held["traced"])
    assert len(held["bit"][0]) == 301
    assert held["set_speed"] == [100.0] * len(held["traced"])
    assert held["best"] in held["traced"]
    assert held["own"] in held["traced"]


def test_embedded_pictures_are_whole_and_follow_the_colours_of_the_reader(elements):
    import base64
    from xml.etree import ElementTree

    themed = 0
    for source in elements.attributes("src"):
        svg = base64.b64decode(source.partition(",")[2])
        assert ElementTree.fromstring(svg).tag.endswith("svg")
        themed += b"prefers-color-scheme:dark" in svg
    assert themed >= 8
