"""What was measured, in words and columns."""

from __future__ import annotations

from typing import Any

from benchmarks.peers.cvode import TITLE as CVODE
from benchmarks.peers.cvode_library import TITLE as CVODE_LIBRARY
from benchmarks.peers.engine import HEADLINE, ONE_CORE
from benchmarks.peers.reference_rows import COMPILED, PLAIN
from benchmarks.peers.scipy_events import LSODA

LSODA_BAR, CVODE_BAR, REFERENCE_BAR = 20_000.0, 1_000.0, 60.0
LANES_BAR, ELEMENTS_BAR = 0.03, 1.25
"""Largest distance of the slope over lanes from 1, and largest ratio of costs over elements."""
WALL_BAR, WALL_STEP_BAR = 12.0, 200e-9
"""Cost of 12 nodes on the wall over a plain lane, or of a lane and step (s): the larger counts."""


def duration(seconds: float) -> str:
    """A time in three digits and a fitting unit."""
    for unit, scale in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if seconds >= scale or unit == "us":
            return f"{seconds / scale:.3g} {unit}"
    raise AssertionError


def times(ratio: float) -> str:
    """A ratio in three digits or to the unit."""
    return f"{ratio:,.0f}" if ratio >= 100.0 else f"{ratio:.3g}"


def peers_table(found: dict[str, Any]) -> list[str]:
    """One line a peer; ratios to drillctl at its standard accuracy."""
    rows = found["rows"]
    by_name = {row["name"]: row for row in rows}
    one, whole = by_name[ONE_CORE], by_name[HEADLINE]
    width = max(len(row["name"]) for row in rows)
    head = (
        f"{'':{width}} {'J1 error':>9} {'core time':>10} {'machine':>10} {'range as run':>20} "
        f"{'x core':>9} {'x as run':>9} {'cores':>6}"
    )
    lines = [head, "-" * len(head)]
    for row in rows:
        spread = f"{duration(row['low_s'])} - {duration(row['high_s'])}"
        lines.append(
            f"{row['name']:{width}} {row['j1_error']:9.1e} {duration(row['core_s']):>10} "
            f"{duration(row['machine_s']):>10} {spread:>20} "
            f"{times(row['core_s'] / one['core_s']):>9} "
            f"{times(row['as_run_s'] / whole['as_run_s']):>9} {row['cores_used']:6.2f}"
        )
    lines += [f"{name}: {why}" for name, why in found["missing"]]
    cells = max(row["cells_compared"] for row in rows)
    fewer = [row["name"] for row in rows if row["cells_compared"] < cells]
    short = [f"Not all cells were run by: {', '.join(fewer)}."] if fewer else []
    return [
        *lines,
        "",
        *short,
        f"Time of one trajectory of 100 s. J1 error: worst of {cells} cells, beside exact ones.",
        "core time: of the processor. machine: on the clock, all cores busy. cores: really used.",
        "x: over drillctl, standard: core for core, and as run (all our cores, one of theirs).",
    ]


def bars(found: dict[str, Any]) -> list[dict[str, Any]]:
    """What the suite has to show, and what it shows; `met` is None where nothing was measured."""
    rows = {row["name"]: row for row in found["rows"]}
    result = []
    wanted = ((LSODA, LSODA_BAR), (CVODE, CVODE_BAR), (CVODE_LIBRARY, CVODE_BAR))
    for start, bar in wanted:
        name = next((n for n in rows if n.startswith(start)), None)
        for how, key, ours in (
            ("as run", "as_run_s", HEADLINE),
            ("core for core", "core_s", ONE_CORE),
        ):
            ratio = None if name is None else rows[name][key] / rows[ours][key]
            what = f"times faster than {name or start}, {how}"
            result.append(_bar(what, ratio, f">= {bar:,.0f}", lambda v, bar=bar: v >= bar))
    reference = None if COMPILED not in rows else rows[PLAIN]["core_s"] / rows[COMPILED]["core_s"]
    what = f"times faster than {PLAIN}, reference solver, core for core"
    result.append(_bar(what, reference, f">= {REFERENCE_BAR:g}", lambda v: v >= REFERENCE_BAR))
    lanes, elements = found["scaling"]["lanes"], found["scaling"]["elements"]
    for prefix, time in (("", "time on the clock"), ("core_", "processor time")):
        slope = f"slope of log {time} over log lanes, to {max(lanes['sizes']):,}"
        result.append(
            _bar(
                slope,
                lanes[f"{prefix}slope"],
                f"1 +- {LANES_BAR}",
                lambda v: abs(v - 1) <= LANES_BAR,
            )
        )
        ratio = f"largest over smallest {time}, 30 to 1,000 elements"
        value = elements[f"{prefix}largest_over_smallest"]
        result.append(_bar(ratio, value, f"<= {ELEMENTS_BAR}", lambda v: v <= ELEMENTS_BAR))
    wall = found["scaling"]["wall"]
    cheap = wall["lane_step_s"] <= WALL_STEP_BAR
    result.append(
        _bar(
            f"times a plain lane, 12 nodes on the wall ({1e9 * wall['lane_step_s']:.0f} ns a step)",
            wall["of_plain"],
            f"<= {WALL_BAR:g}",
            lambda v: cheap or v <= WALL_BAR,
        )
    )
    return result


def _bar(what: str, value: float | None, bar: str, meets: Any) -> dict[str, Any]:
    met = None if value is None else bool(meets(value))
    return {"what": what, "value": value, "bar": bar, "met": met}


def bars_table(found: list[dict[str, Any]]) -> list[str]:
    """One line a bar."""
    told = {True: "met", False: "NOT MET", None: "not measured"}
    width = max(len(bar["what"]) for bar in found)
    lines = []
    for bar in found:
        digits = 0 if bar["value"] is not None and bar["value"] >= 100.0 else 3
        value = "" if bar["value"] is None else f"{bar['value']:,.{digits}f}"
        lines.append(f"{bar['what']:{width}} {value:>9}  {bar['bar']:>10}  {told[bar['met']]}")
    return lines


def roofline_table(roofline: dict[str, Any]) -> list[str]:
    """The modal pass in three lines."""
    r, s = roofline, roofline["standard"]
    return [
        f"modal pass: {1e9 * r['mode_s']:.3g} ns a lane, step and mode; {r['flops_a_mode']:g} "
        f"operations, {r['bytes_a_mode']:g} bytes; {r['flops'] / 1e9:.3g} Gflop/s",
        f"  {100 * r['share_of_peak']:.3g} % of the multiply-add peak of a core, "
        f"{100 * r['share_of_first_cache']:.3g} % of its in-place bandwidth of the first cache",
        f"  at {s['modes']} modes it is {100 * s['pass_share_of_step']:.3g} % of a step; "
        f"laws and measures take {1e9 * r['laws_s']:.3g} ns a lane and step "
        f"(straight line within {100 * r['worst_fit']:.2g} %)",
    ]


def scaling_table(scaling: dict[str, Any]) -> list[str]:
    """Sizes and seconds."""
    lines = []
    for name, found in scaling.items():
        pairs = zip(found["sizes"], found["seconds"], strict=True)
        lines.append(f"{name:9}" + "  ".join(f"{n:,.4g}: {duration(s)}" for n, s in pairs))
        lines.append(
            f"{'':9}slope {found['slope']:.3f}, of processor time {found['core_slope']:.3f}"
        )
    return lines
