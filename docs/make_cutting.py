"""Draw the pictures of `cutting.md` and print its figures: `python docs/make_cutting.py`."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import drillctl
from drillctl import plots, units
from drillctl.plots import style
from drillctl.studies import loop_map
from drillctl.studies.loop.compute import thinned

HERE = Path(__file__).parent
GAINS = [
    {"path": "controller.kp", "min": 100, "max": 1000, "points": 19},
    {"path": "controller.ki", "min": 25, "max": 475, "points": 19},
]
BIT = {
    "law": "richard-detournay", "blades": 4, "radius": "108 mm", "intrinsic_energy": "60 MPa",
    "zeta": 0.6, "wear_flat_length": "11 mm", "contact_stress": "60 MPa", "gamma": 1.0, "mu": 0.6,
}  # fmt: skip


def say(*parts: object) -> None:
    """Print a line of figures for the page."""
    sys.stdout.write(" ".join(map(str, parts)) + "\n")


def compared() -> tuple[drillctl.Design, drillctl.Design]:
    """The paper's string under its falling law, and under a cutting bit of the same torque."""
    falling = drillctl.load(
        "monteiro-trindade-140kn",
        **{"map.axes": GAINS, "map.audit_cells": 0, "map.levels": [5, 10, 20, 40]},
    )
    torque = float(falling.bit_rock.torque_and_slope(140e3, falling.speed, np.exp)[0])
    cutting = falling.replace({
        "bit_rock": BIT, "start": {"kind": "steady", "bit_speed": "70 rpm"},
        "axial": {"model": "lumped", "mass": "34000 kg"},
    })  # fmt: skip
    rock = cutting.bit_rock
    weight = rock.flat_force + (torque - rock.flat_torque) * rock.force_per_depth / (
        rock.torque_per_depth
    )
    cutting = cutting.replace({
        "operating_point.weight_on_bit": units.SI(weight),
        "title": "The same string, a cutting bit of the same torque",
    })  # fmt: skip
    say(f"torque {torque:.1f} N m, weight on the cutting bit {weight / 1e3:.2f} kN")
    return falling, cutting


def gains() -> None:
    """J1 over the gains under both laws."""
    results = [drillctl.stability_map(one, measures=("j1", "lost_contact_time", "stuck_time"))
               for one in compared()]  # fmt: skip
    figure = style.figure(13.0, 5.2)
    panels = figure.subplots(1, 2)
    for panel, result in zip(panels, results, strict=True):
        plots.stability_map(result, ax=panel)
        cell = np.unravel_index(int(np.nanargmin(result.j1)), result.j1.shape)
        at = [axis.values[k] for axis, k in zip(result.axes, cell, strict=True)]
        say(result.design.name, "minimum", result.j1[cell], "at", at)
        for level in (5.0, 10.0, 20.0, 40.0):
            say("  cells at or under", level, int((result.j1 <= level).sum()), "of", result.j1.size)
        say("  cells off bottom", int((result.measures["lost_contact_time"] > 0.0).sum()))
        say("  cells that stick", int((result.measures["stuck_time"] > 0.0).sum()))
    good = [result.j1 <= 1.25 * np.nanmin(result.j1) for result in results]
    say("good for both:", int((good[0] & good[1]).sum()), [int(one.sum()) for one in good])
    best = np.unravel_index(int(np.nanargmin(results[0].j1)), results[0].j1.shape)
    say("best of the falling law under the cutting bit:", results[1].j1[best])
    figure.savefig(HERE / "cutting-gains.png", dpi=110)


def speed_and_weight() -> None:
    """J1 of the shipped case over speed and weight, and the growth of its fastest root."""
    design = drillctl.load("richard-detournay-2dof", **{"map.audit_cells": 0})
    result = drillctl.stability_map(design)
    roots = loop_map(design, tuple(map(thinned, result.axes)), ("growth", "unstable_roots"))
    growth = roots.values["growth"]
    figure = style.figure(13.0, 5.2)
    left, right = figure.subplots(1, 2)
    plots.stability_map(result, ax=left)
    plots.loop_map(roots, "growth", ax=right)
    say("growth", np.nanmin(growth), np.nanmax(growth))
    figure.savefig(HERE / "cutting-speed-weight.png", dpi=110)


if __name__ == "__main__":
    gains()
    speed_and_weight()
