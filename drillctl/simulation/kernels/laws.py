"""Laws called by type: the Python of each law, compiled where it is used.

A law is a `NamedTuple` of arrays, one number a lane. Its methods are looked up by its type
when a kernel is compiled, so that each combination of laws gets a kernel of its own, kept on
disk under the types' names.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import overload

from drillctl.simulation.kernels.compiling import inlined
from drillctl.simulation.kernels.exponential import exp
from drillctl.simulation.kernels.rows import MOST_FIELDS, WIDTH


def at_lane(law: Any, work: Any, row: int, lane: int) -> Any:
    """The law of one lane, its parameters read from `work[row + lane]` on."""
    raise NotImplementedError("compiled only")


@overload(at_lane)
def _at_lane(law, work, row, lane):
    if not isinstance(law, types.BaseNamedTuple):
        return None
    # numba builds a named tuple only from written-out arguments, hence the text.
    arguments = ", ".join(f"work[row + {k * WIDTH} + lane]" for k in range(len(law.fields)))
    scope: dict[str, Any] = {"Law": law.instance_class}
    exec(f"def read(law, work, row, lane):\n    return Law({arguments})", scope)
    return scope["read"]


def load_block(law: Any, work: Any, row: int, first: int) -> None:
    """Copy the parameters of the lanes from `first` on into `work[row:]`."""
    raise NotImplementedError("compiled only")


@overload(load_block)
def _load_block(law, work, row, first):
    if not isinstance(law, types.BaseNamedTuple):
        return None
    if len(law.fields) > max(MOST_FIELDS.values()):
        raise TypeError(f"{law.instance_class.__name__} has more numbers than there is room for")
    lines = [
        f"        work[row + {k * WIDTH} + lane] = law[{k}][first + lane]"
        for k in range(len(law.fields))
    ]
    text = "\n".join(
        ["def load(law, work, row, first):", f"    for lane in range({WIDTH}):", *lines]
    )
    scope: dict[str, Any] = {}
    exec(text, scope)
    return scope["load"]


def load_lane(law: Any, work: Any, row: int, first: int, lane: int) -> None:
    """Copy the parameters of one lane of the block from `first` on into `work[row:]`."""
    raise NotImplementedError("compiled only")


@overload(load_lane)
def _load_lane(law, work, row, first, lane):
    if not isinstance(law, types.BaseNamedTuple):
        return None
    lines = [
        f"    work[row + {k * WIDTH} + lane] = law[{k}][first + lane]"
        for k in range(len(law.fields))
    ]
    scope: dict[str, Any] = {}
    exec("\n".join(["def load(law, work, row, first, lane):", *lines]), scope)
    return scope["load"]


def _method(law: Any, name: str) -> Any:
    """A method of a law's class, compiled."""
    return inlined(getattr(law.instance_class, name))


def static_torque(law: Any, weight: float) -> float:
    """`law.static_torque(weight)`."""
    raise NotImplementedError("compiled only")


@overload(static_torque)
def _static_torque(law, weight):
    method = _method(law, "static_torque")
    return lambda law, weight: method(law, weight)


def kinetic_torque_at_rest(law: Any, weight: float) -> float:
    """`law.kinetic_torque_at_rest(weight)`."""
    raise NotImplementedError("compiled only")


@overload(kinetic_torque_at_rest)
def _kinetic_torque_at_rest(law, weight):
    method = _method(law, "kinetic_torque_at_rest")
    return lambda law, weight: method(law, weight)


def mean_torque(law: Any, angle: float, rate: float) -> tuple[float, float]:
    """`law.mean_torque(angle, rate)`, with `rate` = 1 / step (1/s)."""
    raise NotImplementedError("compiled only")


@overload(mean_torque)
def _mean_torque(law, angle, rate):
    method = _method(law, "mean_torque")
    return lambda law, angle, rate: method(law, angle, rate)


def torque_at(law: Any, angle: float, speed: float) -> float:
    """`law.torque(angle, speed)` of an ideal drive."""
    raise NotImplementedError("compiled only")


@overload(torque_at)
def _torque_at(law, angle, speed):
    method = _method(law, "torque")
    return lambda law, angle, speed: method(law, angle, speed)


def weight_at(law: Any, speed: float) -> float:
    """`law.weight(speed)`."""
    raise NotImplementedError("compiled only")


@overload(weight_at)
def _weight_at(law, speed):
    method = _method(law, "weight")
    return lambda law, speed: method(law, speed)


def contact(friction: Any, weight: Any, speed: float) -> tuple[float, float]:
    """`bit_rock.contact.contact(friction, weight, speed, exp)`."""
    raise NotImplementedError("compiled only")


@overload(contact)
def _contact(friction, weight, speed):
    load_at = _method(weight, "weight")
    torque_at = _method(friction, "torque_and_slope")
    if not weight.instance_class.moves.fget(None):  # a property of the class
        return lambda friction, weight, speed: torque_at(
            friction, load_at(weight, speed), speed, exp
        )
    load_slope = _method(weight, "slope")
    by_weight = _torque_by_weight(friction, torque_at)

    def moving(friction, weight, speed):
        load = load_at(weight, speed)
        torque, slope = torque_at(friction, load, speed, exp)
        return torque, slope + by_weight(friction, load, speed) * load_slope(weight, speed)

    return moving


def _torque_by_weight(friction: Any, torque_at: Any) -> Any:
    if hasattr(friction.instance_class, "torque_by_weight"):
        method = _method(friction, "torque_by_weight")
        return inlined(lambda friction, load, speed: method(friction, load, speed, exp))
    return inlined(lambda friction, load, speed: torque_at(friction, 1.0, speed, exp)[0])
