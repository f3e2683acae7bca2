"""exp(x) in plain arithmetic, so that a loop over lanes becomes vector instructions.

A call into the C library would be made lane by lane and would cost as much as the rest of a
step. Accurate to 1 unit in the last place for -708 <= x <= 709; clamped outside.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from drillctl.simulation.kernels.compiling import inlined

_LOG2_E = 1.4426950408889634
# ln 2 in two parts: k * _LN2_HIGH is exact for the whole numbers k that occur.
_LN2_HIGH = 0.693145751953125
_LN2_LOW = 1.42860682030941723212e-6
# Adding 1.5 * 2^52 rounds to a whole number and leaves it in the low bits.
_ROUNDER = 6755399441055744.0
_LOWEST, _HIGHEST = -708.0, 709.0


@intrinsic
def _bits(typing_context: Any, value: Any) -> Any:
    """The 64 bits of a double as an integer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.IntType(64))

    return types.int64(types.float64), generate


@intrinsic
def _double(typing_context: Any, bits: Any) -> Any:
    """The double made of 64 bits."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.DoubleType())

    return types.float64(types.int64), generate


@inlined
def exp(x: float) -> float:
    """E to the power `x`: 2^k times a Taylor polynomial on |r| <= ln(2)/2. NaN stays NaN."""
    x = _LOWEST if x < _LOWEST else x
    x = _HIGHEST if x > _HIGHEST else x
    shifted = x * _LOG2_E + _ROUNDER
    k = shifted - _ROUNDER
    r = (x - k * _LN2_HIGH) - k * _LN2_LOW
    # Taylor's terms to r^12, summed in pairs (Estrin): a short chain of dependent operations.
    r2 = r * r
    r4 = r2 * r2
    r8 = r4 * r4
    p01 = 1.0 + r
    p23 = 1.0 / 2.0 + r * (1.0 / 6.0)
    p45 = 1.0 / 24.0 + r * (1.0 / 120.0)
    p67 = 1.0 / 720.0 + r * (1.0 / 5040.0)
    p89 = 1.0 / 40320.0 + r * (1.0 / 362880.0)
    p1011 = 1.0 / 3628800.0 + r * (1.0 / 39916800.0)
    low = (p01 + r2 * p23) + r4 * (p45 + r2 * p67)
    high = (p89 + r2 * p1011) + r4 * (1.0 / 479001600.0)
    p = low + r8 * high
    power_of_two = _double((_bits(shifted) << 52) + (1023 << 52))
    return p * power_of_two
