"""Sections of a report, one file each: studies in, blocks out.

A section takes the result of `gather` and returns its blocks; it raises `NotThereError` with the
reason if it does not apply.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from drillctl.reporting.blocks import Block, Text, block, figure
from drillctl.reporting.gather import Gathered
from drillctl.reporting.sections import audit, rig, runs, summary
from drillctl.studies.base import Section, studies


class Kind(NamedTuple):
    """A kind of section."""

    name: str  # value of --sections
    title: str  # its heading
    studies: tuple[str, ...]  # that it reads
    build: Callable[[Gathered], tuple[Block, ...]]  # its blocks


KINDS = (
    Kind("summary", "Summary and verdict",
         ("simulate", "loop", "setting", "map", "cells", "uncertainty", "tune"), summary.build),
    Kind("rig", "The rig", (), rig.build),
    Kind("map", "J1 over the map", ("map", "cells"), runs.build_map),
    Kind("responses", "Time responses", ("simulate", "cells", "best", "bad"), runs.build_responses),
    Kind("uncertainty", "Uncertainty", ("uncertainty", "setting"), runs.build_uncertainty),
    Kind("sensitivity", "Sensitivity", ("uncertainty",), runs.build_sensitivity),
    Kind("audit", "Accuracy audit",
         ("simulate", "map", "uncertainty", "doctor", "mesh-1", "mesh-2", "mesh-4", "step-2",
          "step-4"), audit.build),
    Kind("glossary", "Glossary", (), rig.build_glossary),
)  # fmt: skip
"""Every section that is not of a study object, in the order in which they are read."""
_ORDER = {
    "summary": 0, "rig": 10, "operating-point": 20, "modes": 30, "loop": 40, "map": 50,
    "responses": 60, "uncertainty": 70, "sensitivity": 80,
     "audit": 120, "glossary": 130,
}  # fmt: skip


def _generic(section: Section) -> Callable[[Gathered], tuple[Block, ...]]:
    """Remarks, figures and tables of the studies of a section, or those that it names."""
    owners = {recipe.name: study for study in studies().values() for recipe in study.recipes}

    def build(gathered: Gathered) -> tuple[Block, ...]:
        system = gathered.words.system
        gathered.need(section.reads[0])
        said: list[Block] = []
        parts: list[tuple[str, Block]] = []
        for name in section.reads:
            found = gathered.have(name)
            if found is None:
                continue
            study, result = owners[name], found.result
            said += [Text(remark) for remark in study.remarks(result, system)]
            parts += [(p.name, figure(p, name, system)) for p in study.pictures(result)]
            parts += [(t.name, block(t, system)) for t in study.tables(result) if t.shown]
        if section.shows:
            said = []
            parts = [one for wanted in section.shows for one in parts if one[0] == wanted]
        last = (Text(section.text),) if section.text else ()
        return (*said, *(part for _, part in parts), *last)

    return build


def _sections() -> dict[str, Kind]:
    """Every section by name, in reading order."""
    placed = [(_ORDER[kind.name], kind) for kind in KINDS]
    for study in studies().values():
        for one in study.sections:
            build = one.build or _generic(one)
            placed.append((one.order, Kind(one.name, one.title, one.reads, build)))
    return {kind.name: kind for _, kind in sorted(placed, key=lambda pair: pair[0])}


SECTIONS = _sections()  # sections by name
