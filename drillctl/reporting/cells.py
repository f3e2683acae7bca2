"""Cells of the interactive map: J1, status, and time responses of some of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctl import store, units
from drillctl.arrays import Array, Index
from drillctl.design import Design, parameter
from drillctl.ensemble.grid import Axis, groups, shape_of
from drillctl.progress import Progress
from drillctl.reporting.blocks import Block, Figure, InteractiveMap, Words, name_of
from drillctl.simulation.batch import prepare, trace
from drillctl.simulation.measures import STATUSES
from drillctl.store.json_files import strict, write_text
from drillctl.studies.base import Recipe, Run, Study, fitting_map

if TYPE_CHECKING:
    from drillctl.reporting.gather import Gathered
    from drillctl.studies import Sweep


FILE = "cells.json"
MOST = 200  # most cells with stored time responses
SAMPLES = 300  # intervals of a time response
PART = 10  # speeds are stored in units of 1 / PART rpm
SPEED = "operating_point.speed"


def traced(design: Design, run: Run) -> dict[str, Any]:
    """Write values and time responses of the cells of the map."""
    assert run.folder is not None
    folder, progress = run.folder, run.progress
    result = store.open(folder.parent / "map")
    own = _own(design, result.axes)
    best, bad = _best(result), _bad(result)
    chosen = _lattice(shape_of(result.axes))
    chosen = np.unique([*chosen, *(cell for cell in (own, best, bad) if cell is not None)])
    progress.begin("responses over the map", len(chosen))
    bit, top = _responses(design, result.axes, chosen, progress)
    content = {
        "j1": [_short(value) for value in result.j1.ravel()],
        "status": result.status.ravel(),
        "statuses": list(STATUSES),
        "own": own,
        "best": best,
        "duration": design.tables.simulation.duration,
        "part": PART,
        "traced": chosen,
        "bit": _whole(bit),
        "top": _whole(top),
    }
    text = json.dumps(strict(content), separators=(",", ":"), allow_nan=False)
    write_text(folder / FILE, text)
    return {
        "best": None if best is None else _at(result.axes, best),
        "bad": None if bad is None else _at(result.axes, bad),
        "own": None if own is None else _at(result.axes, own),
        "traced": len(chosen),
        "cells": int(result.j1.size),
    }


def interactive(gathered: Gathered, block: Block) -> Block:
    """The picture of the map with values and time responses of its cells, where there are some."""
    if not (isinstance(block, Figure) and block.name == "map" and (own := gathered.have("cells"))):
        return block
    result = gathered.need("map").result
    return InteractiveMap(block, lambda: shown(own.folder, result, gathered.words))


def shown(folder: Path, result: Sweep, words: Words) -> dict[str, Any]:
    """Read what `traced` wrote, with axes in the units of the reader."""
    held: dict[str, Any] = json.loads((folder / FILE).read_text(encoding="utf-8"))
    held["set_speed"] = _set_speeds(result, held["traced"])
    held["axes"] = [
        {
            "name": name_of(axis.path),
            "unit": words.unit(axis.unit),
            "values": [float(f"{words.scaled(v, axis.unit):.6g}") for v in axis.values],
        }
        for axis in result.axes
    ]
    return held


def _set_speeds(result: Sweep, cells: list[int]) -> list[float]:
    """Set speeds of cells (rpm): those of the map, if it runs over them."""
    speeds = [_at(result.axes, cell).get(SPEED, result.design.speed) for cell in cells]
    return [float(f"{speed / units.RPM:.6g}") for speed in speeds]


def _short(value: float) -> float | None:
    return float(f"{value:.4g}") if np.isfinite(value) else None


def _whole(speeds: Array) -> list[list[int | None]]:
    """Speeds (rad/s) as integers in units of 1 / PART rpm; None for a failed run."""
    parts = speeds * (PART / units.RPM)
    return [[int(v) if np.isfinite(v) else None for v in np.round(row)] for row in parts]


def _at(axes: tuple[Axis, ...], cell: int) -> dict[str, float]:
    where = np.unravel_index(cell, shape_of(axes))
    return {a.path: float(a.values[k]) for a, k in zip(axes, where, strict=True)}


def _own(design: Design, axes: tuple[Axis, ...]) -> int | None:
    """The cell nearest to the design's own values; None outside the map."""
    at = []
    for axis in axes:
        value = parameter(design, axis.path).value
        half = 0.5 * (axis.values[1] - axis.values[0])
        if value is None or not axis.values[0] - half <= value <= axis.values[-1] + half:
            return None
        at.append(int(np.abs(axis.values - value).argmin()))
    return int(np.ravel_multi_index(at, shape_of(axes)))


def _best(result: Sweep) -> int | None:
    return None if result.minimum is None else int(np.nanargmin(result.j1))


def _bad(result: Sweep) -> int | None:
    """A cell that sticks, if there is one, with J1 about twice the highest level."""
    j1 = result.j1.ravel()
    known = np.isfinite(j1)
    sticks = known & (result.status.ravel() == STATUSES.index("sticking"))
    over = known & (j1 > result.levels[-1])
    for cells in (sticks & over, over, known):
        places = np.flatnonzero(cells)
        if places.size:
            return int(places[np.abs(j1[places] - 2.0 * result.levels[-1]).argmin()])
    return None


def _lattice(shape: tuple[int, ...]) -> Index:
    """Cells at even intervals along each axis, ends included, at most `MOST`."""
    counts = list(shape)
    while np.prod(counts) > MOST:
        longest = int(np.argmax(counts))
        counts[longest] -= 1
    along = [np.unique(np.linspace(0, n - 1, k).round().astype(int)) for n, k in
             zip(shape, counts, strict=True)]  # fmt: skip
    grid = np.meshgrid(*along, indexing="ij")
    return np.asarray(np.ravel_multi_index([g.ravel() for g in grid], shape))


def _responses(
    design: Design, axes: tuple[Axis, ...], chosen: Index, progress: Progress
) -> tuple[Array, Array]:
    """Speeds of bit and top (rad/s), shape (chosen, SAMPLES + 1)."""
    times = np.linspace(0.0, design.tables.simulation.duration, SAMPLES + 1)
    bit, top = (np.full((len(chosen), len(times)), np.nan) for _ in range(2))
    for group in groups(design, axes):
        lane = group.lanes_at(chosen)
        rows = np.flatnonzero(lane >= 0)
        if not rows.size:
            continue
        prepared = prepare(group.telling, group.design.tables.simulation)
        time, signals = trace(group.some(lane[rows]), prepared, times[1])
        for column, row in enumerate(rows):
            bit[row] = np.interp(times, time, signals["bit_speed"][:, column])
            top[row] = np.interp(times, time, signals["top_speed"][:, column])
        progress.advance(len(rows))
    return bit, top


CELLS = Study(
    name="report-cells",
    help="Time responses over the map of a report",
    group="Hand over",
    compute=traced,
    command=False,
    recipes=(
        Recipe("cells", "the responses over the map", fitting_map, needs=("map",), summary=dict,
               says=lambda summary: (), order=50),
    ),
)  # fmt: skip
"""What the cells of the map show in a page: of reports alone."""
