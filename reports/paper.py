"""The source paper beside drillctl: its statements, tables and figures, from saved studies."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

import drillctl
from drillctl import plots, studies
from drillctl.simulation.measures import STATUSES
from drillctl.store.json_files import write_json, write_text
from drillctl.studies import Sweep, Uncertainty

MAP, FIG6, FIRST = (
    "monteiro-trindade-140kn",
    "monteiro-trindade-fig6",
    "monteiro-trindade-120kn",
)
MANY = 1024
"""Draws beside the paper's ten."""
KP, KI = "controller.kp", "controller.ki"
LEVEL = 40.0
"""Level whose areas are told of the uncertain map (s)."""


def numbers(swept: Sweep, ten: Uncertainty, many: Uncertainty) -> dict[str, Any]:
    """What the page says, as numbers.

    Parameters
    ----------
    swept : Sweep
        The map at 140 kN.
    ten, many : Uncertainty
        The map of Fig. 6 with the paper's draws, and with more.
    """
    minimum = swept.minimum
    assert minimum is not None
    j1, status = swept.j1, swept.status
    sticks = np.isin(status, [STATUSES.index("sticking"), STATUSES.index("stalled")])
    kp, ki = (axis.values for axis in swept.axes)
    inside = np.outer((kp >= 400) & (kp <= 700), (ki >= 50) & (ki <= 200))
    best, ridge = many.best("mean"), many.best("q95")
    area = many.areas[LEVEL][0.95]
    return {
        "minimum": {"j1": minimum[0], "kp": minimum[1][KP], "ki": minimum[1][KI]},
        "regions": {
            f"{level:g}": {
                "cells": one.cells, "kp": list(one.bounds[KP]), "ki": list(one.bounds[KI]),
                "outlines": len(one.polygons.geoms) if one.polygons is not None else 0,
            }
            for level, one in swept.regions.items()
        },
        "mean_j1_inside": float(j1[inside].mean()),
        "mean_j1_outside": float(j1[~inside].mean()),
        "sticking_up_to_33": int((sticks & (j1 <= 33.0)).sum()),
        "sticking_up_to_50": int((sticks & (j1 <= 50.0)).sum()),
        "share_sticking_over_60": float(sticks[j1 > 60.0].mean()),
        "first_run": drillctl.simulate(drillctl.load(FIRST)).measures.as_dict(),
        "uncertain": {
            "level": LEVEL,
            "nominal": many.nominal_regions[LEVEL].area_fraction,
            "always_of_ten": float(ten.maps[LEVEL].always.mean()),
            "inner": area.value,
            "inner_interval_95": list(area.interval),
            "draws": many.realizations,
            "best_mean": {"value": best.value, **_gains(many.at(best.cell))},
            "best_q95": {"value": ridge.value, **_gains(many.at(ridge.cell))},
        },
    }  # fmt: skip


def _gains(at: dict[str, float]) -> dict[str, float]:
    return {"kp": at[KP], "ki": at[KI]}


def page(found: dict[str, Any]) -> str:
    """The page.

    Parameters
    ----------
    found : dict
        From `numbers`.
    """
    lines = [
        "# The paper beside drillctl", "",
        "Monteiro, H.L.S. & Trindade, M.A., *Effect of Bit-Rock Interaction Uncertainties on the",
        "Torsional Stability Regions of an Oil-Well Drilling System* (2012). The paper prints its",
        "friction, set speed, weights, gains and levels, but **not the string, the inertias and",
        "the damping: these are reconstructed** ([how](../docs/paper.md)), and its printed start",
        "of 70 rad/s is read as 70 rpm. Numbers here are of that reconstruction; they are not",
        "proven to be the authors' own.", "", "## Statements", "",
        "| the paper says | here | agrees |", "|---|---|---|",
    ]  # fmt: skip
    lines += [f"| {said} | {told} | {agrees} |" for said, told, agrees in _statements(found)]
    lines += ["", "## Tables and figures", ""]
    for name, picture, told in _figures(found):
        lines += [f"### {name}", "", told, ""]
        if picture:
            lines += [f"![{name}]({picture})", ""]
    lines += ["## What is reconstructed", "", *_reconstructed(), ""]
    return "\n".join(lines)


def _span(bounds: list[float]) -> str:
    return f"{bounds[0]:g} to {bounds[1]:g}"


def _statements(found: dict[str, Any]) -> list[tuple[str, str, str]]:
    regions, unsure, minimum = found["regions"], found["uncertain"], found["minimum"]
    outer, inner = regions["50"], regions["30"]
    one_each = all(region["outlines"] == 1 for region in regions.values())
    best = unsure["best_mean"]
    low, high = (100.0 * end for end in unsure["inner_interval_95"])
    return [
        (
            "At 140 kN no pair of gains gives J1 = 10; closed nested contours at 20, 30, 40, 50.",
            f"Minimum {minimum['j1']:.2f} s at Kp {minimum['kp']:g}, Ki {minimum['ki']:g}; "
            f"{'one closed outline' if one_each else 'several outlines'} a level, with "
            f"{', '.join(str(region['cells']) for region in regions.values())} cells of 1,681.",
            _yes(minimum["j1"] > 10.0 and one_each),
        ),
        (
            "Kp 400-700 and Ki 50-200 perform better.",
            f"J1 ≤ 50 s for Kp {_span(outer['kp'])}, Ki {_span(outer['ki'])}; J1 ≤ 30 s for Kp "
            f"{_span(inner['kp'])}, Ki {_span(inner['ki'])}. Mean J1 {found['mean_j1_inside']:.0f} "
            f"s inside that window, {found['mean_j1_outside']:.0f} s outside it.",
            _yes(found["mean_j1_inside"] < found["mean_j1_outside"]),
        ),
        (
            "J1 grows with stick-slip; above 33 operation is undesirable.",
            f"{found['sticking_up_to_33']} cells with J1 ≤ 33 s stick in the last 20 s; of those "
            f"over 60 s {found['share_sticking_over_60']:.0%} do. So do "
            f"{found['sticking_up_to_50']} of those up to 50 s: 33 marks poor settling here, not "
            "yet stick-slip that lasts.",
            f"{_yes(found['sticking_up_to_33'] == 0)}, with that qualification",
        ),
        (
            "Uncertainty in a1 and a2 shrinks the usable region.",
            f"J1 ≤ {unsure['level']:g} s in {unsure['nominal']:.1%} of the window without it, in "
            f"all of 10 draws in {unsure['always_of_ten']:.1%}, in 95 % of {unsure['draws']:,} "
            f"draws in {unsure['inner']:.1%} (95 % interval {low:.1f} to {high:.1f} %).",
            _yes(unsure["always_of_ten"] < unsure["nominal"]),
        ),
        (
            "Kp 600-650 with Ki 100-150 stays the best region.",
            f"Best mean of {unsure['draws']:,} draws {best['value']:.1f} s at Kp {best['kp']:g}, "
            f"Ki {best['ki']:g}; best 95 % quantile {unsure['best_q95']['value']:.1f} s at Kp "
            f"{unsure['best_q95']['kp']:g}, Ki {unsure['best_q95']['ki']:g}.",
            _yes(600 <= best["kp"] <= 650 and 100 <= best["ki"] <= 150),
        ),
    ]


def _yes(agrees: bool) -> str:
    return "yes" if agrees else "**no**"


def _figures(found: dict[str, Any]) -> list[tuple[str, str, str]]:
    own, run = f"{MAP}/figures", found["first_run"]
    unsure = f"{FIG6}/figures"
    return [
        (
            "Figures 1 and 3: the system", f"{own}/rig.png",
            "The paper draws a drive with PI control, a string and a BHA with a constant weight on "
            "bit, without numbers for the string. Here with the reconstructed ones.",
        ),
        (
            "Figure 2 and Table 1: torque on the bit", f"{own}/friction.png",
            "The five rows of Table 1 as printed. The paper's three branches about a tolerance are "
            "taken as what they stand in for, a set-valued friction "
            "([the difference](../docs/paper.md#the-printed-friction)).",
        ),
        (
            "The first run", "",
            "120 kN, Kp 200 N m s, Ki 100 N m: the paper names it. Here J1 "
            f"{run['j1']:.2f} s, stuck for {run['stuck_time']:.1f} s, peak bit speed "
            f"{run['peak_bit_speed']:.2f} rad/s.",
        ),
        (
            "Figure 4: responses with growing J1", "paper-figures/responses.png",
            "140 kN. The gains of the paper's panels are not all printed; these are cells of the "
            "map from its minimum on, J1 in even steps of its logarithm. As in the paper more J1 "
            "is more oscillation and more sticking.",
        ),
        (
            "Figure 5: level curves of J1", f"{own}/map.png",
            "The printed axes and levels, 41 x 41 cells, twelve of them simulated again by the "
            "reference solver.",
        ),
        (
            "Table 2 and Figure 6: uncertain friction", f"{unsure}/regions.png",
            "a1 and a2 lognormal about their printed values, 5 %; 10 draws as in the paper, whose "
            "own draws are not printed.",
        ),
    ]  # fmt: skip


def _reconstructed() -> list[str]:
    tables = drillctl.load(MAP).tables
    pipe = tables.drillstring.sections[0]
    assert pipe.outer_diameter is not None
    assert pipe.inner_diameter is not None
    assert pipe.shear_modulus is not None
    return [
        "| quantity | value | status |", "|---|---|---|",
        "| friction over weight on bit | Table 1 | printed |",
        "| set speed, weights on bit, gains, duration | 100 rpm, 80-160 kN, ..., 100 s | printed |",
        f"| pipe | OD {1e3 * pipe.outer_diameter:g} mm, ID {1e3 * pipe.inner_diameter:g} mm, "
        f"{pipe.length:g} m, G {1e-9 * pipe.shear_modulus:g} GPa, {pipe.density:g} kg/m3 "
        "| reconstructed |",
        f"| inertias | {tables.top_drive.inertia:g} kg m2 at the top, {tables.bha.inertia:g} kg m2 "
        "at the bit | reconstructed |",
        "| damping | none | reconstructed |",
        f"| elements | {pipe.elements}, consistent mass | reconstructed |",
        "| start | the whole string at 70 rpm, untwisted | printed as 70 rad/s, a misprint |",
    ]  # fmt: skip


def make(runs: Path, target: Path) -> None:
    """Write the page, its numbers and the one picture that no report has.

    Parameters
    ----------
    runs : Path
        Folder with the reports of `make.py`.
    target : Path
        Folder `reports`.
    """
    swept = drillctl.open(runs / MAP / "studies" / "map")
    ten = drillctl.open(runs / FIG6 / "studies" / "uncertainty")
    many = drillctl.uncertainty(drillctl.load(FIG6), realizations=MANY, audit_cells=0)
    found = numbers(swept, ten, many)
    shutil.rmtree(target / "paper-figures", ignore_errors=True)
    (target / "paper-figures").mkdir()
    paths = [axis.path for axis in swept.axes]
    picture = plots.time_response(studies.responses(swept), paths=paths)
    picture.savefig(target / "paper-figures" / "responses.png", dpi=110)
    write_json(target / "paper.json", found)
    write_text(target / "paper.md", page(found))
