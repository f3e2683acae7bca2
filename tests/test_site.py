"""What the documentation site is built with."""

import importlib.util
import re
import subprocess
import sys
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
    for page in DOCS.glob("*.md"):
        text = page.read_text(encoding="utf-8")
        text = re.sub(r"^```.*?^```$|`[^`]*`", "", text, flags=re.DOTALL | re.MULTILINE)
        for formula in re.findall(r"\${1,2}([^$]+?)\${1,2}", text):
            made = convert(formula)
            assert "\\" not in made, f"{page.name}: {formula}"
            assert made.startswith("<math")


def test_a_page_as_the_site_shows_it(tmp_path):
    pytest.importorskip("myst_parser")
    pytest.importorskip("latex2mathml")
    pages = tmp_path / "docs"
    pages.mkdir()
    (tmp_path / "beside.md").write_text("# Beside\n")
    (pages / "conf.py").write_text(
        f"import sys\nsys.path.insert(0, {str(DOCS)!r})\n"
        "extensions = ['myst_parser', 'site_math', 'site_outside', 'site_tables']\n"
        "myst_enable_extensions = ['dollarmath']\nhtml_math_renderer = 'mathml'\n"
    )
    (pages / "index.md").write_text(
        "# Page\n\n[words](../beside.md) $K_p$\n\n| a | b |\n|---|---|\n| 1e-05 s | 2 of all |\n"
    )
    built = tmp_path / "built"
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html", pages, built]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    text = (built / "index.html").read_text(encoding="utf-8")
    assert "words" in text
    assert "beside" not in text
    assert re.search(r'<td class="number"><p>1e-05 s</p></td>\s*<td><p>2 of all', text)
    assert "<msub><mi>K</mi><mi>p</mi></msub>" in text

    (pages / "index.md").write_text("# Page\n\n[words](../gone.md)\n")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "gone.md" in done.stderr
