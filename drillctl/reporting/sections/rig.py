"""The rig: a drawing by depth, and its parts in a table."""

from __future__ import annotations

from drillctl.design.tables import SectionTable
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.rig_drawing import rig_drawing
from drillctl.reporting.words import NOTHING, Words, number
from drillctl.rig.drillstring import PIPES


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Drawing, sections, bodies; where it is from."""
    design, words = gathered.design, gathered.words
    parts = design.string.parts.sections
    tables = design.tables.drillstring.sections
    rows = tuple(
        (
            table.name, _kind(table),
            words.quantity(table.length, "m") if table.length else NOTHING,
            words.diameter(_diameters(table)[0]), words.diameter(_diameters(table)[1]),
            f"{number(part.stiffness)}", f"{number(part.inertia + part.end_inertia)}",
            str(part.elements),
        )
        for table, part in zip(tables, parts, strict=True)
    )  # fmt: skip
    heads = (
        "section", "given as", "length", "outer diameter", "inner diameter",
        "stiffness (N m/rad)", "inertia (kg m²)", "elements",
    )  # fmt: skip
    bodies = (
        ("top drive", number(design.tables.top_drive.inertia),
         number(design.tables.top_drive.damping)),
        ("BHA with bit", number(design.tables.bha.inertia), number(design.tables.bha.damping)),
    )  # fmt: skip
    blocks: list[Block] = [
        Figure(
            "rig", "The rig, sections by depth; widths not to the scale of depth.",
            _alt(gathered), lambda: rig_drawing(design, words),
        ),
        Table("sections", "Sections from top to bottom", heads, rows),
        Table("bodies", "Bodies at the ends", ("body", "inertia (kg m²)",
              "damping to ground (N m s/rad)"), bodies),
        Text(f"Source: {design.tables.source}" if design.tables.source else "No source is given."),
    ]  # fmt: skip
    if design.tables.notes:
        blocks.append(Text(f"Notes: {design.tables.notes}"))
    return tuple(blocks)


def _kind(table: SectionTable) -> str:
    if table.pipe is not None:
        return table.pipe
    if table.stiffness is not None:
        return "lumped spring"
    return "diameters" if table.outer_diameter is not None else "polar moment"


def _diameters(table: SectionTable) -> tuple[float | None, float | None]:
    if table.pipe is not None:
        return PIPES[table.pipe].outer_diameter, PIPES[table.pipe].inner_diameter
    return table.outer_diameter, table.inner_diameter


def _alt(gathered: Gathered) -> str:
    words: Words = gathered.words
    names = [
        f"{table.name} {words.quantity(table.length, 'm')}" if table.length else table.name
        for table in gathered.design.tables.drillstring.sections
    ]
    return f"Drawing of the drillstring from top drive to bit: {', '.join(names)}."
