"""Time of the linear side's large jobs, each the median of three.

python -m benchmarks.linear_speed
"""

from __future__ import annotations

import statistics
import time

import numpy as np

import drillctl
from drillctl.linear import frequency_response, gain_boundary
from drillctl.studies import Axis, loop_map

GAINS = (
    Axis("controller.kp", "", np.linspace(0.0, 1000.0, 201)),
    Axis("controller.ki", "", np.linspace(0.0, 500.0, 201)),
)


def timed(job, runs=3):
    """Median time of a job (s), the first call apart."""
    job()
    seconds = []
    for _ in range(runs):
        begin = time.perf_counter()
        job()
        seconds.append(time.perf_counter() - begin)
    return statistics.median(seconds)


def main():
    design = drillctl.load("monteiro-trindade-140kn")
    long = design.replace({"drillstring.sections.pipe.elements": 2000})
    frequencies = np.geomspace(0.02, 5.0, 2000)
    long.string  # noqa: B018 - assembled before the clock runs
    jobs = {
        "slope margin, 201 x 201": lambda: loop_map(design, GAINS, ("slope_margin",)),
        "spectral abscissa, 201 x 201": lambda: loop_map(design, GAINS, ("spectral_abscissa",)),
        "Bode, 2,000 elements at 2,000 frequencies, lines": lambda: frequency_response(
            long, frequencies
        ),
        "the same, continuum": lambda: frequency_response(long, frequencies, model="wave"),
        "the same, from M, C and K": lambda: frequency_response(
            long, frequencies, model="matrices"
        ),
        "boundary of the stable gains": lambda: gain_boundary(design),
        "all figures of one loop": lambda: drillctl.loop(design),
    }
    for name, job in jobs.items():
        print(f"{name:50s} {timed(job):8.4f} s")


if __name__ == "__main__":
    main()
