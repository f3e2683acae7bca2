"""Memory and time of ten million lanes, a block of them at a time.

    python -m benchmarks.memory [--lanes N] [--horizon SECONDS]

Gains come from a sequence without end, so that a block's lanes are made when they are run; of
each lane its J1 and its status are kept. Memory does not depend on the horizon: a short one
will do. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time

import numpy as np

import drillctl
from benchmarks.job import DESIGN
from benchmarks.scaling import spread_lanes
from drillctl.simulation.batch import prepare, run_batch, warm_up

BLOCK = 65_536
LIMIT = 2**30
"""Bytes that ten million lanes may take."""


def peak_memory() -> int:
    """Largest memory that this process has had (bytes)."""
    found = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return found if sys.platform == "darwin" else 1024 * found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lanes", type=int, default=10_000_000)
    parser.add_argument("--horizon", type=float, default=1.0)
    asked = parser.parse_args()
    design = drillctl.load(DESIGN, **{"simulation.duration": f"{asked.horizon} s"})
    lanes = spread_lanes(design, 0, 16)
    prepared = prepare(lanes, design.tables.simulation)
    warm_up(lanes, prepared)
    before = peak_memory()
    j1 = np.empty(asked.lanes)
    status = np.empty(asked.lanes, dtype=np.int8)
    begin = time.perf_counter()
    for first in range(0, asked.lanes, BLOCK):
        count = min(BLOCK, asked.lanes - first)
        batch = run_batch(spread_lanes(design, first, count), prepared)
        j1[first : first + count] = batch.measures["j1"]
        status[first : first + count] = batch.status
    found = {
        "lanes": asked.lanes,
        "horizon_s": asked.horizon,
        "seconds": time.perf_counter() - begin,
        "mean_j1": float(j1.mean()),
        "statuses": len(np.unique(status)),
        "before_bytes": before,
        "peak_bytes": peak_memory(),
        "peak_gib": peak_memory() / 2**30,
        "under_1_gib": peak_memory() < LIMIT,
    }
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
