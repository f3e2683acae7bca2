"""Regions by probability with intervals, the setting at its own draws, sensitivity."""

from __future__ import annotations

from drillctl.reporting.blocks import Block, Text, block, figure
from drillctl.reporting.gather import Gathered, NotThereError
from drillctl.reporting.words import chance, number
from drillctl.studies.uncertainty import STUDY, indices


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Areas, figures, distributions, failures."""
    result, system = gathered.need("uncertainty").result, gathered.words.system
    blocks: list[Block] = [Text(remark) for remark in STUDY.remarks(result, system)]
    if (own := gathered.have("setting")) is not None:
        held = own.summary
        blocks.append(
            Text(
                f"At the current setting, with {held['realizations']} draws: P(J1 ≤ "
                f"{number(held['level'])} s) = {chance(held['probability'], held['interval_95'])}."
            )
        )
    blocks += [
        block(table, system)
        for table in STUDY.tables(result)
        if table.shown and table.name != "sensitivity"
    ]
    blocks += [
        figure(picture, "uncertainty", system)
        for picture in STUDY.pictures(result)
        if picture.name != "sensitivity"
    ]
    return tuple(blocks)


def build_sensitivity(gathered: Gathered) -> tuple[Block, ...]:
    """Indices with their errors."""
    study, system = gathered.need("uncertainty"), gathered.words.system
    if "sensitivity" not in study.summary:
        if gathered.requested.tables.uncertainty.sensitivity is None:
            raise NotThereError("the design requests no indices ([uncertainty.sensitivity])")
        raise NotThereError("indices are computed with --profile standard or full")
    *_, picture = STUDY.pictures(study.result)
    return figure(picture, "uncertainty", system), block(indices(study.result), system)
