"""Arrays as the signatures of every room name them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating[Any, Any]]
Mask = NDArray[np.bool_]
Index = NDArray[np.int64]
