"""The shared look: colours told apart by everyone, sizes, and figures without pyplot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drillctl.errors import InputError

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

TITLE = 11.0
"""Size of titles (points)."""
LABEL = 10.0
"""Size of axis labels (points)."""
SMALL = 9.0
"""Size of tick labels and legends (points)."""
LINE = 1.6
"""Width of a curve (points)."""
GRID = "#DDDDDD"
"""Colour of grid and zero lines."""


def figure(width: float = 7.0, height: float = 4.5) -> Figure:
    """An empty figure with constrained layout, unknown to pyplot."""
    return Figure(figsize=(width, height), layout="constrained")


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


def dress(ax: Axes, x: str, y: str, title: str = "") -> None:
    """Label axes and set them in the shared look."""
    ax.set_xlabel(x, fontsize=LABEL)
    ax.set_ylabel(y, fontsize=LABEL)
    if title:
        ax.set_title(title, fontsize=TITLE, loc="left")
    ax.tick_params(labelsize=SMALL)
    ax.grid(visible=True, color=GRID, linewidth=0.7)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)


def _figure_of(ax: Axes) -> Figure:
    owner = ax.figure
    while not isinstance(owner, Figure):  # a subfigure
        owner = owner.figure
    return owner
