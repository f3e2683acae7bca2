"""A report as one HTML file, as PDF printed by a headless browser, and as Markdown."""

from __future__ import annotations

import base64
import os
import re
import shutil
import subprocess
import tempfile
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

from drillctl.errors import DrillctlError
from drillctl.reporting.blocks import Document, Figure
from drillctl.reporting.pictures import FigureFiles, themed
from drillctl.text import clean

_UNIT = re.compile(
    r"(?<=[\d∞]) (?=%|(?:s|Hz|ms|rpm|kN|klbf|ft|m|N|kg|lb|dB|in|mm|kJ)\b)"
    r"|(?<=\bN) (?=m\b)|(?<=\bN m) (?=s\b)|(?<=\bklbf) (?=ft\b)|(?<=\bkN) (?=m\b)"
)
_ONE = r"[+−-]?[\d.]+(?: × 10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?"
_NUMBER = re.compile(
    rf"^{_ONE}(?: \((?:{_ONE} to|at least|at most) {_ONE}\))?( [%°]| s| Hz| ms)?$|^–$|^∞$"
)

_LONG = re.compile(r"[\w./=-]{15,}")
_JOINT = re.compile(r"([./_=])(?=\w)")

SHORT = 26  # longest text (characters) of a cell kept on one line


def html_page(document: Document, files: FigureFiles) -> str:
    """The whole document."""

    def drawn(figure: Figure) -> dict[str, Any]:
        picture = files.picture(figure)
        svg = picture.svg if figure.paper else themed(picture.svg)
        data = base64.b64encode(svg.encode()).decode()
        left, top, width, height = (f"{100.0 * share:.4f}%" for share in picture.box)
        return {
            "source": f"data:image/svg+xml;base64,{data}",
            "width": round(picture.width / 0.75),
            "height": round(picture.height / 0.75),
            "box": f"left:{left};top:{top};width:{width};height:{height}",
        }

    template = _environment().get_template("report.html.j2")
    return template.render(document=document, drawn=drawn)


@cache
def _environment() -> Any:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("drillctl.reporting"), trim_blocks=True, lstrip_blocks=True,
        autoescape=jinja2.select_autoescape(["html.j2"]), undefined=jinja2.StrictUndefined,
        finalize=lambda value: clean(value) if type(value) is str else value,
    )  # fmt: skip
    environment.globals["kind"] = lambda block: type(block).__name__
    for one in (_figures, _kept, _short, _plain, _fence):
        environment.filters[one.__name__.strip("_")] = one
    return environment


def _figures(rows: tuple[tuple[str, ...], ...], column: int) -> bool:
    """Whether a column holds numbers, which are right-aligned; a word among them is as well."""
    if column == 0:
        return False
    numbers = sum(bool(_NUMBER.match(row[column])) for row in rows)
    return 2 * numbers > len(rows) and _short(rows, column)


def _kept(text: str) -> Any:
    """Join numbers and units by non-breaking spaces; say where a long name may be broken."""
    from markupsafe import Markup

    joined = escape(_UNIT.sub("\u00a0", clean(text)))
    return Markup(_LONG.sub(lambda word: _JOINT.sub(r"\1<wbr>", word[0]), joined))


def _short(rows: tuple[tuple[str, ...], ...], column: int) -> bool:
    """Whether all cells of a column are short enough for one line."""
    return all(len(row[column]) <= SHORT for row in rows)


BROWSERS = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome",
    "microsoft-edge",
)  # fmt: skip
"""Browsers that print, in order of preference."""
CHOICE = "DRILLCTL_BROWSER"  # environment variable that names another command
PATIENCE = 120.0  # longest time for printing (s)
OPTIONS = (
    "--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-extensions", "--disable-quic",
    "--no-pdf-header-footer", "--hide-scrollbars",
)  # fmt: skip


def browser() -> str | None:
    """The command of a browser, or None."""
    chosen = os.environ.get(CHOICE)
    if chosen is not None:
        return shutil.which(chosen)
    return next((result for name in BROWSERS if (result := shutil.which(name))), None)


def printed(html_page: Path, target: Path) -> Path:
    """Print a html_page as PDF."""
    command = browser()
    if command is None:
        raise DrillctlError(
            "no PDF: Chromium is not installed; install it ('apt install chromium', or Chrome or "
            f"Edge), set {CHOICE} to its command, or print report.html from any browser"
        )
    target.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory(prefix="drillctl-") as profile:
        options = [*OPTIONS, f"--user-data-dir={profile}", f"--print-to-pdf={target.resolve()}"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:  # the sandbox does not start as root
            options.append("--no-sandbox")
        try:
            done = subprocess.run(
                [command, *options, html_page.resolve().as_uri()],
                capture_output=True, text=True, timeout=PATIENCE, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise DrillctlError(f"no PDF: {command} failed: {error}") from None
    if not target.is_file():
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise DrillctlError(f"no PDF: {command} wrote no file: {last}")
    return target


_MARKS = re.compile(r"([\\`*_{}\[\]#|~])")


def markdown_page(document: Document, files: FigureFiles) -> str:
    """The whole document."""

    def picture(figure: Figure) -> str:
        files.picture(figure)
        return f"figures/{figure.name}.png"

    template = _environment().get_template("report.md.j2")
    text: str = template.render(document=document, picture=picture)
    return text.rstrip() + "\n"


def _plain(text: str) -> str:
    """Escape markup, on one line."""
    return _MARKS.sub(r"\\\1", escape(" ".join(text.split()), quote=False))


def _fence(text: str) -> str:
    """More backquotes than there are in a row in a text."""
    return "`" * max(3, 1 + max(map(len, re.findall("`+", text)), default=0))
