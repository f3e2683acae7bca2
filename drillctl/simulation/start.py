"""State of the string at time zero, in the frame that turns at the set speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drillctl.drillstring import Drillstring

Array = NDArray[np.float64]
Kind = Literal["rest", "turning", "wound_up"]


@dataclass(frozen=True, eq=False)
class Start:
    """Motion of the string at time zero: a shape along the string, times a number of each lane."""

    twist: Array  # shape (nodes,): Shape of the angles in the frame
    # shape (lanes,): What it is to be multiplied with (rad, or N m where the shape is a
    # compliance)
    angle: Array
    turn: Array  # shape (nodes,): Shape of the speeds in the frame
    speed: Array  # shape (lanes,): What it is to be multiplied with (rad/s)

    @property
    def angles(self) -> Array:
        """Angles of every node in the frame (rad), shape (nodes, lanes)."""
        return np.outer(self.twist, self.angle)

    @property
    def speeds(self) -> Array:
        """Speeds of every node in the frame (rad/s), shape (nodes, lanes)."""
        return np.outer(self.turn, self.speed)


def start(
    string: Drillstring, kind: Kind, set_speed: Array, turning_speed: Array, static_torque: Array
) -> Start:
    """Motion at time zero of a number of lanes."""
    ones, none = np.ones(string.nodes), np.zeros(string.nodes)
    if kind == "rest":
        return Start(none, 0.0 * set_speed, ones, -set_speed)
    if kind == "turning":
        return Start(none, 0.0 * set_speed, ones, turning_speed - set_speed)
    compliance = np.concatenate([[0.0], np.cumsum(1.0 / string.element_stiffness)])
    return Start(compliance, -static_torque, compliance / compliance[-1], -set_speed)
