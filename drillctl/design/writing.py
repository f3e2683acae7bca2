"""Designs out: the resolved design as TOML that reads back to the same object."""

from __future__ import annotations

from typing import Any

from drillctl import units
from drillctl.design.design import Design
from drillctl.design.merging import Tree
from drillctl.design.paths import kind_of
from drillctl.design.tables import Table


def to_toml(design: Design) -> str:
    """The whole design, model and defaults included, as the text of a design file."""
    import tomli_w

    return tomli_w.dumps(to_tree(design.tables))


def to_tree(table: Table) -> Tree:
    """A table as plain TOML data, quantities as text with units; what is not set is left out."""
    tree: Tree = {}
    for key, info in type(table).model_fields.items():
        value = _plain(getattr(table, key), kind_of(info))
        if value is not None and value != "" and value != {}:
            tree[info.alias or key] = value
    return tree


def _plain(value: Any, kind: units.Kind | None) -> Any:
    if isinstance(value, Table):
        return to_tree(value)
    if isinstance(value, tuple):
        return [_plain(item, kind) for item in value]
    if isinstance(value, dict):
        return {key: _plain(item, None) for key, item in value.items()}
    if kind is not None and isinstance(value, float):
        return units.write(value, kind)
    return value
