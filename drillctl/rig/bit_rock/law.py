"""What a bit-rock law must offer, and what a design file and the studies know of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

from drillctl import registry
from drillctl.errors import InputError
from drillctl.rig.bit_rock.variation import VariationTable
from drillctl.rig.table import Table, law_name

Exp = Callable[[Any], Any]  # an exponential: `math.exp`, a compiled one, or `casadi.exp`


class BitRockLaw(Protocol):
    """Torque on the bit against its speed and the weight on it."""

    @property
    def set_valued(self) -> bool:
        """True where the law is a set at zero speed, so that a bit can stand still."""
        ...

    def static_torque(self, weight: Any) -> Any:
        """Largest torque on a bit at rest (N m) under `weight` (N)."""
        ...

    def kinetic_torque_at_rest(self, weight: Any) -> Any:
        """Torque (N m) in the limit of a bit that turns ever slower under `weight` (N)."""
        ...

    def steepest_fall(self, weight: Any) -> Any:
        """Largest value of minus the slope at any speed (N m s/rad) under `weight` (N)."""
        ...

    def torque_and_slope(self, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
        """Torque (N m) at `speed` >= 0 (rad/s) under `weight` (N), and its slope (N m s/rad)."""
        ...


class RockTable(Table):
    """Keys that every friction law has."""

    variation: VariationTable = VariationTable()


@dataclass(frozen=True)
class Form:
    """A `NamedTuple` that a law is computed with, and what its numbers are."""

    numbers: type
    # names of the numbers that another rock scales: static torque, sliding torque, decay
    static: tuple[str, ...] = ()
    sliding: tuple[str, ...] = ()
    decay: tuple[str, ...] = ()
    # for docs/laws.md: how a design requests it, when it is of use, curves in the picture
    keys: str = ""
    use: str = ""
    curves: tuple[tuple[str, Any], ...] = ()

    def has_rising(self, law: Any) -> bool:
        """Whether a law has less static torque than sliding torque."""
        if len(self.static) != 1 or len(self.sliding) != 1:
            return False
        return bool(getattr(law, self.static[0]) < getattr(law, self.sliding[0]))


@dataclass(frozen=True)
class FrictionLaw:
    """A friction law as a design file names it."""

    table: type[Table]  # its keys, `law` with its name among them
    # law of the table, the weight on bit (N), and whether that moves while the bit drills
    make: Callable[[Any, float, bool], BitRockLaw]
    draws: tuple[str, ...] = ()  # keys of sliding and static torque: uncertain by default
    # of the table: standard deviation over mean by key, where it is not the usual one of `draws`
    spread: Callable[[Any], Mapping[str, float]] = lambda table: {}
    # of the table: what every result must say of its numbers
    remark: Callable[[Any], str] = lambda table: ""
    forms: tuple[Form, ...] = ()  # that are its own
    # smooth law in place of another one, of a table with `regularised_over`
    regularised: Callable[[Any, Any], BitRockLaw] | None = None

    @property
    def name(self) -> str:
        """`law` in a design file."""
        return law_name(self.table)


@cache
def friction_laws() -> dict[str, FrictionLaw]:
    """All friction laws by name."""
    return {law.name: law for law in registry.gathered(registry.FRICTION_LAWS, "LAWS")}


def form_of(law: Any) -> Form:
    """What the numbers of a law are; those of a law from outside the registry are not known."""
    forms = (form for entry in friction_laws().values() for form in entry.forms)
    return next((form for form in forms if form.numbers is type(law)), Form(type(law)))


def changed_rock(law: Any, static: float, sliding: float, decay: float) -> Any:
    """The law of another rock.

    Parameters
    ----------
    law : BitRockLaw
        Of the rock there is.
    static, sliding, decay : float
        Factors on static torque, sliding torque and decay with speed.

    Raises
    ------
    InputError
        The law has no such number, or static torque would be under the sliding one.
    """
    form = form_of(law)
    values: dict[str, Any] = {}
    for name, factor, fields in (
        ("static", static, form.static),
        ("sliding", sliding, form.sliding),
        ("decay", decay, form.decay),
    ):
        if factor != 1.0 and not fields:
            raise InputError(
                f"{type(law).__name__} has no {name} number of its own", f"{name}_factor"
            )
        values |= {field: getattr(law, field) * factor for field in fields}
    made = law._replace(**values)
    if made.static_torque(1.0) < made.kinetic_torque_at_rest(1.0) or form.has_rising(made):
        raise InputError("static torque would be less than the sliding one", "static_factor")
    return made


def refuse_rising(static: float, sliding: float, names: tuple[str, str] = ("a2", "a1")) -> None:
    """Refuse (`InputError`) a static torque under the sliding one."""
    if static < sliding:
        raise InputError(f"{names[0]} = {static:g} must not be less than {names[1]} = {sliding:g}")


def contact(friction: Any, weight: Any, speed: Any, exp: Exp) -> tuple[Any, Any]:
    """Torque of the rock and its slope over speed, the weight moving with the speed.

    Parameters
    ----------
    friction : BitRockLaw
        Torque over speed and weight.
    weight : WeightLaw
        Weight over speed.
    speed : float, array or symbol
        Of the bit in its own direction, not negative (rad/s).
    exp : callable
        Exponential that fits `speed`.

    Returns
    -------
    torque, slope
        T(W(w), w) (N m) and dT/dw + dT/dW dW/dw (N m s/rad).
    """
    load = weight.weight(speed)
    torque, slope = friction.torque_and_slope(load, speed, exp)
    if not weight.moves:
        return torque, slope
    return torque, slope + by_weight(friction, load, speed, exp) * weight.slope(speed)


def by_weight(friction: Any, load: Any, speed: Any, exp: Exp) -> Any:
    """Torque per weight at constant speed, dT/dW (m).

    Most laws are proportional to the weight; one that is not has a method of its own.
    """
    if hasattr(friction, "torque_by_weight"):
        return friction.torque_by_weight(load, speed, exp)
    return friction.torque_and_slope(1.0, speed, exp)[0]
