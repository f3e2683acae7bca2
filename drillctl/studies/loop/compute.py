"""The loop of a design with its map, and which responses are computed for its pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl import plots, units
from drillctl.arrays import Array, ComplexArray
from drillctl.design import Design
from drillctl.ensemble.grid import Axis, axes_of
from drillctl.errors import InputError
from drillctl.linear.boundary import WINDOW, RootLocus, Window, gain_boundary, root_locus
from drillctl.linear.ends import WeightPath, ends_of
from drillctl.linear.loop_analysis import LoopAnalysis, loop
from drillctl.linear.loop_margins import pole_grid
from drillctl.linear.response import FrequencyResponse, frequency_response, telling_frequencies
from drillctl.linear.tuning import drive_impedance
from drillctl.progress import Progress
from drillctl.store.codec import label
from drillctl.studies.base import Picture
from drillctl.studies.loop_mapping.compute import CUTTING, LoopMap, loop_map

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_NODES = 120
"""Nodes of a string up to which its poles are computed over and over, for maps and loci."""


MOST_ROOTS = 9  # points of an axis over which the roots of a cutting bit are mapped


@dataclass(frozen=True, eq=False)
class MappedLoop(LoopAnalysis):
    """The loop of a design, and a map of its quantities over two parameters."""

    map: LoopMap | None = label(means="the map; None where the axes make none")
    no_map: str = label(means="why there is none, where the design names axes")

    def summary(self) -> dict[str, Any]:
        """That of the loop, with that of the map."""
        more = {} if self.map is None else {"map": self.map.summary()}
        return super().summary() | more

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """The design alone."""
        return self.design, {}


def mapped_loop(design: Design, progress: Progress) -> MappedLoop:
    """Analyse a loop, and map it over the axes of the design if there are two that fit."""
    analysis = loop(design)
    result, why = _map(design, progress)
    return MappedLoop(**vars(analysis), map=result, no_map=why)


def _map(design: Design, progress: Progress) -> tuple[LoopMap | None, str]:
    try:
        axes = axes_of(design)
    except InputError as error:
        named = "axes" in design.tree.get("map", {})  # the default ones fit no drive without gains
        return None, str(error) if named else ""
    if len(axes) != 2:
        return None, f"it runs over 2 parameters, the design's [map] has {len(axes)}"
    if design.axial is not None:
        axes = tuple(thinned(axis) for axis in axes)
        return loop_map(design, axes, ("slope_margin", *CUTTING), progress=progress), ""
    if large(design) or not design.simple_loop:
        return loop_map(design, axes, ("slope_margin",), progress=progress), ""
    return loop_map(design, axes, progress=progress), ""


def thinned(axis: Axis) -> Axis:
    """An axis with few points, the ends among them: its cells take a search for roots each."""
    if len(axis) <= MOST_ROOTS:
        return axis
    return replace(axis, values=np.linspace(axis.values[0], axis.values[-1], MOST_ROOTS))


def large(design: Design) -> bool:
    """Whether the string has too many nodes for its poles to be computed over and over."""
    return design.string.nodes > MOST_NODES


def loop_pictures(result: LoopAnalysis) -> Iterator[Picture]:
    """Every picture that applies to a loop."""
    design, bit = result.design, result.bit_side
    yield Picture(
        "mobility",
        "Mobility at bit and top: speed per torque, of the string alone and in the loop.",
        "Bode plot of the mobility at bit and top; sharp peaks of the string alone are flattened "
        "in the loop near its first mode.", lambda system: _mobility(design, system),
    )  # fmt: skip
    if any(design.linear_drive.gains()):
        if bit.path is None or bit.path.observer is None:
            yield from _of_loop(result)
        # Gains at which a bit that cuts its own wake is stable are not those of its steady torque.
        if design.simple_drive and bit.path is None and result.cutting is None:
            yield from _over_gains(design, bit.slope)
    if design.string.parts.sections[0].inertia > 0.0:
        yield Picture(
            "impedance",
            "Impedance of the drive and what it reflects; vertical line: the stick-slip frequency.",
            "Drive impedance and reflection coefficient over frequency, the stick-slip frequency "
            "marked.", lambda system: _impedance(design, system),
        )  # fmt: skip


@np.errstate(all="ignore")  # an undamped string has no finite response at resonance
def _mobility(design: Design, system: units.System) -> Figure:
    frequencies = telling_frequencies(design.sliding_string)
    strings = [frequency_response(design, frequencies)]
    if design.string.parts.modal_damping == 0.0:
        strings.append(frequency_response(design, frequencies, model="wave"))
    closed = frequency_response(design, frequencies, "closed_loop")
    return plots.mobility([*strings, closed], system=system)


def _impedance(design: Design, system: units.System) -> Figure:
    mark = design.string.stick_slip_frequency / (2.0 * math.pi)
    marks = {"stick-slip": mark}
    return plots.drive_impedance(drive_impedance(design), marks=marks, system=system)


def _of_loop(result: LoopAnalysis) -> Iterator[Picture]:
    """Bode plot from the set speed, and what shows the margins at the top."""
    design, bit = result.design, result.bit_side

    @cache
    def opened() -> FrequencyResponse:
        return smooth_loop(design, result.poles, bit.slope, bit.path)

    def closed() -> FrequencyResponse:
        grid = telling_frequencies(design.sliding_string)
        return frequency_response(design, grid, "closed_loop", slope=bit.slope, path=bit.path)

    yield Picture(
        "closed-loop", "Bode plot from the set speed to the speeds of top and bit.",
        "Magnitude and phase from the set speed to top speed and bit speed.",
        lambda system: plots.bode(closed(), system=system),
    )  # fmt: skip
    yield Picture(
        "nyquist",
        "Nyquist plot of the loop broken at the top torque, the slope of the rock included.",
        "Nyquist curve with the disk that it stays out of around the critical point.",
        lambda system: plots.nyquist(opened(), analysis=result),
    )  # fmt: skip
    yield Picture(
        "nichols", "Nichols chart of the same loop.",
        "Magnitude against phase of the loop, with curves of constant sensitivity.",
        lambda system: plots.nichols(opened(), analysis=result),
    )  # fmt: skip
    yield Picture(
        "sensitivity", "Sensitivities at the top torque.",
        "Magnitude of sensitivity and complementary sensitivity over frequency.",
        lambda system: plots.sensitivity(opened(), analysis=result),
    )  # fmt: skip


TURN = np.radians(4.0)  # largest turn of a Nyquist curve between two frequencies
REFINEMENTS = 6


def smooth_loop(
    design: Design, poles: ComplexArray, slope: float, path: WeightPath | None
) -> FrequencyResponse:
    """The open loop, with more frequencies where its Nyquist curve would show corners."""

    def respond(hertz: Array) -> FrequencyResponse:
        return frequency_response(design, hertz, "open_loop", slope=slope, path=path)

    grid = pole_grid(ends_of(design.sliding_string), poles) / (2.0 * math.pi)
    result = respond(grid)
    for _ in range(REFINEMENTS):
        loop = result.between("speed_error", "top_speed")
        step = np.diff(loop)
        with np.errstate(divide="ignore", invalid="ignore"):
            corner = np.abs(np.angle(step[1:] / step[:-1])) > TURN
        # Of tiny steps the direction is rounding, and none of them is seen.
        corner &= np.abs(step[1:]) > 0.02 * np.clip(np.abs(loop[1:-1]), 0.05, None)
        at = np.flatnonzero(corner)
        if not len(at):
            break
        pieces = np.unique(np.concatenate([at, at + 1]))
        middles = np.sqrt(grid[pieces] * grid[pieces + 1])
        grid = np.unique(np.concatenate([grid, middles]))
        result = respond(grid)
    return result


def _over_gains(design: Design, slope: float) -> Iterator[Picture]:
    """Boundary of the stable gains, and root locus over the proportional gain."""
    yield Picture(
        "boundary", "Gains at which steady drilling is stable.",
        "Boundary of the stable gains in the plane of Kp and Ki, with the current gains.",
        lambda system: plots.gain_boundary(gain_boundary(design, _window(design), slope),
                                           system=system),
        paper=True,
    )  # fmt: skip
    if not large(design) and design.tables.controller.law == "pi":
        kp, _ = design.linear_drive.gains()
        values = np.linspace(0.25, 2.0, 141) * (kp or 500.0)
        yield Picture(
            "root-locus", "Poles of the loop as the proportional gain grows.",
            "Tracks of the poles in the complex plane over the proportional gain.",
            lambda system: plots.root_locus(_locus(design, values), system=system),
            paper=True,
        )  # fmt: skip


def _locus(design: Design, values: Array) -> RootLocus:
    import numba

    return root_locus(design, "controller.kp", values, threads=numba.get_num_threads())


def _window(design: Design) -> Window:
    """Gains to look at: the usual ones, or so many that the design's own lie well inside."""
    kp, ki = design.linear_drive.gains()
    (p0, p1), (i0, i1) = WINDOW
    return (p0, max(p1, 1.6 * kp)), (i0, max(i1, 1.6 * ki))
