"""Bit torque against bit speed."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design
from drillctl.plots import style
from drillctl.plots.style import picture
from drillctl.rig.bit_rock import BitRockLaw
from drillctl.units import RPM, SI

BACKWARD = -20.0  # slowest speed drawn (rpm): enough to show that the torque changes sign
FORWARD = 250.0  # highest speed drawn (rpm), unless the rig is set to turn faster
WEIGHT = "operating_point.weight_on_bit"

Array = NDArray[np.float64]


@picture(design="The rig.")
def friction_curves(design: Design, ax: Axes | None = None, system: units.System = "si") -> Figure:
    """Draw the torque on the bit against its speed, for each weight on bit of the table.

    One curve for each row of the friction table, and for the operating weight on bit if it is not
    a row. At rest the torque takes any value on the vertical segment. A dot marks the operating
    point.
    """
    figure, ax = style.axes_or_new(ax)
    weight = design.tables.operating_point.weight_on_bit
    last = max(FORWARD, 1.2 * design.speed / RPM)
    scale, torque_unit = units.displayed(1.0, "N*m", system)
    for number, each in enumerate(_weights(design)):
        law = design.replace({WEIGHT: SI(each)}).bit_rock
        speeds, torques = _curve(law, each, last)
        ax.plot(
            speeds,
            scale * torques,
            color=style.COLOURS[number % len(style.COLOURS)],
            linestyle="-" if each == weight else "--",
            linewidth=style.LINE,
            label=_weight(each, system),
        )
    torque, _ = design.bit_rock.torque_and_slope(weight, design.speed, math.exp)
    ax.plot(
        design.speed / RPM,
        scale * torque,
        "o",
        color=style.BLACK,
        zorder=5,
        label=f"operating point: {_weight(weight, system)}, {design.speed / RPM:.4g} rpm",
    )
    style.dress(
        ax, "bit speed (rpm)", f"bit torque ({torque_unit})", "Bit torque against bit speed"
    )
    for line in (ax.axhline, ax.axvline):
        line(0.0, color="#888888", linewidth=0.8, zorder=1)
    ax.set_xlim(BACKWARD, last)
    ax.legend(fontsize=style.SMALL, frameon=False, loc="lower right")
    return figure


def _weight(weight: float, system: units.System) -> str:
    shown, unit = units.displayed(weight, "N", system)
    return f"{shown:.4g} {unit}"


def _weights(design: Design) -> list[float]:
    """Weights on bit (N) to draw, heaviest first, as the curves lie in the picture."""
    rows = getattr(design.tables.bit_rock, "table", None) or ()
    weights = {row.weight_on_bit for row in rows}
    return sorted(weights | {design.tables.operating_point.weight_on_bit}, reverse=True)


def _curve(law: BitRockLaw, weight: float, last: float) -> tuple[Array, Array]:
    """Speed (rpm) and torque (N m) from `BACKWARD` to `last` (rpm), through rest."""
    forward = np.linspace(0.0, last, 400)
    backward = np.linspace(-BACKWARD, 0.0, 100)
    ahead = _torques(law, weight, forward * RPM)
    behind = _torques(law, weight, backward * RPM)
    static = law.static_torque(weight)
    speed = np.concatenate([-backward, [0.0, 0.0], forward])
    torque = np.concatenate([-behind, [-static, static], ahead])
    return speed, torque


def _torques(law: BitRockLaw, weight: float, speeds: Array) -> Array:
    return np.array([law.torque_and_slope(weight, speed, math.exp)[0] for speed in speeds])
