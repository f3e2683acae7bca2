"""How everything in this package is compiled.

What rows need beyond the operators: memory, choice, fused multiply-adds.

exp(x) of a row in plain arithmetic.

A call into the C library would be made lane by lane and would cost as much as the rest of a
step. Accurate to 1 unit in the last place for -708 <= x <= 709; clamped outside.
"""

from __future__ import annotations

from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

from drillctl.simulation.kernels.rows import WIDTH
from drillctl.simulation.kernels.vectors import (
    MASK,
    ROW,
    WHOLE,
    Mask,
    Row,
    as_row,
    mask,
    row,
    splat,
)

# No fastmath: what may be fused, `vectors` says. Division follows IEEE. No counting of references:
# kernels hold none and allocate nothing, and counting them cost as much as the laws.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}

inlined = numba.njit(forceinline=True, **OPTIONS)
"""Decorator for what is part of the step of a block."""

compiled = numba.njit(**OPTIONS)  # decorator for what is called once per block, or seldom


def by_type(function: Any) -> Any:
    """Decorator for what numba asks, given types, for the code that stands for `function`.

    That code is part of the step, too: left to itself LLVM calls it, and every row goes through
    memory on the way.
    """
    return overload(function, jit_options={"forceinline": True, **OPTIONS})


DOUBLE_BYTES = 8


def _address(context: Any, builder: Any, array: Any, kind: Any, place: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [place]), ROW.as_pointer())


@intrinsic
def at(typing_context: Any, work: Any, place: Any) -> Any:
    """The row of a flat array that begins at `place`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = _address(context, builder, arguments[0], signature.args[0], arguments[1])
        return builder.load(address, align=DOUBLE_BYTES)

    return row(work, types.intp), generate


@intrinsic
def put(typing_context: Any, work: Any, place: Any, value: Any) -> Any:
    """Store a row, or one number for all lanes, at `place` of a flat array."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = _address(context, builder, arguments[0], signature.args[0], arguments[1])
        stored = as_row(context, builder, arguments[2], signature.args[2])
        builder.store(stored, address, align=DOUBLE_BYTES)
        return context.get_dummy_value()

    return types.void(work, types.intp, value), generate


@intrinsic
def gather(typing_context: Any, work: Any, places: Any) -> Any:
    """One element of a flat array a lane; `places` holds whole numbers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        whole = builder.fptosi(arguments[1], WHOLE)
        result = ir.Constant(ROW, ir.Undefined)
        for lane in range(WIDTH):
            index = ir.Constant(ir.IntType(32), lane)
            element = builder.load(builder.gep(data, [builder.extract_element(whole, index)]))
            result = builder.insert_element(result, element, index)
        return result

    return row(work, row), generate


@intrinsic
def each(typing_context: Any, value: Any) -> Any:
    """A row of one number, or a row as it is."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return as_row(context, builder, arguments[0], signature.args[0])

    return row(value), generate


@intrinsic
def pick(typing_context: Any, condition: Any, yes: Any, no: Any) -> Any:
    """`yes` in the lanes where the condition holds, `no` in the others."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        chosen = [
            as_row(context, builder, value, kind)
            for value, kind in zip(arguments[1:], signature.args[1:], strict=True)
        ]
        return builder.select(arguments[0], *chosen)

    return row(mask, yes, no), generate


@intrinsic
def any_of(typing_context: Any, condition: Any) -> Any:
    """Whether a condition holds in some lane."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(bits.type, 0))

    return types.boolean(mask), generate


@intrinsic
def everywhere(typing_context: Any) -> Any:
    """A condition that holds in every lane."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return ir.Constant(MASK, [1] * WIDTH)

    return mask(), generate


@intrinsic
def fma(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """A * b + c, rounded once, of rows or numbers."""
    vector = any(isinstance(kind, (Row, Mask)) for kind in (a, b, c))

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if not vector:
            return builder.fma(*arguments)
        rows = [
            as_row(context, builder, value, kind)
            for value, kind in zip(arguments, signature.args, strict=True)
        ]
        kind = ir.FunctionType(ROW, [ROW] * 3)
        name = f"llvm.fma.v{WIDTH}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), rows)

    kinds = [k if isinstance(k, (Row, Mask)) else types.float64 for k in (a, b, c)]
    return (row if vector else types.float64)(*kinds), generate


@intrinsic
def least(typing_context: Any, a: Any, b: Any) -> Any:
    """The smaller of two; the second where one is NaN."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        x, y = (
            as_row(context, builder, *pair) for pair in zip(arguments, signature.args, strict=True)
        )
        return builder.select(builder.fcmp_ordered("<", x, y), x, y)

    return row(a, b), generate


@intrinsic
def most(typing_context: Any, a: Any, b: Any) -> Any:
    """The larger of two; the second where one is NaN."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        x, y = (
            as_row(context, builder, *pair) for pair in zip(arguments, signature.args, strict=True)
        )
        return builder.select(builder.fcmp_ordered(">", x, y), x, y)

    return row(a, b), generate


@intrinsic
def power_of_two(typing_context: Any, shifted: Any) -> Any:
    """2^k from k + 1.5 * 2^52: the low bits of that double are those of k."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = builder.bitcast(arguments[0], WHOLE)
        moved = builder.shl(bits, splat(builder, ir.Constant(ir.IntType(64), 52), WHOLE))
        bias = splat(builder, ir.Constant(ir.IntType(64), 1023 << 52), WHOLE)
        return builder.bitcast(builder.add(moved, bias), ROW)

    return row(row), generate


@intrinsic
def rounded_down(typing_context: Any, value: Any) -> Any:
    """The largest whole number that is not above."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = ir.FunctionType(ROW, [ROW])
        name = f"llvm.floor.v{WIDTH}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), arguments)

    return row(row), generate


@intrinsic
def lane_number(typing_context: Any) -> Any:
    """0, 1, 2, ...: each lane's place in its block."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return ir.Constant(ROW, [float(lane) for lane in range(WIDTH)])

    return row(), generate


@intrinsic
def aligned_stack(typing_context: Any) -> Any:
    """Let rows that find no register lie in one line of the first cache, not across two.

    A function realigns its stack if a variable of it asks for that; registers are told where to
    go too late to ask.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        with builder.goto_entry_block():
            slot = builder.alloca(ROW)
        slot.align = 64
        kind = ir.FunctionType(ir.VoidType(), [slot.type])
        builder.call(ir.InlineAsm(kind, "", "r", side_effect=True), [slot])
        return context.get_dummy_value()

    return types.void(), generate


_LOG2_E = 1.4426950408889634
# ln 2 in two parts: k * _LN2_HIGH is exact for the whole numbers k that occur.
_LN2_HIGH = 0.693145751953125
_LN2_LOW = 1.42860682030941723212e-6
# Adding 1.5 * 2^52 rounds to a whole number and leaves it in the low bits.
_ROUNDER = 6755399441055744.0
_LOWEST, _HIGHEST = -708.0, 709.0


@inlined
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
