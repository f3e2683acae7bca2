"""Points spread evenly over the bounds of tuned parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drillctl.studies.robust.tuned import Tuned

Array = NDArray[np.float64]


def spread(tuned: tuple[Tuned, ...], count: int) -> Array:
    """Points (SI), shape (count, parameters), none of them on a bound.

    Additive recurrence on the generalised golden ratio: low discrepancy in any dimension, and the
    first points of a longer sequence are those of a shorter one (Roberts 2018, after Weyl).
    """
    dimension = len(tuned)
    ratio = 2.0
    for _ in range(60):  # the root of x^(d+1) = x + 1
        ratio = (1.0 + ratio) ** (1.0 / (dimension + 1.0))
    strides = ratio ** -np.arange(1.0, dimension + 1.0)
    share = (0.5 + np.outer(np.arange(1, count + 1), strides)) % 1.0
    low = np.array([t.low for t in tuned])
    return np.asarray(low + share * (np.array([t.high for t in tuned]) - low))
