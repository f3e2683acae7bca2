"""Modes of a string and its Bode plot, with the two frequencies a driller asks for.

python examples/modes_and_bode.py [FOLDER]
"""

from __future__ import annotations

import sys
from pathlib import Path

import drillctl
from drillctl.linear import frequency_response, telling_frequencies


def main(folder: Path) -> None:
    """Print the lowest modes and draw shapes and Bode plot into `folder`."""
    design = drillctl.load("monteiro-trindade-140kn")
    modes = drillctl.modes(design, count=4)
    stick_slip = modes.fixed_top[0].frequency_hz
    print(f"stick-slip near {stick_slip:.4f} Hz, a period of {1 / stick_slip:.2f} s")
    for number, mode in enumerate(modes.free_free):
        print(f"free-free mode {number}: {mode.frequency_hz:.4f} Hz")
    drillctl.plots.mode_shapes(modes).savefig(folder / "modes.png")
    frequencies = telling_frequencies(design.string)
    elements = frequency_response(design, frequencies)
    continuum = frequency_response(design, frequencies, model="wave")
    drillctl.plots.bode([elements, continuum]).savefig(folder / "bode.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path())
