"""What a moving weight on bit is worth, from what was saved of that study."""

from __future__ import annotations

from typing import Any

from drillctl.reporting.blocks import Block, Table
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import number


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Everything its summary tells."""
    found = gathered.need("advantage").summary
    heads = ("entry", "value")
    return (Table("advantage", "As the study tells it (SI)", heads, tuple(leaves(found))),)


def leaves(found: Any, prefix: str = "") -> list[tuple[str, str]]:
    """Names and values of nested JSON data, in words.

    Parameters
    ----------
    found : dict, list or value
        As JSON holds it.
    prefix : str
        Put before the names.
    """
    if isinstance(found, dict):
        return [row for key, value in found.items() for row in leaves(value, f"{prefix}{key} ")]
    if isinstance(found, list) and found and all(isinstance(v, dict) for v in found):
        return [row for k, v in enumerate(found, 1) for row in leaves(v, f"{prefix}{k} ")]
    if isinstance(found, list):
        return [(prefix.strip(), ", ".join(_word(v) for v in found))]
    return [(prefix.strip(), _word(found))]


def _word(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number(value) if isinstance(value, (int, float)) or value is None else str(value)
