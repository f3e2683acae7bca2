"""Arrays as the signatures of every room name them, and how numpy treats their exceptions."""

from __future__ import annotations

import math
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


def aligned(*shape: int) -> Array:
    """Zeros of which each row begins with a line of the cache: no register's load spans two."""
    doubles = 8  # in a line
    width = -(-shape[-1] // doubles) * doubles
    room = np.zeros(math.prod(shape[:-1]) * width + doubles)
    first = (-room.ctypes.data % (8 * doubles)) // 8
    return room[first : len(room) - doubles + first].reshape(*shape[:-1], width)


def finite(value: float | None) -> float | None:
    """A number as strict JSON has it: none where it is not finite."""
    return None if value is None or not np.isfinite(value) else float(value)


def runs(where: Mask) -> Index:
    """First place of each run of true values and the one past its last, shape (runs, 2)."""
    edges = np.diff(np.concatenate(([0], np.asarray(where, np.int8), [0])))
    return np.flatnonzero(edges).reshape(-1, 2)
