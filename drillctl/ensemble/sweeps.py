"""Sweeps over any parameters of a design; the J1 map over the gains is one of them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drillctl.design import Design
from drillctl.ensemble import audit as auditing
from drillctl.ensemble.blocks import Blocks, KeepNothing
from drillctl.ensemble.grid import Axis, axes_of, groups, refuse_too_large, shape_of
from drillctl.ensemble.regions import Region, region
from drillctl.errors import InputError, nearest
from drillctl.progress import SILENT, Progress
from drillctl.provenance import provenance
from drillctl.simulation.batch import CHUNK, FLOATS, Batch, prepare, run_batch, warm_up
from drillctl.simulation.measures import STATUSES

if TYPE_CHECKING:
    from pathlib import Path

    import xarray

Array = NDArray[np.float64]

UNITS = {
    "j1": "s", "j1_rate": "1", "stuck_time": "s", "sticks": "1", "stick_slip_index": "1",
    "mean_bit_speed": "rad/s", "min_bit_speed": "rad/s", "peak_bit_speed": "rad/s",
    "peak_pipe_torque": "N*m", "peak_top_torque": "N*m", "settling_time": "s",
    "settling_time_wide": "s", "mean_weight_on_bit": "N", "rop_proxy": "1",
    "work_at_bit": "J", "work_per_turn": "J", "time_outside_table": "s",
}  # fmt: skip
"""SI unit of each measure."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """Measures over a grid of parameters.

    Attributes
    ----------
    design : Design
        What was varied.
    axes : tuple of Axis
        Parameters and their values.
    levels : tuple of float
        Levels of J1 (s).
    measures : dict of ndarray, shape of the grid
        By the names of `simulation.batch.FLOATS`, those that were kept; NaN where undefined.
    status : ndarray of int8, shape of the grid
        Index into `simulation.measures.STATUSES`.
    audit : Audit
        Cells simulated again with the reference solver.
    step, modes : float and int, or None
        Scheme of the batch engine; None where it differs from string to string.
    seconds, total_seconds : float
        Spent in the lanes alone and from call to return (s).
    provenance : dict of str
        Versions and processor it came from.
    """

    design: Design
    axes: tuple[Axis, ...]
    levels: tuple[float, ...]
    measures: dict[str, Array]
    status: NDArray[np.int8]
    audit: auditing.Audit
    step: float | None
    modes: int | None
    seconds: float
    total_seconds: float
    provenance: dict[str, str] = field(default_factory=provenance)

    @property
    def j1(self) -> Array:
        """J1 over the grid (s)."""
        return self.measures["j1"]

    @property
    def regions(self) -> dict[float, Region]:
        """Region of each level."""
        return {level: region(self.j1, self.axes, level) for level in self.levels}

    @property
    def minimum(self) -> tuple[float, dict[str, float]] | None:
        """Smallest J1 (s) and where it is (SI); None if every cell failed."""
        if np.isnan(self.j1).all():
            return None
        where = np.unravel_index(int(np.nanargmin(self.j1)), self.j1.shape)
        at = {a.path: float(a.values[k]) for a, k in zip(self.axes, where, strict=True)}
        return float(self.j1[where]), at

    @property
    def data(self) -> xarray.Dataset:
        """All measures, labelled by parameter path, with units and provenance."""
        import xarray

        paths = [a.path for a in self.axes]
        coordinates = {a.path: (a.path, a.values, {"units": a.unit}) for a in self.axes}
        variables: dict[str, Any] = {
            name: (paths, values, {"units": UNITS[name]}) for name, values in self.measures.items()
        }
        flags = {"flag_values": list(range(len(STATUSES))), "flag_meanings": " ".join(STATUSES)}
        variables["status"] = (paths, self.status, flags)
        variables["audited_cell"] = ("audited", self.audit.cells, {})
        variables["audited_j1"] = ("audited", self.audit.reference, {"units": "s"})
        return xarray.Dataset(variables, coordinates, dict(self.provenance))

    def summary(self) -> dict[str, Any]:
        """Axes, minimum, regions, audit, failures, times; SI units, parameters by path."""
        minimum = self.minimum
        return {
            "axes": {
                a.path: {
                    "min": float(a.values[0]),
                    "max": float(a.values[-1]),
                    "points": len(a),
                }
                for a in self.axes
            },
            "minimum": None if minimum is None else {"j1": minimum[0], "at": minimum[1]},
            "regions": {f"{level:g}": r.summary() for level, r in self.regions.items()},
            "audit": self.audit.summary(),
            "statuses": {
                name: int((self.status == code).sum())
                for code, name in enumerate(STATUSES)
                if (self.status == code).any()
            },
            "step": self.step,
            "modes": self.modes,
            "seconds": self.seconds,
            "total_seconds": self.total_seconds,
        }

    def save(self, folder: str | Path) -> Path:
        """Write design, dataset and summary into a folder; see `drillctl.store`."""
        from drillctl.store import save

        return save(self, folder)


def sweep(
    design: Design,
    axes: tuple[Axis, ...] | None = None,
    audit_cells: int | None = None,
    progress: Progress = SILENT,
    blocks: Blocks | None = None,
    measures: Sequence[str] | None = None,
) -> Sweep:
    """Simulate a design over a grid of its parameters with the batch engine.

    Lanes are made, run and forgotten block by block: the memory is that of what is kept.

    Parameters
    ----------
    design : Design
        Its `[map]` table gives axes, levels and number of audited cells.
    axes : tuple of Axis, optional
        Instead of the design's own.
    audit_cells : int, optional
        Instead of the design's own; 0 for no audit.
    progress : Progress
        Told of blocks and audited cells.
    blocks : Blocks, optional
        Where finished blocks are kept and found again.
    measures : sequence of str, optional
        Measures to keep of each cell, by the names of `simulation.batch.FLOATS`; J1 and the
        status always are. All by default.

    Returns
    -------
    Sweep
        Failed cells carry the status `failed`, not an exception.

    Raises
    ------
    InputError
        An axis that does not fit the design, no measure of that name, or a grid too large for
        the memory.
    """
    begin = time.perf_counter()
    table, kept = design.tables.map, kept_measures(measures)
    axes = axes_of(design, table.axes, len(kept)) if axes is None else axes
    refuse_too_large(shape_of(axes), kept=len(kept))
    collected = _Collected(axes, kept)
    collected.run(design, progress, blocks or KeepNothing())
    count = table.audit_cells if audit_cells is None else audit_cells
    audited = auditing.audit(design, axes, collected.measures["j1"], table.levels, count, progress)
    shape = shape_of(axes)
    step, modes = collected.scheme
    return Sweep(
        design=design,
        axes=axes,
        levels=table.levels,
        measures={name: values.reshape(shape) for name, values in collected.measures.items()},
        status=collected.status.reshape(shape),
        audit=audited,
        step=step,
        modes=modes,
        seconds=collected.seconds,
        total_seconds=time.perf_counter() - begin,
    )


def kept_measures(asked: Sequence[str] | None) -> tuple[str, ...]:
    """Names of the measures to keep, in the order of `FLOATS`; all if none are asked for."""
    if asked is None:
        return FLOATS
    for name in asked:
        if name not in FLOATS:
            raise InputError(f"no measure {name!r}; {nearest(name, FLOATS)}", "measures")
    return tuple(name for name in FLOATS if name == "j1" or name in asked)


def stability_map(design: Design, **options: Any) -> Sweep:
    """The J1 map of a design over the two parameters of its `[map]` table.

    Parameters
    ----------
    design : Design
        By default the map runs over the gains, kp 0-1000 and ki 0-500.
    **options
        As for `sweep`.

    Raises
    ------
    InputError
        The map does not run over exactly two parameters.
    """
    kept = len(kept_measures(options.get("measures")))
    axes = options.pop("axes", None) or axes_of(design, design.tables.map.axes, kept)
    if len(axes) != 2:
        raise InputError(f"a map runs over 2 parameters, got {len(axes)}; use sweep", "map.axes")
    return sweep(design, axes, **options)


class _Collected:
    """Measures of the cells as blocks of them are finished."""

    def __init__(self, axes: tuple[Axis, ...], kept: tuple[str, ...]) -> None:
        self.axes = axes
        cells = int(np.prod(shape_of(axes), dtype=int))
        self.measures = {name: np.full(cells, np.nan) for name in kept}
        self.status = np.full(cells, STATUSES.index("failed"), dtype=np.int8)
        self.schemes: set[tuple[float, int]] = set()
        self.seconds = 0.0

    def run(self, design: Design, progress: Progress, blocks: Blocks) -> None:
        number = done = 0
        warm: set[type] = set()
        for index, group in enumerate(groups(design, self.axes)):
            table, lanes = group.design.tables.simulation, group.telling
            prepared = blocks.prepared(index, partial(prepare, lanes, table))
            self.schemes.add((prepared.scheme.step, prepared.scheme.modes))
            kind = type(prepared.stepper.string)
            if kind not in warm:  # a string of another kind takes another kernel
                warm.add(kind)
                progress.begin("loading kernels", 1)
                warm_up(lanes, prepared)
                progress.begin("simulating lanes", len(self.status))
                progress.advance(done)
            for first in range(0, len(group), CHUNK):
                part = np.arange(first, min(first + CHUNK, len(group)))
                batch = blocks.find(number)
                if batch is None:
                    lanes = group.some(part)
                    begin = time.perf_counter()
                    batch = run_batch(lanes, prepared)
                    self.seconds += time.perf_counter() - begin
                    blocks.keep(number, batch)
                self._put(group.cells_of(part), batch)
                progress.advance(len(batch.status))
                done += len(batch.status)
                number += 1

    @property
    def scheme(self) -> tuple[float, int] | tuple[None, None]:
        """Step and modes, if they were the same throughout."""
        return next(iter(self.schemes)) if len(self.schemes) == 1 else (None, None)

    def _put(self, cells: NDArray[np.int64], batch: Batch) -> None:
        for name, values in self.measures.items():
            values[cells] = batch.measures[name]
        self.status[cells] = batch.status
