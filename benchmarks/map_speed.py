"""The paper's 41 x 41 map by the batch engine, beside SciPy's LSODA on the same job.

Both sides simulate the same rig for 100 s: the batch engine all 1681 cells, LSODA (rtol 1e-6,
stick and slip as separate phases with located changes, as a user of SciPy would write it) one
cell between two batch runs, in one process. Prints a table and writes `map_speed.json`.

    python benchmarks/map_speed.py [--repeats N] [--accuracy fast|standard|fine]
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import drillctl
from drillctl.design import Design
from drillctl.provenance import provenance
from drillctl.simulation.batch import prepare, run_batch, warm_up
from drillctl.simulation.reference import solve
from drillctl.simulation.trajectory import deviation
from drillctl.studies.grid import axes_of, cell_design, groups

CELLS = (1037, 659, 1400, 250)
"""Cells that LSODA simulates: well damped, poorly damped, and two that stick and slip."""


def lsoda_j1(design: Design) -> float:
    """J1 of a design by `scipy.integrate.solve_ivp`, LSODA at rtol 1e-6."""
    string, speed, n = design.string, design.speed, design.string.nodes
    kp, ki = design.top_drive.gains()
    a1, a2, beta = design.bit_rock
    weight = design.weight_on_bit.weight(0.0)
    mass, stiffness = string.mass.toarray(), string.stiffness.toarray()
    slip, stick = np.linalg.inv(mass), np.zeros((n, n))
    stick[:-1, :-1] = np.linalg.inv(mass[:-1, :-1])

    def rates(inverse, torque):
        def function(time, y):
            force = -stiffness @ y[:n]
            force[0] -= kp * y[n] + ki * y[0]
            force[-1] -= torque(y)
            return np.concatenate([y[n : 2 * n], inverse @ force, [abs(y[2 * n - 1]) / speed]])

        return function

    def reaction(y):
        acceleration = stick @ (-stiffness @ y[:n] - np.eye(n)[0] * (kp * y[n] + ki * y[0]))
        return -mass[-1] @ acceleration - stiffness[-1] @ y[:n]

    def ends(event):
        event.terminal, event.direction = True, -1
        return event

    y = np.zeros(2 * n + 1)
    y[n : 2 * n] = design.tables.start.speed - speed
    time, direction, end = 0.0, 1, design.tables.simulation.duration
    while time < end:
        if direction:
            function = rates(slip, lambda y, s=direction: s * weight * (
                a1 + (a2 - a1) * math.exp(min(-beta * s * (y[2 * n - 1] + speed), 50.0))
            ))  # fmt: skip
            event = ends(lambda t, y, s=direction: s * (y[2 * n - 1] + speed) or 1e-300)
        else:
            function = rates(stick, lambda y: 0.0)
            event = ends(lambda t, y: a2 * weight - abs(reaction(y)))
        options = {"method": "LSODA", "rtol": 1e-6, "atol": 1e-8, "events": event}
        run = solve_ivp(function, (time, end), y, **options)
        time, y = run.t[-1], run.y[:, -1].copy()
        if run.status == 1:
            y[2 * n - 1] = -speed
            held = reaction(y)
            sticks = direction and abs(held) <= a2 * weight
            direction = 0 if sticks else (1 if held > 0 else -1)
    return float(y[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--accuracy", default="standard")
    repeats = parser.parse_args().repeats
    accuracy = parser.parse_args().accuracy
    design = drillctl.load("monteiro-trindade-140kn", **{"simulation.accuracy": accuracy})
    axes = axes_of(design, design.tables.map.axes)
    (group,) = groups(design, axes)
    prepared = prepare(group.lanes, design.tables.simulation)
    warm_up(group.lanes, prepared)
    batch_seconds, lsoda_seconds, differences = [], [], []
    for repeat in range(repeats):
        begin = time.perf_counter()
        batch = run_batch(group.lanes, prepared)
        batch_seconds.append(time.perf_counter() - begin)
        if repeat < len(CELLS):
            cell = CELLS[repeat]
            one = cell_design(design, axes, cell)
            begin = time.perf_counter()
            by_lsoda = lsoda_j1(one)
            lsoda_seconds.append(time.perf_counter() - begin)
            exact = deviation(solve(one, tolerance=1e-9), 0.0, 100.0) / design.speed
            differences.append((batch.measures["j1"][cell] / exact - 1.0, by_lsoda / exact - 1.0))
    lanes = len(group.lanes)
    a_run = statistics.median(batch_seconds) / lanes
    a_lsoda = statistics.median(lsoda_seconds)
    result = {
        "cells": lanes,
        "step": prepared.scheme.step,
        "modes": prepared.scheme.modes,
        "map_seconds_median": statistics.median(batch_seconds),
        "map_seconds_best": min(batch_seconds),
        "trajectories_per_second": 1.0 / a_run,
        "lsoda_seconds_per_run": a_lsoda,
        "ratio": a_lsoda / a_run,
        "worst_j1_error_batch": float(np.abs([d[0] for d in differences]).max()),
        "worst_j1_error_lsoda": float(np.abs([d[1] for d in differences]).max()),
        "provenance": provenance(),
    }
    for key, value in result.items():
        print(f"{key:28} {value}")
    Path("map_speed.json").write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
