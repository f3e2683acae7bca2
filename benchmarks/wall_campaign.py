"""Batch engine against reference solver over random wells and rigs on whose wall the string rubs.

    python -m benchmarks.wall_campaign [WELLS]

Each has its own survey in three dimensions, string, mud, friction, gains, speed and law of the
rock, starts from rest, and in one of three is off bottom. Compared are the status of 20 s and J1
up to the moment at which the bit sticks again; later motion is chaotic, where neither is wrong.
Where friction jumps at a critical speed the first slip can be so already: the reference solver at
another tolerance tells.
"""

from __future__ import annotations

import sys
from typing import Any, NamedTuple

import numpy as np

from drillctl import load
from drillctl.arrays import Array
from drillctl.design import Design
from drillctl.simulation import Simulation, simulate
from drillctl.simulation.reference import solve

WELLS = 60
HORIZON = 20.0  # s
FINE = 2e-3  # s between the speeds that J1 is summed from
OTHER = 1e-7  # tolerance of the reference solver beside its usual 1e-8


class Compared(NamedTuple):
    """One well by both engines."""

    number: int
    until: float  # s: the bit sticks again, or the end
    j1: tuple[float, float, float]  # s, until then: reference, batch, reference at `OTHER`
    status: tuple[str, str]
    jumps: bool  # whether friction falls at a critical speed

    @property
    def error(self) -> float:
        """Of J1 by the batch engine, relative."""
        return abs(self.j1[1] / self.j1[0] - 1.0)

    @property
    def scatter(self) -> float:
        """Of J1 by the reference solver, relative."""
        return abs(self.j1[2] / self.j1[0] - 1.0)


def design_of(number: int) -> Design:
    """A random well and rig."""
    random = np.random.default_rng([21, number])
    kick, rate = random.uniform(200.0, 1200.0), random.uniform(1.0, 4.0) / 30.0
    incline, turn = random.uniform(20.0, 90.0), random.uniform(-60.0, 60.0)
    end = kick + incline / rate
    pipe = max(end, 1200.0) + random.uniform(100.0, 1200.0)
    collars = random.uniform(80.0, 250.0)
    survey = [
        ["0 m", "0 deg", "40 deg"], [f"{kick} m", "0 deg", "40 deg"],
        *([f"{kick + share * incline / rate} m", f"{share * incline} deg",
           f"{40.0 + share * turn} deg"] for share in (0.25, 0.5, 0.75, 1.0)),
    ]  # fmt: skip
    ratio = random.choice([0.65, 0.8, 1.0])
    values: dict[str, Any] = {
        "well.survey": survey,
        "well.friction_factor": random.uniform(0.15, 0.4),
        "well.friction_ratio": ratio,
        "well.critical_speed": f"{random.uniform(0.5, 2.0)} rad/s",
        "well.friction_nodes": int(random.integers(10, 21)),
        "well.mud_density": f"{random.uniform(1000.0, 1500.0)} kg/m^3",
        "drillstring.sections.pipe.length": f"{pipe} m",
        "drillstring.sections.pipe.elements": int(pipe // 20.0) + 1,
        "drillstring.sections.bha.length": f"{collars} m",
        "drillstring.sections.bha.elements": int(collars // 10.0) + 1,
        "operating_point.speed": f"{random.uniform(40.0, 150.0)} rpm",
        "controller.kp": 10.0 ** random.uniform(2.7, 4.6),
        "scenario.speed.lag": f"{random.uniform(0.5, 2.0)} s",
        "simulation.duration": f"{HORIZON} s",
        "simulation.j1_from": "0 s",
    }
    values["controller.ki"] = values["controller.kp"] * random.uniform(0.2, 2.5)
    if number % 3:
        table = load("aarsnes-shor-well-a").tree["bit_rock"]
        values |= {"bit_rock": table, "operating_point.weight_on_bit": "100 kN"}
    return load("well-a-off-bottom", **values)


def compared(number: int) -> Compared:
    """The runs of one well."""
    design = design_of(number)
    runs = [simulate(design, engine, interval=FINE) for engine in ("reference", "batch")]
    until = _sticks_again(runs[0])
    j1 = [_j1(run.time, run.signals["bit_speed"], design.speed, until) for run in runs]
    time = np.arange(0.0, until, FINE)
    again = solve(design.replace({"simulation.duration": f"{until} s"}), OTHER)
    j1.append(_j1(time, again.bit_speed(time), design.speed, until))
    status = runs[0].status, runs[1].status
    return Compared(number, until, (j1[0], j1[1], j1[2]), status, design.wall.ratio < 1.0)


def _sticks_again(run: Simulation) -> float:
    """When the bit, once it has turned for half a second, comes to rest (s)."""
    turns = np.abs(run.signals["bit_speed"]) > 0.01
    first = int(np.argmax(turns))
    later = ~turns & (run.time > run.time[first] + 0.5)
    return float(run.time[int(np.argmax(later))]) if turns.any() and later.any() else HORIZON


def _j1(time: Array, speed: Array, set_speed: float, until: float) -> float:
    at = np.arange(0.0, until, FINE)
    away = np.abs(np.interp(at, time, speed) - set_speed)
    return float(np.trapezoid(away, at) / set_speed)


def main(wells: int) -> None:
    """Print a line a well, and the shares."""
    results = []
    for number in range(wells):
        one = compared(number)
        results.append(one)
        print(
            f"{number:3d}  J1 {one.j1[0]:7.4f} s until {one.until:6.3f} s, error {one.error:.1e}, "
            f"reference {one.scatter:.1e}  {'jumps' if one.jumps else '':5}  "
            f"{' / '.join(dict.fromkeys(one.status))}",
            flush=True,
        )
    same = np.mean([one.status[0] == one.status[1] for one in results])
    print(f"{wells} wells: status equal in {same:.0%}; J1 within 1e-2:")
    for jumps, said in ((False, "without a jump"), (True, "with one")):
        some = [one for one in results if one.jumps == jumps]
        errors = np.array([one.error for one in some])
        own = np.array([one.scatter for one in some])
        print(
            f"  {said}: {np.sum(errors < 1e-2)} of {len(some)}, median {np.median(errors):.1e}, "
            f"largest {errors.max():.1e}; the reference by itself {np.sum(own < 1e-2)}, median "
            f"{np.median(own):.1e}, largest {own.max():.1e}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else WELLS)
