"""The pictures that `drillctl loop` writes: which responses are computed for which figure."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from drillctl.linear import (
    LoopAnalysis,
    drive_impedance,
    ends_of,
    frequency_response,
    gain_boundary,
    root_locus,
    telling_frequencies,
)
from drillctl.linear.boundary import WINDOW, Window
from drillctl.linear.ends import BitSide
from drillctl.linear.loop_margins import pole_grid
from drillctl.linear.tuning import stick_slip_frequency

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from drillctl.design import Design
    from drillctl.linear.response import FrequencyResponse
    from drillctl.studies import Axis

Array = NDArray[np.float64]

MOST_NODES = 120
"""Nodes of a string up to which its poles are computed over and over, for maps and loci."""
GAINS = ("controller.kp", "controller.ki")


def over_gains(axes: tuple[Axis, ...]) -> bool:
    """Whether a map runs over the two gains, so that the boundary can be laid over it."""
    return tuple(axis.path for axis in axes) == GAINS


def loop_figures(result: LoopAnalysis) -> dict[str, Figure]:
    """Figures of a loop by the name of their file; see `loop_drawings`."""
    return {name: draw() for name, draw in loop_drawings(result).items()}


def loop_drawings(result: LoopAnalysis) -> dict[str, Callable[[], Figure]]:
    """What draws each figure of a loop, by the name of its file."""
    design, bit = result.design, result.bit_side
    drawings: dict[str, Callable[[], Figure]] = {"mobility": partial(_mobility, design)}
    if any(design.top_drive.gains()):
        if bit.path is None or bit.path.observer is None:
            drawings |= _of_loop(result, bit)
        if design.simple_drive and bit.path is None:
            drawings |= _over_gains(design, bit.slope)
    if design.string.parts.sections[0].inertia > 0.0:
        drawings["impedance"] = partial(_impedance, design)
    return drawings


def _mobility(design: Design) -> Figure:
    from drillctl import plots

    frequencies = telling_frequencies(design.string)
    models = ["finite-elements"]
    if design.string.parts.modal_damping == 0.0:
        models.append("wave")
    strings = [frequency_response(design, frequencies, model=m) for m in models]  # type: ignore[arg-type]
    closed = frequency_response(design, frequencies, "closed_loop")
    return plots.mobility([*strings, closed])


def _impedance(design: Design) -> Figure:
    from drillctl import plots

    mark = stick_slip_frequency(design.string) / (2.0 * math.pi)
    return plots.drive_impedance(drive_impedance(design), marks=(mark,))


def _of_loop(result: LoopAnalysis, bit: BitSide) -> dict[str, Callable[[], Figure]]:
    """Bode plot from the set speed, and what tells the margins at the top."""
    from drillctl import plots

    design = result.design

    def response(frequencies: Array, of: str) -> FrequencyResponse:
        return frequency_response(design, frequencies, of, slope=bit.slope, path=bit.path)  # type: ignore[arg-type]

    @cache
    def cut() -> FrequencyResponse:
        grid = pole_grid(ends_of(design.string), result.poles) / (2.0 * math.pi)
        return response(grid, "open_loop")

    def drilling() -> FrequencyResponse:
        return response(telling_frequencies(design.string), "closed_loop")

    return {
        "closed-loop": lambda: plots.bode(drilling()),
        "nyquist": lambda: plots.nyquist(cut(), analysis=result),
        "nichols": lambda: plots.nichols(cut(), analysis=result),
        "sensitivity": lambda: plots.sensitivity(cut(), analysis=result),
    }


def _over_gains(design: Design, slope: float) -> dict[str, Callable[[], Figure]]:
    """Root locus over the proportional gain and the boundary of the stable gains."""
    from drillctl import plots

    def locus() -> Figure:
        kp, _ = design.top_drive.gains()
        values = np.linspace(0.25, 2.0, 141) * (kp or 500.0)
        return plots.root_locus(root_locus(design, GAINS[0], values))

    drawings: dict[str, Callable[[], Figure]] = {
        "boundary": lambda: plots.gain_boundary(gain_boundary(design, _window(design), slope))
    }
    if design.string.nodes <= MOST_NODES and design.tables.controller.law == "pi":
        drawings["root-locus"] = locus
    return drawings


def _window(design: Design) -> Window:
    """Gains to look at: the usual ones, or so many that the design's own lie well inside."""
    kp, ki = design.top_drive.gains()
    (p0, p1), (i0, i1) = WINDOW
    return (p0, max(p1, 1.6 * kp)), (i0, max(i1, 1.6 * ki))
