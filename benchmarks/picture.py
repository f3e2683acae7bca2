"""One picture of a whole run of the suite."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Okabe and Ito's colours, told apart by all.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#666666"

FAMILIES = (
    ("drillctl", BLUE), ("SciPy", ORANGE), ("CVODE", GREEN), ("NumPy", PURPLE),
    ("diffrax", VERMILION), ("python-control", BLACK),
)  # fmt: skip
MARKERS = "osD^v<>P"
GROWTHS = (
    ("lanes", "lanes", 1.0), ("elements", "elements", 0.0),
    ("horizon", "horizon (s)", 1.0),
)  # fmt: skip
"""Key, axis label and expected power of each growth of cost."""


def draw(found: dict[str, Any], path: Path) -> None:
    """Costs and errors of the peers, roofline, and cost against lanes, elements and horizon."""
    figure = Figure(figsize=(13.5, 8.6), layout="constrained")
    above, below = figure.subfigures(2, 1)
    peers, roof = above.subplots(1, 2, width_ratios=[2.0, 1.1])
    _peers(peers, found["rows"])
    _roof(roof, found["machine"], found["roofline"])
    for ax, (key, label, like) in zip(below.subplots(1, 3), GROWTHS, strict=True):
        _growth(ax, found["scaling"][key], label, like)
    processor = found["provenance"]["processor"]
    figure.suptitle(
        f"drillctl {found['provenance']['drillctl']}: 41 x 41 map, 100 s a lane, 30 elements; "
        f"{found['machine']['cores']} cores of {processor}",
        fontsize=11,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)


def _peers(ax: Axes, rows: list[dict[str, Any]]) -> None:
    seen: dict[str, int] = {}
    for row in rows:
        family, colour = next(
            (f for f in FAMILIES if row["name"].startswith(f[0])), ("other", GREY)
        )
        number = seen[family] = seen.get(family, -1) + 1
        smooth = row["solves"].startswith("regularised")
        ax.plot(
            row["j1_error"], row["core_s"], MARKERS[number % len(MARKERS)], color=colour,
            markerfacecolor="white" if smooth else colour, markersize=9, markeredgewidth=1.6,
            linestyle="none", label=row["name"],
        )  # fmt: skip
    ax.set(
        xscale="log", yscale="log", xlabel="worst relative error in J1 (open: friction regularised)"
    )
    ax.set(ylabel="core time per trajectory (s)", title="Cost against accuracy")
    ax.grid(alpha=0.3)
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8.5, frameon=False)


def _roof(ax: Axes, machine: dict[str, Any], roofline: dict[str, Any]) -> None:
    intensity = np.geomspace(0.05, 20.0, 200)
    peak = machine["flops"] / 1e9
    for key, label, colour, line in (
        ("updates", "first cache, in place", BLUE, "-"), ("loads", "first cache, loads", SKY, "--"),
    ):  # fmt: skip
        bandwidth = machine[key] / 1e9
        roof = np.minimum(bandwidth * intensity, peak)
        ax.plot(intensity, roof, line, color=colour, label=f"{label}: {bandwidth:.0f} GB/s")
    ax.axhline(peak, color=BLACK, linewidth=1.0, label=f"multiply-adds: {peak:.0f} Gflop/s")
    at, standard = roofline["intensity"], roofline["standard"]
    ax.plot(
        at, roofline["flops"] / 1e9, "o", color=VERMILION, markersize=9,
        label=f"modal pass: {100 * roofline['share_of_peak']:.0f} % of peak",
    )  # fmt: skip
    whole = standard["pass_flops_over_whole_step"] / 1e9
    share = 100 * standard["pass_flops_over_whole_step_share_of_peak"]
    ax.plot(
        at,
        whole,
        "s",
        color=ORANGE,
        markersize=8,
        label=f"the same over whole steps: {share:.0f} %",
    )
    ax.set(xscale="log", yscale="log", ylim=(1.0, 2.0 * peak), xlim=(0.05, 20.0))
    ax.set(xlabel="operations per byte", ylabel="Gflop/s, one core", title="Roofline, measured")
    ax.grid(alpha=0.3)
    ax.legend(loc="lower right", fontsize=8)


def _growth(ax: Axes, found: dict[str, Any], label: str, like: float) -> None:
    sizes, seconds = np.array(found["sizes"], dtype=float), np.array(found["seconds"])
    below, above = seconds - np.array(found["low"]), np.array(found["high"]) - seconds
    ax.errorbar(
        sizes, seconds, yerr=[below, above], fmt="o", color=BLUE, capsize=3,
        label="median and range",
    )  # fmt: skip
    # Through the middle of the points: what a cost of this power of the size would be.
    middle = np.exp(np.mean(np.log(seconds) - like * np.log(sizes)))
    power = "proportional" if like else "constant"
    ax.plot(sizes, middle * sizes**like, "--", color=GREY, label=power)
    ax.set(xscale="log", yscale="log", xlabel=label, ylabel="time, all cores (s)")
    if not like:
        decades = np.floor(np.log10(seconds.min() / 2.0)), np.ceil(np.log10(2.0 * seconds.max()))
        ax.set_ylim(10.0 ** decades[0], 10.0 ** decades[1])
        ax.set_xlim(sizes.min() / 1.7, sizes.max() * 1.7)
    ax.set_title(
        f"{label.partition(' (')[0].capitalize()}: slope {found['slope']:.3f}, "
        f"of processor time {found['core_slope']:.3f}",
        fontsize=10,
    )
    for size in sizes:
        modes = found.get("chosen", {}).get(f"{size:g}", {}).get("modes")
        if modes is not None:
            place = ax.get_xaxis_transform()  # along the lower edge
            ax.text(size, 0.05, f"{modes} modes", transform=place, ha="center", fontsize=8)
    ax.grid(alpha=0.3)
    ax.legend(loc="upper left", fontsize=8)
