"""What a section is made of, whatever it is written as."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn


@dataclass(frozen=True)
class Text:
    """A paragraph.

    Attributes
    ----------
    text : str
        Plain; nothing in it is markup.
    kind : {'plain', 'note', 'open', 'warning'}
        How it stands out.
    """

    text: str
    kind: Literal["plain", "note", "open", "warning"] = "plain"


@dataclass(frozen=True)
class Table:
    """A table with one row of heads; the first column names the rows.

    Attributes
    ----------
    name : str
        Of its CSV file.
    caption : str
        What it shows.
    heads : tuple of str
        With units in brackets.
    rows : tuple of tuple of str
        As many words each as there are heads.
    """

    name: str
    caption: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Check:
    """A question with its answer.

    Attributes
    ----------
    question : str
        What is asked.
    answer : bool or None
        None where it is not decided.
    detail : str
        The numbers.
    """

    question: str
    answer: bool | None
    detail: str

    @property
    def word(self) -> str:
        """The answer in a word."""
        return {True: "yes", False: "no", None: "open"}[self.answer]


@dataclass(frozen=True)
class Checks:
    """Questions with their answers.

    Attributes
    ----------
    name : str
        Of its CSV file.
    caption : str
        What they decide.
    checks : tuple of Check
        In the order to be read.
    """

    name: str
    caption: str
    checks: tuple[Check, ...]


@dataclass(frozen=True)
class Figure:
    """A picture, drawn when it is written.

    Attributes
    ----------
    name : str
        Of its files.
    caption : str
        What it shows.
    alt : str
        The same for those who do not see it, with what it says.
    draw : callable
        Makes the figure.
    of : tuple of str
        Studies that it shows: the picture is kept as long as they are the same.
    paper : bool
        Whether it needs light paper, as maps with dark contours do.
    """

    name: str
    caption: str
    alt: str
    draw: Callable[[], Drawn] = field(repr=False, compare=False)
    of: tuple[str, ...] = ()
    paper: bool = False


@dataclass(frozen=True)
class InteractiveMap:
    """A picture of a map whose cells tell their values and show their time responses.

    Attributes
    ----------
    figure : Figure
        The picture; whole without scripts.
    cells : callable
        Gives what the cells hold, as plain data (see `report.cells`).
    """

    figure: Figure
    cells: Callable[[], dict[str, object]] = field(repr=False, compare=False)


@dataclass(frozen=True)
class Code:
    """Text of a file.

    Attributes
    ----------
    caption : str
        What it is.
    text : str
        Word for word.
    language : str
        Its language.
    """

    caption: str
    text: str
    language: str = "toml"


Block = Text | Table | Checks | Figure | InteractiveMap | Code


@dataclass(frozen=True)
class Section:
    """A part of a report.

    Attributes
    ----------
    name : str
        By which it is asked for; its anchor.
    title : str
        Its heading.
    blocks : tuple
        In the order to be read.
    """

    name: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Document:
    """A whole report, before it is written as anything.

    Attributes
    ----------
    title, subtitle : str
        Of the report.
    facts : tuple of (str, str)
        Where it comes from: design, profile, version, seed.
    problems : tuple of str
        Why it is not complete; the first thing that is read.
    sections : tuple of Section
        In the order to be read.
    left_out : tuple of (str, str)
        Titles of other sections and why they are not here.
    """

    title: str
    subtitle: str
    facts: tuple[tuple[str, str], ...]
    problems: tuple[str, ...]
    sections: tuple[Section, ...]
    left_out: tuple[tuple[str, str], ...]
