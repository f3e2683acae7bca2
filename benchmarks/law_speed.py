"""What a lane costs under real laws, beside the plain PI lane at the same step, in one run.

python -m benchmarks.law_speed
"""

from __future__ import annotations

import time

import numpy as np

import drillctl
from drillctl.simulation.batch import prepare, run_batch, warm_up
from drillctl.simulation.lanes import lane_numbers, lanes_of

LANES = 2048
REPEATS = 7
FIXED = {"bit_rock": {"law": "navarro-lopez-suarez", "a1": 0.026, "a2": 0.085, "beta": 0.098}}
DRIVE = {
    "lag": "10 ms", "encoder_lag": "2 ms", "torque_limit": "20 kN*m",
    "torque_rate_limit": "50 kN*m/s", "power_limit": "800 kW",
}  # fmt: skip
FOLLOWING = {
    "law": "navarro-lopez-suarez", "gain": "2 kN*s/rad", "minimum": "42 kN", "maximum": "182 kN",
}  # fmt: skip
PATH = {"path": {"delay": "0.5 s", "sensor_lag": "0.1 s", "hoist_lag": "0.5 s"}}
RIGS = {
    "PI, constant weight": {},
    "PI with limits and lags, constant weight": {"controller.drive": DRIVE},
    "sampled PI with limits and lags, constant weight": {
        "controller.drive": DRIVE | {"sampling_period": "20 ms"}
    },
    "Z-torque, constant weight": {"controller": {"law": "z-torque", "absorption": 0.3}},
    "PI, weight that follows at once": {"weight_on_bit": FOLLOWING},
    "PI, delayed weight": {"weight_on_bit": FOLLOWING | PATH},
    "PI with limits and lags, delayed weight": {
        "controller.drive": DRIVE, "weight_on_bit": FOLLOWING | PATH,
    },
    "PI, observed weight": {"weight_on_bit": FOLLOWING | {"law": "surface-observer"}},
}  # fmt: skip


def lanes_and_scheme(values: dict) -> tuple:
    """`LANES` lanes over a spread of weights, and their scheme of 20 ms."""
    design = drillctl.load("monteiro-trindade-140kn", **(values | {"simulation.step": "20 ms"}))
    numbers = {k: np.full(LANES, v) for k, v in lane_numbers(design).items()}
    spread = np.linspace(0.9, 1.1, LANES)
    first = "level" if "weight.level" in numbers else "nominal"
    numbers[f"weight.{first}"] = numbers[f"weight.{first}"] * spread
    lanes = lanes_of(design, numbers)
    prepared = prepare(lanes, design.tables.simulation)
    warm_up(lanes, prepared)
    return lanes, prepared


def main() -> None:
    for title, rock in (("coefficients", FIXED), ("table over the weight", {})):
        ready = {name: lanes_and_scheme(rock | values) for name, values in RIGS.items()}
        best = dict.fromkeys(ready, np.inf)
        for _ in range(REPEATS):  # side by side: the machine's mood is common to all
            for name, (lanes, prepared) in ready.items():
                begin = time.perf_counter()
                run_batch(lanes, prepared)
                best[name] = min(best[name], time.perf_counter() - begin)
        plain = best["PI, constant weight"]
        print(f"friction from {title}: {LANES} lanes of 100 s, steps of 20 ms")
        for name, seconds in best.items():
            print(f"  {name:52s} {1e6 * seconds / LANES:7.1f} us a lane {seconds / plain:6.2f} x")


if __name__ == "__main__":
    main()
