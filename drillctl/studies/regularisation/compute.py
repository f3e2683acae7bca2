"""What smoothing the friction does to a map: the same cells, set-valued and regularised."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctl import units
from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.design.parts import weight_moves
from drillctl.ensemble.grid import Axis, axes_of, other_axes, span
from drillctl.ensemble.sweeps import sweep
from drillctl.errors import InputError
from drillctl.progress import SILENT, Progress
from drillctl.store.codec import label
from drillctl.store.result import Timed, timed

WIDTHS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02)
"""Widths of the regularisation that are compared by default (rad/s)."""
WIDTH_PATH = "bit_rock.regularised_over"


@dataclass(frozen=True, eq=False)
class Regularisation(Timed, kind="regularisation"):
    """A map with set-valued friction beside the same map with smoothed friction."""

    design: Design = label(means="the rig, its friction set-valued")
    axes: tuple[Axis, ...] = label(means="of the map")
    levels: tuple[float, ...] = label(unit="s", means="levels of J1")
    widths: Array = label(
        "width", unit="rad/s", name="width",
        means="speeds over which tanh changes the sign of the friction, widest first",
    )  # fmt: skip
    j1: Array = label("axes", unit="s", means="J1 of the set-valued law")
    smoothed: Array = label(
        "width", "axes", unit="s", name="smoothed_j1", means="J1 of the regularised law"
    )

    @property
    def shifts(self) -> Array:
        """Relative change of J1 in each cell, shape of `smoothed`; NaN where a run failed."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.smoothed / self.j1 - 1.0

    def cells(self, level: float) -> tuple[int, list[int]]:
        """Cells at or under a level: of the set-valued map, and of each width."""
        return int((self.j1 <= level).sum()), [int((x <= level).sum()) for x in self.smoothed]

    def changed(self, level: float) -> list[int]:
        """Cells on the other side of a level than in the set-valued map, of each width."""
        return [int(((x <= level) != (self.j1 <= level)).sum()) for x in self.smoothed]

    def summary(self) -> dict[str, Any]:
        """Per width: median and worst shift of J1, cells per level and cells that change side."""
        counts = {level: self.cells(level) for level in self.levels}
        rows = []
        for i, width in enumerate(self.widths):
            size = np.abs(self.shifts[i])
            finite = size[np.isfinite(size)]
            rows.append({
                "width": float(width),
                "median_shift": float(np.median(finite)) if finite.size else None,
                "worst_shift": float(finite.max()) if finite.size else None,
                "failed": int(np.isnan(self.smoothed[i]).sum()),
                "cells": {f"{level:g}": counts[level][1][i] for level in self.levels},
                "changed_side": {f"{level:g}": self.changed(level)[i] for level in self.levels},
            })  # fmt: skip
        return {
            "axes": span(self.axes),
            "set_valued_cells": {f"{level:g}": counts[level][0] for level in self.levels},
            "widths": rows,
            "total_seconds": self.total_seconds,
        }

    def requested(self) -> tuple[Design, dict[str, Any]]:
        """Axes and widths that the design does not give."""
        widths = {} if tuple(self.widths) == WIDTHS else {"widths": self.widths.tolist()}
        return self.design, other_axes(self) | widths


@timed
def regularisation(
    design: Design,
    widths: tuple[float, ...] = WIDTHS,
    axes: tuple[Axis, ...] | None = None,
    progress: Progress = SILENT,
) -> Regularisation:
    """Compute a map with set-valued friction and again with friction smoothed by tanh.

    Parameters
    ----------
    design : Design
        Under the law of Navarro-Lopez & Suarez in either form.
    widths : tuple of float
        Widths of the regularisation (rad/s).
    axes : tuple of Axis, optional
        Instead of the design's own.
    progress : Progress
        Receives finished blocks.

    Raises
    ------
    InputError
        A law that is not regularised, a width that is not more than zero, or a weight on bit
        that moves (its friction law has no regularised form).
    """
    if not hasattr(design.tables.bit_rock, "regularised_over"):
        raise InputError(
            f"{design.tables.bit_rock.law!r} has no regularised form; allowed: "
            "bit-radius-friction, navarro-lopez-suarez",
            "bit_rock.law",
        )
    if not widths or min(widths) <= 0.0:
        raise InputError("widths must be more than 0 rad/s", "widths")
    if weight_moves(design.tables):
        raise InputError("friction under a weight that moves is not regularised", "weight_on_bit")
    if design.tables.bit_rock.regularised_over is not None:
        raise InputError("is compared with the set-valued law: leave it out", WIDTH_PATH)
    axes = axes_of(design) if axes is None else axes
    reference = sweep(design, axes, audit_cells=0, progress=progress)
    ordered = np.array(sorted(widths, reverse=True))
    smoothed = [
        sweep(design.replace({WIDTH_PATH: units.SI(float(w))}), axes, 0, progress).j1
        for w in ordered
    ]
    return Regularisation(
        design, axes, design.tables.map.levels, ordered, reference.j1, np.array(smoothed)
    )
