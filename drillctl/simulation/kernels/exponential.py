"""exp(x) of a row in plain arithmetic.

A call into the C library would be made lane by lane and would cost as much as the rest of a
step. Accurate to 1 unit in the last place for -708 <= x <= 709; clamped outside.
"""

from __future__ import annotations

from typing import Any

from drillctl.simulation.kernels.arithmetic import fma, pick, power_of_two
from drillctl.simulation.kernels.compiling import inlined

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
