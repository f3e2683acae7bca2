"""Designs at draws of their uncertain parameters."""

from __future__ import annotations

from collections.abc import Iterator

from drillctl import units
from drillctl.design import Design
from drillctl.ensemble.parameters import Draws
from drillctl.errors import InputError


def designs_at(design: Design, draws: Draws) -> Iterator[Design]:
    """The design at every draw that a rig can have; impossible ones are left out."""
    for number in range(len(draws)):
        values = {path: units.SI(column[number]) for path, column in draws.values.items()}
        try:
            variant = design.replace(values)
            _ = variant.bit_rock, variant.string
        except InputError:
            continue
        yield variant
