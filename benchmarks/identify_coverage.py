"""Coverage of the bands of `identify` on synthetic logs over random strings, gains, laws, sampling.

    python benchmarks/identify_coverage.py [LOGS [FIRST]]

Each log is made by characteristics (`tests/logs/synthetic.py`), 300 s with white noise of 200 N m
and 0.02 rad/s, and fitted with its own string. Coverage: share of 21 speeds among those that the
bit had, averaged over logs. Width: mean half width over the least one that would cover 90 %.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import drillctl
from drillctl.errors import InputError
from drillctl.studies.identify.compute import identify
from tests.logs.synthetic import Rig, sampled, write

NOISE = (200.0, 0.02)
G, RHO = 79.6e9, 7850.0
LAWS = ("exponential", "peak", "straight")
WEIGHT = 140e3


def rig_of(number: int) -> tuple[Rig, float, str, float]:
    """A rig, its length (m), the law of its rock and the rate of its log (Hz)."""
    random = np.random.default_rng([20, number])
    length = random.uniform(1200.0, 4000.0)
    zeta = float(random.choice((200.0, 297.0, 400.0)))
    top = random.uniform(500.0, 2500.0)
    law = LAWS[number % 3]
    soft = (number // 3) % 2
    kp = zeta * (random.uniform(2.0, 6.0) if soft else random.uniform(0.6, 1.2))
    ki = kp * random.uniform(0.1, 0.4)
    low = random.uniform(2500.0, 5000.0)
    high = low * random.uniform(1.3, 2.2)
    speed = random.uniform(60.0, 160.0) * np.pi / 30.0
    more = {
        "exponential": {"a1": low, "a2": high, "beta": random.uniform(0.05, 0.2)},
        "peak": {"a1": low, "a2": low, "beta": 0.0, "peak": 1.6 * high},
        "straight": {"a1": 0.5 * low, "a2": high, "beta": -random.uniform(60.0, 200.0)},
    }[law]
    made = Rig(
        zeta=zeta, delay=length / np.sqrt(G / RHO), top=top, bit=random.uniform(200.0, 600.0),
        kp=kp, ki=ki, speed=speed, parts=400, **more,
    )  # fmt: skip
    return made, length, law, (10.0, 100.0)[(number // 6) % 2]


def design_of(rig: Rig, length: float) -> drillctl.Design:
    """The design of a rig."""
    pipe = {
        "name": "pipe", "length": f"{length!r} m", "shear_modulus": f"{G!r} Pa",
        "density": f"{RHO!r} kg/m^3", "polar_moment": f"{float(rig.zeta / np.sqrt(G * RHO))!r} m^4",
    }  # fmt: skip
    return drillctl.load("monteiro-trindade-140kn", **{
        "drillstring.sections": [pipe], "bha.inertia": f"{rig.bit!r} kg*m^2",
        "top_drive.inertia": f"{rig.top!r} kg*m^2", "identify.draws": 50,
    })  # fmt: skip


def main(count: int = 100, first: int = 0) -> None:
    """Print coverage and width, of all logs from number `first` on and of each class."""
    rows = []
    folder = Path(tempfile.mkdtemp())
    for number in range(first, first + count):
        rig, length, law, rate = rig_of(number)
        motion = rig.run(320.0)
        if not np.isfinite(motion[3]).all() or np.abs(motion[3]).max() > 200.0:
            print(number, law, "this rig has no bounded motion", flush=True)
            continue
        path = write(
            folder / "log.csv", sampled(motion, rate, 20.0, 320.0, NOISE, number), weight=WEIGHT
        )
        try:
            found = identify(design_of(rig, length), [path])
        except InputError as error:
            print(number, law, rate, "refused:", error.problem, flush=True)
            continue
        one = found.fitted
        speed = np.linspace(one.speed[0], one.speed[-1], 21)
        low, torque, high = (
            np.interp(speed, one.speed, x) for x in (one.low, one.torque, one.high)
        )
        # At rest a peak is a point of its own; the curve is that of a turning bit.
        error = (rig.curve(np.maximum(speed, 0.05)) - torque) / (0.5 * (high - low))
        sticks = "sticks" if found.sticks.any() else "turns"
        rows.append((law, f"{rate:g} Hz", sticks, np.abs(error), (high - low) / torque / 2))
        print(
            number, law, rate, sticks, found.law, f"{len(found.begin)} windows",
            f"covered {np.mean(np.abs(error) <= 1.0):.2f}",
            f"half width {np.mean(rows[-1][4]):.2%}",
            f"error {np.mean(np.abs(error) * rows[-1][4]):.2%}", flush=True,
        )  # fmt: skip
    classes = ["all", *LAWS, "10 Hz", "100 Hz", "sticks", "turns"]
    for name in classes:
        inside = [row for row in rows if name == "all" or name in row[:3]]
        if inside:
            errors = np.concatenate([row[3] for row in inside])
            width = 1.0 / np.quantile(errors, 0.9)
            share = f"covered {np.mean(errors <= 1.0):.1%}, width {width:.2f}"
            print(f"{name:12s} {len(inside):4d} logs, {share}")


if __name__ == "__main__":
    main(*(int(one) for one in sys.argv[1:]))
