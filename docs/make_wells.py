"""Draw the pictures of `wells.md` and print its figures: `python docs/make_wells.py`."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import drillctl
from drillctl import plots
from drillctl.simulation import Simulation, simulate

HERE = Path(__file__).resolve().parent
WELL_A = "well-a-off-bottom"
FIRST_CYCLE = {
    "well.tension": False, "simulation.duration": "8 s", "simulation.j1_from": "0 s",
}  # fmt: skip
PIPE = "drillstring.sections.pipe.elements"
MESHES = (114, 160, 227, 320, 454)  # elements of the pipe
SETTLED, LAGS = 15.0, (2.5, 9.0)  # s: from when on the period is looked for, and where


def say(line: str) -> None:
    """Print a line of figures for the page."""
    sys.stdout.write(line + "\n")


def first_cycle(run: Simulation) -> str:
    """What happens until the bit sticks again, in a line."""
    time, bit, pipe = run.time, np.abs(run.signals["bit_speed"]), run.signals["pipe_torque"]
    turns = int(np.argmax(bit > 0.01))
    sticks = int(np.argmax((time > time[turns] + 0.5) & (bit < 0.01)))
    first = pipe[time < 5.0]
    return (
        f"first turns {time[turns]:.3f} s; pipe torque {first.max():.0f} N m at "
        f"{time[first.argmax()]:.3f} s; bit speed {bit[:sticks].max():.2f} rad/s at "
        f"{time[bit[:sticks].argmax()]:.3f} s; sticks again {time[sticks]:.3f} s"
    )


def period(run: Simulation) -> float:
    """Lag (s) of the largest autocorrelation of the pipe torque."""
    torque, every = run.signals["pipe_torque"][run.time >= SETTLED], run.time[1]
    lags = np.arange(int(LAGS[0] / every), int(LAGS[1] / every) + 1)
    return float(every * max(lags, key=lambda k: np.corrcoef(torque[:-k], torque[k:])[0, 1]))


def main() -> None:
    """Pictures beside this file, figures on the console."""
    well_a = drillctl.load(WELL_A)
    plots.torque_drag(drillctl.torque_drag(well_a)).savefig(HERE / "torque-drag.png", dpi=110)
    plots.sticking(simulate(well_a, "batch")).savefig(HERE / "sticking.png", dpi=110)
    design = drillctl.load(WELL_A, **FIRST_CYCLE)
    for engine in ("reference", "batch"):
        say(f"{engine}: {first_cycle(simulate(design, engine, interval=0.005))}")
    for elements in MESHES:
        run = simulate(design.replace({PIPE: elements}), "reference", interval=0.001)
        say(f"{elements} elements of pipe: {first_cycle(run)}")
    for speed in ("60 rpm", "20 rpm"):
        run = simulate(
            well_a.replace({"well.tension": False, "operating_point.speed": speed}), "batch"
        )
        say(f"period at {speed}: {period(run):.2f} s")


if __name__ == "__main__":
    main()
