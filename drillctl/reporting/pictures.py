"""Figures of a report as files, reused while the results that they show are unchanged."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl.errors import DrillctlError, InputError
from drillctl.plots.style import axes_or_new, default_look
from drillctl.reporting.blocks import Document, Figure, InteractiveMap
from drillctl.reporting.gather import Gathered
from drillctl.store.json_files import read_json, write_json, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

DPI = 110  # of PNG files, and of bitmaps within an SVG
MOST_SHAPES = 500
"""Most shapes of one kind in an SVG; more are rasterised, as they make it slow and large."""
INDEX = "index.json"
_PATHS = re.compile(r' d="([^"]*)"', re.DOTALL)
_DIGITS = re.compile(r"(\.\d\d)\d+")
_METADATA = re.compile(r"\s*<metadata>.*?</metadata>", re.DOTALL)


@dataclass(frozen=True)
class Picture:
    """A figure on disk."""

    name: str  # of its files
    # size (points)
    width: float
    height: float
    # its first axes: left, top, width, height as shares of the picture
    box: tuple[float, float, float, float]
    folder: Path  # where `name.svg` and `name.png` are

    @property
    def svg(self) -> str:
        """The picture as SVG."""
        return (self.folder / f"{self.name}.svg").read_text(encoding="utf-8")

    @property
    def png(self) -> Path:
        """The file of the picture as PNG."""
        return self.folder / f"{self.name}.png"


class FigureFiles:
    """The figures of a report in their folder."""

    def __init__(self, folder: Path, gathered: Gathered) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder, self._gathered = folder, gathered
        self._problems: list[str] = []
        self._index: dict[str, Any] = {}
        if (folder / INDEX).is_file():
            try:
                self._index = dict(read_json(folder / INDEX))
            except InputError:  # an unreadable index: draw all figures again
                self._index = {}

    def collect(self, document: Document) -> tuple[str, ...]:
        """Draw the missing figures of a document; return the errors."""
        for section in document.sections:
            for block in section.blocks:
                if isinstance(block, Figure):
                    self.picture(block)
                elif isinstance(block, InteractiveMap):
                    self.picture(block.figure)
        return tuple(self._problems)

    def picture(self, figure: Figure) -> Picture:
        """The file of a figure, drawn if it is missing."""
        key = self._gathered.key(figure.of)
        held = self._index.get(figure.name, {})
        there = all((self._folder / f"{figure.name}.{kind}").is_file() for kind in ("svg", "png"))
        if held.get("key") == key and there:
            return self._made(figure.name, held)
        try:
            made = self._draw(figure)
        except (DrillctlError, ArithmeticError, ValueError, LookupError) as error:
            self._problems.append(f"Figure {figure.name} could not be drawn: {error}")
            return self._draw(replace(figure, draw=_blank))
        about = {k: v for k, v in asdict(made).items() if k not in ("name", "folder")}
        self._index[figure.name] = about | {"key": key}
        write_json(self._folder / INDEX, self._index)
        return made

    def _made(self, name: str, held: dict[str, Any]) -> Picture:
        return Picture(name, held["width"], held["height"], tuple(held["box"]), self._folder)

    def _draw(self, figure: Figure) -> Picture:
        # A fixed salt: the same figure gives the same file.
        with default_look({"svg.hashsalt": figure.name, "svg.fonttype": "path"}):
            return self._saved(figure)

    def _saved(self, figure: Figure) -> Picture:
        drawn = figure.draw()
        for ax in drawn.axes:
            for crowd in ax.collections:
                crowd.set_rasterized(crowd.get_rasterized() or len(crowd.get_paths()) > MOST_SHAPES)
        svg = self._folder / f"{figure.name}.svg"
        part = svg.with_suffix(".part")
        drawn.savefig(part, format="svg", dpi=DPI, metadata={"Date": None})
        write_text(svg, _small(part.read_text(encoding="utf-8")))
        part.unlink(missing_ok=True)
        place = drawn.axes[0].get_position()
        drawn.set_layout_engine("none")  # laid out already
        drawn.savefig(part, format="png", dpi=DPI)
        part.replace(svg.with_suffix(".png"))
        width, height = (72.0 * float(inches) for inches in drawn.get_size_inches())
        left, up = float(place.x0), 1.0 - float(place.y1)
        box = (left, up, float(place.width), float(place.height))
        return Picture(figure.name, width, height, box, self._folder)


def _blank() -> Drawn:
    """Placeholder for a figure that could not be drawn."""
    made, ax = axes_or_new(None, 6.0, 2.0)
    ax.set_axis_off()
    ax.text(0.5, 0.5, "could not be drawn: see the top of the report", ha="center", va="center")
    return made


def _small(svg: str) -> str:
    """Remove metadata, and round curves to a hundredth of a point."""
    svg = _METADATA.sub("", svg)
    return _PATHS.sub(lambda result: _DIGITS.sub(r"\1", result[0]), svg)


# Colours of `plots.style` on light and on dark background.
_INKS = {
    "#000000": ("ink", "#1a1a1a", "#e8e6e3"),
    "#ffffff": ("paper", "#ffffff", "#16191d"),
    "#dddddd": ("grid", "#dddddd", "#3a3f45"),
    "#0072b2": ("blue", "#0072b2", "#4fb0e8"),
    "#d55e00": ("vermillion", "#d55e00", "#ff8b3d"),
    "#009e73": ("green", "#009e73", "#2cc79b"),
    "#cc79a7": ("purple", "#cc79a7", "#e39ac2"),
    "#bbbbbb": ("shade", "#bbbbbb", "#5a6068"),
}
_COLOURS = re.compile("|".join(_INKS), re.IGNORECASE)


def themed(svg: str) -> str:
    """Add a dark colour scheme to an SVG."""
    svg = _COLOURS.sub(lambda match: f"var(--{_INKS[match[0].lower()][0]})", svg)
    light = "".join(f"--{name}:{colour};" for name, colour, _ in _INKS.values())
    dark = "".join(f"--{name}:{colour};" for name, _, colour in _INKS.values())
    style = (
        f"<style>svg{{{light}fill:var(--ink)}}"
        f"@media (prefers-color-scheme:dark){{svg{{{dark}}}}}</style>"
    )
    head, mark, rest = svg.partition("<svg")
    opening, end, body = rest.partition(">")
    return f"{head}{mark}{opening}{end}{style}{body}"
