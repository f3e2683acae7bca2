"""Write the tables and the figure of `adaptive-maps.md`: adaptive maps beside the full grids.

python docs/make_adaptive_maps.py

Twelve full grids of 401 x 401 cells: some minutes.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import drillctl
from drillctl.design.reading import parse_axis
from drillctl.studies import AdaptiveMap
from drillctl.studies.adaptive.contour_search import bands_of, search

PAGE = Path(__file__).with_name("adaptive-maps.md")
MARKS = ("<!-- table: begin, made by make_adaptive_maps.py -->", "<!-- table: end -->")
HEAD = (
    "| map of 401 x 401 cells | simulated | cells in another band | same to one cell "
    "| shifted 64 times: simulated | with a mismatch | largest region missed (cells) |",
    "|---|---|---|---|---|---|---|",
)
GAINS = ("controller.kp=0:1000:401", "controller.ki=0:500:401")
SHIFTS = 8
"""Along each axis: those that put the coarsest lattice at other cells."""
DYNAMIC = {
    "weight_on_bit.law": "navarro-lopez-suarez",
    "weight_on_bit.gain": "4 kN*s/rad",
    "weight_on_bit.minimum": "42 kN",
    "weight_on_bit.maximum": "182 kN",
}


@dataclass(frozen=True)
class Case:
    """A row: its name, the design, the axes, and what is laid over it."""

    name: str
    design: str
    axes: tuple[str, str] = GAINS
    values: dict[str, Any] = field(default_factory=dict)


CASES = (
    Case("80 kN, gains", "monteiro-trindade-80kn"),
    Case("100 kN, gains", "monteiro-trindade-100kn"),
    Case("120 kN, gains", "monteiro-trindade-120kn"),
    Case("140 kN, gains: the paper's", "monteiro-trindade-140kn"),
    Case("160 kN, gains", "monteiro-trindade-160kn"),
    Case("140 kN, weight following the bit speed, gains", "pi-vs-dynamic-wob-140kn", GAINS,
         DYNAMIC),
    Case("140 kN, torque limited, gains", "torque-limited-140kn"),
    Case("140 kN, rock: a1 and a2 times 0.8 to 1.2", "monteiro-trindade-140kn",
         ("bit_rock.a1_factor=0.8:1.2:401", "bit_rock.a2_factor=0.8:1.2:401")),
    Case("weight and Kp", "monteiro-trindade-140kn",
         ("operating_point.weight_on_bit=80 kN:160 kN:401", "controller.kp=0:1000:401")),
    Case("speed and weight (`wob-rpm-chart`)", "wob-rpm-chart",
         ("operating_point.speed=60 rpm:180 rpm:401",
          "operating_point.weight_on_bit=60 kN:200 kN:401")),
    Case("weight and speed (`six-drives-100kn`)", "six-drives-100kn",
         ("operating_point.weight_on_bit=80 kN:160 kN:401",
          "operating_point.speed=60 rpm:160 rpm:401")),
    Case("start and torque (`navarro-lopez-2dof-bistable`)", "navarro-lopez-2dof-bistable",
         ("start.speed=1 rad/s:14 rad/s:401", "controller.torque=7 kN*m:12 kN*m:401")),
)  # fmt: skip


def main() -> None:
    """Write the table between its marks, and the figure of the paper's case."""
    rows = []
    for case in CASES:
        result = beside_the_full_grid(case)
        if "paper" in case.name:
            picture = drillctl.plots.adaptive_map(result)
            picture.savefig(PAGE.with_name("adaptive-map.png"), dpi=110)
        rows.append(row(case, result))
        print(rows[-1], flush=True)  # noqa: T201
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    table = "\n".join([*HEAD, *rows])
    PAGE.write_text(f"{before}{MARKS[0]}\n{table}\n{MARKS[1]}{after}", encoding="utf-8")


def beside_the_full_grid(case: Case) -> AdaptiveMap:
    """An adaptive map with the full grid beside it."""
    design = drillctl.load(case.design, **case.values)
    design = design.replace({"map.axes": [parse_axis(text) for text in case.axes]})
    return drillctl.adaptive_map(design, full_grid=True)


def row(case: Case, result: AdaptiveMap) -> str:
    """One row of the table."""
    full = result.full_audit
    assert full is not None
    wrong = int((bands_of(full.j1, result.levels) != result.bands).sum())
    shares, missed = shifted(full.j1, result.levels)
    cells = [
        case.name,
        f"{result.share:.2%}",
        str(wrong),
        "yes" if full.verdict == "ok" else "no",
        f"{min(shares):.2%} to {max(shares):.2%}",
        f"{sum(size > 0 for size in missed)} of {len(missed)}",
        str(max(missed)) if max(missed) else "-",
    ]
    return f"| {' | '.join(cells)} |".replace("%", " %")


def shifted(j1: np.ndarray, levels: tuple[float, ...]) -> tuple[list[float], list[int]]:
    """Of the search over parts of a full grid, 8 rows and columns less: shares, largest misses."""
    from scipy.ndimage import label

    shares, missed = [], []
    for i, j in itertools.product(range(SHIFTS), repeat=2):
        part = j1[i : len(j1) - SHIFTS + i, j : j1.shape[1] - SHIFTS + j]
        found = search(lambda cells, of=part: of.ravel()[cells], part.shape, levels)
        wrong = found.bands != bands_of(part, levels)
        groups, _ = label(wrong, np.ones((3, 3)))
        shares.append(float(found.seen.mean()))
        missed.append(int(np.bincount(groups.ravel())[1:].max(initial=0)))
    return shares, missed


if __name__ == "__main__":
    main()
