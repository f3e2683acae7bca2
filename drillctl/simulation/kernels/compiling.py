"""How everything in this package is compiled."""

from __future__ import annotations

from typing import Any

import numba
from numba import types
from numba.extending import intrinsic

# No fastmath of any kind: multiply-adds are fused where `arithmetic.fma` says so, the same for
# any width of vectors, and tests for NaN stay. Division follows IEEE: a test for zero before
# each would keep loops over lanes scalar.
OPTIONS: dict[str, Any] = {"error_model": "numpy"}

inlined = numba.njit(forceinline=True, **OPTIONS)
"""Decorator for what is part of the step of a lane."""

compiled = numba.njit(**OPTIONS)
"""Decorator for what is called once per block and step."""


@intrinsic
def widest_vectors(typing_context: Any) -> Any:
    """Let the function that calls this use the widest vector registers there are.

    LLVM keeps to 256 bits on processors that have 512, for fear of a lower clock; for a
    function that does nothing but multiply-adds over lanes the wide ones win. No result
    depends on it.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        # llvmlite knows few attributes by name and refuses this one; the set itself takes it.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.void(), generate
