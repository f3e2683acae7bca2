"""Laws called by type: the Python of each law, compiled for rows where it is used.

A law is a `NamedTuple` of arrays, one number a lane. Its methods are looked up by its type
when a kernel is compiled, so that each combination of laws gets a kernel of its own, kept on
disk under the types' names.
"""

from __future__ import annotations

from typing import Any

from numba import types

from drillctl.simulation.kernels.arithmetic import at, by_type, exp, inlined, pick, put
from drillctl.simulation.kernels.rows import MOST_FIELDS, WIDTH


def law_at(law: Any, work: Any, place: int) -> Any:
    """The law of a block, its numbers the rows of `work` from `place` on."""
    raise NotImplementedError("compiled only")


@by_type(law_at)
def _law_at(law, work, place):
    if not isinstance(law, types.BaseNamedTuple):
        return None
    # numba builds a named tuple only from written-out arguments, hence the text.
    arguments = ", ".join(f"at(work, place + {k * WIDTH})" for k in range(len(law.fields)))
    scope: dict[str, Any] = {"Law": law.instance_class, "at": at}
    exec(f"def read(law, work, place):\n    return Law({arguments})", scope)
    return scope["read"]


def load_block(law: Any, work: Any, place: int, first: int) -> None:
    """Copy the numbers of the lanes from `first` on into `work[place:]`."""
    raise NotImplementedError("compiled only")


@by_type(load_block)
def _load_block(law, work, place, first):
    if not isinstance(law, types.BaseNamedTuple):
        return None
    if len(law.fields) > max(MOST_FIELDS.values()):
        raise TypeError(f"{law.instance_class.__name__} has more numbers than there is room for")
    lines = [
        f"    put(work, place + {k * WIDTH}, at(law[{k}], first))" for k in range(len(law.fields))
    ]
    scope: dict[str, Any] = {"at": at, "put": put}
    exec("\n".join(["def load(law, work, place, first):", *lines]), scope)
    return scope["load"]


def load_where(due: Any, law: Any, work: Any, place: int, first: int) -> None:
    """Copy the numbers of some lanes, those where `due` holds."""
    raise NotImplementedError("compiled only")


@by_type(load_where)
def _load_where(due, law, work, place, first):
    if not isinstance(law, types.BaseNamedTuple):
        return None
    places = [f"place + {k * WIDTH}" for k in range(len(law.fields))]
    lines = [
        f"    put(work, {row}, pick(due, at(law[{k}], first), at(work, {row})))"
        for k, row in enumerate(places)
    ]
    scope: dict[str, Any] = {"at": at, "put": put, "pick": pick}
    exec("\n".join(["def load(due, law, work, place, first):", *lines]), scope)
    return scope["load"]


def _method(law: Any, name: str) -> Any:
    """A method of a law's class, compiled."""
    return inlined(getattr(law.instance_class, name))


def static_torque(law: Any, weight: Any) -> Any:
    """`law.static_torque(weight)`."""
    raise NotImplementedError("compiled only")


@by_type(static_torque)
def _static_torque(law, weight):
    method = _method(law, "static_torque")
    return lambda law, weight: method(law, weight)


def kinetic_torque_at_rest(law: Any, weight: Any) -> Any:
    """`law.kinetic_torque_at_rest(weight)`."""
    raise NotImplementedError("compiled only")


@by_type(kinetic_torque_at_rest)
def _kinetic_torque_at_rest(law, weight):
    method = _method(law, "kinetic_torque_at_rest")
    return lambda law, weight: method(law, weight)


def mean_torque(law: Any, angle: Any, rate: float) -> Any:
    """`law.mean_torque(angle, rate)`, with `rate` = 1 / step (1/s)."""
    raise NotImplementedError("compiled only")


@by_type(mean_torque)
def _mean_torque(law, angle, rate):
    method = _method(law, "mean_torque")
    return lambda law, angle, rate: method(law, angle, rate)


def torque_at(law: Any, angle: Any, speed: Any) -> Any:
    """`law.torque(angle, speed)` of an ideal drive."""
    raise NotImplementedError("compiled only")


@by_type(torque_at)
def _torque_at(law, angle, speed):
    method = _method(law, "torque")
    return lambda law, angle, speed: method(law, angle, speed)


def weight_at(law: Any, speed: Any) -> Any:
    """`law.weight(speed)`."""
    raise NotImplementedError("compiled only")


@by_type(weight_at)
def _weight_at(law, speed):
    method = _method(law, "weight")
    return lambda law, speed: method(law, speed)


def moves(weight: Any) -> bool:
    """Whether a weight law, as numba knows it, moves with the bit speed of the moment."""
    return bool(weight.instance_class.moves.fget(None))  # a property of the class


def contact(friction: Any, weight: Any, speed: Any) -> Any:
    """`bit_rock.law.contact(friction, weight, speed, exp)`."""
    raise NotImplementedError("compiled only")


@by_type(contact)
def _contact(friction, weight, speed):
    load_at = _method(weight, "weight")
    torque_at = _method(friction, "torque_and_slope")
    if not moves(weight):
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
