"""Time responses for gains of growing J1: what the number means at the bit.

python examples/four_gain_pairs.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import drillctl

GAINS = ((625.0, 125.0), (475.0, 62.5), (400.0, 100.0), (200.0, 100.0))


def main(folder: Path) -> None:
    """Simulate each pair with the reference solver and draw the runs side by side."""
    design = drillctl.load("monteiro-trindade-140kn")
    runs = []
    for kp, ki in GAINS:
        run = drillctl.simulate(design, **{"controller.kp": kp, "controller.ki": ki})
        runs.append(run)
        print(
            f"Kp {kp:g}, Ki {ki:g}: J1 {run.measures.j1:.1f} s, stuck for "
            f"{run.measures.stuck_time:.1f} s, {run.status}"
        )
    drillctl.plots.time_response(runs).savefig(folder / "four-gain-pairs.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
