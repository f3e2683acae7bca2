"""The string as a state-space system, alone and with its top-drive controller.

The states are the twists of the elements and the speeds of the nodes. The angle of the string
as a whole is left out: no torque depends on it, and as a state it would be an undamped
integrator in every norm and margin.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.linalg

from drillctl.arrays import Array
from drillctl.errors import InputError
from drillctl.rig.drillstring import Drillstring

if TYPE_CHECKING:
    import control

    from drillctl.design import Design


INPUTS = ("top_torque", "bit_torque")  # inputs of the plant (N m); positive bit torque brakes
OUTPUTS = ("top_speed", "bit_speed", "pipe_torque", "twist")
"""Outputs of the plant (rad/s, rad/s, N m, rad)."""
LOOP_OUTPUTS = (*OUTPUTS, "top_torque")
"""Outputs of a loop: those of the plant and the torque of the drive (N m)."""
SIGNALS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "plant": (INPUTS, OUTPUTS),
    "open_loop": (("speed_error", "bit_torque"), LOOP_OUTPUTS),
    "closed_loop": (("set_speed", "bit_torque"), LOOP_OUTPUTS),
}
"""Inputs and outputs of each loop."""


class StateMatrices(NamedTuple):
    """x' = A x + B u, y = C x + D u."""

    # shape (states, states): State matrix; entries in the units of their states and inputs, SI
    a: Array
    b: Array  # shape (states, inputs): Input matrix
    c: Array  # shape (outputs, states): Output matrix
    d: Array  # shape (outputs, inputs): Feedthrough


@lru_cache(maxsize=4)  # by the string itself: loops of many gains share one
def plant_matrices(string: Drillstring) -> StateMatrices:
    """State matrices of the string without control; not to be written to.

    With B the signed incidence of nodes and elements (1 above, -1 below) and k the element
    stiffnesses, the stiffness matrix is B k B^T, so that M u'' + C u' + K u = F reads
    `twist' = B^T speed`, `M speed' = F - B k twist - C speed`.
    """
    nodes, elements = string.nodes, string.nodes - 1
    incidence = np.eye(nodes, elements) - np.eye(nodes, elements, k=-1)
    forces = np.zeros((nodes, 2))
    forces[0, 0] = 1.0
    forces[-1, 1] = -1.0
    torques = np.hstack([-incidence * string.element_stiffness, -string.damping.toarray(), forces])
    # Unlike `solve` it says nothing of inertias that are far apart, which a diagonal bears.
    mass = scipy.linalg.cho_factor(string.mass.toarray(), lower=True)
    accelerations = scipy.linalg.cho_solve(mass, torques)

    a = np.zeros((elements + nodes, elements + nodes))
    a[:elements, elements:] = incidence.T
    a[elements:] = accelerations[:, :-2]
    b = np.zeros((elements + nodes, 2))
    b[elements:] = accelerations[:, -2:]
    made = StateMatrices(a, b, _plant_outputs(string), np.zeros((len(OUTPUTS), 2)))
    for matrix in made:
        matrix.setflags(write=False)
    return made


def _plant_outputs(string: Drillstring) -> Array:
    elements = string.nodes - 1
    c = np.zeros((len(OUTPUTS), elements + string.nodes))
    c[0, elements] = 1.0
    c[1, -1] = 1.0
    c[2, 0] = string.element_stiffness[0]
    c[2, elements] = string.element_damping[0]
    c[2, elements + 1] = -string.element_damping[0]
    c[3, :elements] = 1.0
    return c


def open_loop_matrices(string: Drillstring, kp: float, ki: float) -> StateMatrices:
    """State matrices from speed error through controller and string, the loop left open."""
    a, b, c, d = plant_matrices(string)
    from_error = np.column_stack([kp * b[:, 0], b[:, 1]])
    c = np.vstack([c, np.zeros(len(a))])
    d = np.vstack([d, [kp, 0.0]])
    if ki == 0.0:
        return StateMatrices(a, from_error, c, d)
    states = len(a)
    a = np.pad(a, (0, 1))
    a[:states, -1] = ki * b[:, 0]
    c = np.pad(c, ((0, 0), (0, 1)))
    c[-1, -1] = ki
    return StateMatrices(a, np.vstack([from_error, [1.0, 0.0]]), c, d)


def closed_loop_matrices(string: Drillstring, kp: float, ki: float) -> StateMatrices:
    """State matrices of the string closed with speed control of the top drive."""
    a, b, c, d = open_loop_matrices(string, kp, ki)
    top_speed = c[0]
    error = b[:, 0]
    return StateMatrices(a - np.outer(error, top_speed), b, c - np.outer(d[:, 0], top_speed), d)


def plant(string: Drillstring) -> control.StateSpace:
    """The string without control, as a system with named signals.

    Parameters
    ----------
    string : Drillstring
        The assembled string.

    Returns
    -------
    control.StateSpace
        `drillstring`. Inputs `top_torque`, `bit_torque` (N m; positive bit torque brakes).
        Outputs `top_speed`, `bit_speed` (rad/s), `pipe_torque` (N m, carried by stiffness and
        damper of the first element, positive when the top leads), `twist` (rad, top minus
        bit). States `twist_1`... (rad) and `speed_0`... (rad/s).
    """
    return named(plant_matrices(string), "plant", string_states(string.nodes), "drillstring")


def open_loop(design: Design) -> control.StateSpace:
    """The loop cut at the speed error: controller and string in series.

    Parameters
    ----------
    design : Design
        The rig; its top-drive law gives the gains.

    Returns
    -------
    control.StateSpace
        `open_loop`. Inputs `speed_error` (rad/s) and `bit_torque` (N m), outputs those of the
        plant and `top_torque` (N m). From `speed_error` to `top_speed` it is the loop transfer
        under negative feedback. States of the plant and, with integral action, `integral`
        (rad, of the speed error).
    """
    if not design.simple_drive:
        raise InputError(
            "a drive with torque feedback or filters is not cut at the speed error; see "
            "closed_loop",
            "controller",
        )
    kp, ki = design.linear_drive.gains()
    matrices = open_loop_matrices(design.sliding_string, kp, ki)
    return named(matrices, "open_loop", state_names(design.string.nodes, ki))


def string_states(nodes: int) -> list[str]:
    """Names of the states of a string."""
    twists = [f"twist_{i}" for i in range(1, nodes)]
    return [*twists, *(f"speed_{i}" for i in range(nodes))]


def state_names(nodes: int, ki: float) -> list[str]:
    """Names of a loop's states; without integral action those of the string alone."""
    return [*string_states(nodes), *(["integral"] if ki != 0.0 else [])]


def named(
    matrices: StateMatrices, loop: str, states: list[str], name: str | None = None
) -> control.StateSpace:
    """A loop as a system of python-control with the names of its signals."""
    import control

    inputs, outputs = map(list, SIGNALS[loop])
    # dt and the states are given, so that no default of the user's `control.config` counts.
    return control.StateSpace(
        *matrices, dt=0, remove_useless_states=False,
        name=name or loop, inputs=inputs, outputs=outputs, states=states,
    )  # fmt: skip
