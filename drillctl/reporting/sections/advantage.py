"""What a moving weight on bit is worth, from what was saved of that study."""

from __future__ import annotations

from drillctl.reporting.blocks import Block, Table
from drillctl.reporting.gather import Gathered
from drillctl.reporting.sections.tuning import leaves


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Everything its summary tells."""
    found = gathered.need("advantage").summary
    return (
        Table("advantage", "As the study tells it", ("entry", "value"), tuple(leaves(found))),
    )  # fmt: skip
