"""The suite: one table, one JSON file, one picture.

    python -m benchmarks.run [--quick] [--rounds N] [--lanes N] [--out DIR] [--without PEER ...]

About six minutes; a minute with `--quick`, which measures each thing once or twice, slow
peers on one cell, and is good for nothing but seeing that all is well.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from benchmarks import machine, roofline, scaling, table
from benchmarks.job import Job, load_job
from benchmarks.peers import MODULES, all_peers
from benchmarks.picture import draw
from benchmarks.timing import interleave, row_of
from drillctl.provenance import provenance

LIBRARIES = ("control", "scikit-sundae", "diffrax", "jax")
ROUNDS, MOST_LANES = 9, 1_000_000
QUICK_ROUNDS, QUICK_LANES = 1, 10_000


def main(arguments: Sequence[str] | None = None) -> None:
    asked = _parser().parse_args(arguments)
    begin = time.perf_counter()

    def told(text: str) -> None:
        print(f"{time.perf_counter() - begin:6.1f} s  {text}", file=sys.stderr, flush=True)

    rounds = asked.rounds or (QUICK_ROUNDS if asked.quick else ROUNDS)
    lanes = asked.lanes or (QUICK_LANES if asked.quick else MOST_LANES)
    modules = tuple(name for name in MODULES if name not in asked.without)
    found = run(load_job(), modules, rounds, lanes, told)
    found["seconds"] = time.perf_counter() - begin
    report(found, asked.out)


def run(job: Job, modules: tuple[str, ...], rounds: int, lanes: int, told: Any) -> dict[str, Any]:
    """Measure everything; what `report` takes."""
    told("peaks of the machine")
    peaks = machine.measure()
    told("preparing and compiling")
    peers, missing = all_peers(job, modules)
    timed = interleave(peers, rounds, told)
    peaks = peaks.better(machine.measure())
    told("modal pass")
    pass_ = roofline.measure(job, peaks, rounds)
    told("elements and horizons")
    elements, horizon = scaling.over_elements(job, rounds), scaling.over_horizons(job, rounds)
    told(f"lanes to {lanes:,}")
    over_lanes = scaling.over_lanes(job, lanes, rounds)
    found = {
        "rounds": rounds,
        "machine": asdict(peaks) | {"units": peaks.units},
        "machine_in_words": machine.describe(peaks),
        "rows": [row_of(row, job, peaks.cores) for row in timed],
        "missing": [list(peer) for peer in missing],
        "roofline": pass_,
        "scaling": {
            "lanes": over_lanes,
            "elements": elements,
            "horizon": horizon,
            "wall": scaling.over_wall(rounds),
        },
        "provenance": provenance() | _libraries(),
    }
    return found | {"bars": table.bars(found)}


def report(found: dict[str, Any], folder: Path) -> None:
    """Print the table; write JSON and picture."""
    parts = [
        found["machine_in_words"], table.peers_table(found),
        table.roofline_table(found["roofline"]), table.scaling_table(found["scaling"]),
        table.bars_table(found["bars"]),
    ]  # fmt: skip
    print("\n\n".join("\n".join(part) for part in parts))
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(found, indent=2, allow_nan=False)
    (folder / "bench.json").write_text(text + "\n", encoding="utf-8")
    draw(found, folder / "bench.png")
    print(f"\n{found['seconds']:.0f} s; {folder / 'bench.json'}, {folder / 'bench.png'}")


def _libraries() -> dict[str, str]:
    found = {}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="everything once or twice")
    parser.add_argument("--rounds", type=int, help=f"rounds of the interleaved runs ({ROUNDS})")
    parser.add_argument("--lanes", type=int, help=f"most lanes of the scaling ({MOST_LANES:,})")
    parser.add_argument("--out", type=Path, default=Path("runs/bench"), help="folder (runs/bench)")
    parser.add_argument("--without", nargs="*", default=[], choices=MODULES, help="peers to skip")
    return parser


if __name__ == "__main__":
    main()
