"""A row as one value: a vector with one number a lane, held in the processor's registers.

The kernels are written as if for one lane, `torque = level + spread * exp(-decay * speed)`, and
work on `WIDTH` lanes at once: a `Row` is an LLVM vector, each of its operations one instruction a
register. Nothing is left to a compiler's judgement of loops, so that nothing is ever computed lane
by lane, and quantities that live within a step never touch memory.

They are ordinary Python, called once for each combination of laws with values that stand for
numbers to come: every operation on them emits its instruction. Numba takes what was emitted as one
of its own functions (`emitted`), optimises it and keeps it on disk. Which law is at work is thus an
ordinary question of Python, and compiling costs what LLVM takes for it: a compiler that has to find
out the types of a thousand calls took eight times as long.

What a lane does must not depend on its company. There is no branch on the value of a row: a
comparison gives a `Mask`, and `pick` takes from two rows by it. Python's numbers mix with rows;
a mask in a sum or product counts as one or zero.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from drillctl.simulation.kernels.rows import FUSES, WIDTH

DOUBLE, INTEGER, TRUTH = ir.DoubleType(), ir.IntType(64), ir.IntType(1)

DOUBLE_BYTES = 8


class _Here:
    """Where instructions go; one kernel is compiled at a time, under numba's own lock."""

    context: Any = None
    builder: Any = None
    lanes = WIDTH


def builder() -> Any:
    """LLVM's builder at the place that is being emitted."""
    return _Here.builder


def lanes() -> int:
    """Lanes of a row at the place that is being emitted."""
    return _Here.lanes


@contextmanager
def rows_of(count: int) -> Iterator[None]:
    """Let rows have fewer lanes: what keeps many of them finds a register for each."""
    was, _Here.lanes = _Here.lanes, count
    try:
        yield
    finally:
        _Here.lanes = was


def vector(kind: Any = DOUBLE) -> Any:
    """LLVM's type of a row of numbers, or of something else."""
    return ir.VectorType(kind, _Here.lanes)


def emitted(function: Callable[..., None]) -> Any:
    """Decorator: compiled code calls what this function emits for values of its arguments' types.

    A named tuple arrives as itself, of such values; arrays as `Array`.
    """

    def typed(typing_context: Any, *kinds: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            was = _Here.context, _Here.builder
            _Here.context, _Here.builder = context, builder
            try:
                function(*map(_value, arguments, signature.args))
            finally:
                _Here.context, _Here.builder = was
            return context.get_dummy_value()

        return types.void(*kinds), generate

    parameters = list(inspect.signature(function).parameters.values())
    plain = [p.replace(annotation=inspect.Parameter.empty) for p in parameters]
    first = inspect.Parameter("typing_context", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    typed.__signature__ = inspect.Signature([first, *plain])  # type: ignore[attr-defined]
    typed.__name__ = typed.__qualname__ = function.__name__
    return intrinsic(typed)


def _value(value: Any, kind: Any) -> Any:
    """What stands for an argument."""
    if isinstance(kind, types.BaseNamedTuple):
        fields = (builder().extract_value(value, k) for k in range(len(kind)))
        return kind.instance_class(*map(_value, fields, kind))
    if isinstance(kind, types.Array):
        if kind.layout != "C":
            raise TypeError(f"a kernel takes arrays without gaps, not {kind}")
        array = _Here.context.make_array(kind)(_Here.context, builder(), value)
        shape = cgutils.unpack_tuple(builder(), array.shape, kind.ndim)
        return Array(array.data, tuple(map(Integer, shape)), types.int64 == kind.dtype)
    if isinstance(kind, types.Float):
        return Number(value)
    return Integer(_Here.context.cast(builder(), value, kind, types.int64))


class Value:
    """Something that is known when the compiled code runs."""

    def __init__(self, value: Any) -> None:
        self.ir = value

    def __bool__(self) -> bool:
        raise TypeError("a kernel cannot branch on data: use `pick`, or `when` for all lanes")

    def __add__(self, other: Any) -> Any:
        return _arithmetic("add", self, other)

    def __radd__(self, other: Any) -> Any:
        return _arithmetic("add", other, self)

    def __sub__(self, other: Any) -> Any:
        return _arithmetic("sub", self, other)

    def __rsub__(self, other: Any) -> Any:
        return _arithmetic("sub", other, self)

    def __mul__(self, other: Any) -> Any:
        return _product(self, other)

    def __rmul__(self, other: Any) -> Any:
        return _product(other, self)

    def __truediv__(self, other: Any) -> Any:
        return _arithmetic("div", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return _arithmetic("div", other, self)

    def __lt__(self, other: Any) -> Any:
        return _compared("<", self, other)

    def __le__(self, other: Any) -> Any:
        return _compared("<=", self, other)

    def __gt__(self, other: Any) -> Any:
        return _compared(">", self, other)

    def __ge__(self, other: Any) -> Any:
        return _compared(">=", self, other)

    def __eq__(self, other: object) -> Any:
        return _compared("==", self, other)

    def __ne__(self, other: object) -> Any:
        return _compared("!=", self, other)

    __hash__ = None  # type: ignore[assignment]  # equality is a value, too


class Row(Value):
    """A double a lane.

    A product knows its factors, and a sum with it is emitted as one operation, rounded once. Left
    to LLVM, what is fused would depend on which branches it keeps, and that on the block width. No
    other liberty is taken: sums keep their order, and tests for NaN stay.
    """

    def __init__(
        self, value: Any, factors: tuple[Row, Row] | None = None, uniform: bool = False
    ) -> None:
        super().__init__(value)
        self.factors, self.uniform = factors, uniform

    def __neg__(self) -> Row:
        negative = Row(builder().fneg(self.ir))
        if self.factors is not None:
            negative.factors = (-self.factors[0], self.factors[1])
        return negative

    def __abs__(self) -> Row:
        """The sign bit cleared."""
        without = splat(ir.Constant(INTEGER, 2**63 - 1))
        bits = builder().bitcast(self.ir, without.type)
        return Row(builder().bitcast(builder().and_(bits, without), self.ir.type))


class Truths(Value):
    """What is true or not."""

    def __and__(self, other: Any) -> Any:
        return type(self)(builder().and_(self.ir, other.ir))

    def __or__(self, other: Any) -> Any:
        return type(self)(builder().or_(self.ir, other.ir))

    def __invert__(self) -> Any:
        return type(self)(builder().not_(self.ir))


class Mask(Truths):
    """A truth a lane."""


class Truth(Truths):
    """One truth, for all lanes."""


class Number(Value):
    """A double, the same for all lanes."""

    def __neg__(self) -> Number:
        return Number(builder().fneg(self.ir))


class Integer(Value):
    """A whole number, the same for all lanes."""

    def __and__(self, other: Any) -> Integer:
        return Integer(builder().and_(self.ir, as_integer(other).ir))

    def __floordiv__(self, other: int) -> Integer:
        return Integer(builder().sdiv(self.ir, as_integer(other).ir))


def splat(value: Any) -> Any:
    """The same value in every lane."""
    kind = vector(value.type)
    if isinstance(value, ir.Constant):
        return ir.Constant(kind, [value.constant] * lanes())
    nothing, whole = ir.Constant(kind, ir.Undefined), ir.IntType(32)
    first = builder().insert_element(nothing, value, ir.Constant(whole, 0))
    places = ir.Constant(vector(whole), [0] * lanes())
    return builder().shuffle_vector(first, nothing, places)


def as_integer(value: Any) -> Integer:
    """A whole number of Python's, or one that is known later; what is left of a double."""
    if isinstance(value, Number):
        return Integer(builder().fptosi(value.ir, INTEGER))
    return value if isinstance(value, Integer) else Integer(ir.Constant(INTEGER, int(value)))


def as_number(value: Any) -> Number:
    """A number of Python's, or one that is known later, as a double."""
    if isinstance(value, Number):
        return value
    if isinstance(value, Integer):
        return Number(builder().sitofp(value.ir, DOUBLE))
    return Number(ir.Constant(DOUBLE, float(value)))


def each(value: Any) -> Row:
    """A row of one number, or a row as it is; a mask as ones and zeros."""
    if isinstance(value, Row):
        return value
    if isinstance(value, Mask):
        return Row(builder().select(value.ir, splat(as_number(1).ir), splat(as_number(0).ir)))
    return Row(splat(as_number(value).ir), uniform=True)


def _alike(x: Any, y: Any) -> tuple[Any, Any]:
    """Two operands as values of one kind."""
    if isinstance(x, (Row, Mask)) or isinstance(y, (Row, Mask)):
        return each(x), each(y)
    if all(isinstance(value, (Integer, int)) for value in (x, y)):
        return as_integer(x), as_integer(y)
    return as_number(x), as_number(y)


def _arithmetic(name: str, x: Any, y: Any) -> Any:
    x, y = _alike(x, y)
    if isinstance(x, Integer):
        if name == "div":
            x, y = as_number(x), as_number(y)
        else:
            return Integer(getattr(builder(), name)(x.ir, y.ir))
    if isinstance(x, Row) and name in ("add", "sub"):
        if y.factors is not None:
            a, b = y.factors if name == "add" else (-y.factors[0], y.factors[1])
            return multiplied(a, b, x)
        if x.factors is not None:
            return multiplied(*x.factors, y if name == "add" else -y)
    result = type(x)(getattr(builder(), "f" + name)(x.ir, y.ir))
    if isinstance(x, Row) and name == "mul":
        # The sign is that of the first: free in a row, not in one number for all lanes.
        result.factors = (y, x) if x.uniform else (x, y)
    return result


def multiplied(a: Row, b: Row, c: Row) -> Row:
    """A * b + c, rounded once if the machine can do that."""
    if not FUSES:  # it would call a function for each lane
        return Row(builder().fadd(builder().fmul(a.ir, b.ir), c.ir))
    kind, values = ir.FunctionType(vector(), [vector()] * 3), (a.ir, b.ir, c.ir)
    name = f"llvm.fma.v{lanes()}f64"
    called = cgutils.get_or_insert_function(builder().module, kind, name)
    return Row(builder().call(called, values))


def _product(x: Any, y: Any) -> Any:
    """A mask chooses; anything else is multiplied."""
    for chooses, value in ((x, y), (y, x)):
        if isinstance(chooses, Mask):
            return pick(chooses, value, 0.0)
    return _arithmetic("mul", x, y)


def _compared(sign: str, x: Any, y: Any) -> Any:
    x, y = _alike(x, y)
    if isinstance(x, Integer):
        return Truth(builder().icmp_signed(sign, x.ir, y.ir))
    # As Python has it: NaN is unequal to everything, and not above or below anything.
    compare = builder().fcmp_unordered if sign == "!=" else builder().fcmp_ordered
    return (Mask if isinstance(x, Row) else Truth)(compare(sign, x.ir, y.ir))


def pick(condition: Any, yes: Any, no: Any) -> Any:
    """`yes` where a condition holds, `no` elsewhere: lane by lane, or of two numbers."""
    if isinstance(condition, Mask):
        yes, no = each(yes), each(no)
    else:
        yes, no = _alike(yes, no)
    return type(yes)(builder().select(condition.ir, yes.ir, no.ir))


class Array:
    """An array without gaps, of doubles or of whole numbers."""

    def __init__(self, data: Any, shape: tuple[Any, ...], whole: bool = False) -> None:
        self.data, self.shape, self.whole = data, shape, whole

    def address(self, place: Any) -> Any:
        """Address of an element, the array taken as flat."""
        return builder().gep(self.data, [as_integer(place).ir])

    def __getitem__(self, place: Any) -> Any:
        """An element, a part along the first axis, or one of those as an array."""
        if isinstance(place, slice):
            begin = as_integer(0 if place.start is None else place.start)
            end = as_integer(self.shape[0] if place.stop is None else place.stop)
            return Array(self.address(begin), (end - begin,), self.whole)
        if isinstance(place, tuple) and len(place) > 1:
            return self[place[0]][place[1:]]
        place = place[0] if isinstance(place, tuple) else place
        size = 1
        for extent in self.shape[1:]:
            size = extent * size
        start = self.address(size * place)
        if len(self.shape) > 1:
            return Array(start, self.shape[1:], self.whole)
        return (Integer if self.whole else Number)(builder().load(start))

    def __setitem__(self, place: Any, value: Any) -> None:
        value = as_integer(value) if self.whole else as_number(value)
        builder().store(value.ir, self.address(place))


def _rows_address(array: Array, place: Any) -> Any:
    return builder().bitcast(array.address(place), vector().as_pointer())


def at(work: Array, place: Any) -> Row:
    """The row of a flat array that begins at `place`."""
    return Row(builder().load(_rows_address(work, place), align=DOUBLE_BYTES))


def put(work: Array, place: Any, value: Any) -> None:
    """Store a row, or one number for all lanes, at `place` of a flat array."""
    builder().store(each(value).ir, _rows_address(work, place), align=DOUBLE_BYTES)


class Variable:
    """A value that a loop or a condition changes: LLVM finds a register for it."""

    def __init__(self, value: Any) -> None:
        value = value if isinstance(value, Value) else as_number(value)
        self._kind, self._slot = type(value), cgutils.alloca_once(builder(), value.ir.type)
        self.set(value)

    def get(self) -> Any:
        """Its value here."""
        return self._kind(builder().load(self._slot))

    def set(self, value: Any) -> None:
        """Give it another one."""
        make = {Row: each, Number: as_number, Integer: as_integer}.get(self._kind)
        builder().store((make(value) if make else value).ir, self._slot)


class Loop:
    """A loop that is being emitted."""

    def __init__(self, made: Any) -> None:
        self.index, self._leave = Integer(made.index), made.do_break

    def leave(self) -> None:
        """Go on after the loop."""
        self._leave()


@contextmanager
def loop(count: Any) -> Iterator[Loop]:
    """Do what is emitted within for 0, 1, ..., count - 1."""
    with cgutils.for_range(builder(), as_integer(count).ir, intp=INTEGER) as made:
        yield Loop(made)


@contextmanager
def when(condition: Truth) -> Iterator[None]:
    """Do what is emitted within only if a condition holds."""
    with builder().if_then(condition.ir):
        yield
