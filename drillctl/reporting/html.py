"""A report as one HTML file that needs nothing beside it."""

from __future__ import annotations

import base64
import re
from functools import cache
from typing import Any

from drillctl.reporting.blocks import Document, Figure
from drillctl.reporting.pictures import Album, themed

_UNIT = re.compile(
    r"(?<=[\d∞]) (?=%|(?:s|Hz|ms|rpm|kN|klbf|ft|m|N|kg|dB|in|mm|kJ)\b)"
    r"|(?<=\bN) (?=m\b)|(?<=\bN m) (?=s\b)|(?<=\bklbf) (?=ft\b)|(?<=\bkN) (?=m\b)"
)
_NUMBER = re.compile(r"^[−-]?[\d.]+( × 10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?( [%°]| s| Hz| ms)?$|^–$|^∞$")

SHORT = 26
"""Longest text (characters) of a cell that stays on one line."""


def page(document: Document, album: Album) -> str:
    """The whole document."""

    def drawn(figure: Figure) -> dict[str, Any]:
        picture = album.picture(figure)
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
        loader=jinja2.PackageLoader("drillctl.reporting"), autoescape=True, trim_blocks=True,
        lstrip_blocks=True, undefined=jinja2.StrictUndefined,
    )  # fmt: skip
    environment.globals["kind"] = lambda block: type(block).__name__
    environment.filters["figures"] = _figures
    environment.filters["kept"] = _kept
    environment.filters["short"] = _short
    return environment


def _figures(rows: tuple[tuple[str, ...], ...], column: int) -> bool:
    """Whether a column holds numbers alone, which are set to the right."""
    return column > 0 and all(_NUMBER.match(row[column]) for row in rows)


def _kept(text: str) -> str:
    """Text whose numbers are not parted from their units at the end of a line."""
    return _UNIT.sub("\u00a0", text)


def _short(rows: tuple[tuple[str, ...], ...], column: int) -> bool:
    """Whether the cells of a column are better left on one line."""
    return all(len(row[column]) <= SHORT for row in rows)
