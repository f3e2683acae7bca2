"""From a design to a report on disk: studies, document, figures, tables as CSV."""

from __future__ import annotations

import csv
import io
import os
import time
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import drillctl
from drillctl import store
from drillctl.arrays import own_errstate
from drillctl.design import Design
from drillctl.errors import DrillctlError, InputError, nearest
from drillctl.progress import SILENT, Progress
from drillctl.reporting.blocks import (
    Block,
    Checks,
    Document,
    Figure,
    InteractiveMap,
    Section,
    Table,
    Words,
    figures_of,
)
from drillctl.reporting.gather import (
    INTERRUPTED,
    PROFILES,
    Gathered,
    NotThereError,
    Profile,
    explained,
    gather,
)
from drillctl.reporting.pages import html_page, markdown_page, printed
from drillctl.reporting.pictures import FigureFiles, drawing_helpers
from drillctl.reporting.sections import SECTIONS
from drillctl.reporting.sections.summary import summary as verdict_summary
from drillctl.reporting.sections.summary import verdict
from drillctl.store.json_files import write_json, write_text
from drillctl.text import one_line

if TYPE_CHECKING:
    from drillctl import units

NAMES = {"html": "report.html", "pdf": "report.pdf", "md": "report.md"}  # files by format


def write(
    document: Document, files: FigureFiles, folder: Path, formats: tuple[str, ...]
) -> tuple[dict[str, Path], dict[str, str]]:
    """Write a document in some formats, and its tables."""
    written: dict[str, Path] = {}
    unwritten: dict[str, str] = {}
    _write_tables(document, folder / "tables")
    if "html" in formats or "pdf" in formats:
        page = folder / NAMES["html"]
        write_text(page, html_page(document, files))
        written["html"] = page
    if "md" in formats:
        path = folder / NAMES["md"]
        write_text(path, markdown_page(document, files))
        written["md"] = path
    if "pdf" in formats:
        try:
            written["pdf"] = printed(folder / NAMES["html"], folder / NAMES["pdf"])
        except DrillctlError as error:
            unwritten["pdf"] = str(error)
    return written, unwritten


def _write_tables(document: Document, folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for section in document.sections:
        for block in section.blocks:
            if isinstance(block, Table | Checks):
                _write_csv(folder / f"{section.name}-{block.name}.csv", block.heads, block.rows)


def _write_csv(path: Path, heads: tuple[str, ...], rows: tuple[tuple[str, ...], ...]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([[_plain(cell) for cell in row] for row in rows])
    write_text(path, text.getvalue())


def _plain(cell: str) -> str:
    """Format a cell for a spreadsheet: plain numbers, formulas as text."""
    minus = cell.replace("−", "-")
    try:
        float(minus)
    except ValueError:
        return f"'{cell}" if cell[:1] in "=+@" else cell
    return minus


def chosen_sections(requested: Iterable[str] | None) -> tuple[str, ...]:
    """Names of the requested sections in order; all by default."""
    if requested is None:
        return tuple(SECTIONS)
    names = [name.strip() for name in requested if name.strip()]
    _known(names, SECTIONS, "section", "--sections")
    if not names:
        raise InputError(f"must name a section; allowed: {', '.join(SECTIONS)}", "--sections")
    return tuple(name for name in SECTIONS if name in names)


def studies_of(sections: Iterable[str]) -> tuple[str, ...]:
    """Studies that sections read."""
    return tuple(dict.fromkeys(name for one in sections for name in SECTIONS[one].studies))


def compose(gathered: Gathered, sections: Iterable[str], title: str | None) -> Document:
    """The document of a design."""
    names = set(sections)
    made, left_out, failed = [], [], []
    for kind in SECTIONS.values():
        if kind.name not in names:
            continue
        try:
            made.append(Section(kind.name, kind.title, kind.build(gathered)))
        except NotThereError as reason:
            left_out.append((kind.title, reason.why))
        except Exception as error:  # one section less, whatever it raises
            left_out.append((kind.title, explained(error)))
            failed.append(f"The section {kind.title!r} failed: {explained(error)}")
    design = gathered.requested
    made = [_with_own_files(one, _taken_twice(made)) for one in made]
    return Document(
        title=one_line(title or design.tables.title or design.name),
        subtitle=f"Torsional stick-slip of a drillstring: report of the design {design.name}",
        facts=_facts(gathered),
        problems=(*gathered.problems, *failed),
        sections=tuple(made),
        left_out=tuple(left_out),
    )


def _taken_twice(sections: Iterable[Section]) -> set[str]:
    """Names of figures that several sections have."""
    names = Counter(one.name for section in sections for one in figures_of(section.blocks))
    return {name for name, count in names.items() if count > 1}


def _with_own_files(section: Section, taken: set[str]) -> Section:
    """A section whose figures have files of their own: with its name before one taken twice."""

    def own(block: Block) -> Block:
        if isinstance(block, InteractiveMap):
            figure = own(block.figure)
            assert isinstance(figure, Figure)
            return replace(block, figure=figure)
        if isinstance(block, Figure) and block.name in taken:
            return replace(block, name=f"{section.name}-{block.name}")
        return block

    return replace(section, blocks=tuple(map(own, section.blocks)))


def _today() -> str:
    """The date, or that of `SOURCE_DATE_EPOCH` where the same report is to be the same file."""
    now = datetime.fromtimestamp(float(os.environ.get("SOURCE_DATE_EPOCH", time.time())), UTC)
    return f"{now.day} {now:%B %Y}"


def _facts(gathered: Gathered) -> tuple[tuple[str, str], ...]:
    design, table = gathered.requested, gathered.design.tables.uncertainty
    facts = [
        ("design", design.name),
        *([("author", one_line(design.tables.author))] if design.tables.author else []),
        ("date", _today()),
        ("profile", f"{gathered.profile.name} ({gathered.profile.meaning})"),
        ("program", f"drillctl {drillctl.__version__}"),
        ("seed", str(table.seed)),
        ("units", "field (klbf, klbf ft, ft, in)" if gathered.words.system == "field" else "SI"),
    ]
    if design.tables.status:
        facts.append(("status of the model", design.tables.status))
    return tuple(facts)


Format = Literal["html", "pdf", "md"]
FORMATS: tuple[Format, ...] = ("html", "pdf", "md")


@dataclass(frozen=True)
class Report:
    """A report on disk."""

    folder: Path  # where it is
    files: dict[str, Path]  # files by format: `html`, `pdf`, `md`
    problems: tuple[str, ...]  # failed or unfinished parts; empty for a complete report
    interrupted: bool  # whether it was interrupted; the same call resumes
    unwritten: dict[str, str]  # formats that could not be written, with the reason
    content: dict[str, Any]  # what `summary.json` holds

    def summary(self) -> dict[str, Any]:
        """Verdict, problems, files and the summaries of the studies; SI units."""
        return self.content


@own_errstate()
def report(
    design: Design,
    folder: str | Path | None = None,
    profile: str | Profile = "quick",
    sections: Iterable[str] | None = None,
    title: str | None = None,
    formats: Iterable[str] = ("html",),
    system: units.System | None = None,
    progress: Progress = SILENT,
    processes: int = 1,
) -> Report:
    """Write the report of a design; finished studies in its folder are read, not run again.

    Parameters
    ----------
    design : Design
        Any.
    folder : str or Path, optional
        New, empty, or holding the report of the same design and profile; by default a new folder
        under `runs`.
    profile : str or Profile
        How much is computed: `quick`, `standard` or `full`.
    sections : iterable of str, optional
        Names of the sections; all by default.
    title : str, optional
        Instead of the design's own.
    formats : iterable of str
        `html`, `pdf` and `md`.
    system : {'si', 'field'}, optional
        Units of tables and pictures; by default those of the design, else field units.
    progress : Progress
        Receives tasks and finished parts.
    processes : int
        How many draw the pictures. More than this one import its main module again: a script
        that asks for them does its work below `if __name__ == "__main__"`.

    Returns
    -------
    Report
        Lists a study that fails, as do the first lines of the document. If none of the formats
        can be written, an exception is raised.

    Raises
    ------
    InputError
        Unknown profile, section or format, or the folder holds other files.
    """
    if isinstance(profile, str):
        _known([profile], PROFILES, "profile", "--profile")
    spent = PROFILES[profile] if isinstance(profile, str) else profile
    wanted, named = chosen_sections(sections), set(formats)
    _known(named, FORMATS, "format", "--format")
    kinds = tuple(name for name in FORMATS if name in named) or ("html",)
    words = Words(system or design.tables.units or "field")
    with (
        store.claim("report", design, folder, profile=spent.name) as run,
        drawing_helpers(processes - 1) as helpers,
    ):
        return _report(design, run, spent, wanted, title, kinds, words, progress, helpers)


def _report(
    design: Design, run: store.RunFolder, profile: Profile, wanted: tuple[str, ...],
    title: str | None, kinds: tuple[Format, ...], words: Words, progress: Progress,
    helpers: Executor | None,
) -> Report:  # fmt: skip
    gathered = gather(design, profile, run.path / "studies", studies_of(wanted), words, progress)
    interrupted = any(one.why == INTERRUPTED for one in gathered.studies.values())
    progress.begin("writing the report", 1)
    document = compose(gathered, wanted, title)
    files = FigureFiles(run.path / "figures", gathered)
    problems = (*document.problems, *files.collect(document, helpers))
    document = replace(document, problems=problems)
    written, unwritten = write(document, files, run.path, kinds)
    if not written:
        raise DrillctlError("; ".join(unwritten.values()))
    content = _content(gathered, document, written, unwritten)
    if problems:
        write_json(run.path / "summary.json", content)  # unfinished: the same call resumes it
    else:
        run.conclude(None, content)
    return Report(run.path, written, problems, interrupted, unwritten, content)


def _known(names: Iterable[str], allowed: Iterable[str], kind: str, option: str) -> None:
    """Refuse a name that is not allowed, with the nearest that is."""
    for name in names:
        if name not in allowed:
            raise InputError(f"no {kind} {name!r}; {nearest(name, allowed)}", option)


def _content(
    gathered: Gathered,
    document: Document,
    written: dict[str, Path],
    unwritten: dict[str, str],
) -> dict[str, Any]:
    design = gathered.requested
    return {
        "design": design.name,
        "title": document.title,
        "profile": gathered.profile.name,
        "complete": not document.problems,
        "problems": list(document.problems),
        "verdict": verdict_summary(verdict(gathered)),
        "sections": [section.name for section in document.sections],
        "left_out": dict(document.left_out),
        "files": {kind: path.name for kind, path in written.items()},
        "not_written": unwritten,
        "studies": {
            name: one.summary for name, one in gathered.studies.items() if one.state == "done"
        },
    }
