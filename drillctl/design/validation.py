"""From plain TOML data to validated tables, with errors in the user's own words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from drillctl.design.merging import Tree
from drillctl.design.tables import DesignTables
from drillctl.errors import InputError, nearest, shown
from drillctl.rig.bit_rock.law import friction_laws
from drillctl.rig.top_drive.law import drive_laws, top_drive
from drillctl.rig.weight_on_bit.law import weight_laws

_LAWS: dict[str, Callable[[], dict[str, Any]]] = {
    "bit_rock": friction_laws,
    "controller": drive_laws,
    "weight_on_bit": weight_laws,
}

_TYPES = {
    "tuple_type": "it must be a list",
    "model_type": "it must be a table",
    "model_attributes_type": "it must be a table",
    "dict_type": "it must be a table",
    "string_type": "it must be text in quotes",
    "bool_type": "it must be true or false",
    "bool_parsing": "it must be true or false",
}
"""What is due, by pydantic's name of the error."""


def validated(tree: Tree, origin: str) -> DesignTables:
    """Validate plain TOML data."""
    from drillctl.design import parts

    try:
        tables = DesignTables.model_validate(tree)
        parts.refuse_impossible_string(tables)
        parts.bit_rock_before(tables)
        parts.program(tables)
        if drive_laws()[tables.controller.law].tuned_to_string:
            top_drive(tables.controller, lambda: parts.drillstring(tables))
        if not parts.drive_of(tables).ideal:
            parts.refuse_weak_drive(
                tables, parts.drillstring(tables), parts.torque_at_set_speed(tables)
            )
    except ValidationError as error:
        raise _reported(_first(error.errors()), tree, origin) from None
    except InputError as error:
        raise error.within(origin) if origin else error from None
    return tables


def _first(problems: list[Any]) -> Any:
    """The first error; a misspelt key before the missing one it was meant for."""
    first = problems[0]
    if first["type"] == "missing":
        table = first["loc"][:-1]
        for problem in problems:
            if problem["type"] == "extra_forbidden" and problem["loc"][:-1] == table:
                return problem
    return first


def _reported(problem: Any, tree: Tree, origin: str) -> InputError:
    """The first pydantic error as one of ours."""
    path = _path(problem["loc"], tree)
    where = f"{origin}: {path}" if origin and path else origin or path
    kind = problem["type"]
    if kind == "extra_forbidden":
        *parents, key = problem["loc"]
        allowed = sorted(_keys_at(tuple(parents)))
        homes = [
            f"[{home}]"
            for home in _homes(DesignTables, str(key))
            if home != ".".join(map(str, parents))
        ]
        elsewhere = f"; it stands in {' or '.join(homes[:3])}" if homes else ""
        return InputError(f"unknown key{elsewhere}; {nearest(str(key), allowed)}", where)
    if kind == "missing":
        return InputError("is missing", where)
    if kind == "value_error":
        return InputError(str(problem["ctx"]["error"]), where)
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        laws = sorted(_LAWS[str(problem["loc"][0])]())
        if kind == "union_tag_not_found":
            return InputError(f"law is missing; allowed: {', '.join(laws)}", where)
        came = problem["input"]["law"]
        return InputError(f"no law {shown(came)}; {nearest(str(came), laws)}", f"{where}.law")
    if kind == "literal_error":
        allowed = problem["ctx"]["expected"].replace(" or ", ", ").replace("'", "").split(", ")
        return InputError(
            f"got {shown(problem['input'])}; {nearest(str(problem['input']), allowed)}", where
        )
    due = _TYPES.get(kind, problem["msg"])
    if where.endswith("drillstring.sections") and kind == "tuple_type":
        due = "it must be a list of tables, each under [[drillstring.sections]]"
    return InputError(f"got {shown(problem['input'])}; {due}", where)


def _path(loc: tuple[str | int, ...], tree: Tree) -> str:
    """Dotted path as a user writes it: sections by name, no union tags."""
    words: list[str] = []
    here: Any = tree
    for step in loc:
        if isinstance(step, int):
            here = here[step] if isinstance(here, list) and step < len(here) else None
            name = here.get("name") if isinstance(here, dict) else None
            words.append(_printed(name) if name and isinstance(name, str) else str(step + 1))
        elif isinstance(here, dict) and here.get("law") == step and step not in here:
            continue
        else:
            here = here.get(step) if isinstance(here, dict) else None
            words.append(_printed(step))
    return ".".join(words)


def _printed(key: str) -> str:
    """A key as it stands in a one-line message."""
    return key if key.isprintable() else repr(key)


def _keys_at(loc: tuple[str | int, ...]) -> list[str]:
    """Keys that the table at `loc` may hold."""
    model: Any = DesignTables
    for step in loc:
        if isinstance(step, int):
            continue
        fields = getattr(model, "model_fields", {})
        if step in fields:
            model = fields[step].annotation
        model = _table_class(model, step)
    return [f.alias or key for key, f in model.model_fields.items()]


def _homes(table: Any, key: str, path: str = "") -> list[str]:
    """Tables by dotted path that hold a key of this name."""
    found = [path] if path and key in table.model_fields else []
    for name, field in table.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            found += _homes(inner, key, f"{path}.{name}" if path else name)
    return found


def _table_class(annotation: Any, step: str) -> Any:
    """The table class inside an annotation: itself, an item of a tuple, or the law `step`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) is dict:  # of tables by name
        return get_args(annotation)[1]
    classes = [a for a in get_args(annotation) if a is not Ellipsis and a is not type(None)]
    for cls in classes:
        law = getattr(cls, "model_fields", {}).get("law")
        if law is not None and step in get_args(law.annotation):
            return cls
    if len(classes) == 1:
        return _table_class(classes[0], step)
    tuples = [c for c in classes if get_args(c)]
    return _table_class(tuples[0], step) if tuples else annotation
