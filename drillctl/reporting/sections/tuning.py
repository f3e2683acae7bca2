"""Tuned gains with their certificate, from what was saved of the search."""

from __future__ import annotations

from typing import Any

from drillctl.reporting.blocks import Block, Check, Checks, Table, Text
from drillctl.reporting.gather import Gathered
from drillctl.reporting.words import chance, number, percent


def build(gathered: Gathered) -> tuple[Block, ...]:
    """Gains, objective, certificate, baselines; whatever of it was saved."""
    found = gathered.need("tune").summary
    blocks: list[Block] = []
    gains = found.get("gains") or {}
    rows = [
        (gathered.words.head(gathered.design, path), number(value)) for path, value in gains.items()
    ]
    for name, key in (("objective", "objective"), ("its value (s)", "value"),
                      ("runs", "trajectories"), ("time (s)", "seconds")):  # fmt: skip
        if found.get(key) is not None:
            value = found[key]
            rows.append((name, value if isinstance(value, str) else number(value)))
    blocks.append(Table("tuned", "Tuned gains", ("quantity", "value"), tuple(rows)))
    if found.get("certificate"):
        blocks.append(_certificate(found["certificate"]))
    if found.get("baselines"):
        blocks.append(_plain("baselines", "Baselines", found["baselines"]))
    if found.get("tolerance"):
        blocks.append(_plain("tolerance", "How far the gains may be off", found["tolerance"]))
    if found.get("message"):
        blocks.append(Text(str(found["message"])))
    return tuple(blocks)


def _certificate(found: dict[str, Any]) -> Checks:
    asked = found["required_probability"]
    detail = chance(found["probability"], found["interval_95"])
    question = (
        f"Is P(J1 ≤ {number(found['level'])} s) at least {percent(asked)}, on draws that the "
        "search has not seen?"
    )
    check = Check(question, bool(found["passed"]), f"{detail}, {found['realizations']} draws")
    return Checks("certificate", "Certificate", (check,))


def _plain(name: str, caption: str, found: Any) -> Table:
    """A table of whatever was saved, one line a leaf."""
    return Table(name, caption, ("entry", "value"), tuple(leaves(found)))


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
