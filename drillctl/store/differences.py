"""What tells a run from the one that a folder was made for, and what may differ."""

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
"""Keys that are named at most."""
LONGEST = 57
"""Length of a list that is told in full (characters)."""


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
    told = [f"{key} is {_told(held, key)}, here {_told(here, key)}" for key in keys[:MOST]]
    more = f" and {len(keys) - MOST} more" if len(keys) > MOST else ""
    return f": {'; '.join(told)}{more}"


def _told(leaves: dict[str, Any], key: str) -> str:
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
    """A count of a design that a finished run may be taken on to."""

    count: int  # how many are asked for
    # the design with another count in its place, the same for all: it identifies the run
    like: Design


def growing_realizations(design: Design) -> Growing | None:
    """What lets a run under uncertainty grow; None for draws of a fixed number.

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
    """Refuse (`InputError`) to go on with a run of other packages or another processor."""
    here = provenance()
    other = [key for key in here if held.get(key) != here[key]]
    if allow_mixed and other == ["processor"]:
        return
    if other:
        told = ", ".join(f"{key} {held.get(key)}, here {here[key]}" for key in other)
        raise InputError(
            "holds a run begun with other packages or on another processor; the rest would differ "
            f"in the last bits: give another folder ({told})",
            where,
        )
