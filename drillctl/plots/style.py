"""The shared look: colours that everyone can distinguish, sizes, and figures without pyplot.

What colour bars share: parts of viridis, ends that say that values go on, plain ticks.

The plane of two parameters that maps are drawn on, and what all pictures of a design say.
"""

from __future__ import annotations

import inspect
import io
import re
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize, same_color, to_rgba
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from drillctl import units
from drillctl.arrays import Array
from drillctl.design.paths import USUAL_NAMES
from drillctl.errors import InputError

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axis import Axis as Scale
    from matplotlib.collections import QuadMesh

    from drillctl.studies import Axis

Drawing = TypeVar("Drawing", bound=Callable[..., Figure])

BLACK = "#000000"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#CC79A7"
ORANGE = "#E69F00"
SKY = "#56B4E9"

COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Okabe & Ito's palette without its yellow, which is too pale for a line on white."""
DASHES = ("-", "--", "-.", ":")
"""Line styles that go with the colours, so that grey print can be read too."""

TITLE = 11.0  # size of titles (points)
LABEL = 10.0  # size of axis labels (points)
SMALL = 9.0  # size of tick labels and legends (points)
LINE = 1.6  # width of a curve (points)
GRID = "#DDDDDD"
GREY = "#888888"
"""Colour of levels and zero lines: in the background, yet legible."""

STAR: dict[str, Any] = {
    "color": VERMILLION, "markeredgecolor": "white", "markersize": 15, "linestyle": "none",
}  # fmt: skip
"""Mark of the best."""
RING: dict[str, Any] = {
    "marker": "o", "markerfacecolor": "none", "markeredgecolor": VERMILLION, "linestyle": "none",
}  # fmt: skip
"""Mark of what the reference solver ran again."""
USUAL = {
    "ax": "Axes to draw on; by default those of a new figure.",
    "system": "Units of axes and labels.",
}
"""Parameters that most pictures have; any other is what is drawn, unless it is described."""
OVER_TWO = {
    "result": "Over two parameters.",
    "raises": "The result has another number of parameters than two.",
}
_TYPES = (
    (r"units\.System", "{'si', 'field'}"), (r" \| None", ""), (r" \| ", " or "),
    (r"Sequence\[(\w+)\]", r"sequence of \1"), (r"Mapping\[(\w+), (\w+)\]", r"mapping of \1 to \2"),
)  # fmt: skip


def picture(raises: str = "", **about: str) -> Callable[[Drawing], Drawing]:
    """Add to the docstring of a picture its parameters, the figure, and what it refuses.

    `about` describes parameters by name, where their type and `USUAL` do not say enough.
    """

    def completed(draw: Drawing) -> Drawing:
        @wraps(draw)
        def drawn(*given: Any, **named: Any) -> Figure:
            return _readable(draw(*given, **named))

        lines = [inspect.cleandoc(draw.__doc__ or ""), "", "Parameters", "----------"]
        for name, one in inspect.signature(draw).parameters.items():
            kind = str(one.annotation) + ", optional" * (one.default in (None, ()))
            for pattern, words in _TYPES:
                kind = re.sub(pattern, words, kind)
            lines += [
                f"{name} : {kind}",
                f"    {about.get(name) or USUAL.get(name, 'What to draw.')}",
            ]
        lines += ["", "Returns", "-------", "Figure", "    The picture, not shown."]
        if raises:
            lines += ["", "Raises", "------", "InputError", f"    {raises}"]
        drawn.__doc__ = "\n".join(lines)
        return cast("Drawing", drawn)

    return completed


def _readable(figure: Figure) -> Figure:
    """The figure with its black lines in white where the user's style has a dark background."""
    for ax in figure.axes:
        red, green, blue, _ = to_rgba(ax.get_facecolor())
        if 0.3 * red + 0.6 * green + 0.1 * blue > 0.5:
            continue
        legend = ax.get_legend()
        for line in (*ax.lines, *(legend.get_lines() if legend else ())):
            if same_color(line.get_color(), BLACK):
                line.set_color("white")
    return figure


@contextmanager
def default_look(more: Any) -> Iterator[None]:
    """Draw as matplotlib does by default, with `more` settings, whatever the user has set."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(more)
        yield


class _Shown(Figure):
    """A figure that a notebook shows: it knows those of pyplot alone."""

    def _repr_png_(self) -> bytes:
        drawn = io.BytesIO()
        self.savefig(drawn, format="png")
        return drawn.getvalue()


def figure(width: float = 7.0, height: float = 4.5) -> Figure:
    """An empty figure with constrained layout, unknown to pyplot."""
    return _Shown(figsize=(width, height), layout="constrained")


def lay_out(figure: Figure, dpi: float) -> None:
    """Lay out a figure for good: each file of it would else take another draw for that alone."""
    engine = figure.get_layout_engine()
    if engine is not None:
        figure.set_dpi(dpi)
        engine.execute(figure)
        figure.set_layout_engine(None)


def axes_or_new(ax: Axes | None, width: float = 7.0, height: float = 4.5) -> tuple[Figure, Axes]:
    """The axes given and their figure, or new ones."""
    if ax is None:
        fresh = figure(width, height)
        return fresh, fresh.add_subplot()
    return _figure_of(ax), ax


def grid_or_new(
    ax: Sequence[Axes] | None,
    rows: int,
    columns: int,
    width: float,
    height: float,
    share_x: bool = False,
    share_y: bool = False,
) -> tuple[Figure, list[Axes]]:
    """The panels given and their figure, or a new grid of them."""
    if ax is None:
        fresh = figure(width, height)
        grid = fresh.subplots(rows, columns, sharex=share_x, sharey=share_y, squeeze=False)
        return fresh, list(grid.flat)
    panels = list(np.atleast_1d(np.asarray(ax, dtype=object)).flat)
    if len(panels) != rows * columns:
        raise InputError(f"needs {rows * columns} axes, got {len(panels)}", "ax")
    return _figure_of(panels[0]), panels


def dress(ax: Axes, x: str, y: str, text: str = "") -> None:
    """Label axes and set them in the shared look."""
    ax.set_xlabel(x, fontsize=LABEL)
    ax.set_ylabel(y, fontsize=LABEL)
    if text:
        title(ax, text)
    ax.tick_params(labelsize=SMALL)
    ax.grid(visible=True, color=GRID, linewidth=0.7)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)


def title(ax: Axes, text: str, **how: Any) -> None:
    """Title axes."""
    ax.set_title(text, fontsize=TITLE, loc="left", **how)


def headline(figure: Figure, text: str) -> None:
    """Title a picture of several panels."""
    figure.suptitle(text, fontsize=TITLE, x=0.01, ha="left")


def note(figure: Figure, text: str) -> None:
    """What stands under a picture."""
    figure.supxlabel(text, fontsize=SMALL)


def _figure_of(ax: Axes) -> Figure:
    owner = ax.figure
    while not isinstance(owner, Figure):  # a subfigure
        owner = owner.figure
    return owner


def colours(low: float, high: float) -> Colormap:
    """A part of viridis: 0.2 to 1 under black lines, 0 to 0.88 for lines on white."""
    from matplotlib import colormaps

    return ListedColormap(colormaps["viridis"](np.linspace(low, high, 256)))


def beyond(values: Array, norm: Normalize) -> Literal["neither", "both", "min", "max"]:
    """On which side values go beyond the limits of the colours."""
    finite = values[np.isfinite(values)]
    low, high = norm.vmin, norm.vmax
    below = low is not None and bool((finite < low).any())
    above = high is not None and bool((finite > high).any())
    if below and above:
        return "both"
    return "min" if below else "max" if above else "neither"


def written_out(axis: Scale, digits: Sequence[float] = (1.0, 2.0, 5.0)) -> None:
    """Ticks of a logarithmic axis at some digits of each decade, written out."""
    axis.set_major_locator(LogLocator(subs=digits))
    axis.set_major_formatter(FormatStrFormatter("%g"))
    axis.set_minor_formatter(NullFormatter())


def cells(ax: Axes, x: Array, y: Array, values: Array, **colours: Any) -> QuadMesh:
    """Cells by their values, shape (x, y), as a bitmap."""
    return ax.pcolormesh(x, y, values.T, shading="nearest", rasterized=True, **colours)


def within_cells(ax: Axes, x: Array, y: Array) -> None:
    """Limits at the outer borders of the cells."""
    ax.set_xlim(*edges(x)[[0, -1]])
    ax.set_ylim(*edges(y)[[0, -1]])


def listed(result: Any) -> list[Any]:
    """Results as a list, whether one was given or a sequence of them; none is refused."""
    results = list(result) if isinstance(result, Sequence) else [result]
    if not results:
        raise InputError("nothing to draw: give one result or more")
    return results


def colour_bar(
    figure: Figure,
    drawn: ScalarMappable,
    ax: Axes | Sequence[Axes],
    label: str,
    extend: Literal["neither", "both", "min", "max"] = "neither",
) -> Colorbar:
    """A labelled colour bar; on a log scale with ticks at 1, 2, 5 of each decade, written out."""
    bar = figure.colorbar(drawn, ax=ax, extend=extend, pad=0.02)
    if isinstance(drawn.norm, LogNorm):
        written_out(bar.ax.yaxis)
    bar.set_label(label, fontsize=LABEL)
    bar.ax.tick_params(labelsize=SMALL)
    return bar


class Plane(NamedTuple):
    """Axes of a picture over two parameters."""

    figure: Figure  # the whole picture
    ax: Axes  # labelled and titled
    # values of the parameters in the units people read
    x: Array
    y: Array


def plane(result: Any, ax: Axes | None, height: float, system: units.System, what: str) -> Plane:
    """The plane of a result over two parameters."""
    if len(result.axes) != 2:
        raise InputError(f"a map shows 2 parameters, the result has {len(result.axes)}")
    figure, ax = axes_or_new(ax, 8.0, height)
    (x, x_label), (y, y_label) = (axis_label(axis, system) for axis in result.axes)
    dress(ax, x_label, y_label, heading(result, what))
    ax.grid(visible=False)
    return Plane(figure, ax, x, y)


def legend(ax: Axes, **how: Any) -> None:
    """Legend in the axes, or where `how` says."""
    ax.legend(fontsize=SMALL, frameon=False, **how)


def legend_above(
    ax: Axes, handles: Sequence[Artist] | None = None, side: Literal["left", "right"] = "right"
) -> None:
    """Legend above the axes, where no curve runs."""
    corner = (float(side == "right"), 1.0)
    legend(ax, handles=handles, loc=f"lower {side}", bbox_to_anchor=corner, handlelength=3.5)


def legend_of_all(
    figure: Figure, ax: Axes | None, columns: int, text: str | None = None,
    handles: Sequence[Artist] = (),
) -> None:  # fmt: skip
    """One legend under all panels: of one of them, or of `handles`; with `text` above it."""
    handles = handles if ax is None else ax.get_legend_handles_labels()[0]
    figure.legend(
        handles=list(handles), loc="outside lower center", ncols=columns, fontsize=SMALL,
        frameon=False, title=text, title_fontsize=SMALL,
    )  # fmt: skip


def legend_under(
    ax: Axes, columns: int, handles: Sequence[Artist] | None = None, drop: float = 0.12
) -> None:
    """Legend under the axes; `drop` is how far, in heights of the axes."""
    corner = (0.5, -drop)
    legend(ax, handles=handles, loc="upper center", bbox_to_anchor=corner, ncols=columns)


def axis_label(axis: Axis, system: units.System) -> tuple[np.ndarray, str]:
    """Values of an axis in the units people read, and its label."""
    values, unit = units.displayed(axis.values, axis.unit, system)
    name = USUAL_NAMES.get(axis.path, axis.path)
    return values, f"{name} ({unit})" if unit else name


def named_values(
    path: str, unit: str, values: Array, system: units.System
) -> tuple[np.ndarray, str]:
    """Values of a parameter in the units people read, and the label of their axis."""
    from drillctl.ensemble.grid import Axis

    return axis_label(Axis(path, unit, values), system)


def title_of(result: Any) -> str:
    """Title of a picture: that of the design, or its name; its dollars are no formulas."""
    title: str = result.design.tables.title or result.design.name
    return title.replace("$", r"\$")


def heading(result: Any, what: str) -> str:
    """Title of a picture that says what it shows, and under that whose it is."""
    return f"{what}\n{title_of(result)}"


def caption(result: Any, *texts: str, width: int = 110) -> str:
    """Text under a picture in lines of at most `width` characters, a line or more for each part."""
    guessed = result.design.tables.status == "reconstructed"
    first, *rest = texts
    parts = ("String reconstructed. " * guessed + first, *rest)
    return "\n".join(line for part in parts for line in textwrap.wrap(part, width))


def colour(number: int) -> str:
    """Colour of one of several things."""
    return COLOURS[number % len(COLOURS)]


def look(number: int, width: float = LINE) -> dict[str, Any]:
    """Colour, dashes and width of one of several curves."""
    dashes = DASHES[number % len(DASHES)]
    return {"color": colour(number), "linestyle": dashes, "linewidth": width}


def edges(centres: Array) -> Array:
    """Borders of cells around increasing centres, halfway; the outer cells are symmetric."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    between = 0.5 * (centres[1:] + centres[:-1])
    ends = 2.0 * centres[[0, -1]] - between[[0, -1]]
    return np.concatenate([ends[:1], between, ends[1:]])


def panels_or_new(
    ax: Sequence[Axes] | None, count: int, each: tuple[float, float], rim: tuple[float, float]
) -> tuple[Figure, list[Axes]]:
    """So many panels, those given or new ones two by two; `each` and `rim` are sizes (inches)."""
    if ax is not None:
        return grid_or_new(ax, 1, count, 0.0, 0.0)
    columns = min(count, 2)
    rows = -(-count // columns)
    size = columns * each[0] + rim[0], rows * each[1] + rim[1]
    fresh, panels = grid_or_new(None, rows, columns, *size)
    for spare in panels[count:]:
        spare.remove()
    return fresh, panels[:count]
