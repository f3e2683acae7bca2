"""Cost of a step of a bit that cuts its own wake over that of a plain falling law.

python -m benchmarks.cutting

Processor time of one thread, step by step in turn; at equal steps and modes.
"""

from __future__ import annotations

import sys
import time

import numba
import numpy as np

import drillctl
from drillctl.simulation import batch
from drillctl.simulation.lanes import lane_numbers, lanes_of
from drillctl.units import SI

LANES = 512
BIT = {
    "law": "richard-detournay", "blades": 4, "radius": "108 mm", "intrinsic_energy": "60 MPa",
    "wear_flat_length": "11 mm", "contact_stress": "60 MPa",
}  # fmt: skip
PLAIN = {"law": "navarro-lopez-suarez", "a1": 0.03, "a2": 0.06, "beta": 0.1}


def prepared(design):
    """Lanes at many starts, and what they take."""
    numbers = {name: np.full(LANES, value) for name, value in lane_numbers(design).items()}
    numbers["bit_speed"] = design.speed * np.linspace(0.8, 0.95, LANES)
    lanes = lanes_of(design, numbers)
    ready = batch.prepare(lanes, design.tables.simulation)
    batch.warm_up(lanes, ready)
    return lanes, ready


def seconds(lanes, ready):
    """Processor time of a run."""
    begin = time.process_time()
    batch.run_batch(lanes, ready)
    return time.process_time() - begin


def main():
    numba.set_num_threads(1)
    two = drillctl.load("richard-detournay-2dof", **{"simulation.duration": "6 s"})
    paper = drillctl.load("monteiro-trindade-140kn", **{"simulation.duration": "10 s"})
    cutting = paper.replace({
        "bit_rock": BIT, "start": {"kind": "steady", "bit_speed": "70 rpm"},
        "axial": {"model": "lumped", "mass": "34000 kg"},
        "operating_point.weight_on_bit": "118.95 kN",
    })  # fmt: skip
    turning = {"start": {"kind": "turning", "speed": "40 rpm"}}
    for name, cuts, plain in (
        ("two bodies", two, two.replace({"bit_rock": PLAIN} | turning)),
        ("the paper's string", cutting, paper),
    ):
        own = prepared(cuts)
        scheme = own[1].scheme
        like = {"simulation.step": SI(scheme.step), "simulation.modes": scheme.modes}
        other = prepared(plain.replace(like))
        times = np.array([[seconds(*own), seconds(*other)] for _ in range(5)]).min(axis=0)
        cost, reference = times / (LANES * scheme.steps) * 1e9
        sys.stdout.write(
            f"{name}, {scheme.modes} modes: {cost:.1f} ns, plain {reference:.1f} ns, "
            f"{cost / reference:.2f} times\n"
        )


if __name__ == "__main__":
    main()
