"""The string in its well: tension, side force and torque by depth, and over the friction factor."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from drillctl import units
from drillctl.errors import InputError
from drillctl.plots import style

if TYPE_CHECKING:
    from drillctl.simulation import Simulation
    from drillctl.studies.torque_drag.compute import TorqueDrag

_LABELS = {
    "rotating": "rotating", "off_bottom": "rotating off bottom", "pulling_out": "pulling out",
    "running_in": "running in",
}  # fmt: skip


def _shown(result: TorqueDrag) -> list[str]:
    """Cases that differ: off bottom stands for both where the bit carries no weight."""
    weight = result.design.tables.operating_point.weight_on_bit
    return [case for case in _LABELS if case != "rotating" or weight > 0.0]


@style.picture()
def torque_drag(
    result: TorqueDrag, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Effective tension, side force and torque against measured depth, downwards."""
    figure, panels = style.grid_or_new(ax, 1, 3, 10.0, 5.2, share_y=True)
    deep, depth_unit = units.displayed(result.depth, "m", system)
    middle, _ = units.displayed(result.middle, "m", system)
    parts = (
        ("effective tension", result.tension, deep, "N"),
        ("side force", result.side_force, middle, "N/m"),
        ("torque", result.torque, deep, "N*m"),
    )
    for panel, (name, by_case, depth, si_unit) in zip(panels, parts, strict=True):
        for number, case in enumerate(_shown(result)):
            values, unit = units.displayed(by_case[case], si_unit, system)
            panel.plot(
                values, depth, color=style.COLOURS[number], linestyle=style.DASHES[number],
                linewidth=style.LINE, label=_LABELS[case],
            )  # fmt: skip
        style.dress(panel, f"{name} ({unit})", f"measured depth ({depth_unit})")
        panel.label_outer()
    panels[0].set_ylim(float(deep[-1]), 0.0)
    panels[0].axvline(0.0, color=style.BLACK, linewidth=0.7)
    style.legend_of_all(figure, panels[0], 4)
    return figure


@style.picture()
def friction_sweep(
    result: TorqueDrag, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Hook load and off-bottom torque over the friction factor, the design's own marked."""
    figure, (left, right) = style.grid_or_new(ax, 1, 2, 9.0, 4.0)
    for number, case in enumerate(("off_bottom", "pulling_out", "running_in")):
        values, unit = units.displayed(result.hook_loads[case], "N", system)
        left.plot(
            result.factors, values, color=style.COLOURS[number], linestyle=style.DASHES[number],
            marker="o", markersize=3, label=_LABELS[case],
        )  # fmt: skip
    style.dress(left, "friction factor", f"hook load ({unit})")
    values, unit = units.displayed(result.torques["off_bottom"], "N*m", system)
    right.plot(result.factors, values, color=style.COLOURS[0], marker="o", markersize=3)
    style.dress(right, "friction factor", f"torque off bottom ({unit})")
    for panel in (left, right):
        panel.axvline(result.friction_factor, color=style.BLACK, linewidth=0.8, linestyle=":")
    style.legend(left)
    return figure


@style.picture(result="Of a string on which the wall rubs.", raises="The wall does not rub.")
def sticking(
    result: Simulation, ax: Sequence[Axes] | None = None, system: units.System = "si"
) -> Figure:
    """Parts of the string that the wall holds, over depth and time; the length that it holds."""
    if result.wall_stuck is None or result.wall_depth is None:
        raise InputError("the wall does not rub in this run", "well.friction_factor")
    figure, (upper, lower) = style.grid_or_new(ax, 2, 1, 8.0, 5.6, share_x=True)
    depth, unit = units.displayed(result.wall_depth, "m", system)
    stuck = result.wall_stuck[:-1].T
    colours = ListedColormap(["#FFFFFF", "#777777"])
    upper.pcolormesh(
        result.time, depth, stuck, cmap=colours, vmin=0.0, vmax=1.0, rasterized=True,
        shading="flat",
    )  # fmt: skip
    upper.set_ylim(float(depth[-1]), float(depth[0]))
    style.dress(upper, "", f"measured depth ({unit})", "grey: held by the wall")
    length, _ = units.displayed(result.signals["stuck_length"], "m", system)
    lower.plot(result.time, length, color=style.BLUE, linewidth=1.0)
    lower.set_xlim(0.0, float(result.time[-1]))
    style.dress(lower, "time (s)", f"length held ({unit})")
    return figure
