"""Terms: what a function makes of numbers with names, as expressions for other languages.

A function is called with terms in place of floats. What is not there drops out, be it a filter or a
limit: a branch on numbers of the design is taken, and sums and products with 0, 1 and infinity are
simplified.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import FunctionType, SimpleNamespace
from typing import Any

COMPUTED: Mapping[str, Callable[..., float]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
    "negative": operator.neg, "abs": abs, "exp": math.exp, "min": min, "max": max,
    "limit": lambda least, value, most: min(max(value, least), most),
}  # fmt: skip
"""What a term may be made by, of floats."""


def _operator(kind: str) -> tuple[Callable[..., Term], Callable[..., Term]]:
    """An operator of terms, with a term on its left and on its right."""
    return lambda a, b: made(kind, a, b), lambda a, b: made(kind, b, a)


@dataclass(frozen=True, eq=False)
class Term:
    """A number, a name, or an operation on terms."""

    kind: str  # "number", "name", "choose" or a key of `COMPUTED`
    parts: tuple[Term, ...] = ()
    value: float | None = None  # None unless it is the same at every sample
    name: str = ""

    __add__, __radd__ = _operator("+")
    __sub__, __rsub__ = _operator("-")
    __mul__, __rmul__ = _operator("*")
    __truediv__, __rtruediv__ = _operator("/")

    def __neg__(self) -> Term:
        return made("negative", self)

    def __gt__(self, other: float) -> bool:
        return self.fixed > other

    def __eq__(self, other: object) -> bool:
        return self.fixed == other if isinstance(other, float) else self is other

    __hash__ = object.__hash__

    @property
    def fixed(self) -> float:
        """Its value; only what is the same at every sample may be branched on."""
        if self.value is None:
            raise TypeError(
                f"a branch on {self.name or self.kind}, which changes from sample to sample"
            )
        return self.value

    def is_number(self, value: float) -> bool:
        """Whether it is this very number, and not a name with that value."""
        return self.kind == "number" and self.value == value

    def inside(self) -> Iterator[Term]:
        """Itself and every term in it."""
        yield self
        for part in self.parts:
            yield from part.inside()


Value = Term | float


def number(value: float) -> Term:
    """A number without a name."""
    return Term("number", value=float(value))


def named(name: str, value: float | None = None) -> Term:
    """A variable, or a parameter with its value; one that is zero or infinite is the number."""
    if value is not None and (value == 0.0 or math.isinf(value)):
        return number(value)
    return Term("name", value=value, name=name)


def choose(which: Term, yes: Value, no: Value) -> Term:
    """One of two terms by a condition, which is a name."""
    return Term("choose", (which, _term(yes), _term(no)))


def made(kind: str, *values: Value) -> Term:
    """An operation on terms, simplified."""
    parts = tuple(map(_term, values))
    numbers = [part.value for part in parts]
    value = None if None in numbers else COMPUTED[kind](*numbers)
    if all(part.kind == "number" for part in parts):
        assert value is not None
        return number(value)
    return _simpler(kind, parts) or Term(kind, parts, value)


def _term(value: Value) -> Term:
    return value if isinstance(value, Term) else number(value)


def _simpler(kind: str, parts: tuple[Term, ...]) -> Term | None:
    first, last = parts[0], parts[-1]
    if kind == "limit":
        least, value, most = parts
        if least.is_number(-math.inf):
            return made("min", value, most)
        return made("max", value, least) if most.is_number(math.inf) else None
    if kind in ("min", "max"):
        nothing = math.inf if kind == "min" else -math.inf
        return first if last.is_number(nothing) else last if first.is_number(nothing) else None
    if kind == "*" and any(part.is_number(0.0) for part in parts):
        return number(0.0)
    if kind == "/" and first.kind == "number" and first.value in (0.0, math.inf, -math.inf):
        return first  # what is divided by is above zero: a speed, a period, an inertia
    if kind == "-" and first is last:
        return number(0.0)
    if kind == "/" and first.kind == "*" and first.parts[1] is last:
        return first.parts[0]
    neutral = {"+": 0.0, "-": 0.0, "*": 1.0, "/": 1.0}.get(kind)
    if neutral is None:
        return None
    if last.is_number(neutral):
        return first
    if first.is_number(neutral) and kind in ("+", "*"):
        return last
    return made("negative", last) if first.is_number(0.0) and kind == "-" else None


FUNCTIONS: Mapping[str, Any] = {
    "abs": lambda x: made("abs", x),
    "min": lambda x, y: made("min", x, y),
    "max": lambda x, y: made("max", x, y),
    "math": SimpleNamespace(
        exp=lambda x: made("exp", x), isfinite=lambda x: math.isfinite(x.fixed)
    ),
    "clipped": lambda x, least, most: made("limit", least, x, most),
}
"""Functions of terms, by the names of those of floats."""


def of_terms(function: Callable[..., Any], **others: Any) -> Callable[..., Any]:
    """The same function with these and `FUNCTIONS` for what it calls by such a name."""
    assert isinstance(function, FunctionType)
    known = {**function.__globals__, **FUNCTIONS, **others}
    return FunctionType(function.__code__, known, function.__name__, function.__defaults__)
