"""Figures of a report as files, reused while the results that they show are unchanged."""

from __future__ import annotations

import io
import re
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl.errors import InputError
from drillctl.plots.style import axes_or_new, default_look, lay_out
from drillctl.reporting.blocks import Document, Figure, figures_of
from drillctl.reporting.gather import Gathered
from drillctl.store.json_files import read_json, replaced, write_json, write_text

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
        self._index: dict[str, Any] = {}
        if (folder / INDEX).is_file():
            with suppress(InputError):  # an unreadable index: draw all figures again
                self._index = dict(read_json(folder / INDEX))

    def collect(self, document: Document, helpers: Executor | None = None) -> tuple[str, ...]:
        """Draw the missing figures of a document; return the errors."""
        blocks = (block for section in document.sections for block in section.blocks)
        missing = [one for one in figures_of(blocks) if self._held(one) is None]
        return tuple(self._draw_all(missing, helpers))

    def picture(self, figure: Figure) -> Picture:
        """The file of a figure, drawn if it is missing."""
        return self._held(figure) or _draw(self._folder, replace(figure, draw=_blank))

    def _held(self, figure: Figure) -> Picture | None:
        about = self._index.get(figure.name, {})
        there = all((self._folder / f"{figure.name}.{kind}").is_file() for kind in ("svg", "png"))
        if not there or about.get("key") != self._gathered.key(figure.of):
            return None
        box = tuple(about["box"])
        return Picture(figure.name, about["width"], about["height"], box, self._folder)

    def _draw_all(self, figures: list[Figure], helpers: Executor | None) -> Iterator[str]:
        """Draw figures, this process from the first on and helpers from the last; the errors."""
        asked: list[Future[Picture | str]] = [Future() for _ in figures]
        if helpers is not None:
            asked = [helpers.submit(_draw_or_say, self._folder, one) for one in figures[::-1]][::-1]
        others = []
        for figure, one in zip(figures, asked, strict=True):
            if one.cancel():  # no helper has begun it
                yield from self._kept(figure, _draw_or_say(self._folder, figure))
            else:
                others.append((figure, one))
        for figure, one in others:
            yield from self._kept(figure, one.result())

    def _kept(self, figure: Figure, made: Picture | str) -> Iterator[str]:
        if isinstance(made, str):
            yield f"Figure {figure.name} could not be drawn: {made}"
            return
        about = {k: v for k, v in asdict(made).items() if k not in ("name", "folder")}
        self._index[figure.name] = about | {"key": self._gathered.key(figure.of)}
        write_json(self._folder / INDEX, self._index)


@contextmanager
def drawing_helpers(count: int) -> Iterator[Executor | None]:
    """Other processes that draw, started at once: they load while this one computes."""
    if count < 1:
        yield None
        return
    # A fork would not be safe with the threads of the engines.
    with ProcessPoolExecutor(count, get_context("spawn"), _left_alone) as helpers:
        helpers.submit(int)
        try:
            yield helpers
        finally:
            helpers.shutdown(cancel_futures=True)


def _left_alone() -> None:
    """An interruption is for the process that asks."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _draw_or_say(folder: Path, figure: Figure) -> Picture | str:
    try:
        return _draw(folder, figure)
    except Exception as error:  # one picture less, whatever it raises
        return str(error) or type(error).__name__


def _draw(folder: Path, figure: Figure) -> Picture:
    # A fixed salt: the same figure gives the same file.
    with default_look({"svg.hashsalt": figure.name, "svg.fonttype": "path"}):
        return _saved(folder, figure)


def _saved(folder: Path, figure: Figure) -> Picture:
    drawn = figure.draw()
    for ax in drawn.axes:
        for crowd in ax.collections:
            crowd.set_rasterized(crowd.get_rasterized() or len(crowd.get_paths()) > MOST_SHAPES)
    lay_out(drawn, DPI)
    svg = folder / f"{figure.name}.svg"
    text = io.StringIO()
    drawn.savefig(text, format="svg", dpi=DPI, metadata={"Date": None})
    write_text(svg, _small(text.getvalue()))
    place = drawn.axes[0].get_position()
    with replaced(svg.with_suffix(".png")) as part:
        drawn.savefig(part, format="png", dpi=DPI)
    width, height = (72.0 * float(inches) for inches in drawn.get_size_inches())
    left, up = float(place.x0), 1.0 - float(place.y1)
    box = (left, up, float(place.width), float(place.height))
    return Picture(figure.name, width, height, box, folder)


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
