"""Compare the `--json` answers of two checkouts, verb by verb over the shipped designs.

    python -m benchmarks.same_numbers record CHECKOUT FILE [--only VERB ...]
    python -m benchmarks.same_numbers compare FILE FILE

`record` runs every command of `commands` with the package of a checkout and keeps what it
printed; commands that are there already are not run again. `compare` reports numbers that are not
the same to the bit, the largest relative difference of each command, and keys that are missing.
Words, times and new keys may differ; the exit code may not.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

TOLERANCE = 1e-9
"""Largest relative difference of a number that another route may compute."""
NOT_COMPARED = {
    "seconds", "total_seconds", "processor_seconds", "speed", "path", "files", "folder",
    "provenance", "problems", "title", "message", "search_message", "reason", "reasons", "example",
    "advice", "refused", "no_map", "cost",
}  # fmt: skip
"""Keys that hold times, places and sentences."""

UNCERTAIN = ("dynamic-wob-delay-140kn", "monteiro-trindade-fig6", "uncertain-string-140kn",
             "five-weights-uncertain", "slip-laws-140kn")  # fmt: skip
COMPARED = ("pi-vs-dynamic-wob-140kn", "pi-vs-delayed-wob-140kn", "six-drives-100kn",
            "slip-laws-140kn", "torque-limited-140kn")  # fmt: skip
SMALL = ["--axis", "controller.kp=300:800:6", "--axis", "controller.ki=25:225:5"]
FEW = ["--realizations", "20"]
NO_AUDIT = ["--set", "map.audit_cells=0"]


def commands(checkout: Path) -> Iterator[list[str]]:
    """Every verb on every design that it makes sense for, long studies at 20 draws."""
    designs = sorted(path.stem for path in (checkout / "designs").glob("*.toml"))
    yield ["models"]
    yield ["designs"]
    for name in designs:
        yield ["show", name]
        yield ["validate", name]
        yield ["modes", name]
        yield ["loop", name]
        yield ["simulate", name, "--engine", "batch"]
        yield ["map", name, *NO_AUDIT]
        yield ["doctor", name, "--audit", "0"]
    for name in designs[::4]:
        yield ["simulate", name]
    yield ["map", "monteiro-trindade-140kn", "--set", "map.audit_cells=2"]
    yield ["map", "monteiro-trindade-140kn", *NO_AUDIT, "--measure", "sticks"]
    yield ["loop", "monteiro-trindade-140kn", *SMALL]
    yield ["cycle", "navarro-lopez-2dof-bistable"]
    for name in ("monteiro-trindade-140kn", "slip-laws-140kn", "torque-limited-140kn"):
        yield ["regions", name, *SMALL]
    for name in ("monteiro-trindade-140kn", "monteiro-trindade-100kn"):
        yield ["regularisation", name, *SMALL]
    for name in UNCERTAIN:
        yield ["uncertainty", name, *FEW, "--audit", "0"]
    yield ["uncertainty", "monteiro-trindade-fig6", *FEW, "--audit", "1", "--full"]
    yield ["uncertainty", "uncertain-string-140kn", *FEW, "--audit", "0", "--sensitivity", "16"]
    for name in COMPARED:
        yield ["compare", name, *FEW]
    yield ["delay", "dynamic-wob-delay-140kn", *FEW]
    for name in ("robust-gains-140kn", "six-drives-100kn"):
        yield ["tune", name, *FEW, "--certificate", "20", "--set", "tune.certificate.audit=0"]
    yield ["advantage", "pi-vs-pi-dynamic-wob", "--set", "tune.realizations=20",
           "--set", "advantage.realizations=20"]  # fmt: skip
    yield ["report", "monteiro-trindade-140kn", "--profile", "quick"]


def record(checkout: Path, target: Path, only: list[str]) -> None:
    """Run the commands of a checkout; finished ones are kept at once."""
    held: dict[str, Any] = json.loads(target.read_text()) if target.is_file() else {}
    chosen = [c for c in commands(checkout) if not only or c[0] in only]
    for number, command in enumerate(chosen, start=1):
        key = " ".join(command)
        if key in held:
            continue
        print(f"{number}/{len(chosen)} {key}", file=sys.stderr, flush=True)
        held[key] = _run(checkout, command)
        part = target.with_suffix(".part")
        part.write_text(json.dumps(held))
        part.replace(target)


def _run(checkout: Path, command: list[str]) -> dict[str, Any]:
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    with tempfile.TemporaryDirectory() as folder:
        out = [] if command[0] in ("models", "designs", "show", "validate") else ["--out", "run"]
        done = subprocess.run(
            [sys.executable, "-m", "drillctl", *command, "--json", *out],
            capture_output=True, text=True, check=False, cwd=folder, env=environment,
        )  # fmt: skip
    answer = json.loads(done.stdout) if done.stdout.strip() else None
    return {"exit": done.returncode, "answer": answer, "notes": done.stderr[-2000:]}


def compare(first: Path, second: Path) -> int:
    """Report what differs; the exit code is 1 if anything differs that must not."""
    before, after = json.loads(first.read_text()), json.loads(second.read_text())
    faults = same = within = 0
    for key in (key for key in before if key in after):
        a, b = before[key], after[key]
        found = list(differences(a["answer"], b["answer"]))
        if a["exit"] != b["exit"]:
            found.append(f"exit {a['exit']} before, {b['exit']} after: {b['notes'][-300:]}")
        wrong = [one for one in found if isinstance(one, str)]
        largest = max((one for one in found if isinstance(one, float)), default=0.0)
        wrong += [f"differs by {largest:.1e}"] if largest > TOLERANCE else []
        faults += bool(wrong)
        same += not found
        within += bool(found) and not wrong
        for one in wrong[:5]:
            print(f"{key}: {one}")
        if found and not wrong:
            print(f"{key}: within {largest:.1e}")
    absent = [key for key in before if key not in after]
    print(f"{same} the same to the bit, {within} within {TOLERANCE:g}, {faults} differ, "
          f"{len(absent)} not run")  # fmt: skip
    return int(faults > 0)


def differences(before: Any, after: Any, where: str = "") -> Iterator[str | float]:
    """Relative differences of numbers, and what is missing or of another kind as a sentence."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key, value in before.items():
            if key in NOT_COMPARED:
                continue
            if key not in after:
                yield f"{where}.{key} is missing"
            else:
                yield from differences(value, after[key], f"{where}.{key}")
    elif isinstance(before, list) and isinstance(after, list):
        if len(before) != len(after):
            yield f"{where} has {len(after)} entries, before {len(before)}"
        for number, pair in enumerate(zip(before, after, strict=False)):
            yield from differences(*pair, f"{where}[{number}]")
    elif isinstance(before, str) and isinstance(after, str):
        return
    elif isinstance(before, bool | None) or isinstance(after, bool | None):
        if before != after:
            yield f"{where}: {before!r} before, {after!r} after"
    elif isinstance(before, int | float) and isinstance(after, int | float):
        if before != after:
            scale = max(abs(before), abs(after))
            difference = abs(before - after) / scale
            if math.isfinite(difference) and difference <= TOLERANCE:
                yield difference
            else:
                yield f"{where}: {before!r} before, {after!r} after"
    elif type(before) is not type(after):
        yield f"{where}: {before!r} before, {after!r} after"


def main() -> int:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    one = verbs.add_parser("record")
    one.add_argument("checkout", type=Path)
    one.add_argument("file", type=Path)
    one.add_argument("--only", nargs="*", default=[])
    two = verbs.add_parser("compare")
    two.add_argument("before", type=Path)
    two.add_argument("after", type=Path)
    asked = parser.parse_args()
    if asked.verb == "record":
        record(asked.checkout.resolve(), asked.file, asked.only)
        return 0
    return compare(asked.before, asked.after)


if __name__ == "__main__":
    sys.exit(main())
