"""One small report for all tests that read one."""

from __future__ import annotations

import pytest
from small_report import TINY, small_design

import drillctl
from drillctl.reporting import Report


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """Its report as HTML and Markdown."""
    folder = tmp_path_factory.mktemp("report") / "small"
    return drillctl.report(small_design(), folder, TINY, formats=("html", "md"), processes=2)


@pytest.fixture(scope="session")
def page(small: Report) -> str:
    """The HTML of that report."""
    return small.files["html"].read_text(encoding="utf-8")
