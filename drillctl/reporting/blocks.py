"""Blocks of a section, independent of the output format; quantities as text for a reader."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal

from drillctl.design import Design, parameter
from drillctl.design.paths import USUAL_NAMES
from drillctl.simulation.measures import Measure
from drillctl.store.tables import Table as Results
from drillctl.store.tables import quantity
from drillctl.studies.base import Check, Picture
from drillctl.units import DIAMETERS, displayed, told, unit_name

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
    # makes the figure, in any process: to be pickled
    draw: Callable[[], Drawn] = field(repr=False, compare=False)
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


def figures_of(blocks: Iterable[Block]) -> list[Figure]:
    """The figures among blocks, that of a map too."""
    found = (one.figure if isinstance(one, InteractiveMap) else one for one in blocks)
    return [one for one in found if isinstance(one, Figure)]


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


def figure(picture: Picture, name: str, draw: Callable[[], Drawn], system: units.System) -> Figure:
    """A picture of a study as a block of a report."""
    alt = told(picture.alt, system)
    return Figure(picture.name, picture.caption, alt, draw, (name,), picture.paper)


def block(table: Results, system: units.System) -> Table:
    """A table of a study as a block of a report."""
    heads, rows = tuple(table.heads(system)), tuple(map(tuple, table.texts(system)))
    said = table.said(system)
    caption = said[0].upper() + said[1:]
    return Table(table.name, caption, heads, rows)


@dataclass(frozen=True)
class Words:
    """Quantities in a system of units."""

    system: units.System  # {'si', 'field'}

    def quantity(self, value: float | None, si_unit: str, digits: int = 4) -> str:
        """Format an SI value with its displayed unit."""
        return quantity(value, si_unit, self.system, digits)

    def unit(self, si_unit: str) -> str:
        """The displayed unit for an SI unit."""
        return unit_name(si_unit, self.system)

    def scaled(self, value: float, si_unit: str) -> float:
        """Convert an SI value to the displayed unit."""
        return float(displayed(value, si_unit, self.system)[0])

    def measure(self, one: Measure) -> str:
        """Label of a measure with its unit in brackets."""
        return one.label if one.unit == "1" else f"{one.label} ({self.unit(one.unit)})"

    def diameter(self, value: float | None) -> str:
        """Format a diameter (m) in mm or inches."""
        return self.quantity(value, DIAMETERS)

    def named(self, design: Design, path: str, value: float) -> str:
        """A parameter of a design with a value (SI) and its unit."""
        return f"{name_of(path)} {self.quantity(value, parameter(design, path).si_unit)}"

    def place(self, design: Design, at: dict[str, float]) -> str:
        """Format parameters by path (SI) on one line."""
        return ", ".join(self.named(design, path, value) for path, value in at.items())

    def head(self, design: Design, path: str) -> str:
        """Name of a parameter with its unit in brackets."""
        unit = self.unit(parameter(design, path).si_unit)
        return f"{name_of(path)} ({unit})" if unit else name_of(path)


def name_of(path: str) -> str:
    """The usual name of a parameter, else its path."""
    return USUAL_NAMES.get(path, path)
