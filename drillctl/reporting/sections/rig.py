"""A drawing of the rig: top drive, sections by depth, BHA and bit, rock.

The rig: a drawing by depth and tables of its parts; the glossary.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawn
from matplotlib.patches import Polygon, Rectangle

from drillctl.design import Design, to_toml
from drillctl.design.parts import pieces, section
from drillctl.design.tables import SectionTable
from drillctl.plots import style
from drillctl.reporting.blocks import Block, Code, Figure, Table, Text, Words
from drillctl.reporting.gather import Gathered
from drillctl.store.tables import NOTHING, number
from drillctl.studies.recommend.candidates import NAMES

LUMPED = 0.12  # height of a lumped spring as a share of the drawing
WIDEST = 0.16  # half the width of the widest section, as a share of the drawing's width
LEAST = 0.055  # smallest share of the height for a section, so that its name fits


class _Part(NamedTuple):
    table: SectionTable
    top: float
    bottom: float
    half: float


def rig_drawing(design: Design, words: Words) -> Drawn:
    """Draw a rig, depth downward."""
    figure, ax = style.axes_or_new(None, 6.4, 6.2)
    ax.set_xlim(-0.5, 1.0)
    ax.set_ylim(1.16, -0.16)
    ax.set_axis_off()
    parts = _parts(design)
    depth = 0.0
    for number_, part in enumerate(parts):
        _section(ax, part, number_, words)
        depth += part.table.span
        if part.table.length:
            shown = words.quantity(depth, "m")
            ax.text(-0.22, part.bottom, shown, ha="right", va="center", fontsize=style.SMALL)
            ax.plot([-0.2, -part.half], [part.bottom] * 2, color="#888888", linewidth=0.6)
    _ends(ax, design, words)
    name = design.tables.title or design.name
    style.title(ax, name.replace("$", r"\$"), wrap=True)
    return figure


def _parts(design: Design) -> list[_Part]:
    """Sections between 0 and 1, by length, each high enough for its name."""
    tables = design.tables.drillstring.sections
    lengths = [table.span for table in tables]
    total = sum(lengths) or 1.0
    shares = [max(LEAST, length / total) if length else LUMPED for length in lengths]
    if not any(lengths):
        shares = [1.0] * len(tables)
    scale = 1.0 / sum(shares)
    widths = [_outer(table) for table in tables]
    widest = max(widths)
    parts, top = [], 0.0
    for table, share, width in zip(tables, shares, widths, strict=True):
        bottom = top + scale * share
        parts.append(_Part(table, top, bottom, WIDEST * (0.35 + 0.65 * width / widest)))
        top = bottom
    return parts


def _outer(table: SectionTable) -> float:
    return table.diameters[0] if table.diameters else 0.1


def _section(ax: Axes, part: _Part, order: int, words: Words) -> None:
    table = part.table
    if table.stiffness is not None:
        _spring(ax, part)
        text = f"{table.name}: spring {words.quantity(table.stiffness, 'N*m/rad')}"
    else:
        colour = style.COLOURS[order % len(style.COLOURS)]
        ax.add_patch(
            Rectangle(
                (-part.half, part.top), 2.0 * part.half, part.bottom - part.top, facecolor=colour,
                alpha=0.35, edgecolor=colour, linewidth=1.4,
            )
        )  # fmt: skip
        text = f"{table.name}: {words.quantity(table.span, 'm')}"
        if table.pipe is not None:
            text += f", {table.pipe}"
        elif table.outer_diameter is not None:
            text += f", {words.diameter(table.outer_diameter)}"
            text += f" x {words.diameter(table.inner_diameter)}" if table.inner_diameter else ""
    middle = 0.5 * (part.top + part.bottom)
    ax.text(WIDEST + 0.06, middle, text, va="center", fontsize=style.SMALL)


def _spring(ax: Axes, part: _Part) -> None:
    turns = 9
    heights = [part.top + (part.bottom - part.top) * k / turns for k in range(turns + 1)]
    sides = [0.0] + [(-1.0) ** k * 0.5 * WIDEST for k in range(turns - 1)] + [0.0]
    ax.plot(sides, heights, color="black", linewidth=style.LINE)


def _ends(ax: Axes, design: Design, words: Words) -> None:
    tables = design.tables
    ax.add_patch(Rectangle((-0.24, -0.09), 0.48, 0.085, facecolor=style.SKY, edgecolor="black"))
    law = NAMES.get(tables.controller.law, tables.controller.law)
    text = f"top drive: {words.quantity(tables.top_drive.at_pipe, 'kg*m^2')}\n{law}"
    ax.text(0.28, -0.05, text, va="center", fontsize=style.SMALL)
    ax.add_patch(Rectangle((-0.1, 1.0), 0.2, 0.035, facecolor="#888888", edgecolor="black"))
    bit = [(-0.1, 1.035), (0.1, 1.035), (0.05, 1.075), (-0.05, 1.075)]
    ax.add_patch(Polygon(bit, facecolor=style.ORANGE, edgecolor="black"))
    ax.add_patch(
        Rectangle((-0.45, 1.075), 0.9, 0.06, facecolor="#BBBBBB", edgecolor="none", hatch="///",
                  alpha=0.7)
    )  # fmt: skip
    weight = words.quantity(tables.operating_point.weight_on_bit, "N")
    text = f"BHA: {words.quantity(tables.bha.inertia, 'kg*m^2')}, {weight} on bit"
    ax.text(WIDEST + 0.06, 1.045, text, va="center", fontsize=style.SMALL)


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Drawing, sections, bodies, source."""
    design, words = gathered.design, gathered.words
    tables = pieces(design.tables)
    rows = tuple(
        (
            table.name, _kind(table),
            words.quantity(table.span, "m") if table.span else NOTHING,
            *(words.diameter(x) for x in table.diameters or (None, None)),
            number(words.scaled(part.stiffness, "N*m/rad")),
            number(words.scaled(part.inertia + part.end_inertia, "kg*m^2")),
            made.said if made.lumped_into else str(made.elements),
        )
        for table, part, made in zip(tables, map(section, tables), design.mesh, strict=True)
    )  # fmt: skip
    inertia = f"inertia ({words.unit('kg*m^2')})"
    heads = (
        "section", "given as", "length", "outer diameter", "inner diameter",
        f"stiffness ({words.unit('N*m/rad')})", inertia, "elements",
    )  # fmt: skip
    top, bha = design.tables.top_drive, design.tables.bha
    bodies = tuple(
        (name, number(words.scaled(inertia_, "kg*m^2")),
         number(words.scaled(damping, "N*m*s/rad")))
        for name, inertia_, damping in (
            ("top drive", top.at_pipe, top.damping), ("BHA with bit", bha.inertia, bha.damping))
    )  # fmt: skip
    blocks: list[Block] = [
        Figure(
            "rig", "The rig: sections by depth; widths are not to scale.",
            _alt(gathered), partial(rig_drawing, design, words),
        ),
        Table("sections", "Sections from top to bottom", heads, rows),
        Table("bodies", "Bodies at the ends", ("body", inertia,
              f"damping to ground ({words.unit('N*m*s/rad')})"), bodies),
        Text(f"Source: {design.tables.source}" if design.tables.source else "No source given."),
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


def _alt(gathered: Gathered) -> str:
    words: Words = gathered.words
    names = [
        f"{table.name} {words.quantity(table.span, 'm')}" if table.length else table.name
        for table in gathered.design.tables.drillstring.sections
    ]
    return f"Drawing of the drillstring from top drive to bit: {', '.join(names)}."


def build_design(gathered: Gathered) -> tuple[Block, ...]:
    """The resolved design, word for word."""
    return (Code("The design in full", to_toml(gathered.requested)),)


GLOSSARY = Path(__file__).parents[1] / "templates" / "glossary.tsv"  # SI units in braces


def build_glossary(gathered: Gathered) -> tuple[Block, ...]:
    """One table, in the units of the reader."""

    def unit(match: re.Match[str]) -> str:
        return gathered.words.unit(match[1])

    text = re.sub(r"\{(.*?)\}", unit, GLOSSARY.read_text(encoding="utf-8"))
    heads, *rows = (tuple(line.split("\t")) for line in text.splitlines())
    return (Table("glossary", "Symbols and terms", heads, tuple(rows)),)
