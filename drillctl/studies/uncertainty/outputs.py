"""What is written and drawn of regions under uncertainty: data, large tables, interim pictures."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillctl import units
from drillctl.arrays import Array
from drillctl.ensemble.grid import over_axes
from drillctl.ensemble.realizations import Realizations
from drillctl.ensemble.running import Block
from drillctl.ensemble.storing import FILES, ZarrBlocks, disk_errors
from drillctl.store.codec import TREE, encoded, stored_name
from drillctl.store.json_files import write_json
from drillctl.store.tables import texts, write_columns

if TYPE_CHECKING:
    from drillctl.studies.uncertainty.result import Uncertainty


def write(result: Uncertainty, folder: Path) -> None:
    """Write lanes that are not in the folder yet, and all else."""
    import zarr

    job = Realizations(result.design, result.axes, result.seed, tuple(result.measures), None)
    stored = ZarrBlocks(folder, "realizations", job)
    for first, count in stored.missing(result.realizations):
        rows = slice(first, first + count)
        flat = {k: v[rows].reshape(-1, job.width) for k, v in result.measures.items()}
        status = result.status[rows].reshape(-1, job.width)
        stored.keep(Block(first, flat, status, provenance=result.provenance))
    path = folder / FILES["realizations"]
    own = {*result.measures, "status"}
    with disk_errors(path):
        group = zarr.open_group(path, mode="a")
        for name in list(group.array_keys()):
            if name not in own:  # of fewer realizations
                del group[name]
        data = result.data.drop_vars(own)
        names = {str(n): stored_name(str(n)) for n in (*data.variables, *data.dims)}
        data.rename(names).to_zarr(path, mode="a", consolidated=False)
    write_json(folder / TREE, encoded(result)[0])


class Interim:
    """Pictures of what is finished, from time to time."""

    def __init__(self, every: float, path: Path, system: units.System) -> None:
        self._every, self._path, self._system = every, path, system
        self._next = time.monotonic() + every

    def __call__(self, so_far: Callable[[], Uncertainty | None]) -> None:
        """Draw what is finished if it is time."""
        if time.monotonic() < self._next:
            return
        from drillctl import plots

        result = so_far()
        if result is not None and len(result.axes) == 2:
            part = self._path.with_suffix(".part.png")
            plots.probability_map(result, system=self._system).savefig(part)
            part.replace(self._path)
        self._next = time.monotonic() + self._every


def write_columns_of(result: Uncertainty, folder: Path) -> None:
    """Write what has many rows (SI): `cells.csv`, `draws.csv`, and `contours.csv` on request."""
    columns: dict[str, Array] = {}
    for level, one in result.maps.items():
        name = f"probability_{level:g}"
        columns[name] = one.probability
        columns[f"{name}_low"], columns[f"{name}_high"] = one.interval
    columns |= {f"j1_{name}": values for name, values in result.known.items()}
    columns["nominal_j1"] = result.nominal
    cells = over_axes(result.axes) | {name: texts(v) for name, v in columns.items()}
    write_columns(folder / "cells.csv", cells)
    write_columns(folder / "draws.csv", {path: texts(v) for path, v in result.drawn.items()})
    if result.design.tables.uncertainty.contours:
        heads = ["level", "realization", "polygon", "ring", *(a.path for a in result.axes)]
        rows = [[f"{one}" for one in row] for row in _contours(result)]
        columns_ = zip(*rows, strict=True) if rows else [[] for _ in heads]
        write_columns(folder / "contours.csv", dict(zip(heads, columns_, strict=True)))


def _contours(result: Uncertainty) -> Iterator[tuple[Any, ...]]:
    for level in result.levels:
        for number in range(result.realizations):
            outline = result.contours(level, number)
            for k, polygon in enumerate(outline.geoms):
                for ring, line in enumerate((polygon.exterior, *polygon.interiors)):
                    for x, y in line.coords:
                        yield level, number, k, ring, x, y
