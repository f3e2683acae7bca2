"""Write `paper_map_sample.json`: J1 at cells of the paper's map by the event-accurate solver.

    python -m tests.data.make_paper_map_sample

Forty cells drawn once by a seed, at two tolerances: how far J1 moves from one to the other is kept
beside it. A tenth of a second a cell.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

import drillctl
from drillctl.design import Design
from drillctl.ensemble.grid import axes_of, cell_design, shape_of
from drillctl.simulation.reference import solve
from drillctl.simulation.run import deviation

DESIGN, SEED, CELLS = "monteiro-trindade-140kn", 2012, 40
TOLERANCES = (1e-9, 1e-10)
PATH = Path(__file__).with_name("paper_map_sample.json")


def exact_j1(design: Design, tolerance: float) -> float:
    table = design.tables.simulation
    motion = solve(design, tolerance=tolerance)
    return deviation(motion, table.j1_from, table.duration) / design.speed


def main() -> None:
    design = drillctl.load(DESIGN)
    axes = axes_of(design)
    count = int(np.prod(shape_of(axes)))
    cells = sorted(np.random.default_rng(SEED).choice(count, CELLS, replace=False).tolist())
    designs = [cell_design(design, axes, cell) for cell in cells]
    loose, tight = ([exact_j1(d, tolerance) for d in designs] for tolerance in TOLERANCES)
    found = {
        "made_by": "python -m tests.data.make_paper_map_sample",
        "design": DESIGN,
        "shape": list(shape_of(axes)),
        "tolerance": TOLERANCES[1],
        "moved_by_a_tolerance_of_1e-9": float(np.abs(np.divide(loose, tight) - 1.0).max()),
        "j1": {str(cell): value for cell, value in zip(cells, tight, strict=True)},
    }
    PATH.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
