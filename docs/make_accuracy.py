"""Write the tables of `accuracy.md`: errors over the paper's map, and the doctor on every design.

python docs/make_accuracy.py

Some three minutes. The event-accurate cells come from `tests/data/paper_map_sample.json`, made by
`python -m tests.data.make_paper_map_sample`.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import drillctl
from drillctl import catalog
from drillctl.ensemble.grid import axes_of, groups
from drillctl.simulation.batch import prepare, run_batch
from drillctl.simulation.scheme import PROMISES, Scheme

PAGE = Path(__file__).with_name("accuracy.md")
SAMPLE = PAGE.parents[1] / "tests" / "data" / "paper_map_sample.json"
DESIGN, SHOWN = "monteiro-trindade-140kn", "monteiro-trindade-100kn"
TRUTH = {"step": "0.5 ms", "modes": 999}


def map_j1(**simulation: Any) -> tuple[np.ndarray, Scheme]:
    """J1 of all cells of the paper's map, flat, and the scheme it was computed with."""
    values = {f"simulation.{key}": value for key, value in simulation.items()}
    design = drillctl.load(DESIGN, **values)
    (group,) = groups(design, axes_of(design))
    prepared = prepare(group.telling, design.tables.simulation)
    return run_batch(group.lanes, prepared).measures["j1"], prepared.scheme


def over_the_map() -> list[str]:
    """Errors of the named accuracies against the finest run, and that run against the sample."""
    truth, scheme = map_j1(**TRUTH)
    known = json.loads(SAMPLE.read_text(encoding="utf-8"))
    cells = [int(cell) for cell in known["j1"]]
    exact = np.array(list(known["j1"].values()))
    apart = np.abs(truth[cells] / exact - 1.0)
    rows = [
        "| accuracy | step | modes | median | 90 % | 99 % | largest | promised: median | 99 % |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, promise in PROMISES.items():
        j1, scheme = map_j1(accuracy=name)
        errors = np.percentile(np.abs(j1 / truth - 1.0), (50, 90, 99, 100))
        median = "-" if promise.median is None else f"{promise.median:.1e}"
        said = " | ".join(f"{error:.1e}" for error in errors)
        rows.append(
            f"| `{name}` | {1e3 * scheme.step:.3g} ms | {scheme.modes} | {said} | {median} "
            f"| {promise.p99:.1e} |"
        )
    return [
        *rows,
        "",
        f"Beside the {len(cells)} event-accurate cells the run at 0.5 ms differs by "
        f"{apart.max():.1e} at most, {np.median(apart):.1e} at the median.",
    ]


def designs() -> list[str]:
    """The doctor on every shipped design."""
    rows = [
        "| design | step | decided by | modes | median | 99 % | largest | order "
        "| audited: largest | of | verdict |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name in catalog.names("designs"):
        said = drillctl.doctor(drillctl.load(name)).summary()
        scheme, estimate, audit = said["scheme"], said["estimate"], said["audit"]
        rows.append(
            f"| `{name}` | {1e3 * scheme['step']:.3g} ms | {scheme['decided_by']} "
            f"| {scheme['modes']} | {estimate['median']:.1e} | {estimate['p99']:.1e} "
            f"| {estimate['worst']:.1e} | {estimate['order']:.2f} "
            f"| {audit['worst_relative_difference']:.1e} | {audit['cells']} | {said['verdict']} |"
        )
        print(rows[-1], flush=True)  # noqa: T201
    return rows


def said() -> list[str]:
    """What the command prints."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", "drillctl", "doctor", SHOWN, "--out", str(Path(folder, "d"))],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
    lines = [line for line in done.stdout.splitlines() if not line.startswith("results")]
    mark = "not run: make_accuracy.py runs it; its speeds are those of one machine"
    return [f"<!-- code: {mark} -->", "```console", f"$ drillctl doctor {SHOWN}", *lines, "```"]


def main() -> None:
    """Write each part between its marks."""
    text = PAGE.read_text(encoding="utf-8")
    for name, made in (("map", over_the_map), ("said", said), ("designs", designs)):
        begin, end = f"<!-- {name}: begin, made by make_accuracy.py -->", f"<!-- {name}: end -->"
        before, rest = text.split(begin)
        after = rest.split(end)[1]
        text = "\n".join([before + begin, *made(), end + after])
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
