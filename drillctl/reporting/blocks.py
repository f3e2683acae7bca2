"""Blocks of a section, independent of the output format."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal

from drillctl.store.tables import Table as Results
from drillctl.studies.base import Check, Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

    from drillctl import units


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str  # plain; nothing in it is markup
    kind: Literal["plain", "note", "open", "warning"] = "plain"


@dataclass(frozen=True)
class Table:
    """A table with one row of heads; the first column names the rows."""

    name: str  # of its CSV file
    caption: str  # what it shows
    heads: tuple[str, ...]  # with units in brackets
    rows: tuple[tuple[str, ...], ...]  # as long as the heads


@dataclass(frozen=True)
class Checks:
    """Questions with their answers."""

    name: str  # of its CSV file
    caption: str
    checks: tuple[Check, ...]  # in reading order
    heads: ClassVar = ("question", "answer", "detail")

    @property
    def rows(self) -> tuple[tuple[str, ...], ...]:
        """As those of a table."""
        return tuple((one.question, one.word, one.detail) for one in self.checks)


@dataclass(frozen=True)
class Figure:
    """A picture, drawn when it is written."""

    name: str  # of its files
    caption: str  # what it shows
    alt: str  # text alternative
    draw: Callable[[], Drawn] = field(repr=False, compare=False)  # makes the figure
    # studies that it shows: the file is reused while they are unchanged
    of: tuple[str, ...] = ()
    paper: bool = False  # whether it needs a light background, like maps with dark contours


@dataclass(frozen=True)
class InteractiveMap:
    """A figure of a map with values and time responses of its cells."""

    figure: Figure  # complete without scripts
    # values of the cells as plain data (see `cells`)
    cells: Callable[[], dict[str, object]] = field(repr=False, compare=False)


@dataclass(frozen=True)
class Code:
    """Text of a file."""

    caption: str  # what it is
    text: str  # word for word
    language: str = "toml"  # its language


Block = Text | Table | Checks | Figure | InteractiveMap | Code


@dataclass(frozen=True)
class Section:
    """A part of a report."""

    name: str  # value of --sections; anchor
    title: str  # its heading
    blocks: tuple[Block, ...]  # in reading order


@dataclass(frozen=True)
class Document:
    """A report, before it is written in a format."""

    # of the report
    title: str
    subtitle: str
    facts: tuple[tuple[str, str], ...]  # design, profile, version, seed
    problems: tuple[str, ...]  # why it is not complete; shown first
    sections: tuple[Section, ...]  # in reading order
    left_out: tuple[tuple[str, str], ...]  # titles of omitted sections, with reasons


def figure(picture: Picture, name: str, system: units.System) -> Figure:
    """A picture of a study as a block of a report."""
    return Figure(
        picture.name, picture.caption, picture.alt, lambda: picture.draw(system), (name,),
        picture.paper,
    )  # fmt: skip


def block(table: Results, system: units.System) -> Table:
    """A table of a study as a block of a report."""
    heads, rows = tuple(table.heads(system)), tuple(map(tuple, table.texts(system)))
    caption = table.title[0].upper() + table.title[1:]
    return Table(table.name, caption, heads, rows)
