"""Impedance and reflection of three top drives on one string: what drillers look at.

python examples/three_drives.py [FOLDER]
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import drillctl
from drillctl.linear import drive_impedance
from drillctl.linear.tuning import soft_torque, stiff_speed


def main(folder: Path) -> None:
    """Print how much of a wave each drive sends back at the stick-slip frequency; draw both."""
    design = drillctl.load("monteiro-trindade-140kn")
    at = design.string.stick_slip_frequency / (2.0 * math.pi)
    gains = {
        "stiff speed control": stiff_speed(design.string),
        "soft torque, P = 4 zeta": soft_torque(design.string),
        "Kp 625, Ki 125": (625.0, 125.0),
    }
    drives = {
        name: design.replace({"controller.kp": kp, "controller.ki": ki})
        for name, (kp, ki) in gains.items()
    }
    for name, drive in drives.items():
        print(
            f"{name}: reflects {abs(drive_impedance(drive, [at]).reflection[0]):.3f} at {at:.4f} Hz"
        )
    pictures = [drive_impedance(drive, label=name) for name, drive in drives.items()]
    figure = drillctl.plots.drive_impedance(pictures, marks=(at,))
    figure.savefig(folder / "three-drives.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
