"""Entry point of the `drillctl` command."""

from __future__ import annotations

import gc
import os
import sys
from pathlib import Path
from typing import Any


def main() -> None:
    """Run the command line and leave with its exit code."""
    # Imports create a million objects and no garbage; collecting after every 700 of them, as is
    # the default, takes a tenth of the time of a map.
    gc.set_threshold(100_000, 50, 50)
    # Pictures go to files in one look, whatever the user draws others with.
    os.environ |= {"MPLBACKEND": "agg", "MATPLOTLIBRC": os.devnull}
    # Matrices are small: threads of BLAS wait for each other many times as long as they work.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _settle_streams()
    from drillctl.cli import run

    sys.exit(run(sys.argv[1:]))


def _settle_streams() -> None:
    """Print on any terminal, and never into a file that took the place of a closed stream."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is this one
    if sys.stderr is None:
        sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115
    streams: Any = [one for one in (sys.stdout, sys.stderr) if one is not None]
    for stream in streams:
        stream.reconfigure(errors="replace")  # letters that its encoding lacks


if __name__ == "__main__":
    main()
