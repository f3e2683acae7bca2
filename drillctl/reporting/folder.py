"""What lies in the folder of a report: the documents, pictures, tables as CSV."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

from drillctl.errors import DrillctlError
from drillctl.reporting import html, markdown
from drillctl.reporting import html as pdf
from drillctl.reporting.blocks import Checks, Document, Table
from drillctl.reporting.pictures import Album
from drillctl.store.json_files import write_json, write_text

NAMES = {"html": "report.html", "pdf": "report.pdf", "md": "report.md"}
"""Files by format."""


def write(
    document: Document, album: Album, folder: Path, formats: tuple[str, ...]
) -> tuple[dict[str, Path], dict[str, str]]:
    """Write a document in some formats, and its tables."""
    written: dict[str, Path] = {}
    unwritten: dict[str, str] = {}
    _write_tables(document, folder / "tables")
    if "html" in formats or "pdf" in formats:
        page = folder / NAMES["html"]
        write_text(page, html.page(document, album))
        written["html"] = page
    if "md" in formats:
        path = folder / NAMES["md"]
        write_text(path, markdown.page(document, album))
        written["md"] = path
    if "pdf" in formats:
        try:
            written["pdf"] = pdf.printed(folder / NAMES["html"], folder / NAMES["pdf"])
        except DrillctlError as error:
            unwritten["pdf"] = str(error)
    return written, unwritten


def unfinished(folder: Path, content: dict[str, Any]) -> None:
    """Write what is known of a report that is not complete; its run goes on when asked again."""
    write_json(folder / "summary.json", content)


def _write_tables(document: Document, folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for section in document.sections:
        for block in section.blocks:
            if isinstance(block, Table):
                _write_csv(folder / f"{section.name}-{block.name}.csv", block.heads, block.rows)
            elif isinstance(block, Checks):
                rows = tuple((one.question, one.word, one.detail) for one in block.checks)
                heads = ("question", "answer", "detail")
                _write_csv(folder / f"{section.name}-{block.name}.csv", heads, rows)


def _write_csv(path: Path, heads: tuple[str, ...], rows: tuple[tuple[str, ...], ...]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([[_plain(cell) for cell in row] for row in rows])
    write_text(path, text.getvalue())


def _plain(cell: str) -> str:
    """A number as a spreadsheet reads it; a formula as text."""
    minus = cell.replace("−", "-")
    try:
        float(minus)
    except ValueError:
        return f"'{cell}" if cell[:1] in "=+@" else cell
    return minus
