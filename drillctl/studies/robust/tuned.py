"""What is tuned: paths of a design with their bounds, and the drive's numbers that follow.

A design's controller holds numbers such as `share` or `absorption`, and a law made of it holds
gains. `drive_numbers` is that step with symbols in place of numbers: what `design/drive.py` does
with numbers alone, which a test holds it to.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drillctl import units
from drillctl.design import Design, parameter
from drillctl.design.tune_tables import RangeTable
from drillctl.errors import InputError, nearest
from drillctl.linear.tuning import active_damping, pipe_impedance, stick_slip_frequency
from drillctl.rig.drillstring import Drillstring

Array = NDArray[np.float64]

LAW_KEYS = {
    "pi": ("kp", "ki"),
    "stiff-speed": ("stiffness", "rate"),
    "soft-torque": ("share",),
    "z-torque": ("absorption", "high_pass", "stiffness", "rate"),
    "torsional-rectification": ("high_pass", "stiffness", "rate"),
    "active-damping": ("spring", "damper", "stiffness", "rate"),
    "constant-torque": ("torque",),
}
"""Numbers of each controller that may be tuned."""
WEIGHT_KEYS = ("weight_on_bit.gain", "weight_on_bit.path.delay")
"""Numbers of a weight on bit that follows the bit speed that may be tuned."""
DEFAULTS = {
    "pi": {"kp": (0.0, 1000.0), "ki": (0.0, 500.0)},
    "stiff-speed": {"stiffness": (0.5, 50.0), "rate": (0.01, 5.0)},
    "soft-torque": {"share": (0.05, 1.0)},
    "z-torque": {"absorption": (0.0, 1.0)},
    "torsional-rectification": {"high_pass": (5.0, 60.0)},
}
"""Bounds where a design names no parameters (SI). Active damping and constant torque: from a
quarter to four times, and from half to twice, what the design has."""


@dataclass(frozen=True)
class Tuned:
    """A tuned parameter.

    Attributes
    ----------
    path : str
        Dotted path.
    unit : str
        Unit of its values, empty for factors.
    low, high : float
        Bounds (SI).
    """

    path: str
    unit: str
    low: float
    high: float


def tuned_parameters(design: Design) -> tuple[Tuned, ...]:
    """What the `[tune]` table of a design names, or the numbers of its controller.

    Raises
    ------
    InputError
        An unknown path, a wrong unit, bounds in the wrong order, or a count.
    """
    table = design.tables.tune
    if table.parameters:
        found = tuple(_read(design, path, entry) for path, entry in table.parameters.items())
    else:
        found = _defaults(design)
    for path in (t.path for t in found if t.path in design.tables.uncertain):
        raise InputError(
            "is drawn in [uncertain], and cannot be tuned as well", _where(design, path)
        )
    return found


def _where(design: Design, path: str) -> str:
    return f"{design.origin}: " * bool(design.origin) + f"tune.parameters.{path}"


def _read(design: Design, path: str, entry: RangeTable) -> Tuned:
    where = _where(design, path)
    try:
        target = parameter(design, path)
        low, high = target.parse(entry.min), target.parse(entry.max)
    except InputError as error:
        raise InputError(error.problem, where) from None
    if path.startswith("simulation.") or target.whole:
        raise InputError("is not a number of the rig that can be tuned", where)
    if not low < high:
        raise InputError(
            f"min {entry.min} must be less than max {entry.max}: the bounds are "
            + ("reversed" if high < low else "equal"),
            where,
        )
    for key, end in (("min", low), ("max", high)):
        try:
            design.replace({path: units.SI(end)})
        except InputError as error:
            raise InputError(f"no design has it: {error.problem}", f"{where}.{key}") from None
    return Tuned(path, target.si_unit, low, high)


def _defaults(design: Design) -> tuple[Tuned, ...]:
    law = design.tables.controller.law
    bounds: Mapping[str, tuple[float, float]]
    if law == "active-damping":
        damper, spring = active_damping(design.string)
        bounds = {"spring": (spring / 4, 4 * spring), "damper": (damper / 4, 4 * damper)}
    elif law == "constant-torque":
        torque = float(getattr(design.tables.controller, "torque", 0.0))
        bounds = {"torque": (min(0.5 * torque, 2 * torque), max(0.5 * torque, 2 * torque))}
        if torque == 0.0:
            raise InputError("a torque of 0 has no bounds about it: give some", "tune.parameters")
    else:
        bounds = DEFAULTS[law]
    return tuple(
        Tuned(f"controller.{key}", parameter(design, f"controller.{key}").si_unit, low, high)
        for key, (low, high) in bounds.items()
    )


def put(design: Design, tuned: tuple[Tuned, ...], values: Array) -> Design:
    """The design with values (SI) of its tuned parameters, shape (parameters,)."""
    return design.replace({t.path: units.SI(float(v)) for t, v in zip(tuned, values, strict=True)})


def middle(design: Design, tuned: tuple[Tuned, ...]) -> Design:
    """The design with every tuned parameter halfway: it has the types that its laws have within.

    An absorption or a delay of zero would make laws of another type.
    """
    return put(design, tuned, np.array([0.5 * (t.low + t.high) for t in tuned]))


class StringNumbers(NamedTuple):
    """What drives are tuned to of a string."""

    pipe: Any  # impedance of the uppermost pipe (N m s/rad); NaN of a lumped spring
    inertia: Any  # of the top drive (kg m2)
    spring: Any  # w_s^2 J_d, with w_s the lowest frequency with the top held (N m/rad)
    damper: Any  # of active damping by its own rule (N m s/rad)


def string_numbers(string: Drillstring) -> StringNumbers:
    """Those of a string."""
    inertia = string.parts.top_inertia
    spring = stick_slip_frequency(string) ** 2 * inertia
    lumped = string.parts.sections[0].inertia == 0.0
    pipe = math.nan if lumped else pipe_impedance(string)
    return StringNumbers(pipe, inertia, spring, 2.0 * math.sqrt(string.static_stiffness * inertia))


def drive_numbers(
    design: Design, values: Mapping[str, Any], string: StringNumbers
) -> dict[str, Any]:
    """Numbers of the drive law of a design with some of the controller's numbers replaced."""
    table = design.tables.controller
    refuse_other_paths(table.law, values)
    given = {k.removeprefix("controller."): v for k, v in values.items() if "controller." in k}

    def number(key: str, other: Any = None) -> Any:
        own = getattr(table, key, None)
        return given.get(key, other if own is None else own)

    if table.law == "constant-torque":
        return {"level": number("torque"), "feedforward": number("torque")}
    if table.law == "pi":
        numbers = {"kp": number("kp"), "ki": number("ki")}
    elif table.law == "soft-torque":
        numbers = {"kp": string.pipe / number("share"), "ki": string.spring}
    else:
        numbers = {"kp": number("stiffness") * string.pipe, "ki": number("rate") * string.inertia}
    if table.drive.anti_windup != "none" and table.drive.tracking_time is None:
        numbers["tracking"] = _tracking(numbers["kp"], numbers["ki"])
    if table.law in ("z-torque", "torsional-rectification"):
        numbers["mobility"] = number("absorption", 1.0) / string.pipe
        numbers["corner"] = 2.0 * math.pi / number("high_pass")
    if table.law == "active-damping":
        damper = number("damper", string.damper)
        numbers["mobility"] = 1.0 / damper
        numbers["corner"] = number("spring", string.spring) / damper
    return numbers


def _tracking(kp: Any, ki: Any) -> Any:
    """Rate of the anti-windup (1/s), as `design/drive.py` chooses it."""
    if isinstance(kp, float) and not kp > 0.0:
        return 1.0
    return ki / kp


def refuse_other_paths(law: str, values: Mapping[str, Any]) -> None:
    """Refuse (`InputError`) paths of a controller that its equations do not take as symbols."""
    allowed = [f"controller.{key}" for key in LAW_KEYS[law]]
    for path in values:
        if path.startswith("controller.") and path not in allowed:
            raise InputError(
                f"{path!r} has no derivative here; {nearest(path, allowed)}", "tune.parameters"
            )
