"""Differences between a run and the run that a folder was made for."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drillctl.design import Design
from drillctl.design.reading import to_tree
from drillctl.errors import InputError, shown
from drillctl.provenance import provenance

MOST = 3
"""Largest number of keys in a message."""
LONGEST = 57
"""Longest list printed in full (characters)."""


def difference(path: Path, design: Design, grown: tuple[str, ...] = ()) -> str:
    """The keys in which a design differs from a resolved one on disk, for a message."""
    try:
        held = _leaves(tomllib.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return ""
    here = _leaves(to_tree(design.tables))
    keys = [
        key for key in dict.fromkeys((*held, *here))
        if held.get(key) != here.get(key) and key not in grown
    ]  # fmt: skip
    if not keys:
        return ""
    named = [f"{key} is {_value(held, key)}, here {_value(here, key)}" for key in keys[:MOST]]
    more = f" and {len(keys) - MOST} more" if len(keys) > MOST else ""
    return f": {'; '.join(named)}{more}"


def _value(leaves: dict[str, Any], key: str) -> str:
    if key not in leaves:
        return "not given"
    value = leaves[key]
    if isinstance(value, list):
        text = ", ".join(map(str, value))
        return f"[{text}]" if len(text) <= LONGEST else f"[{text[:LONGEST]}...]"
    return shown(value)


def _leaves(tree: Any, prefix: str = "") -> dict[str, Any]:
    """Values by dotted path; those of named tables in a list by their names."""
    found: dict[str, Any] = {}
    for key, value in tree.items():
        path = f"{prefix}{key}"
        if isinstance(value, dict):
            found |= _leaves(value, f"{path}.")
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            for number, item in enumerate(value, start=1):
                name = item.get("name") or item.get("path") or number
                found |= _leaves(item, f"{path}.{name}.")
        else:
            found[path] = value
    return found


@dataclass(frozen=True)
class Growing:
    """A count of draws to which a finished run may be extended."""

    count: int  # requested
    # the design with a fixed count in place of the requested one: it identifies the run
    like: Design


def growing_realizations(design: Design) -> Growing | None:
    """The extension of a run under uncertainty; None for samplings of fixed size.

    Parameters
    ----------
    design : Design
        Of the run.
    """
    table = design.tables.uncertainty
    if table.sampling == "latin-hypercube":
        return None
    return Growing(
        table.realizations, design.replace({"uncertainty.realizations": table.replicates})
    )


def refuse_other_machine(held: dict[str, str], where: str, allow_mixed: bool) -> None:
    """Refuse (`InputError`) to resume a run of other packages or another processor."""
    here = provenance()
    other = [key for key in here if held.get(key) != here[key]]
    if allow_mixed and other == ["processor"]:
        return
    if other:
        text = ", ".join(f"{key} {held.get(key)}, here {here[key]}" for key in other)
        raise InputError(
            "holds a run started with other packages or on another processor, whose bits would "
            f"differ; give another folder ({text})",
            where,
        )
