"""Sections of a report, each in a file of its own: studies in, blocks out.

A section takes what `gather` found and returns its blocks; it raises `NotThereError` with the
reason where it does not apply.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from drillctl.reporting.blocks import Block
from drillctl.reporting.gather import Gathered
from drillctl.reporting.sections import (
    advantage,
    audit,
    comparison,
    glossary,
    loop,
    modes,
    operating_point,
    regions,
    responses,
    rig,
    sensitivity,
    stability,
    summary,
    tuning,
    uncertainty,
)


class Kind(NamedTuple):
    """A kind of section."""

    name: str  # by which it is asked for
    title: str  # its heading
    studies: tuple[str, ...]  # what it reads
    build: Callable[[Gathered], tuple[Block, ...]]  # its blocks


KINDS = (
    Kind("summary", "Summary and verdict",
         ("simulate", "loop", "setting", "map", "cells", "uncertainty", "tune"), summary.build),
    Kind("rig", "The rig", (), rig.build),
    Kind("operating-point", "Operating point and friction", ("loop",), operating_point.build),
    Kind("modes", "Modes of the string", ("modes",), modes.build),
    Kind("loop", "The linear loop", ("loop", "slope-margin"), loop.build),
    Kind("map", "J1 over the map", ("map", "cells"), stability.build),
    Kind("responses", "Time responses", ("simulate", "cells", "best", "bad"), responses.build),
    Kind("regions", "Three regions", ("regions",), regions.build),
    Kind("uncertainty", "Uncertainty", ("uncertainty", "setting"), uncertainty.build),
    Kind("sensitivity", "Sensitivity", ("uncertainty",), sensitivity.build),
    Kind("tuning", "Tuned gains and their certificate", ("tune",), tuning.build),
    Kind("comparison", "Cases compared", ("compare",), comparison.build),
    Kind("advantage", "What a moving weight on bit is worth", ("advantage",), advantage.build),
    Kind("audit", "Audit",
         ("simulate", "map", "uncertainty", "doctor", "mesh-1", "mesh-2", "mesh-4", "step-2",
          "step-4"), audit.build),
    Kind("glossary", "Glossary", (), glossary.build),
)  # fmt: skip
"""Every section, in the order in which they are read."""

SECTIONS = {kind.name: kind for kind in KINDS}
"""Sections by name."""
