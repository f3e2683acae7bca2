"""Grids that would not fit the memory, refused before anything is computed."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path

from drillctl.errors import InputError
from drillctl.simulation.batch import FLOATS

BYTES_PER_CELL, BYTES_PER_MEASURE = 80, 10
"""Memory that a cell takes in a sweep, its regions and its file, and each measure kept of it."""
MEMORY_SHARE = 0.5
"""Largest share of the free memory that a sweep may ask for."""


def refuse_too_large(
    points: Sequence[int], where: str = "map.axes", kept: int = len(FLOATS)
) -> None:
    """Refuse (`InputError`) a grid of so many points along its axes, if memory falls short."""
    cells = math.prod(points)
    refuse_more_bytes(
        cells * (BYTES_PER_CELL + kept * BYTES_PER_MEASURE),
        f"{cells:,} cells",
        where,
        "fewer points",
    )


def refuse_more_bytes(needed: float, what: str, where: str, instead: str = "fewer of them") -> None:
    """Refuse (`InputError`) what needs more memory than may be used."""
    usable = MEMORY_SHARE * _free_memory()
    if needed > usable:
        raise InputError(
            f"{what} need about {needed / 2**30:,.1f} GiB; "
            f"{usable / 2**30:.1f} GiB may be used: {instead}",
            where,
        )


def _free_memory() -> float:
    """Memory that can be had (bytes); infinite where the system does not tell."""
    info = Path("/proc/meminfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (ValueError, OSError, AttributeError):
        return float("inf")
