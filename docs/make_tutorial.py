"""Draw the pictures of tutorial.md from the rig on that page.

python docs/make_tutorial.py
"""

import re
import tempfile
from pathlib import Path

import drillctl

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Draw the map of the rig, and a run at its best gains."""
    page = (HERE / "tutorial.md").read_text(encoding="utf-8")
    found = re.search(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    assert found
    with tempfile.TemporaryDirectory() as folder:
        rig = Path(folder) / "my-rig.toml"
        rig.write_text(found[1], encoding="utf-8")
        design = drillctl.load(rig)
    result = drillctl.stability_map(design, audit_cells=4)
    drillctl.plots.stability_map(result).savefig(HERE / "tutorial-map.png")
    _, gains = result.minimum
    run = drillctl.simulate(design.replace(gains))
    drillctl.plots.time_response(run).savefig(HERE / "tutorial-run.png")


if __name__ == "__main__":
    main()
