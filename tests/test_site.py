"""What the documentation site is built with."""

import importlib.util
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"


def script(name):
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_links_and_anchors_that_lead_nowhere_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<a href="b.html#here">1</a> <a href="b.html#gone">2</a> <img src="no.png">'
        '<a href="#top">3</a> <a href="https://example.org/x">4</a>'
    )
    (tmp_path / "b.html").write_text('<h1 id="here">b</h1> <a href="c.html">5</a>')
    assert list(script("check_links").broken(tmp_path)) == [
        "a.html: b.html#gone: no such anchor",
        "a.html: no.png",
        "a.html: #top: no such anchor",
        "b.html: c.html",
    ]


def test_every_page_has_its_place_in_the_site():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = set(index.split())
    for page in DOCS.glob("*.md"):
        assert page.stem in listed or page.stem.startswith("howto-") or page.stem == "index", page


def test_every_formula_becomes_mathml():
    pytest.importorskip("sphinx")
    convert = pytest.importorskip("latex2mathml.converter").convert
    import re

    for page in DOCS.glob("*.md"):
        text = page.read_text(encoding="utf-8")
        text = re.sub(r"^```.*?^```$|`[^`]*`", "", text, flags=re.DOTALL | re.MULTILINE)
        for formula in re.findall(r"\${1,2}([^$]+?)\${1,2}", text):
            made = convert(formula)
            assert "\\" not in made, f"{page.name}: {formula}"
            assert made.startswith("<math")
