"""Sections of a report, one file each: studies in, blocks out.

A section takes the result of `gather` and returns its blocks; it raises `NotThereError` with the
reason if it does not apply.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from drillctl.reporting.blocks import Block, Checks, Text
from drillctl.reporting.cells import interactive
from drillctl.reporting.gather import Gathered, NotThereError
from drillctl.reporting.sections import rig, runs, summary
from drillctl.studies.base import Section, studies


class Kind(NamedTuple):
    """A kind of section."""

    name: str  # value of --sections
    title: str  # its heading
    studies: tuple[str, ...]  # that it reads
    build: Callable[[Gathered], tuple[Block, ...]]  # its blocks
    order: int  # place among the sections


KINDS = (
    Kind("summary", "Summary and verdict",
         ("simulate", "loop", "setting", "map", "cells", "uncertainty", "tune"), summary.build, 0),
    Kind("rig", "The rig", (), rig.build, 10),
    Kind("responses", "Time responses", ("simulate", "cells", "best", "bad"), runs.build_responses,
         60),
    Kind("audit", "Accuracy audit",
         ("simulate", "map", "uncertainty", "doctor", "mesh-1", "mesh-2", "mesh-4", "step-2",
          "step-4"), runs.build_audit, 120),
    Kind("glossary", "Glossary", (), rig.build_glossary, 130),
    Kind("design", "Appendix: the design", (), rig.build_design, 140),
)  # fmt: skip
"""Every section that is not of a study object."""


def _generic(section: Section, others: set[str]) -> Callable[[Gathered], tuple[Block, ...]]:
    """What the studies of a section show, without what other sections do, or what it names."""

    def build(gathered: Gathered) -> tuple[Block, ...]:
        gathered.need(section.reads[0])
        shown = [gathered.shown(name) for name in section.reads]
        parts = [part for one in shown for part in one.parts]
        parts += [("remarks", remark, True) for remark in shown[0].remarks]
        blocks: list[Block] = []
        if section.shows:
            blocks += [part for want in section.shows for name, part, _ in parts if name == want]
            if not blocks:
                raise NotThereError(section.absent(gathered.requested))
        else:
            blocks += [remark for one in shown for remark in one.remarks]
            if checks := tuple(check for one in shown for check in one.checks):
                blocks.append(Checks("checks", "Checks", checks))
            blocks += [part for one in shown for name, part, usual in one.parts
                       if usual and name not in others]  # fmt: skip
        blocks += [Text(section.text)] if section.text else []
        return tuple(interactive(gathered, one) for one in blocks)

    return build


def _sections() -> dict[str, Kind]:
    """Every section by name, in reading order."""
    placed = list(KINDS)
    for study in studies().values():
        for one in study.sections:
            others = {name for other in study.sections if other is not one for name in other.shows}
            build = one.build or _generic(one, others)
            placed.append(Kind(one.name, one.title, one.reads, build, one.order))
    return {kind.name: kind for kind in sorted(placed, key=lambda kind: kind.order)}


SECTIONS = _sections()  # sections by name
