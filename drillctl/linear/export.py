"""The loop for other programs: a nonlinear python-control system; matrices for MATLAB and NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.errors import InputError
from drillctl.linear.ends import bit_side
from drillctl.linear.loop_model import closed_at, closed_loop
from drillctl.linear.operating_point import operating_point
from drillctl.linear.state_space import (
    LOOP_OUTPUTS,
    open_loop,
    plant,
    plant_matrices,
    state_names,
)
from drillctl.rig.bit_rock import contact
from drillctl.rig.weight_on_bit import PATHS

if TYPE_CHECKING:
    import control


WIDTH = 0.05  # speed (rad/s) over which the regularised friction changes sign


def nonlinear_system(design: Design, width: float = WIDTH) -> control.NonlinearIOSystem:
    """The closed loop with REGULARISED friction, for use with python-control.

    python-control integrates smooth systems, and set-valued friction is not one: here the
    torque of the law is multiplied by tanh(bit speed / width). A bit that should stand still
    creeps instead, and J1 shifts by several per cent (by up to half of it for wide ones). For
    results use `drillctl.simulate`, which regularises nothing. The input `weight_on_bit` is the
    weight at the set speed of the design, about which one that follows the bit speed moves.
    """
    import control

    # A limited drive would be integrated without its limits.
    ideal = design.top_drive is design.linear_drive and design.simple_drive
    if not ideal or isinstance(design.weight_on_bit, PATHS) or design.wall or design.axial:
        raise InputError(
            "takes an ideal drive, a weight that acts at once, a rock without memory and a well "
            "without friction; use drillctl.simulate",
            "law",
        )
    if not (0.0 < width < np.inf):
        raise InputError(f"must be more than 0 rad/s, got {width:g}", "width")
    matrices = plant_matrices(design.sliding_string)
    drive, friction = design.linear_drive, design.bit_rock
    moved: Any = design.weight_on_bit
    strings = len(matrices.a)
    top, bit = matrices.c[0], matrices.c[1]
    _, ki = drive.gains()

    def torques(state: Array, inputs: Array) -> tuple[float, float]:
        speed = float(bit @ state[:strings])
        weight = type(moved)(float(inputs[1]), *moved[1:])  # first of both laws: that at set speed
        torque, _ = contact(friction, weight, abs(speed), np.exp)
        angle = -float(state[-1]) if ki != 0.0 else 0.0
        error = float(top @ state[:strings]) - float(inputs[0])
        return float(drive.torque(angle, error)), float(torque) * float(np.tanh(speed / width))

    def update(time: float, state: Array, inputs: Array, parameters: Any) -> Array:
        rates = matrices.a @ state[:strings] + matrices.b @ np.array(torques(state, inputs))
        if ki == 0.0:
            return np.asarray(rates)
        return np.append(rates, float(inputs[0]) - float(top @ state[:strings]))

    def output(time: float, state: Array, inputs: Array, parameters: Any) -> Array:
        return np.concatenate([matrices.c @ state[:strings], torques(state, inputs)])

    return control.NonlinearIOSystem(
        update,
        output,
        inputs=["set_speed", "weight_on_bit"],
        outputs=[*LOOP_OUTPUTS, "bit_torque"],
        states=state_names(design.string.nodes, ki),
        name="regularised_loop",
        dt=0,
    )


def write_matrices(design: Design, path: str | Path) -> Path:
    """Write the linear models of a design for MATLAB (`.mat`) or NumPy (`.npz`)."""
    path = Path(path)
    if path.suffix not in (".mat", ".npz"):
        raise InputError(f"{path.name!r}: a file ends in .mat or .npz", "export")
    content = _content(design)
    try:
        if path.suffix == ".mat":
            import scipy.io

            scipy.io.savemat(path, content, oned_as="column")
        else:
            np.savez_compressed(path, allow_pickle=False, **_flat(content))
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", str(path)) from None
    return path


def _content(design: Design) -> dict[str, Any]:
    string = design.sliding_string
    point = operating_point(design)
    bit = bit_side(design, point.slope, point.speed)
    systems = {
        "plant": _system(plant(string)),
        "closed_loop": _system(closed_loop(design)),
        "closed_loop_with_slope": _system(closed_at(design, bit)),
    }
    if design.simple_drive:  # else it is not cut open
        systems["open_loop"] = _system(open_loop(design))
    string_matrices = {
        "M": string.mass.toarray(),
        "C": string.damping.toarray(),
        "K": string.stiffness.toarray(),
    }
    return {
        **systems,
        "string": string_matrices,
        "slope": point.slope,
        "kp": float(design.linear_drive.gains()[0]),
        "ki": float(design.linear_drive.gains()[1]),
        "design": design.name,
    }


def _system(of: control.StateSpace) -> dict[str, Any]:
    """Matrices of a system and the names of its signals."""
    names = {"states": of.state_labels, "inputs": of.input_labels, "outputs": of.output_labels}
    return {name: np.asarray(getattr(of, name)) for name in "ABCD"} | {
        kind: np.array(own, dtype=np.str_) for kind, own in names.items()
    }


def _flat(content: dict[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in content.items():
        if isinstance(value, dict):
            flat |= {f"{name}.{key}": part for key, part in value.items()}
        else:
            flat[name] = np.asarray(value)
    return flat
