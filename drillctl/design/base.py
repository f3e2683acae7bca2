"""What every table of a design file is."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from drillctl.design.quantities import number


class Table(BaseModel):
    """A table of a design: unknown keys refused, frozen when made."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def number_or_quantity(value: object) -> object:
    """Text as it came, or a finite number: what may stand for a value at any path."""
    return value if isinstance(value, str) else number(value)
