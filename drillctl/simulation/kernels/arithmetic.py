"""What rows need beyond the operators: fused multiply-adds, extremes, questions to all lanes.

exp(x) of a row in plain arithmetic.

A call into the C library would be made lane by lane and would cost as much as the rest of a
step. Accurate to 1 unit in the last place for -708 <= x <= 709; clamped outside.

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
    MASK,
    ROW,
    WHOLE,
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
    pick,
    put,
    splat,
)

# No fastmath: what may be fused, `vectors` says. Division follows IEEE. No counting of references:
# kernels hold none and allocate nothing, and counting them cost as much as the laws.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}


def gather(work: Array, places: Row) -> Row:
    """One element of a flat array a lane; `places` holds whole numbers."""
    whole = builder().fptosi(places.ir, WHOLE)
    result = ir.Constant(ROW, ir.Undefined)
    for lane in range(WIDTH):
        index = ir.Constant(ir.IntType(32), lane)
        place = builder().extract_element(whole, index)
        element = builder().load(builder().gep(work.data, [place]), align=DOUBLE_BYTES)
        result = builder().insert_element(result, element, index)
    return Row(result)


def any_of(condition: Mask) -> Truth:
    """Whether a condition holds in some lane."""
    bits = builder().bitcast(condition.ir, ir.IntType(WIDTH))
    return Truth(builder().icmp_unsigned("!=", bits, ir.Constant(bits.type, 0)))


def everywhere() -> Mask:
    """A condition that holds in every lane."""
    return Mask(ir.Constant(MASK, [1] * WIDTH))


def _function(name: str, *arguments: Any) -> Any:
    kind = arguments[0].type
    of = ir.FunctionType(kind, [kind] * len(arguments))
    suffix = f"v{WIDTH}f64" if kind == ROW else "f64"
    called = cgutils.get_or_insert_function(builder().module, of, f"llvm.{name}.{suffix}")
    return builder().call(called, arguments)


def fma(a: Any, b: Any, c: Any) -> Any:
    """A * b + c, rounded once, of rows or numbers."""
    vector = any(isinstance(value, (Row, Mask)) for value in (a, b, c))
    values = [(each if vector else as_number)(value).ir for value in (a, b, c)]
    return (Row if vector else Number)(_function("fma", *values))


def least(a: Any, b: Any) -> Any:
    """The smaller of two; the second where one is NaN."""
    return pick(a < b, a, b) if isinstance(a, Value) else pick(b > a, a, b)


def most(a: Any, b: Any) -> Any:
    """The larger of two; the second where one is NaN."""
    return pick(a > b, a, b) if isinstance(a, Value) else pick(b < a, a, b)


def power_of_two(shifted: Row) -> Row:
    """2^k from k + 1.5 * 2^52: the low bits of that double are those of k."""
    bits = builder().bitcast(shifted.ir, WHOLE)
    moved = builder().shl(bits, splat(ir.Constant(INTEGER, 52), WHOLE))
    bias = splat(ir.Constant(INTEGER, 1023 << 52), WHOLE)
    return Row(builder().bitcast(builder().add(moved, bias), ROW))


def rounded_down(value: Row) -> Row:
    """The largest whole number that is not above."""
    return Row(_function("floor", value.ir))


def lane_number() -> Row:
    """0, 1, 2, ...: each lane's place in its block."""
    return Row(ir.Constant(ROW, [float(lane) for lane in range(WIDTH)]))


def aligned_stack() -> None:
    """Let rows that find no register lie in one line of the first cache, not across two.

    A function realigns its stack if a variable of it asks for that; registers are told where to
    go too late to ask.
    """
    with builder().goto_entry_block():
        slot = builder().alloca(ROW)
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
# ln 2 in two parts: k * _LN2_HIGH is exact for the whole numbers k that occur.
_LN2_HIGH = 0.693145751953125
_LN2_LOW = 1.42860682030941723212e-6
# Adding 1.5 * 2^52 rounds to a whole number and leaves it in the low bits.
_ROUNDER = 6755399441055744.0
_LOWEST, _HIGHEST = -708.0, 709.0


def exp(x: Any) -> Any:
    """E to the power `x`: 2^k times a Taylor polynomial on |r| <= ln(2)/2. NaN stays NaN."""
    x = pick(x < _LOWEST, _LOWEST, x)
    x = pick(x > _HIGHEST, _HIGHEST, x)
    shifted = fma(x, _LOG2_E, _ROUNDER)
    k = shifted - _ROUNDER
    r = fma(-k, _LN2_LOW, fma(-k, _LN2_HIGH, x))
    # Taylor's terms to r^12, summed in pairs (Estrin): a short chain of dependent operations.
    r2 = r * r
    r4 = r2 * r2
    r8 = r4 * r4
    p23 = fma(r, 1.0 / 6.0, 1.0 / 2.0)
    p45 = fma(r, 1.0 / 120.0, 1.0 / 24.0)
    p67 = fma(r, 1.0 / 5040.0, 1.0 / 720.0)
    p89 = fma(r, 1.0 / 362880.0, 1.0 / 40320.0)
    p1011 = fma(r, 1.0 / 39916800.0, 1.0 / 3628800.0)
    low = fma(r4, fma(r2, p67, p45), fma(r2, p23, 1.0 + r))
    high = fma(r4, 1.0 / 479001600.0, fma(r2, p1011, p89))
    return fma(r8, high, low) * power_of_two(shifted)
