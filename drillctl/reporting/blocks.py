"""What a section is made of, whatever it is written as."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from drillctl.store.tables import Table as Results
from drillctl.studies.base import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

    from drillctl import units


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str  # plain; nothing in it is markup
    # {'plain', 'note', 'open', 'warning'}: How it stands out
    kind: Literal["plain", "note", "open", "warning"] = "plain"


@dataclass(frozen=True)
class Table:
    """A table with one row of heads; the first column names the rows."""

    name: str  # of its CSV file
    caption: str  # what it shows
    heads: tuple[str, ...]  # with units in brackets
    rows: tuple[tuple[str, ...], ...]  # as many words each as there are heads


@dataclass(frozen=True)
class Check:
    """A question with its answer."""

    question: str  # what is asked
    answer: bool | None  # none where it is not decided
    detail: str  # the numbers

    @property
    def word(self) -> str:
        """The answer in a word."""
        return {True: "yes", False: "no", None: "open"}[self.answer]


@dataclass(frozen=True)
class Checks:
    """Questions with their answers."""

    name: str  # of its CSV file
    caption: str  # what they decide
    checks: tuple[Check, ...]  # in the order to be read


@dataclass(frozen=True)
class Figure:
    """A picture, drawn when it is written."""

    name: str  # of its files
    caption: str  # what it shows
    alt: str  # the same for those who do not see it, with what it says
    draw: Callable[[], Drawn] = field(repr=False, compare=False)  # makes the figure
    # studies that it shows: the picture is kept as long as they are the same
    of: tuple[str, ...] = ()
    paper: bool = False  # whether it needs light paper, as maps with dark contours do


@dataclass(frozen=True)
class InteractiveMap:
    """A picture of a map whose cells tell their values and show their time responses."""

    figure: Figure  # the picture; whole without scripts
    # gives what the cells hold, as plain data (see `report.cells`)
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

    name: str  # by which it is asked for; its anchor
    title: str  # its heading
    blocks: tuple[Block, ...]  # in the order to be read


@dataclass(frozen=True)
class Document:
    """A whole report, before it is written as anything."""

    # of the report
    title: str
    subtitle: str
    facts: tuple[tuple[str, str], ...]  # where it comes from: design, profile, version, seed
    problems: tuple[str, ...]  # why it is not complete; the first thing that is read
    sections: tuple[Section, ...]  # in the order to be read
    left_out: tuple[tuple[str, str], ...]  # titles of other sections and why they are not here


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
