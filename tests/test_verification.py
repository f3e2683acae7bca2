"""The page of what is verified is that of the tests as they are."""

import importlib.util
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "verification.md"


def maker():
    spec = importlib.util.spec_from_file_location("making", ROOT / "docs/make_verification.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_holds_what_the_tests_hold():
    making, text = maker(), PAGE.read_text(encoding="utf-8")
    assert making.put(text, "held", making.rows(making.held())) == text, (
        "run `python docs/make_verification.py`"
    )


def test_figures_of_the_page_are_measured_by_tests():
    table = PAGE.read_text(encoding="utf-8").split("<!-- measured: begin")[1]
    rows = [line.split(" | ") for line in table.splitlines() if line.startswith("| ")][1:]
    assert len(rows) >= 8
    for name, _, test in rows:
        text = (ROOT / test.strip(" |`")).read_text(encoding="utf-8")
        assert name.strip("| ").split(",")[0] in text, name
