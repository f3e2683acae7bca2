"""Gains chosen before any simulation: the slope margin over the gains, then the other margins.

python examples/gains_from_margins.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import drillctl
from drillctl.linear import gain_boundary
from drillctl.studies import loop_map


def main(folder: Path) -> None:
    """Print the gains of the largest slope margin and what they are worth; draw the map."""
    design = drillctl.load("monteiro-trindade-140kn")
    gains = loop_map(design, quantities=("slope_margin", "low_damping"))
    margin, best = gains.best
    print(f"largest slope margin {margin:.1f} N m s at {best}")
    for values in ({"controller.kp": 625.0, "controller.ki": 125.0}, best):
        found = drillctl.loop(design.replace(values))
        assert found.margins is not None
        print(
            f"Kp {values['controller.kp']:g}, Ki {values['controller.ki']:g}: slope "
            f"{found.operating_point.slope:.1f} of {found.slope_margin:.1f} N m s, sensitivity "
            f"{found.margins.peak_sensitivity:.2f}, disk {found.margins.phase_deg:.1f} deg"
        )
    picture = drillctl.plots.loop_map(gains, boundary=gain_boundary(design))
    picture.savefig(folder / "gains-from-margins.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
