"""From one's own design file to a stability map.

python examples/own_rig.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import drillctl
from drillctl.design.reading import write_starter


def main(folder: Path) -> None:
    """Write the starter file, load it, map it and draw the map."""
    path = write_starter(str(folder / "my-rig.toml"))
    design = drillctl.load(path)
    result = drillctl.stability_map(design, audit_cells=0)
    value, at = result.minimum or (float("nan"), {})
    print(f"smallest J1 {value:.1f} s at {at}")
    for level, region in result.regions.items():
        print(f"J1 <= {level:g} s: {region.area_fraction:.1%} of the map, {region.bounds}")
    drillctl.plots.stability_map(result).savefig(folder / "my-rig.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
