"""Advantage of dynamic weight on bit, each policy at its robust optimum."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from drillctl import plots
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered, Study
from drillctl.reporting.words import NOTHING, between, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawn

PICTURES = (
    ("advantage-cases", "Policies at the fresh draws, each at its robust optimum.",
     "Spread of J1 of every policy under each condition.",
     lambda result, system: plots.advantage_cases(result)),
    ("advantage-front", "Robust J1 against the mean weight on bit.",
     "Objective of every policy against its mean weight, over nominal weights.",
     lambda result, system: plots.advantage_front(result, system=system)),
    ("advantage-map", "Advantage over weights and set speeds.",
     "Maps of the objective with constant weight minus that with dynamic weight.",
     lambda result, system: plots.advantage_map(result, system=system)),
    ("advantage-delays", "Advantage against the delay of the path.",
     "Advantage over the delay, with fixed gains and with gains tuned at each delay.",
     lambda result, system: plots.advantage_delay(result)),
)  # fmt: skip
"""Name, caption, text alternative and function of each figure of `drillctl advantage`."""


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Cases with paired differences, areas, crossing delays and figures."""
    study = gathered.need("advantage")
    found, system = study.summary, gathered.words.system
    blocks: list[Block] = [
        Text(
            "PI with constant weight, and PI with dynamic weight on bit, each tuned "
            f"for the {found['objective']} of J1 and evaluated at the same {found['realizations']} "
            f"fresh draws, seed {found['seed']}."
        ),
        _cases(gathered, found),
        _areas(found["regions"]),
        _delays(found),
    ]
    for name, caption, alt, draw in PICTURES:
        drawn = partial(_drawn, draw, study, system)
        blocks.append(Figure(name, caption, alt, drawn, ("advantage",)))
    return tuple(blocks)


def _drawn(draw: Callable[..., Drawn], study: Study, system: str) -> Drawn:
    return draw(study.result, system)


def _cases(gathered: Gathered, found: dict[str, Any]) -> Table:
    words, rows = gathered.words, []
    first = next(iter(found["cases"]))
    for name, case in found["cases"].items():
        less, apart = case["objective_difference"], NOTHING
        if name != first and less["interval_95"] is not None:
            apart = f"{number(less['value'])} ({between(*less['interval_95'])})"
        kp, ki, gain = case["gains"].values()
        gains = (
            f"Kp {number(kp)} N m s, Ki {number(ki)} N m, "
            f"K_w {number(words.scaled(gain, 'N'))} {words.unit('N')} s/rad"
        )
        weight = case["means"]["mean_weight_after_start"]
        rows.append((
            name, gains, number(case["objective"]["value"]), apart,
            words.quantity(weight, "N"), number(case["means"]["rop_proxy"]),
        ))  # fmt: skip
    heads = ("case", "gains", f"{found['objective']} of J1 (s)",
             "minus constant (s), 95 % interval", "mean weight", "ROP proxy")  # fmt: skip
    return Table("advantage", "Policies at their robust optima", heads, tuple(rows))


def _areas(found: dict[str, Any]) -> Table:
    rows = [
        (policy, f"J1 ≤ {level} s", _share(one["nominal_area"]),
         _share(one["area_p95"]["value"]), _share(one["area_p05"]["value"]))
        for policy, regions in found.items()
        for level, one in regions["levels"].items()
    ]  # fmt: skip
    heads = ("policy", "region", "nominal", "P ≥ 0.95", "P ≥ 0.05")
    return Table("advantage-areas", "Share of the window of gains of the drive", heads, tuple(rows))


def _share(value: float) -> str:
    return f"{100.0 * value:.1f} %"


def _delays(found: dict[str, Any]) -> Table:
    delays, share = found["delay"], 100.0 * found["material"]
    rows = (
        ("gains of the ideal path: no advantage from", _crossing(delays["kept"]["zero"])),
        (f"gains tuned at each delay: below {share:g} % from",
         _crossing(delays["anew"]["material"])),
    )  # fmt: skip
    heads = ("gains", "delay (s), 95 % interval")
    return Table("advantage-ends", "Delay at which the advantage ends", heads, rows)


def _crossing(found: dict[str, Any]) -> str:
    if found["delay"] is None:
        return "beyond the longest delay"
    low, high = (NOTHING if end is None else number(end) for end in found["interval_95"])
    return f"{number(found['delay'])} ({low} to {high})"
