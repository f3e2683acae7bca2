"""How everything in this package is compiled."""

from __future__ import annotations

from typing import Any

import numba
from numba.extending import overload

# No fastmath: what may be fused, `vectors` says. Division follows IEEE. No counting of references:
# kernels hold none and allocate nothing, and counting them cost as much as the laws.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False}

inlined = numba.njit(forceinline=True, **OPTIONS)
"""Decorator for what is part of the step of a block."""

compiled = numba.njit(**OPTIONS)
"""Decorator for what is called once per block, or seldom."""


def by_type(function: Any) -> Any:
    """Decorator for what numba asks, given types, for the code that stands for `function`.

    That code is part of the step, too: left to itself LLVM calls it, and every row goes through
    memory on the way.
    """
    return overload(function, jit_options={"forceinline": True, **OPTIONS})
