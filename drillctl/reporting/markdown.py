"""A report as Markdown, with figures as PNG files."""

from __future__ import annotations

import re
from functools import singledispatch
from html import escape

from drillctl.reporting.blocks import (
    Block,
    Checks,
    Code,
    Document,
    Figure,
    InteractiveMap,
    Table,
    Text,
)
from drillctl.reporting.pictures import FigureFiles

_MARKS = re.compile(r"([\\`*_{}\[\]#|~])")


def page(document: Document, files: FigureFiles) -> str:
    """The whole document."""
    lines = [f"# {_text(document.title)}", ""]
    if document.problems:
        lines += ["**This report is not complete.**", ""]
        lines += [f"- {_text(problem)}" for problem in document.problems] + [""]
    lines += [_text(document.subtitle), ""]
    lines += [f"- {_text(name)}: {_text(value)}" for name, value in document.facts] + [""]
    for section in document.sections:
        lines += [f"## {_text(section.title)}", ""]
        for block in section.blocks:
            lines += [_block(block, files), ""]
    if document.left_out:
        lines += ["## Not in this report", ""]
        lines += [f"- {_text(name)}: {_text(why)}" for name, why in document.left_out] + [""]
    return "\n".join(lines)


def _text(text: str) -> str:
    """Escape markup, on one line."""
    return _MARKS.sub(r"\\\1", escape(" ".join(text.split()), quote=False))


@singledispatch
def _block(block: Block, files: FigureFiles) -> str:
    raise TypeError(type(block).__name__)


@_block.register
def _(block: Text, files: FigureFiles) -> str:
    return _text(block.text) if block.kind == "plain" else f"> {_text(block.text)}"


@_block.register
def _(block: Table, files: FigureFiles) -> str:
    return _table(block.caption, block.heads, block.rows)


@_block.register
def _(block: Checks, files: FigureFiles) -> str:
    rows = tuple((one.question, one.word, one.detail) for one in block.checks)
    return _table(block.caption, ("question", "answer", "detail"), rows)


def _table(caption: str, heads: tuple[str, ...], rows: tuple[tuple[str, ...], ...]) -> str:
    lines = [f"**{_text(caption)}**", ""]
    lines.append("| " + " | ".join(map(_text, heads)) + " |")
    lines.append("|" + "---|" * len(heads))
    lines += ["| " + " | ".join(map(_text, row)) + " |" for row in rows]
    return "\n".join(lines)


@_block.register
def _(block: Figure, files: FigureFiles) -> str:
    files.picture(block)
    return f"![{_text(block.alt)}](figures/{block.name}.png)\n\n*{_text(block.caption)}*"


@_block.register
def _(block: InteractiveMap, files: FigureFiles) -> str:
    return _block(block.figure, files)


@_block.register
def _(block: Code, files: FigureFiles) -> str:
    fence = "```"
    while fence in block.text:
        fence += "`"
    return f"{_text(block.caption)}\n\n{fence}{block.language}\n{block.text.rstrip()}\n{fence}"
