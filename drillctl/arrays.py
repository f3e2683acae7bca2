"""Arrays as the signatures of every room name them, and how numpy treats their exceptions."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]
Mask = NDArray[np.bool_]
Index = NDArray[np.int64]

# Whatever the user of the library has set with `numpy.seterr`: the exponentials of friction laws
# vanish far from rest, which is no fault.
own_errstate = partial(np.errstate, divide="warn", over="warn", under="ignore", invalid="warn")


def finite(value: float | None) -> float | None:
    """A number as strict JSON has it: none where it is not finite."""
    return None if value is None or not np.isfinite(value) else float(value)
