"""What rows need beyond the operators: fused multiply-adds, extremes, questions to all lanes.

exp(x) of a row in plain arithmetic.

A call into the C library would be made lane by lane and would cost as much as the rest of a
step. Accurate to 2e-14 for |x| < 100 and to 4e-14 for -708 <= x <= 709; clamped outside: the
scheme asks for 1e-9 of the torque.

The numbers of laws in a block's memory.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils

from drillctl.simulation.kernels.rows import MOST_FIELDS, WIDTH
from drillctl.simulation.kernels.vectors import (
    DOUBLE_BYTES,
    INTEGER,
    TRUTH,
    Array,
    Mask,
    Number,
    Row,
    Truth,
    Value,
    as_number,
    at,
    builder,
    each,
    lanes,
    multiplied,
    pick,
    put,
    splat,
    vector,
)

# No fastmath: what is fused, `vectors` says. Division follows IEEE. No counting of references:
# kernels hold none and allocate nothing, and counting them cost as much as the laws.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}


def gather(work: Array, places: Row) -> Row:
    """One element of a flat array a lane; `places` holds whole numbers."""
    whole = builder().fptosi(places.ir, vector(INTEGER))
    result = ir.Constant(vector(), ir.Undefined)
    for lane in range(lanes()):
        index = ir.Constant(ir.IntType(32), lane)
        place = builder().extract_element(whole, index)
        element = builder().load(builder().gep(work.data, [place]), align=DOUBLE_BYTES)
        result = builder().insert_element(result, element, index)
    return Row(result)


def scatter(work: Array, places: Row, row: Row) -> None:
    """Store one element of a flat array a lane; `places` holds whole numbers."""
    whole = builder().fptosi(places.ir, vector(INTEGER))
    for lane in range(lanes()):
        index = ir.Constant(ir.IntType(32), lane)
        address = builder().gep(work.data, [builder().extract_element(whole, index)])
        element = builder().extract_element(row.ir, index)
        builder().store(element, address, align=DOUBLE_BYTES)


def any_of(condition: Mask) -> Truth:
    """Whether a condition holds in some lane."""
    bits = builder().bitcast(condition.ir, ir.IntType(lanes()))
    return Truth(builder().icmp_unsigned("!=", bits, ir.Constant(bits.type, 0)))


def everywhere() -> Mask:
    """A condition that holds in every lane."""
    return Mask(ir.Constant(vector(TRUTH), [1] * lanes()))


def fma(a: Any, b: Any, c: Any) -> Any:
    """A * b + c, rounded once, of rows or numbers."""
    if any(isinstance(value, (Row, Mask)) for value in (a, b, c)):
        return multiplied(each(a), each(b), each(c))
    return Number(builder().fma(*(as_number(value).ir for value in (a, b, c))))


def least(a: Any, b: Any) -> Any:
    """The smaller of two; the second where one is NaN."""
    return pick(a < b, a, b) if isinstance(a, Value) else pick(b > a, a, b)


def most(a: Any, b: Any) -> Any:
    """The larger of two; the second where one is NaN."""
    return pick(a > b, a, b) if isinstance(a, Value) else pick(b < a, a, b)


def signed(size: Row, sign: Row) -> Row:
    """A number that is not negative, with the sign of another one."""
    bits = [builder().bitcast(value.ir, vector(INTEGER)) for value in (size, sign)]
    sign_bit = builder().and_(bits[1], splat(ir.Constant(INTEGER, -(2**63))))
    return Row(builder().bitcast(builder().or_(bits[0], sign_bit), vector()))


def power_of_two(shifted: Row) -> Row:
    """2^k from k + 1.5 * 2^52: the low bits of that double are those of k."""
    bits = builder().bitcast(shifted.ir, vector(INTEGER))
    moved = builder().shl(bits, splat(ir.Constant(INTEGER, 52)))
    bias = splat(ir.Constant(INTEGER, 1023 << 52))
    return Row(builder().bitcast(builder().add(moved, bias), vector()))


def rounded_down(value: Row) -> Row:
    """The largest whole number that is not above."""
    kind = ir.FunctionType(vector(), [vector()])
    name = f"llvm.floor.v{lanes()}f64"
    called = cgutils.get_or_insert_function(builder().module, kind, name)
    return Row(builder().call(called, (value.ir,)))


def root(value: Row) -> Row:
    """The square root of a row."""
    kind = ir.FunctionType(vector(), [vector()])
    name = f"llvm.sqrt.v{lanes()}f64"
    called = cgutils.get_or_insert_function(builder().module, kind, name)
    return Row(builder().call(called, (value.ir,)))


def lane_number() -> Row:
    """0, 1, 2, ...: each lane's place in its block."""
    return Row(ir.Constant(vector(), [float(lane) for lane in range(lanes())]))


def aligned_stack() -> None:
    """Let rows that find no register lie in one line of the first cache, not across two.

    A function realigns its stack if a variable of it asks for that; registers are told where to
    go too late to ask.
    """
    with builder().goto_entry_block():
        slot = builder().alloca(vector())
    slot.align = 64
    kind = ir.FunctionType(ir.VoidType(), [slot.type])
    builder().call(ir.InlineAsm(kind, "", "r", side_effect=True), [slot])


def law_at(law: Any, work: Array, place: int) -> Any:
    """The law of a block, its numbers the rows of `work` from `place` on."""
    return type(law)(*(at(work, place + k * WIDTH) for k in range(len(law))))


def load_block(law: Any, work: Array, place: int, first: Any, due: Mask | None = None) -> None:
    """Copy the numbers of the lanes from `first` on into `work[place:]`; all, or where `due`."""
    if len(law) > MOST_FIELDS[place]:
        raise TypeError(f"{type(law).__name__} has more numbers than there is room for")
    for k, numbers in enumerate(law):
        row = place + k * WIDTH
        new = at(numbers, first)
        put(work, row, new if due is None else pick(due, new, at(work, row)))


_LOG2_E = 1.4426950408889634
_LN2 = 0.6931471805599453
# Adding 1.5 * 2^52 rounds to a whole number and leaves it in the low bits.
_ROUNDER = 6755399441055744.0
_LOWEST, _HIGHEST = -708.0, 709.0


# Least largest relative error, 1.5e-14, of a polynomial of this degree with p(0) = 1.
_TERMS = (
    1.0, 0.9999999999999128, 0.499999999996087, 0.1666666666775023, 0.04166666698618283,
    0.008333333006764743, 0.0013888808020380765, 0.00019841603794055196, 2.4882081837218747e-05,
    2.747670363364591e-06,
)  # fmt: skip


def exp(x: Any) -> Any:
    """E to the power `x`: 2^k times a polynomial on |r| <= ln(2)/2. NaN stays NaN."""
    x = pick(x < _LOWEST, _LOWEST, x)
    x = pick(x > _HIGHEST, _HIGHEST, x)
    shifted = fma(x, _LOG2_E, _ROUNDER)
    r = fma(_ROUNDER - shifted, _LN2, x)
    # Summed in pairs (Estrin): a short chain of dependent operations.
    c = _TERMS
    r2 = r * r
    r4 = r2 * r2
    low = fma(r2, fma(r, c[3], c[2]), fma(r, c[1], c[0]))
    high = fma(r2, fma(r, c[7], c[6]), fma(r, c[5], c[4]))
    highest = fma(r4, fma(r, c[9], c[8]), high)
    return fma(r4, highest, low) * power_of_two(shifted)
