"""A row as one value: a vector with one number a lane, held in the processor's registers.

The kernels are written as if for one lane, `torque = level + spread * exp(-decay * speed)`, and
work on `WIDTH` lanes at once: a `Row` is an LLVM vector, each of its operations one instruction a
register. Nothing is left to a compiler's judgement of loops, so that nothing is ever computed lane
by lane, and quantities that live within a step never touch memory.

What a lane does must not depend on its company. There is no branch on the value of a row: a
comparison gives a `Mask`, and `pick` takes from two rows by it. Python's `float` mixes with rows;
a mask in a sum or product counts as one or zero.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typeconv import Conversion
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, lower_cast, models, register_model

from drillctl.simulation.kernels.rows import WIDTH

ROW = ir.VectorType(ir.DoubleType(), WIDTH)
MASK = ir.VectorType(ir.IntType(1), WIDTH)
WHOLE = ir.VectorType(ir.IntType(64), WIDTH)

FUSED = ("contract",)
"""A product and a sum become one operation, rounded once. All lanes share it: unlike in a loop
that a compiler splits into vectors and a remainder, no lane is fused otherwise than its neighbour.
No other liberty is taken: sums keep their order, and tests for NaN stay."""


class Row(types.Type):
    """Numba's type of a vector of doubles, one a lane."""

    def __init__(self) -> None:
        super().__init__("Row")

    def can_convert_from(self, context: Any, other: Any) -> Any:
        """A number counts for every lane, a mask as ones and zeros."""
        return Conversion.safe if other in (number, mask) else None


class Mask(types.Type):
    """Numba's type of a vector of truths, one a lane."""

    def __init__(self) -> None:
        super().__init__("Mask")


row = Row()
mask = Mask()
number = types.float64


@register_model(Row)
class _RowModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ROW)


@register_model(Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, MASK)


def splat(builder: Any, value: Any, vector: Any = ROW) -> Any:
    """The same value in every lane."""
    nothing = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(nothing, value, ir.Constant(ir.IntType(32), 0))
    places = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, nothing, places)


def constant(value: float) -> Any:
    """A row of one number."""
    return ir.Constant(ROW, [value] * WIDTH)


def as_row(context: Any, builder: Any, value: Any, kind: Any) -> Any:
    """A row, mask or number as a row."""
    if kind == row:
        return value
    if kind == mask:
        return builder.select(value, constant(1.0), constant(0.0))
    return splat(builder, context.cast(builder, value, kind, number))


@lower_cast(number, row)
@lower_cast(mask, row)
def _converted(context: Any, builder: Any, kind: Any, wanted: Any, value: Any) -> Any:
    return as_row(context, builder, value, kind)


def _by_operator(key: Any, kinds: list[tuple[Any, ...]], result: Any, emit: Callable) -> None:
    """Teach numba an operator: the kinds it takes, and what it becomes."""
    cases = [signature(result, *arguments) for arguments in kinds]
    template = type("Template", (ConcreteTemplate,), {"key": key, "cases": cases})
    infer_global(key)(template)
    for arguments in kinds:

        def lower(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            return emit(context, builder, sig, values)

        lower_builtin(key, *arguments)(lower)


_PAIRS = [
    (row, row), (row, number), (number, row), (mask, row), (row, mask), (mask, number),
    (number, mask), (mask, mask),
]  # fmt: skip


def _arithmetic(key: Any, method: str) -> None:
    def emit(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        rows = (as_row(context, builder, *pair) for pair in zip(values, sig.args, strict=True))
        return getattr(builder, method)(*rows, flags=FUSED)

    _by_operator(key, _PAIRS, row, emit)


def _comparison(key: Any, sign: str) -> None:
    def emit(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        rows = (as_row(context, builder, *pair) for pair in zip(values, sig.args, strict=True))
        # As Python has it: NaN is unequal to everything, and not above or below anything.
        compare = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
        return compare(sign, *rows)

    _by_operator(key, _PAIRS, mask, emit)


def _product(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    """A mask chooses; anything else is multiplied."""
    (x, y), (of_x, of_y) = values, sig.args
    if of_x == mask:
        return builder.select(x, as_row(context, builder, y, of_y), constant(0.0))
    if of_y == mask:
        return builder.select(y, as_row(context, builder, x, of_x), constant(0.0))
    rows = as_row(context, builder, x, of_x), as_row(context, builder, y, of_y)
    return builder.fmul(*rows, flags=FUSED)


def _logic(key: Any, method: str) -> None:
    def emit(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return getattr(builder, method)(*values)

    _by_operator(key, [(mask, mask)], mask, emit)


def _negative(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    return builder.fneg(values[0])


def _not(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    return builder.not_(values[0])


def _size(context: Any, builder: Any, sig: Any, values: Any) -> Any:
    """The sign bit cleared."""
    without = ir.Constant(WHOLE, [2**63 - 1] * WIDTH)
    return builder.bitcast(builder.and_(builder.bitcast(values[0], WHOLE), without), ROW)


for _key, _method in (
    (operator.add, "fadd"), (operator.sub, "fsub"), (operator.truediv, "fdiv"),
    (operator.iadd, "fadd"), (operator.isub, "fsub"),
):  # fmt: skip
    _arithmetic(_key, _method)
for _key, _sign in (
    (operator.gt, ">"), (operator.ge, ">="), (operator.lt, "<"), (operator.le, "<="),
    (operator.eq, "=="), (operator.ne, "!="),
):  # fmt: skip
    _comparison(_key, _sign)
for _key, _method in ((operator.and_, "and_"), (operator.or_, "or_")):
    _logic(_key, _method)
for _key in (operator.mul, operator.imul):
    _by_operator(_key, _PAIRS, row, _product)
_by_operator(operator.neg, [(row,)], row, _negative)
_by_operator(operator.invert, [(mask,)], mask, _not)
_by_operator(abs, [(row,)], row, _size)
