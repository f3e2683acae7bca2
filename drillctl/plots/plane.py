"""The plane of two parameters that maps are drawn on, and what all pictures of a design say."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drillctl import units
from drillctl.errors import InputError
from drillctl.plots.style import SMALL, axes_or_new, dress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist

    from drillctl.studies import Axis

NAMES = {
    "controller.kp": "Kp",
    "controller.ki": "Ki",
    "operating_point.speed": "set speed",
    "operating_point.weight_on_bit": "weight on bit",
}
"""What the usual parameters are called on an axis; others keep their path."""


class Plane(NamedTuple):
    """Axes of a picture over two parameters."""

    figure: Figure  # the whole picture
    ax: Axes  # labelled and titled
    # values of the parameters in the units people read
    x: NDArray[np.float64]
    y: NDArray[np.float64]


def plane(
    result: Any, ax: Axes | None, height: float, system: units.System, what: str = "a map shows"
) -> Plane:
    """The plane of a result over two parameters."""
    if len(result.axes) != 2:
        raise InputError(f"{what} 2 parameters, the result has {len(result.axes)}")
    figure, ax = axes_or_new(ax, 8.0, height)
    (x, x_label), (y, y_label) = (axis_label(axis, system) for axis in result.axes)
    dress(ax, x_label, y_label, title_of(result))
    ax.grid(visible=False)
    return Plane(figure, ax, x, y)


def legend_under(
    ax: Axes, columns: int, handles: Sequence[Artist] | None = None, drop: float = 0.12
) -> None:
    """Legend under the axes; `drop` is how far, in heights of the axes."""
    ax.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.5, -drop), ncols=columns,
        fontsize=SMALL, frameon=False,
    )  # fmt: skip


def axis_label(axis: Axis, system: units.System) -> tuple[np.ndarray, str]:
    """Values of an axis in the units people read, and its label."""
    values, unit = units.displayed(axis.values, axis.unit, system)
    name = NAMES.get(axis.path, axis.path)
    return values, f"{name} ({unit})" if unit else name


def named_values(
    path: str, unit: str, values: NDArray[np.float64], system: units.System
) -> tuple[np.ndarray, str]:
    """Values of a parameter in the units people read, and the label of their axis."""
    from drillctl.studies.grid import Axis

    return axis_label(Axis(path, unit, values), system)


def title_of(result: Any) -> str:
    """Title of a picture: that of the design, or its name; its dollars are no formulas."""
    title: str = result.design.tables.title or result.design.name
    return title.replace("$", r"\$")


def origin_of(result: Any) -> str:
    """What a caption begins with where the string is not the authors' own."""
    return "string reconstructed; " if result.design.tables.status == "reconstructed" else ""
