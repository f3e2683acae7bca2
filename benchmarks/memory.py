"""Memory and time of a sweep of ten million lanes.

    python -m benchmarks.memory [--side N] [--horizon SECONDS]

The paper's map with N x N gains by `drillctl.sweep`, as anybody would call it; of each lane its J1
and its status are kept. Memory does not depend on the horizon: a short one will do. The process
is a fresh one, its peak told by the system. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import tempfile
from pathlib import Path
from typing import Any

import drillctl
from benchmarks.job import DESIGN
from drillctl.design import Design
from drillctl.design.reading import parse_axis

SIDE = 3163
LIMIT = 2**30
"""Bytes that ten million lanes may take."""
LEVELS = (0.8748761, 20.0)
"""J1 (s). Within a second the gains hardly reach the bit: the first cuts the map in two, so that
its region has an outline."""


def peak_memory() -> int:
    """Largest memory that this process has had (bytes)."""
    found = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return found if sys.platform == "darwin" else 1024 * found


def job(side: int, horizon: float) -> Design:
    """The map with so many gains along each axis, over so many seconds."""
    axes = (f"controller.kp=0:1000:{side}", f"controller.ki=0:500:{side}")
    design = drillctl.load(DESIGN, **{"simulation.duration": f"{horizon} s"})
    return design.replace({"map.axes": [parse_axis(a) for a in axes], "map.levels": LEVELS})


def measure(side: int, horizon: float) -> dict[str, Any]:
    """Peaks after a small map, after the sweep, after regions and after saving (bytes)."""
    drillctl.sweep(job(4, horizon), audit_cells=0)
    peaks = {"before_bytes": peak_memory()}
    result = drillctl.sweep(job(side, horizon), audit_cells=0, measures=["j1"])
    peaks["sweep_bytes"] = peak_memory()
    regions = result.summary()["regions"]
    peaks["regions_bytes"] = peak_memory()
    with tempfile.TemporaryDirectory() as folder:
        result.save(Path(folder, "run"))
    peaks["peak_bytes"] = peak_memory()
    return {
        "lanes": result.j1.size,
        "horizon_s": horizon,
        "lanes_s": result.seconds,
        "seconds": result.total_seconds,
        "mean_j1": float(result.j1.mean()),
        "shares": {level: found["area_fraction"] for level, found in regions.items()},
        **peaks,
        "peak_gib": peaks["peak_bytes"] / 2**30,
        "under_1_gib": peaks["peak_bytes"] < LIMIT,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--side", type=int, default=SIDE)
    parser.add_argument("--horizon", type=float, default=1.0)
    asked = parser.parse_args()
    print(json.dumps(measure(asked.side, asked.horizon), indent=2))


if __name__ == "__main__":
    main()
