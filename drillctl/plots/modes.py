"""Shapes of the modes along the string."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from drillctl import units
from drillctl.linear.modal import Mode, Modes
from drillctl.plots import style

SHOWN = 4
"""Modes drawn of each boundary condition: more cannot be told apart."""


def mode_shapes(
    result: Modes, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Draw angle and torque of the lowest modes along the string, depth downward.

    Parameters
    ----------
    result : Modes
        From `drillctl.modes`.
    ax : sequence of Axes, optional
        Four panels: angle and torque with the top free, then with the top held.
    system : {'si', 'field'}
        Units of depth.

    Returns
    -------
    Figure
        A lumped string, which has no length, is drawn over its node numbers.
    """
    figure, panels = style.grid_or_new(ax, 2, 2, 8.5, 8.0, share_y=True)
    place, label = _places(result, system)
    rows = (("Top free", result.free_free), ("Top held", result.fixed_top))
    for (support, found), (left, right) in zip(rows, (panels[:2], panels[2:]), strict=True):
        for number, mode in enumerate(found[:SHOWN]):
            _draw(left, right, mode, place, number)
        style.dress(left, "angle, largest = 1", label, f"{support}: angle")
        style.dress(right, "torque, largest = 1", "", f"{support}: torque")
        right.legend(
            fontsize=style.SMALL, frameon=False, loc="upper left", bbox_to_anchor=(1.02, 1.0)
        )
    for panel in panels:
        panel.axvline(0.0, color="#888888", linewidth=0.8, zorder=1)
        panel.set_xlim(-1.1, 1.1)
        panel.set_ylim(place[-1], place[0])
        panel.yaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def _places(result: Modes, system: units.System) -> tuple[NDArray[np.float64], str]:
    """Where the nodes are drawn, and the label of that axis."""
    if result.node_depth[-1] > 0.0:
        depth, unit = units.displayed(result.node_depth, "m", system)
        return depth, f"depth ({unit})"
    return np.arange(len(result.node_depth), dtype=float), "node, 0 = top drive"


def _draw(left: Axes, right: Axes, mode: Mode, place: NDArray[np.float64], number: int) -> None:
    colour = style.COLOURS[number]
    dashes = style.DASHES[number]
    left.plot(mode.shape, place, color=colour, linestyle=dashes, linewidth=style.LINE)
    # Torque is constant along an element: steps, and no more smoothness than there is.
    right.stairs(
        mode.torque_shape,
        place,
        orientation="horizontal",
        baseline=None,
        color=colour,
        linestyle=dashes,
        linewidth=style.LINE,
        zorder=2,
        label=_name(mode),
    )


def _name(mode: Mode) -> str:
    if mode.frequency_hz == 0.0:
        return "rigid body"
    if mode.damping_ratio is None:
        return f"{mode.frequency_hz:.4g} Hz, overdamped"
    damping = f"\ndamping {100.0 * mode.damping_ratio:.3g} %" if mode.damping_ratio else ""
    return f"{mode.frequency_hz:.4g} Hz{damping}"
