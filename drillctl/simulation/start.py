"""State of the string at time zero, in the frame that turns at the set speed."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drillctl.drillstring import Drillstring

Array = NDArray[np.float64]
Kind = Literal["rest", "turning", "wound_up"]


def start(
    string: Drillstring, kind: Kind, set_speed: Array, turning_speed: Array, static_torque: Array
) -> tuple[Array, Array]:
    """Angles and speeds of every node for a number of lanes.

    Parameters
    ----------
    string : Drillstring
        Only its compliance matters.
    kind : {'rest', 'turning', 'wound_up'}
        Still, untwisted and stuck; all nodes at one speed, untwisted; or stuck with the twist
        of exactly the static torque and the top at the set speed, twist and speed spread in
        proportion to the compliance.
    set_speed, turning_speed : ndarray, shape (lanes,)
        Set speed, and speed of all nodes when turning (rad/s).
    static_torque : ndarray, shape (lanes,)
        Largest torque on a bit at rest (N m).

    Returns
    -------
    angle, speed : ndarray, shape (nodes, lanes)
        In the frame (rad, rad/s). The top drive is at angle zero, and so is its integral
        action. A bit at rest has exactly minus the set speed.
    """
    ones = np.ones(string.nodes)
    still = np.zeros((string.nodes, len(set_speed)))
    if kind == "rest":
        return still, np.outer(ones, -set_speed)
    if kind == "turning":
        return still, np.outer(ones, turning_speed - set_speed)
    compliance = np.concatenate([[0.0], np.cumsum(1.0 / string.element_stiffness)])
    share = compliance / compliance[-1]
    return np.outer(compliance, -static_torque), np.outer(share, -set_speed)
