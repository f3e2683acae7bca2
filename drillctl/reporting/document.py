"""From studies to a document: its sections, what is left out, what went wrong."""

from __future__ import annotations

from collections.abc import Iterable

import drillctl
from drillctl.errors import InputError, nearest
from drillctl.reporting.blocks import Document, Section
from drillctl.reporting.gather import Gathered, NotThereError
from drillctl.reporting.sections import KINDS, SECTIONS


def chosen_sections(asked: Iterable[str] | None) -> tuple[str, ...]:
    """Names of sections in the order in which they are read; all if none are asked for."""
    if asked is None:
        return tuple(SECTIONS)
    names = [name.strip() for name in asked if name.strip()]
    for name in names:
        if name not in SECTIONS:
            raise InputError(f"no section {name!r}; {nearest(name, SECTIONS)}", "--sections")
    if not names:
        raise InputError(f"names no section; allowed: {', '.join(SECTIONS)}", "--sections")
    return tuple(name for name in SECTIONS if name in names)


def studies_of(sections: Iterable[str]) -> tuple[str, ...]:
    """Studies that some sections read."""
    return tuple(dict.fromkeys(name for one in sections for name in SECTIONS[one].studies))


def compose(gathered: Gathered, sections: Iterable[str], title: str | None) -> Document:
    """The document of a design."""
    names = set(sections)
    made, left_out = [], []
    for kind in KINDS:
        if kind.name not in names:
            continue
        try:
            made.append(Section(kind.name, kind.title, kind.build(gathered)))
        except NotThereError as reason:
            left_out.append((kind.title, reason.why))
    design = gathered.asked
    return Document(
        title=title or design.tables.title or design.name,
        subtitle=f"Torsional stick-slip of a drillstring: report of the design {design.name}",
        facts=_facts(gathered),
        problems=gathered.problems,
        sections=tuple(made),
        left_out=tuple(left_out),
    )


def _facts(gathered: Gathered) -> tuple[tuple[str, str], ...]:
    design, table = gathered.asked, gathered.design.tables.uncertainty
    facts = [
        ("design", design.name),
        ("profile", f"{gathered.profile.name} ({gathered.profile.told})"),
        ("program", f"drillctl {drillctl.__version__}"),
        ("seed", str(table.seed)),
        ("units", "drillers' (klbf, klbf ft, ft)" if gathered.words.system == "field" else "SI"),
    ]
    if design.tables.status:
        facts.append(("status of the rig", design.tables.status))
    return tuple(facts)
