"""Times of whole commands, from the shell and back, as a Markdown table.

    python -m benchmarks.commands [--rounds N] [--cold] [--only NAME ...]

Warm: the least of some rounds with the kernels on disk. Cold: one run with an empty folder of
kernels, on a machine that has run the package before. Results go to a folder that is removed.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from drillctl.provenance import provenance

PAPER = "monteiro-trindade-140kn"
SAMPLED = (
    "--set", "controller.drive.sampling_period=10 ms", "--set", "controller.drive.lag=20 ms",
)  # fmt: skip
COMMANDS: dict[str, tuple[str, ...]] = {
    "validate": ("validate", PAPER),
    "modes": ("modes", PAPER),
    "map --audit 0": ("map", PAPER, "--audit", "0"),
    "map": ("map", PAPER, "--audit", "48"),
    "simulate": ("simulate", PAPER),
    "simulate, sampled drive": ("simulate", PAPER, *SAMPLED),
    "loop": ("loop", PAPER),
    "report --profile quick": ("report", PAPER, "--profile", "quick"),
    "uncertainty, 200 draws": (
        "uncertainty", "monteiro-trindade-fig6", "--realizations", "200",
    ),
    "tune": ("tune", "robust-gains-140kn"),
}  # fmt: skip
"""What is timed, by the name in the table."""


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3, help="warm rounds (3)")
    parser.add_argument("--cold", action="store_true", help="time the first run as well")
    parser.add_argument("--only", nargs="*", choices=COMMANDS, default=list(COMMANDS))
    given = parser.parse_args(arguments)
    print(f"{_processor()}, {os.cpu_count()} cores, drillctl {provenance()['drillctl']}\n")
    print("| command | warm, s | cold, s |\n|---|---|---|")
    for name in given.only:
        cold = f"{_seconds(COMMANDS[name], cold=True):.1f}" if given.cold else ""
        _seconds(COMMANDS[name], cold=False)
        warm = min(_seconds(COMMANDS[name], cold=False) for _ in range(given.rounds))
        print(f"| `{name}` | {warm:.2f} | {cold} |", flush=True)


def _seconds(command: tuple[str, ...], cold: bool) -> float:
    """Time on the clock of one run in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        out = () if command[0] == "validate" else ("--out", str(Path(folder) / "out"))
        kernels = {"NUMBA_CACHE_DIR": str(Path(folder) / "kernels")} if cold else {}
        begin = time.perf_counter()
        done = subprocess.run(
            [sys.executable, "-m", "drillctl", *command, *out],
            capture_output=True, text=True, env={**os.environ, **kernels},
        )  # fmt: skip
        seconds = time.perf_counter() - begin
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{' '.join(command)}: exit {done.returncode}\n{done.stderr}")
    return seconds


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
