"""J1 of the compared cells by the event-accurate solver, kept in `exact.json`.

    python -m benchmarks.exact

At tolerance 1e-10, and at 1e-9 for what the first is worth: both are kept.
"""

from __future__ import annotations

import json

import drillctl
from benchmarks.job import CELLS, DESIGN, EXACT, gains
from drillctl.design import Design
from drillctl.ensemble.grid import axes_of, cell_design
from drillctl.provenance import provenance
from drillctl.simulation.reference import solve
from drillctl.simulation.run import deviation

TOLERANCE, LOOSER = 1e-10, 1e-9


def exact_j1(design: Design, tolerance: float = TOLERANCE) -> float:
    """J1 with every stick and slip located."""
    table = design.tables.simulation
    return deviation(solve(design, tolerance), table.j1_from, table.duration) / design.speed


def main() -> None:
    design = drillctl.load(DESIGN)
    axes = axes_of(design)
    j1, moved = {}, {}
    for cell in CELLS:
        one = cell_design(design, axes, cell)
        j1[str(cell)] = exact_j1(one)
        moved[str(cell)] = exact_j1(one, LOOSER) / j1[str(cell)] - 1.0
        print(
            f"cell {cell}: J1 {j1[str(cell)]:.12g}, at {LOOSER:g} moved by {moved[str(cell)]:.1e}"
        )
    kept = {
        "design": DESIGN,
        "duration": design.tables.simulation.duration,
        "gains": gains(design, axes),
        "tolerance": TOLERANCE,
        "j1": j1,
        f"relative_change_at_{LOOSER:g}": moved,
        "provenance": provenance(),
    }
    EXACT.write_text(json.dumps(kept, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
