"""Print the table of `robust-gains.md`: what the linear rule costs, over weights, speeds, lengths.

python docs/make_robust_gains.py
"""

from __future__ import annotations

from typing import Any

import numpy as np

import drillctl
from drillctl.studies.tune.linear_design import linear_design
from drillctl.studies.tune.problem import GainProblem, Point
from drillctl.studies.tune.search import search
from drillctl.studies.tune.tuned import tuned_parameters

BOUNDS = {"controller.kp": {"min": 200, "max": 1200}, "controller.ki": {"min": 5, "max": 400}}
CASES = (
    ("100 kN", "100 rpm", "3000 m"),
    ("120 kN", "100 rpm", "3000 m"),
    ("140 kN", "100 rpm", "3000 m"),
    ("160 kN", "100 rpm", "3000 m"),
    ("140 kN", "80 rpm", "3000 m"),
    ("140 kN", "120 rpm", "3000 m"),
    ("140 kN", "140 rpm", "3000 m"),
    ("140 kN", "100 rpm", "2000 m"),
    ("140 kN", "100 rpm", "4000 m"),
)
FRESH = 2000
"""Realizations, with a seed of their own, that both gains are measured at."""
HEAD = (
    "| weight | speed | pipe | largest slope margin: Kp, Ki | D* | q95 | P(J1 <= 33) "
    "| least q95: Kp, Ki | q95 | P(J1 <= 33) |\n|---|---|---|---|---|---|---|---|---|---|"
)


def main() -> None:
    """Print the table."""
    print(HEAD)  # noqa: T201
    for case in CASES:
        print(row(*case), flush=True)  # noqa: T201


def row(weight: str, speed: str, length: str) -> str:
    """One case."""
    values: dict[str, Any] = {
        "operating_point.weight_on_bit": weight, "operating_point.speed": speed,
        "drillstring.sections.pipe.length": length, "simulation.accuracy": "fast",
        "tune": {"parameters": BOUNDS, "realizations": 400},
    }  # fmt: skip
    design = drillctl.load("monteiro-trindade-140kn", **values)
    linear, found = linear_design(design), search(design)
    fresh = design.replace({"tune": {"realizations": FRESH, "seed": 4242}})
    judge = GainProblem(fresh, tuned_parameters(fresh))
    by_rule, best = judge.points(np.stack([linear.values, found.values]), FRESH)
    margin = f"{linear.slope_margin:.0f} ({linear.slope_margin - linear.excess:.0f})"
    return (
        f"| {weight} | {speed} | {length} | {gains(by_rule)} | {margin} | {figures(by_rule)} "
        f"| {gains(best)} | {figures(best)} |"
    )


def gains(point: Point) -> str:
    """Gains as they stand in the table."""
    return ", ".join(f"{value:.0f}" for value in point.values)


def figures(point: Point) -> str:
    """Quantile and share."""
    return f"{point.value:.1f} | {point.share:.3f}"


if __name__ == "__main__":
    main()
