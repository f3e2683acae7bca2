"""Figures of the loop over any two parameters: slope margin, abscissa, damping, sensitivity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl.arrays import Array, ComplexArray, Mask
from drillctl.design import Design
from drillctl.ensemble.grid import (
    Axis,
    Group,
    axes_of,
    cell_design,
    groups,
    other_axes,
    place_of,
    shape_of,
    span,
)
from drillctl.errors import InputError
from drillctl.linear.ends import ends_of
from drillctl.linear.loop_margins import peak_sensitivities
from drillctl.linear.loop_model import many_loop_poles
from drillctl.progress import SILENT, Progress
from drillctl.rig.drillstring.frequencies import natural_frequencies
from drillctl.store.codec import label
from drillctl.store.result import Timed, timed
from drillctl.studies.three_regions.compute import gains_of, slopes_tolerated, steady_drilling

QUANTITIES = {
    "slope_margin": ("N*m*s/rad", "friction-slope margin D*"),
    "deciding_frequency": ("Hz", "frequency of the poles that decide it"),
    "slope": ("N*m*s/rad", "falling slope of the rock"),
    "spectral_abscissa": ("1/s", "largest real part of the poles"),
    "low_damping": ("1", "least damping ratio of the drive's and the first elastic mode"),
    "peak_sensitivity": ("1", "largest sensitivity at the top torque"),
}
"""Unit and meaning of what is mapped."""
CUTTING = {
    "growth": ("1/s", "largest real part of the roots of the cutting bit"),
    "unstable_roots": ("1", "roots of the cutting bit in the right half-plane, up to a frequency"),
}
"""The same of a bit that cuts its own wake."""
ALL = QUANTITIES | CUTTING


@dataclass(frozen=True, eq=False)
class LoopMap(Timed, kind="loop-map"):
    """Quantities of the loop over a grid of parameters.

    `low_damping` is negative where one of these modes grows; `peak_sensitivity` is NaN where the
    loop is not stable, and all are where there is no steady drilling.
    """

    design: Design = label(means="what was varied")
    axes: tuple[Axis, ...] = label(means="parameters and their values")
    values: dict[str, Array] = label(
        "axes", flat=True, unit=lambda name: ALL[name][0], means=lambda name: ALL[name][1],
    )  # fmt: skip

    @property
    def stable(self) -> Mask:
        """Cells whose slope is under its margin, shape of the grid; of a cutting bit, its roots."""
        if "unstable_roots" in self.values:
            return np.asarray(self.values["unstable_roots"] == 0.0)
        return np.asarray(self.values["slope"] < self.values["slope_margin"])

    @property
    def best(self) -> tuple[float, dict[str, float]] | None:
        """Largest slope margin (N m s/rad) and where (SI); None without steady drilling."""
        result = self.values["slope_margin"]
        if np.isnan(result).all():
            return None
        cell = int(np.nanargmax(result))
        return float(result.flat[cell]), place_of(self.axes, cell)

    def unit(self, quantity: str) -> str:
        """Unit of a quantity, SI."""
        return ALL[quantity][0]

    def summary(self) -> dict[str, Any]:
        """Axes, stable cells, largest slope margin; strict JSON values, SI."""
        best = self.best
        return {
            "axes": span(self.axes),
            "stable_cells": int(self.stable.sum()),
            "cells": int(self.stable.size),
            "largest_slope_margin": best and {"slope_margin": best[0], "at": best[1]},
            "total_seconds": self.total_seconds,
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Axes and quantities that the design does not give."""
        some = {} if len(self.values) == len(QUANTITIES) else {"quantities": list(self.values)}
        return self.design, some | other_axes(self)


@timed
def loop_map(
    design: Design,
    axes: tuple[Axis, ...] | None = None,
    quantities: tuple[str, ...] = tuple(QUANTITIES),
    progress: Progress = SILENT,
) -> LoopMap:
    """Map figures of the loop over parameters of a design.

    Parameters
    ----------
    design : Design
        Its `[map]` table gives the axes.
    axes : tuple of Axis, optional
        Instead of the design's own.
    quantities : tuple of str
        What to map, of `QUANTITIES`, and of `CUTTING` for a bit that cuts its own wake; slope and
        slope margin always are.
    progress : Progress
        Receives finished cells.

    Raises
    ------
    InputError
        An axis that does not fit the design, or an unknown quantity.
    """
    for name in quantities:
        if name not in ALL or (name in CUTTING and design.axial is None):
            allowed = QUANTITIES if design.axial is None else ALL
            raise InputError(f"no quantity {name!r}; allowed: {', '.join(allowed)}")
    axes = axes_of(design) if axes is None else axes
    shape = shape_of(axes)
    wanted = {"slope", "slope_margin", "deciding_frequency", *quantities}
    values = {name: np.full(int(np.prod(shape)), np.nan) for name in ALL if name in wanted}
    progress.begin("analysing loops", values["slope"].size)
    for group in groups(design, axes):
        for name, result in _figures(design, axes, group, wanted).items():
            values[name][group.cells] = result
        if wanted & CUTTING.keys():
            _cut(design, axes, group, values)
        progress.advance(len(group.cells))
    return LoopMap(design, axes, {k: v.reshape(shape) for k, v in values.items()})


def _figures(
    design: Design, axes: tuple[Axis, ...], group: Group, wanted: set[str]
) -> dict[str, Array]:
    """Each wanted figure of the cells that share a string."""
    drilling = steady_drilling(design, axes, group)
    slope = drilling.slope
    margin = slopes_tolerated(design, axes, group, drilling.speed)
    steady = np.isfinite(slope)
    results = {
        "slope": slope,
        "slope_margin": np.where(steady, margin.slope, np.nan),
        "deciding_frequency": np.where(steady, margin.omega / (2.0 * np.pi), np.nan),
    }
    if wanted & {"spectral_abscissa", "low_damping", "peak_sensitivity"}:
        results |= _of_poles(group, slope, slope < margin.slope, wanted)
    return results


def _cut(design: Design, axes: tuple[Axis, ...], group: Group, values: dict[str, Array]) -> None:
    """Roots of the cutting bit in the cells that share a string."""
    from drillctl.linear.regenerative import rightmost

    for cell in group.cells:
        found = rightmost(cell_design(design, axes, int(cell)))
        for name, value in zip(("unstable_roots", "growth"), found, strict=True):
            if name in values:
                values[name][cell] = value


def _of_poles(group: Group, slope: Array, stable: Mask, wanted: set[str]) -> dict[str, Array]:
    import numba

    if not group.design.simple_loop:
        raise InputError(
            "maps of poles take an ideal drive and a weight that acts at once; slope_margin is "
            "mapped for all",
            "quantities",
        )
    string = group.design.sliding_string
    kp, ki = gains_of(group.lanes)
    steady = np.isfinite(slope)
    poles = many_loop_poles(
        string, kp, ki, np.where(steady, slope, 0.0), threads=numba.get_num_threads()
    )
    results: dict[str, Array] = {}
    if "spectral_abscissa" in wanted:
        results["spectral_abscissa"] = np.where(steady, np.nanmax(poles.real, axis=1), np.nan)
    if "low_damping" in wanted:
        results["low_damping"] = np.where(steady, _low_damping(group, poles), np.nan)
    if "peak_sensitivity" in wanted:
        peak = np.full(len(kp), np.nan)
        if stable.any():
            peak[stable] = peak_sensitivities(
                ends_of(string), kp[stable], ki[stable], slope[stable], poles[stable]
            )
        results["peak_sensitivity"] = peak
    return results


def _low_damping(group: Group, poles: ComplexArray) -> Array:
    """Least damping ratio of the poles under the middle between first and second mode."""
    parts = group.design.string.parts
    held = natural_frequencies(parts, "finite-elements", 2, top_held=True)
    limit = np.sqrt(held[0] * held[1]) if len(held) > 1 else np.inf
    size = np.abs(poles)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = -poles.real / size
        # A real pole that decays is no oscillation; one that grows is the worst.
        ratio = np.where((poles.imag == 0.0) & (poles.real < 0.0), np.inf, ratio)
        ratio = np.where(size < limit, ratio, np.inf)
        least = np.nanmin(ratio, axis=1)
    return np.where(np.isinf(least), 1.0, least)
