"""Points of loops as CasADi functions: crossings, poles, delays, sensitivities.

Each function takes the tuned values first; the string comes as data, the series of a circle, and
what differs from loop to loop as constants, so that one function serves all loops whose laws are
of one kind. Derivatives are CasADi's, of first and second order, exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.robust.line_data import TERMS, Chain, Circle, chain_at
from drillctl.studies.robust.loops import Loop
from drillctl.studies.robust.pairs import Pair, pair
from drillctl.studies.robust.tuned import StringNumbers, Tuned, drive_numbers

Array = NDArray[np.float64]

DATA = 8 * TERMS + 4
"""Numbers that tell a circle."""
CONSTANTS = 6
"""Numbers that tell a loop from another of its kind."""


@dataclass(frozen=True, eq=False)
class PointFunctions:
    """CasADi functions of loops of one kind."""

    # (values, constants, circle, u) -> slope at which poles lie at centre + i radius u, and its
    # imaginary part, zero at a crossing (N m s/rad)
    crossing: Any
    # (values, constants, circle, u), u a pair -> characteristic function (2,) over a size, and
    # the damping ratio of a pole there
    pole: Any
    # (values, constants, circle, (u, delay)) -> characteristic function (2,) over a size with the
    # drive later by a delay (s), on the axis
    late: Any
    # (values, constants, chain, omega) -> squares of numerator and denominator of the sensitivity
    # at the top torque, over a size
    sensitivity: Any


def kind_of(loop: Loop, tuned: tuple[Tuned, ...]) -> tuple[Any, ...]:
    """What loops have in common that share their functions."""
    values = {t.path: 1.0 for t in tuned}
    fixed = drive_numbers(loop.design, values, loop.string)
    law: Any = loop.design.top_drive
    # The anti-windup plays no part in a linear loop.
    kept = tuple(v for k, v in law._asdict().items() if k not in {*fixed, "tracking"})
    side = loop.weight
    path = None if side is None else (side.gain, side.path.delay, side.path.sensor, side.path.hoist)
    return type(law), kept, loop.design.tables.controller.model_dump_json(), path


def constants_of(loop: Loop) -> Array:
    """What tells a loop from another of its kind."""
    return np.array([*loop.string, loop.slope, 0.0 if loop.weight is None else loop.weight.torque])


def point_functions(loop: Loop, tuned: tuple[Tuned, ...]) -> PointFunctions:
    """Functions of the loops of one kind over the values (SI) of what is tuned."""
    import casadi as ca

    p, known = ca.SX.sym("p", len(tuned)), ca.SX.sym("constants", CONSTANTS)
    # As pairs, so that the laws' equations never mix symbols and pairs.
    values = {t.path: pair(p[k]) for k, t in enumerate(tuned)}
    string = StringNumbers(*(pair(known[k]) for k in range(4)))
    side = None if loop.weight is None else replace(loop.weight, torque=pair(known[5]))
    own = replace(loop, string=string, slope=known[4], weight=side)
    data = ca.SX.sym("circle", DATA)
    return PointFunctions(
        _crossing(own, values, p, known, data),
        _pole(own, values, p, known, data),
        _late(own, values, p, known, data),
        _sensitivity(own, values, p, known),
    )


def _read(data: Any) -> tuple[tuple[Any, Any], Pair, Any, Any]:
    """Series, centre, radius and size of a circle."""
    import casadi as ca

    half = 4 * TERMS
    terms = ca.reshape(data[:half], 4, TERMS), ca.reshape(data[half : 2 * half], 4, TERMS)
    rest = data[2 * half :]
    return terms, Pair(rest[0], rest[1]), rest[2], rest[3]


def _crossing(loop: Loop, values: dict[str, Any], p: Any, known: Any, data: Any) -> Any:
    import casadi as ca

    terms, centre, radius, _ = _read(data)
    u = ca.SX.sym("u")
    s = Pair(0.0, centre.im + radius * u)
    over, under = chain_at(terms, Pair(0.0, u)).bit(loop.drive(values, s))
    impedance = over * under.conjugate() * (1.0 / under.square) + loop.rock(values, s)
    return ca.Function("crossing", [p, known, data, u], [impedance.re, impedance.im])


def _pole(loop: Loop, values: dict[str, Any], p: Any, known: Any, data: Any) -> Any:
    import casadi as ca

    terms, centre, radius, size = _read(data)
    both = ca.SX.sym("u", 2)
    u = Pair(both[0], both[1])
    s = centre + u * radius
    rock = loop.rock(values, s) - loop.slope
    root = chain_at(terms, u).characteristic(loop.drive(values, s), rock)
    ratio = -s.re / ca.sqrt(s.square)
    return ca.Function("pole", [p, known, data, both], [ca.vertcat(root.re, root.im) / size, ratio])


def _late(loop: Loop, values: dict[str, Any], p: Any, known: Any, data: Any) -> Any:
    import casadi as ca

    terms, centre, radius, size = _read(data)
    both = ca.SX.sym("u", 2)
    s = Pair(0.0, centre.im + radius * both[0])
    rock = loop.rock(values, s) - loop.slope
    drive = loop.drive(values, s) * (-s * both[1]).exp()
    root = chain_at(terms, Pair(0.0, both[0])).characteristic(drive, rock)
    return ca.Function("late", [p, known, data, both], [ca.vertcat(root.re, root.im) / size])


def _sensitivity(loop: Loop, values: dict[str, Any], p: Any, known: Any) -> Any:
    import casadi as ca

    omega, flat = ca.SX.sym("omega"), ca.SX.sym("chain", 9)
    s = Pair(0.0, omega)
    chain = Chain(*(Pair(flat[k], flat[k + 4]) for k in range(4)))
    rock = loop.rock(values, s) - loop.slope
    above = chain.alpha + rock * chain.gamma
    whole = chain.characteristic(loop.drive(values, s), rock)
    squares = [above.square / flat[8], whole.square / flat[8]]
    return ca.Function("sensitivity", [p, known, flat, omega], squares)


def circle_data(circle: Circle, size: float = 1.0) -> Array:
    """A circle as the functions take it; `size` scales the characteristic function."""
    terms = circle.terms
    return np.concatenate([
        terms.real.ravel(order="F"), terms.imag.ravel(order="F"),
        [circle.centre.real, circle.centre.imag, circle.radius, size],
    ])  # fmt: skip


def chain_data(chain: Chain, size: float) -> Array:
    """Chain parameters at one frequency as the functions take them."""
    flat = np.array([complex(part) for part in chain])
    return np.concatenate([flat.real, flat.imag, [size]])
