"""Regions by probability, how sure they are, and the setting at its own draws."""

from __future__ import annotations

from drillctl import plots
from drillctl.reporting.blocks import Block, Figure, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import chance, number, percent


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Areas, pictures, distributions, failures."""
    study = gathered.need("uncertainty")
    found = study.summary
    blocks: list[Block] = [Text(_draws(gathered)), _areas(gathered)]
    if (own := gathered.have("setting")) is not None:
        told = own.summary
        blocks.append(
            Text(
                f"At the current setting, {told['realizations']} draws of its own: P(J1 ≤ "
                f"{number(told['level'])} s) = {chance(told['probability'], told['interval_95'])}."
            )
        )
    if len(found["axes"]) == 2:
        blocks += _maps(gathered)
    blocks += _curves(gathered)
    for one in found["failures"]:
        blocks.append(
            Text(f"{one['count']} of {found['realizations']} draws failed: {one['reason']}.",
                 "warning")
        )  # fmt: skip
    return tuple(blocks)


def _draws(gathered: Gathered) -> str:
    found = gathered.need("uncertainty").summary
    stopped = found["statuses"].get("censored", 0)
    lanes = sum(found["statuses"].values())
    told = (
        f"{found['realizations']} draws ({found['sampling']}, seed {found['seed']}) of "
        f"{', '.join(found['uncertain'])}: {found['trajectories']} runs in all."
    )
    if stopped:
        told += (
            f" {percent(stopped / lanes)} of them were stopped once J1 had passed the highest "
            "level: they are outside every region, and their J1 is a lower bound."
        )
    return told


def _areas(gathered: Gathered) -> Table:
    rows = tuple(
        (
            f"J1 ≤ {level} s", percent(one["nominal_area"]),
            chance(one["area_p95"], one["interval_95"]),
            chance(one["area_p50"], one["interval_95_p50"]),
            chance(one["area_p05"], one["interval_95_p05"]),
        )
        for level, one in gathered.need("uncertainty").summary["levels"].items()
    )  # fmt: skip
    caption = "Share of the map in which the level is kept with a probability (95 % interval)"
    heads = ("region", "nothing uncertain", "P ≥ 95 %", "P ≥ 50 %", "P ≥ 5 %")
    return Table("uncertain-regions", caption, heads, rows)


def _maps(gathered: Gathered) -> list[Block]:
    study, system = gathered.need("uncertainty"), gathered.words.system
    levels = study.summary["levels"]
    inner = "; ".join(f"under {x} s {percent(one['area_p95'])}" for x, one in levels.items())
    return [
        Figure(
            "uncertain-regions", "Regions by probability: kept in 95 %, 50 % and 5 % of the draws.",
            f"Bands of the regions over the map. Share kept with 95 %: {inner}.",
            lambda: plots.uncertain_regions(study.result, system=system), ("uncertainty",), True,
        ),
        Figure(
            "probability", "Probability that J1 keeps to each level.",
            "Maps of the probability at each level, with contours.",
            lambda: plots.probability_map(study.result, system=system), ("uncertainty",), True,
        ),
    ]  # fmt: skip


def _curves(gathered: Gathered) -> list[Block]:
    study, system = gathered.need("uncertainty"), gathered.words.system
    return [
        Figure(
            "convergence", "Areas of the inner regions against the number of draws.",
            "Curves of the area against the number of draws, with their intervals narrowing.",
            lambda: plots.area_convergence(study.result), ("uncertainty",),
        ),
        Figure(
            "distributions", "J1 over the draws at the best cells.",
            "Distribution functions of J1 at the cells that are best by mean and by quantile.",
            lambda: plots.cell_distributions(study.result, system=system), ("uncertainty",),
        ),
    ]  # fmt: skip
