"""Batch engine against reference solver over random wells and rigs on whose wall the string rubs.

    python -m benchmarks.wall_campaign [WELLS]

Each has its own survey in three dimensions, string, mud, friction, gains, speed and law of the
rock, starts from rest, and in one of three is off bottom. Compared are the status of 20 s, and J1
up to two moments: where the bit sticks again for the first time, and where it does half a second
after it first turned. Before that the bit may stick many times for some milliseconds, as waves of
the string pass; each is a place where motions part, and later motion is chaotic. The reference
solver at a smaller tolerance tells whether it knows the answer itself. J1 is that of the engines:
a string whose waves are as short as its elements loses some of it between samples.
"""

from __future__ import annotations

import sys
from typing import Any, NamedTuple

import numpy as np

from drillctl import load
from drillctl.design import Design
from drillctl.simulation import simulate
from drillctl.simulation.reference import Motion, solve
from drillctl.simulation.run import sample

WELLS = 60
HORIZON = 20.0  # s
TOLERANCES = 1e-10, 1e-12  # of the reference solver
RUNS = ("standard", "fine", "reference")  # what is compared with the reference at the first of them
BAR = 1e-2


class Compared(NamedTuple):
    """One well by both engines."""

    number: int
    until: tuple[float, float]  # s: the bit sticks again, and does after half a second; or the end
    j1: tuple[float, float]  # s, by the reference solver
    error: tuple[dict[str, float], ...]  # of J1 up to each, relative, by what is compared
    status: tuple[str, str]
    jumps: bool  # whether friction falls at a critical speed


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
    whole = solve(design, TOLERANCES[0])
    status = sample(whole).status, simulate(design, "batch").status
    until = _sticks_again(whole)
    j1, error = zip(*(_errors(design, end) for end in until), strict=True)
    return Compared(number, until, j1, error, status, design.wall.ratio < 1.0)


def _sticks_again(motion: Motion) -> tuple[float, float]:
    """When the bit sticks for the first time after it has turned, and after half a second (s)."""
    turned = next((one.time for one in motion.events if one.kind == "release"), HORIZON)
    sticks = [one.time for one in motion.events if one.kind == "stick" and one.time > turned]
    later = (time for time in sticks if time > turned + 0.5)
    return min(sticks, default=HORIZON), next(later, HORIZON)


def _errors(design: Design, until: float) -> tuple[float, dict[str, float]]:
    """J1 up to a time (s) by the reference solver, and by how much others are off."""
    design = design.replace({"simulation.duration": f"{until} s"})
    exact, again = (sample(solve(design, one)).measures.j1 for one in TOLERANCES)
    found = [
        simulate(design, "batch", **{"simulation.accuracy": one}).measures.j1 for one in RUNS[:-1]
    ]
    off = (abs(one / exact - 1.0) for one in (*found, again))
    return exact, dict(zip(RUNS, off, strict=True))


def main(wells: int) -> None:
    """Print two lines a well, and the shares."""
    results = []
    for number in range(wells):
        one = compared(number)
        results.append(one)
        said = f"{'jumps' if one.jumps else '':5}  {' / '.join(dict.fromkeys(one.status))}"
        for until, j1, error in zip(one.until, one.j1, one.error, strict=True):
            errors = ", ".join(f"{name} {error[name]:.1e}" for name in RUNS)
            print(f"{number:3d}  J1 {j1:7.4f} s until {until:6.3f} s, {errors}  {said}", flush=True)
    same = np.mean([one.status[0] == one.status[1] for one in results])
    print(f"{wells} wells: status equal in {same:.0%}; J1 within {BAR:g}:")
    for place, said in enumerate(("sticks again", "sticks again after half a second")):
        for name in RUNS:
            errors = np.array([one.error[place][name] for one in results])
            worst = ", ".join(str(k) for k in np.flatnonzero(errors >= BAR)) or "none"
            print(
                f"  until the bit {said}, {name}: {np.sum(errors < BAR)}, median "
                f"{np.median(errors):.1e}, largest {errors.max():.1e}; not in {worst}"
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else WELLS)
