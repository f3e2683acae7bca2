"""How everything in this package is compiled."""

from __future__ import annotations

from typing import Any

import numba

# No fastmath of any kind: multiply-adds are fused where `arithmetic.fma` says so, the same for
# any width of vectors, and tests for NaN stay. Division follows IEEE: a test for zero before
# each would keep loops over lanes scalar.
OPTIONS: dict[str, Any] = {"error_model": "numpy"}

inlined = numba.njit(forceinline=True, **OPTIONS)
"""Decorator for what is part of the step of a lane."""

compiled = numba.njit(**OPTIONS)
"""Decorator for what is called once per block and step."""
