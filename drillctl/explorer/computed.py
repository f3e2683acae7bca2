"""What a page shows, computed slice by slice by the functions that the commands call.

Every number is that of a command on the same design: a map that of `map`, a response that of
`simulate --engine batch`, margins those of `loop`, a share of draws that of `uncertainty`. What is
new here is the order alone: a coarse map first, the rest in slices short enough that a newer
request never waits for long.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from drillctl.arrays import Array, ComplexArray
from drillctl.design import Design
from drillctl.ensemble.grid import Axis, shape_of
from drillctl.errors import InputError

if TYPE_CHECKING:
    from drillctl.ensemble.audit import Audit
    from drillctl.ensemble.sweeps import Sweep
    from drillctl.explorer.work import Until
    from drillctl.linear.loop_margins import Margins
    from drillctl.simulation import Simulation
    from drillctl.studies.recommend.compute import Recommendation

Axes = tuple[Axis, Axis]

COARSE = 11  # points of an axis of the first map
BETWEEN = 21  # points of an axis of the linear overlays
SLICE = 0.06  # time (s) that a slice of a map should take: a newer request waits for one at most
BETWEEN_PICTURES = 0.3  # time (s): a browser takes a good part of it to draw one
FIRST = 128  # lanes of the first slice, before it is known how long one takes
SAMPLES = 800  # of a response, as many as a picture has points along it


@dataclass(frozen=True, eq=False)
class Picture:
    """A map as far as it is known."""

    axes: Axes
    measure: str
    values: Array  # shape of the map; coarse where the cell itself is not known yet
    whole: Sweep | None = None  # once every cell is known


def thinned(axis: Axis, points: int) -> Axis:
    """About so many points of an axis, both ends among them."""
    chosen = np.unique(np.linspace(0, len(axis) - 1, min(points, len(axis))).round().astype(int))
    return replace(axis, values=axis.values[chosen])


def spread(values: Array, coarse: tuple[Axis, ...], axes: Axes) -> Array:
    """Values of a coarse map at the nearest cells of the whole one."""
    places = [
        np.abs(fine.values[:, None] - few.values[None, :]).argmin(axis=1)
        for fine, few in zip(axes, coarse, strict=True)
    ]
    return values[np.ix_(*places)]


def mapped(design: Design, axes: Axes, measure: str) -> Iterator[Picture | None]:
    """The map of `drillctl map`: coarse, then cell by cell, then whole."""
    from drillctl.ensemble.sweeps import kept_measures, sweep

    begin = time.perf_counter()
    names = kept_measures([measure])
    coarse = thinned(axes[0], COARSE), thinned(axes[1], COARSE)
    first = sweep(design, coarse, 0, measures=names)
    values = spread(first.measures[measure], coarse, axes)
    yield Picture(axes, measure, values)
    yield from _refined(design, axes, names, values, begin)


def _refined(
    design: Design, axes: Axes, names: tuple[str, ...], shown: Array, begin: float
) -> Iterator[Picture | None]:
    from drillctl.ensemble.audit import unaudited
    from drillctl.ensemble.sweeps import Cells, Sweep

    job = Cells(design, axes, names).prepared(lambda number, make: make())
    cells = shown.size
    rows = {name: np.full(cells, np.nan) for name in names}
    status = np.zeros(cells, dtype=np.int8)
    known = np.zeros(cells, dtype=bool)
    schemes: set[tuple[float, int]] = set()
    strips, seconds, since = _Strips(job.pieces(known)), 0.0, time.perf_counter()
    for at, size in strips:
        block = job.run(at, size)
        part = slice(at, at + size)
        for name in names:
            rows[name][part] = block.measures[name].ravel()
        status[part], known[part] = block.status.ravel(), True
        schemes |= block.schemes
        seconds += block.seconds
        if known.all():
            break
        if time.perf_counter() - since < BETWEEN_PICTURES:
            yield None
            continue
        since = time.perf_counter()
        now = np.where(job.over_grid(known), job.over_grid(rows[names[-1]]), shown)
        yield Picture(axes, names[-1], now)
    step, modes = next(iter(schemes)) if len(schemes) == 1 else (None, None)
    whole = Sweep(
        design=design, axes=axes, levels=design.tables.map.levels,
        measures={name: job.over_grid(values) for name, values in rows.items()},
        status=job.over_grid(status), audit=unaudited(), step=step, modes=modes,
        seconds=seconds, total_seconds=time.perf_counter() - begin,
    )  # fmt: skip
    yield Picture(axes, names[-1], whole.measures[names[-1]], whole)


class _Strips:
    """Blocks cut into strips that take a slice each, by the time that the last one took."""

    def __init__(self, pieces: list[tuple[int, int]]) -> None:
        self._pieces, self._size = pieces, FIRST

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """First row and number of rows of each strip, as soon as the one before is done."""
        for first, count in self._pieces:
            begin = first
            while begin < first + count:
                part = min(self._size, first + count - begin)
                started = time.perf_counter()
                yield begin, part
                taken = time.perf_counter() - started
                self._size = int(np.clip(part * SLICE / max(taken, 1e-6), 16, 4096))
                begin += part


@dataclass(frozen=True, eq=False)
class Boundary:
    """Slope margin and stability boundary of the linear loop over a map."""

    axes: Axes
    ratio: Array  # slope that the loop tolerates over that of the rock; NaN without steady drilling
    lines: tuple[Array, ...] | None  # exact boundary over both gains, (points, 2) each; else None


ROWS = 1  # rows of the overlay that a slice computes


def boundary(design: Design, axes: Axes) -> Iterator[Boundary | None]:
    """Slope margin over the map, and the stability boundary."""
    from drillctl.linear.boundary import boundary_over
    from drillctl.studies.loop_mapping.compute import loop_map

    if design.tables.bit_rock.law == "printed-three-branch":
        return
    few = thinned(axes[0], BETWEEN), thinned(axes[1], BETWEEN)
    parts = []
    for row in range(0, len(few[0]), ROWS):
        first = replace(few[0], values=few[0].values[row : row + ROWS])
        found = loop_map(design, (first, few[1]), ("slope_margin",)).values
        with np.errstate(divide="ignore", invalid="ignore"):
            parts.append(found["slope_margin"] / np.maximum(found["slope"], 1e-12))
        yield None
    exact = boundary_over(design, (x.path for x in axes), (x.values for x in axes))
    lines = None if exact is None else tuple(exact.rings)
    yield Boundary(few, np.concatenate(parts), lines)


def response(design: Design) -> Iterator[Simulation]:
    """The run of `drillctl simulate --engine batch`."""
    from drillctl.simulation import simulate

    yield simulate(design, "batch", design.tables.simulation.duration / SAMPLES)


@dataclass(frozen=True, eq=False)
class Loop:
    """The loop about steady drilling, as pictures need it."""

    # frequency (Hz), abs(Z) of the drive over that of the pipe (NaN without a pipe), and abs(r)
    drive: dict[str, Array]
    loop: ComplexArray  # L at the top torque, by rising frequency
    slope: float  # falling slope of the rock (N m s/rad)
    slope_margin: float  # that the loop tolerates (N m s/rad)
    margins: Margins | None  # None where the loop is not stable, or not known yet

    @property
    def stable(self) -> bool:
        """Whether steady drilling is."""
        return self.slope < self.slope_margin


def loop(design: Design) -> Iterator[Loop]:
    """Curves first, then smooth ones with the margins of `drillctl loop`."""
    from drillctl.linear.ends import bit_side, ends_of
    from drillctl.linear.loop_analysis import tolerated_slope
    from drillctl.linear.loop_margins import margins
    from drillctl.linear.loop_model import poles_of
    from drillctl.linear.operating_point import operating_point
    from drillctl.linear.response import frequency_response, telling_frequencies
    from drillctl.studies.loop.compute import smooth_loop

    point, string = operating_point(design), design.sliding_string
    bit = bit_side(design, point.slope, point.speed)
    path = None if bit.path is None or bit.path.observer is not None else bit.path
    tolerated, _ = tolerated_slope(design, point.speed)

    frequency = telling_frequencies(string)
    drive = _drive(design, frequency)
    curve = frequency_response(design, frequency, "open_loop", slope=bit.slope, path=path)
    result = Loop(drive, curve.between("speed_error", "top_speed"), point.slope, tolerated, None)
    yield result
    poles = poles_of(design, bit)
    curve = smooth_loop(design, poles, bit.slope, path)
    ends, drive_law = ends_of(string), design.linear_drive
    at_top = margins(ends, drive_law, bit, poles) if result.stable else None
    yield replace(result, loop=curve.between("speed_error", "top_speed"), margins=at_top)


def _drive(design: Design, frequency: Array) -> dict[str, Array]:
    """Impedance of the drive over that of the pipe, and reflection, over frequency."""
    from drillctl.linear.tuning import drive_impedance

    try:
        drive = drive_impedance(design, frequency)
    except InputError:  # of a lumped spring
        impedance = reflection = np.full(len(frequency), np.nan)
    else:
        impedance, reflection = np.abs(drive.impedance) / drive.pipe, np.abs(drive.reflection)
    return {"frequency": frequency, "impedance": impedance, "reflection": reflection}


@dataclass(frozen=True, eq=False)
class Share:
    """Share of the draws that keep a level, over the map."""

    axes: Axes
    values: Array
    draws: int  # so far


FEWEST = 4  # draws of the first picture


def probability(design: Design, axes: Axes, level: float, draws: int) -> Iterator[Share]:
    """The share of the draws of `drillctl uncertainty` with J1 at or under a level."""
    from drillctl.ensemble.realizations import Realizations
    from drillctl.studies.uncertainty.compute import refuse_impossible

    refuse_impossible(design, axes)
    shape = shape_of(axes)
    job = Realizations(design, axes, design.tables.uncertainty.seed, ("j1",), level)
    job = job.prepared(lambda number, make: make())
    kept = np.zeros(int(np.prod(shape)), dtype=np.int64)
    done, count = 0, FEWEST
    while done < draws:
        begin = time.perf_counter()
        size = min(count, draws - done)
        j1 = job.run(done, size).measures["j1"]
        kept += (np.nan_to_num(j1, nan=np.inf) <= level).sum(axis=0)
        done += size
        taken = time.perf_counter() - begin
        count = int(np.clip(size * 4 * SLICE / max(taken, 1e-6), 1, 64))
        yield Share(axes, (kept / done).reshape(shape), done)


def audited(whole: Sweep, until: Until) -> Iterator[Audit]:
    """The audit of `drillctl map`."""
    from drillctl.ensemble import audit
    from drillctl.ensemble.grid import cell_design

    design = whole.design
    cells = audit.choose_cells(whole.j1, whole.levels, design.tables.map.audit_cells)
    designs = [cell_design(design, whole.axes, int(cell)) for cell in cells]
    known = audit.kept(whole.measures, whole.status, cells)
    yield audit.audited(cells, known, designs, progress=until)


def recommended(design: Design, until: Until) -> Iterator[Recommendation]:
    """The recommendation of `drillctl recommend`."""
    from drillctl.studies.recommend.compute import recommend

    yield recommend(design, until)
