"""What colour bars share: parts of viridis, ends that say that values go on, plain ticks."""

from __future__ import annotations

from typing import Literal

import numpy as np
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray

Array = NDArray[np.float64]


def colours(low: float, high: float) -> Colormap:
    """A part of viridis: 0.2 to 1 under black lines, 0 to 0.88 for lines on white."""
    from matplotlib import colormaps

    return ListedColormap(colormaps["viridis"](np.linspace(low, high, 256)))


def beyond(values: Array, norm: Normalize) -> Literal["neither", "both", "min", "max"]:
    """On which side values go beyond the limits of the colours."""
    finite = values[np.isfinite(values)]
    low, high = norm.vmin, norm.vmax
    below = low is not None and bool((finite < low).any())
    above = high is not None and bool((finite > high).any())
    if below and above:
        return "both"
    return "min" if below else "max" if above else "neither"


def plain_ticks(bar: Colorbar) -> None:
    """Ticks at 1, 2, 5 of each decade, written out."""
    bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    bar.ax.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    bar.ax.yaxis.set_minor_formatter(NullFormatter())
